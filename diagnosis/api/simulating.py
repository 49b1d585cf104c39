"""Simulate a mission with known faults: its log, and its truth beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from diagnosis.api.errors import stated
from diagnosis.api.inputs import StrPath, path_of
from diagnosis.api.log_format import ENDINGS, LogFormat, format_named, format_of
from diagnosis.api.simulation_options import SimulateRequest, options_of
from replay.errors import ConfigError, MfhcaError
from replay.progress import Progress, Stage, Subscriber, silent

if TYPE_CHECKING:
    import pandas as pd

    from replay.simulation.options import EvidenceLevel, Scenario, SimulatedLaw, SimulatedMission, SimulationOptions
    from replay.truth import MissionTruth


@dataclass(frozen=True)
class MadeLog:
    """A log that was written with known faults, and its truth.

    Attributes
    ----------
    log, truth_file : Path
        The log, and the truth file beside it.
    format : str
        Container: ``mcap``, ``bag``, ``rosbag2``, ``twincat``, ``csv`` or ``parquet``.
    truth : MissionTruth
        What the truth file holds.
    notes : tuple[str, ...]
        What may spoil a comparison with the truth, one sentence each; empty where nothing does.
    """

    log: Path
    truth_file: Path
    format: str
    truth: MissionTruth
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        count = len(self.truth.intervals)
        return f"<MadeLog {self.log} ({self.format}, {self.truth.duration_s:.1f} s): {count} fault{'s' * (count != 1)}>"

    @property
    def faults(self) -> pd.DataFrame:
        """The injected faults, shape (faults, 10), one row each in order of their start.

        Columns: ``component`` and ``kind`` (``wheel`` or ``steer``), ``side`` and ``mode`` (row of the paper's tables),
        ``start_s`` and ``stop_s`` (mission time [s], half open), ``epsilon`` (ε of L4 or L8 [1]), ``sat_mean`` and
        ``sat_std`` (saturation term [m/s], [rad] or [fraction of full opening]), ``ramp_s`` (time over which ε grows [s]).
        """
        import pandas as pd

        from replay.truth import TruthInterval

        rows = [[str(x) if isinstance(x, str) else x for x in astuple(interval)] for interval in self.truth.intervals]
        return pd.DataFrame(rows, columns=[f.name for f in fields(TruthInterval)])


@stated
def simulate(
    output: StrPath | None = None,
    *,
    scenario: Scenario | None = None,
    faults: Sequence[str] = (),
    seed: int = 1,
    start_ns: int | None = None,
    duration_s: float = 240.0,
    rate_hz: float | None = None,
    evidence: EvidenceLevel = "direct",
    preset: str | None = None,
    coupling: Literal["ground", "free"] | None = None,
    law: SimulatedLaw | None = None,
    controller: str | None = None,
    ice: float | None = None,
    format: str | None = None,  # noqa: A002 - the option's name
    settings: Mapping[str, float | str] | None = None,
    vary: bool = False,
    force: bool = False,
) -> MadeLog:
    """Simulate a mission of the paper's machine, as `mfhca simulate` does: a log, and its truth beside it.

    Parameters
    ----------
    output : str, Path or None
        Log to write; None: ``mission`` with the format's ending, in the current folder.
    scenario : str or None
        ``paper`` (the default), ``brief``, ``random`` or ``healthy``: drive and faults.
    faults : Sequence[str]
        Faults instead of the scenario's, each ``PART SIDE MODE START STOP [eps=] [sat=] [std=] [tau=] [ramp=]``, times in
        seconds: ``"FR sensor stuck 30 45"``.
    seed : int
        The same seed gives the same mission.
    start_ns : int or None
        When the mission begins [ns since 1970]; None: on a day in October 2025.
    duration_s : float
        Length of the mission [s].
    rate_hz : float or None
        Recorded rate, 50 to 1000 [Hz]; None: 1000, or with `vary` a drawn one.
    evidence : str
        Second measurements in the log: ``base`` none, ``spool`` valve positions, ``direct`` also speeds and angles.
    preset : str or None
        A named mission: ``paper-table``.
    coupling : str or None
        ``ground`` (the default): wheels share the body through their tyres; ``free``: wheels in the air.
    law : str or None
        Reading of the control law: ``opposed`` (the default), ``signed``, ``printed``, ``sign_abs``, ``p``, ``event_reset``.
    controller : str or None
        Another controller instead of a law: ``p``, ``pi``, ``adaptive``, ``finite-time``, ``neural``, ``fuzzy``.
    ice : float or None
        Share of icy ground, 0 to 0.9 [1]; None: the scenario's.
    format : str or None
        Container, see `MadeLog.format`; None: by the ending of `output`.
    settings : Mapping[str, float or str] or None
        Constants by name, in SI units: ``{"K": 1.6, "dead_zone": 0.03}``; `mfhca simulate --help` lists them.
    vary : bool
        Whether all that is not given is drawn by the seed.
    force : bool
        Whether an earlier simulated log of that name, or the truth of another one, may be replaced.

    Raises
    ------
    ConfigError
        Where a word is not known, a value is out of its range, or something else stands in the place of the log.
    OutputError
        Where the log cannot be written.
    """
    request = SimulateRequest(
        output=None if output is None else path_of(output),
        scenario=scenario,
        preset=preset,
        seed=seed,
        start_ns=start_ns,
        duration_s=duration_s,
        rate_hz=rate_hz,
        evidence=evidence,
        coupling=coupling,
        law=law,
        controller=controller,
        ice=ice,
        format=None if format is None else format_named(format),
        faults=tuple(faults),
        settings=tuple(f"{key}={value}" for key, value in (settings or {}).items()),
        vary=vary,
        force=force,
    )
    return write_simulation(request)[0]


def write_simulation(request: SimulateRequest, progress: Subscriber = silent) -> tuple[MadeLog, SimulatedMission]:
    """Simulate a mission, and write its log and its truth.

    Parameters
    ----------
    request : SimulateRequest
        What is asked for.
    progress : Subscriber
        Called at the beginning of each stage.

    Returns
    -------
    tuple[MadeLog, SimulatedMission]
        What was written, and the mission that it was written from.

    Raises
    ------
    ConfigError
        See `simulate`.
    """
    from replay.truth import truth_path

    kind = request.format or (LogFormat.MCAP if request.output is None else format_of(request.output))
    log = request.output or Path(f"mission{ENDINGS[kind]}")
    truth = truth_path(log, folder=kind is LogFormat.ROSBAG2)
    _check_absent(log, truth, request.force)
    from replay.export.mission import write_mission
    from replay.simulation.run import simulate_mission
    from replay.truth import write_truth

    options = options_of(request)
    mission = simulate_mission(options)
    if not request.force:
        _keep_other_truth(truth, mission.truth)
    progress(Progress(Stage.WRITING, log.name))
    write_mission(mission, log, "ros1" if kind is LogFormat.BAG else kind.value)
    write_truth(mission.truth, truth)
    return MadeLog(log, truth, kind.value, mission.truth, _notes(log, options, mission)), mission


def _notes(log: Path, options: SimulationOptions, mission: SimulatedMission) -> tuple[str, ...]:
    if options.faults is not None or options.scenario == "healthy" or mission.truth.intervals:
        return ()
    return (
        f"{log}: the {options.scenario} scenario has no fault in {options.duration_s:g} s; give a longer --duration, or --fault",
    )


def _check_absent(log: Path, truth: Path, force: bool) -> None:
    """Raise a `ConfigError` where a log would be replaced that is not simulated, or that was not asked to be."""
    if log.exists() and not truth.exists():
        raise ConfigError(f"{log}: exists and is not a simulated log, so it was not changed; give another name with -o")
    if log.exists() and not force:
        raise ConfigError(f"{log}: exists already; give another name with -o, or --force to replace it and its truth")


def _keep_other_truth(path: Path, truth: MissionTruth) -> None:
    """Raise a `ConfigError` where a truth file of another mission stands where this one's belongs."""
    from replay.truth import read_truth

    try:
        same = not path.exists() or read_truth(path) == truth
    except MfhcaError:
        same = False
    if not same:
        raise ConfigError(
            f"{path}: belongs to another mission, whose truth would be lost; give another name with -o, or --force to replace it"
        )
