"""A diagnosed mission in Python: verdict, faults, states and signals as tables, figures, and files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.api.errors import stated
from diagnosis.api.frames import channels_frame, coverage_frame, faults_frame, signals_frame, states_frame
from diagnosis.api.inputs import StrPath, path_of
from diagnosis.api.verdict import Verdict, exit_code
from diagnosis.results.document import ReportDocument
from diagnosis.results.result import MissionResult
from replay.errors import ConfigError

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import plotly.graph_objects as go
    from numpy.typing import NDArray

    from diagnosis.api.series import Series


class Diagnosis:
    """A diagnosed mission, from `mfhca.diagnose` or `mfhca.read_result`.

    All tables come from what ``report.json`` and ``report.parquet`` hold, so that a saved result shows the same (its time
    series as 32-bit numbers). Times are seconds from the mission's start, speeds m/s, angles rad, openings fractions of full
    opening.
    """

    def __init__(self, result: MissionResult) -> None:
        self._result = result

    @property
    def report(self) -> ReportDocument:
        """The whole document, as in ``report.json``; `mfhca schema report` prints its JSON schema."""
        return self._result.report

    @property
    def columns(self) -> Mapping[str, NDArray[np.float64] | NDArray[np.float32]]:
        """Time series as arrays of shape (n,), ``t`` [s] first: what `signals` shows as a table."""
        return self._result.columns

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the machine may go out, and why not."""
        return Verdict.of(self.report)

    def exit_code(self, fail_on: str = "low") -> int:
        """Exit code that `mfhca diagnose` ends with.

        Parameters
        ----------
        fail_on : str
            Lowest severity that counts as a fault: ``info``, ``low``, ``medium``, ``high``, or ``never``.

        Returns
        -------
        int
            0 no fault, 1 faults, 3 nothing could be judged.

        Raises
        ------
        ConfigError
            Where `fail_on` is none of them.
        """
        return exit_code(self.report, fail_on)

    @cached_property
    def faults(self) -> pd.DataFrame:
        """The faults, the worst first, shape (faults, 22), indexed by ``id``; the same as ``intervals`` in ``report.json``.

        ``component``, ``kind``, ``side``, ``mode``; ``start_s``, ``stop_s`` [s, half open], ``start``, ``stop`` (UTC);
        ``severity``; ``probability`` [1]; ``epsilon``, ``epsilon_low``, ``epsilon_high`` (ε̂ with 95 % bounds [1]); ``sat``,
        ``sat_low``, ``sat_high``, ``sat_rms`` (saturation term in ``sat_unit``); ``detected_s`` [s]; ``tier``, ``advice``,
        ``evidence``. Unknown numbers are NaN. `diagnosis.api.frames.FAULT_COLUMNS` tells what each holds.
        """
        return faults_frame(self.report)

    @cached_property
    def states(self) -> pd.DataFrame:
        """Each stretch of a component and side in one state, shape (stretches, 6).

        ``component``, ``side`` (``sensor`` or ``actuator``), ``state`` (a fault mode, ``healthy``, ``not_excited``,
        ``masked``, ``slip``, ``no_data`` or ``not_assessed``), ``start_s``, ``stop_s`` [s, half open], ``reason``.
        """
        return states_frame(self.report)

    @cached_property
    def coverage(self) -> pd.DataFrame:
        """How long each component and side was in each state, shape (parts, 5 + states).

        ``component``, ``side``, ``tier``; ``driving_s``, ``decided_driving_s`` [s]; ``seconds.<state>`` [s].
        """
        return coverage_frame(self.report)

    @cached_property
    def channels(self) -> pd.DataFrame:
        """Where each signal was found and how it was recorded, shape (signals, 11), indexed by ``name``.

        ``channel``, ``unit``, ``recorded_unit``, ``rate_hz`` [Hz], ``samples``, ``gaps``, ``longest_gap_s`` [s],
        ``missing_share`` [1], ``lsb`` [unit], ``guessed``, ``source``.
        """
        return channels_frame(self.report)

    @cached_property
    def signals(self) -> pd.DataFrame:
        """Recorded signals, replayed loop and evidence on one time axis, shape (n, columns), indexed by ``t`` [s].

        ``wheel.<W>.v``, ``wheel.<W>.u``, ``steer.<A>.phi`` … as recorded in SI; ``replay.<W>.…`` the replayed loop;
        ``evidence.<part>.<side>.…`` residual, threshold, estimates and probabilities. NaN where there is no sample.
        ``attrs["units"]`` has the unit of every column. Copy the table before you change values in it. Of missions longer than about 17 minutes at 1 kHz the rows are
        extremes, two for every ``report["log"]["samples_per_bucket"]`` samples; `closeups` then has every sample around the
        worst faults.
        """
        return signals_frame(self.report, self._result.columns)

    @cached_property
    def closeups(self) -> pd.DataFrame | None:
        """Every sample around the worst faults where `signals` holds extremes, as `signals`, shape (m, columns); else None."""
        windows = self._result.windows
        return None if windows is None else signals_frame(self.report, windows.columns, windows.step)

    def plot(self, *groups: str, start_s: float | None = None, stop_s: float | None = None) -> go.Figure:
        """The mission: the timeline of all parts, or the replayed loop.

        Parameters
        ----------
        *groups : str
            ``speed``, ``drive``, ``steering``, ``psi``: plots of the loop as on the page; none: the timeline of states and
            faults. A column of `signals` stands for itself.
        start_s, stop_s : float or None
            Part of the mission [s]; None: all of it.

        Raises
        ------
        ConfigError
            Where a name is neither a group of this result nor one of its columns, or the times are not in order.
        """
        from diagnosis.api.plots import mission_figure

        return mission_figure(self._series, groups, start_s, stop_s)

    def plot_fault(self, fault: str, *, margin_s: float | None = None) -> go.Figure:
        """Evidence of one fault, as on the page: channel and reference, residual, probabilities, estimates, valve, peers.

        Parameters
        ----------
        fault : str
            Name of the fault: ``F1``.
        margin_s : float or None
            Time before and behind it [s]; None: a third of its length, at least 0.5 s.

        Raises
        ------
        ConfigError
            Where there is no fault of that name, or no time series of it was kept.
        """
        from diagnosis.api.plots import fault_figure

        return fault_figure(self._series, fault, margin_s)

    @stated
    def save(self, folder: StrPath, *, max_size_mb: float = 8.0) -> Path:
        """Write what `mfhca diagnose` writes: ``report.html``, ``report.json``, ``report.parquet``.

        Parameters
        ----------
        folder : str or Path
            Folder of the report; made if absent, its report replaced.
        max_size_mb : float
            Size that the page should keep to [MB], at least 0.5.

        Returns
        -------
        Path
            The page, ``report.html``.

        Raises
        ------
        ConfigError
            Where `max_size_mb` is too small.
        OutputError
            Where the folder cannot be written; all files are written, or none.
        """
        from diagnosis.output import HTML, write_result

        if not max_size_mb >= 0.5:
            raise ConfigError(f"--max-size {max_size_mb:g}: expected 0.5 MB or more")
        place = path_of(folder)
        write_result(self._result, place, max_size_mb=max_size_mb)
        return place / HTML

    @cached_property
    def _series(self) -> Series:
        from diagnosis.api.series import Series

        return Series(self.report, self._result.columns, self._result.windows)

    def __repr__(self) -> str:
        log = self.report["log"]
        names = ", ".join(str(file["path"]) for file in log["files"]) or "signals"
        count = len(self.report["intervals"])
        return f"<Diagnosis of {names} ({log['duration_s']:.1f} s): {self.verdict.headline}; {count} fault{'s' * (count != 1)}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: the verdict, why, what to do, and the table of faults."""
        from diagnosis.api.notebook import html_of

        return html_of(self.report, self.verdict)
