"""Results as pandas tables: faults, states, parts, channels, and time series with their units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from diagnosis.report.units import unit_of
from diagnosis.results.document import IntervalRow, ReportDocument

#: Columns of the table of faults, and what each holds.
FAULT_COLUMNS: Mapping[str, str] = {
    "component": "wheel or steering axle",
    "kind": "wheel or steer",
    "side": "sensor, actuator, or sensor_or_actuator where these cannot be told apart",
    "mode": "stuck, no_signal, inefficient, noisy or outside_table",
    "start_s": "begin [s from the mission's start]",
    "stop_s": "end, half open [s from the mission's start]",
    "start": "begin on the log's clock (UTC)",
    "stop": "end on the log's clock (UTC)",
    "severity": "info, low, medium or high",
    "probability": "probability of side and mode [1]",
    "epsilon": "loss of effectiveness ε̂ [1]; NaN where it is not known",
    "epsilon_low": "its lower 95 % bound [1]",
    "epsilon_high": "its upper 95 % bound [1]",
    "sat": "mean of the saturation term [sat_unit]; NaN where it is not known",
    "sat_low": "its lower 95 % bound [sat_unit]",
    "sat_high": "its upper 95 % bound [sat_unit]",
    "sat_rms": "root mean square of the saturation term [sat_unit]",
    "sat_unit": "unit of the saturation term",
    "detected_s": "when the evidence up to then showed the fault [s from the mission's start]; NaN where it is not known",
    "tier": "kind of evidence: direct, model, drive, signal, response, tracking",
    "advice": "what to do",
    "evidence": "what decided, one sentence each",
}
_STATE_COLUMNS = ("component", "side", "state", "start_s", "stop_s", "reason")
_COVERAGE_COLUMNS = ("component", "side", "tier", "driving_s", "decided_driving_s")
_CHANNEL_COLUMNS = (
    "channel", "unit", "recorded_unit", "rate_hz", "samples", "gaps", "longest_gap_s", "missing_share", "lsb", "guessed",
    "source",
)  # fmt: skip
_TEXTS = ("component", "kind", "side", "mode", "severity", "sat_unit", "tier", "advice", "evidence")


def faults_frame(report: ReportDocument) -> pd.DataFrame:
    """The faults of a report, the worst first.

    Returns
    -------
    pd.DataFrame, shape (faults, 22)
        Indexed by ``id`` (``F1``, ``F2``, …); columns and units as in `FAULT_COLUMNS`.
    """
    rows = [_fault(fault) for fault in report["intervals"]]
    ids = pd.Index([fault["id"] for fault in report["intervals"]], dtype="object", name="id")
    frame = pd.DataFrame(rows, index=ids, columns=list(FAULT_COLUMNS))
    for name in FAULT_COLUMNS:
        if name in ("start", "stop"):
            frame[name] = pd.to_datetime(frame[name].astype("int64"), utc=True).astype("datetime64[ns, UTC]")
        else:
            frame[name] = frame[name].astype("object" if name in _TEXTS else "float64")
    return frame


def _fault(fault: IntervalRow) -> dict[str, object]:
    epsilon, sat, nan = fault["epsilon"], fault["sat"], np.nan
    return {
        **{name: str(fault[name]) for name in ("component", "kind", "side", "mode", "severity", "tier", "advice")},
        **{name: fault[name] for name in ("start_s", "stop_s", "probability", "detected_s")},
        "start": fault["start_ns"],
        "stop": fault["stop_ns"],
        "epsilon": epsilon["value"] if epsilon else nan,
        "epsilon_low": epsilon["low"] if epsilon else nan,
        "epsilon_high": epsilon["high"] if epsilon else nan,
        "sat": sat["mean"] if sat else nan,
        "sat_low": sat["low"] if sat else nan,
        "sat_high": sat["high"] if sat else nan,
        "sat_rms": sat["rms"] if sat else nan,
        "sat_unit": sat["unit"] if sat else "",
        "evidence": " ".join(fault["evidence"]),
    }


def states_frame(report: ReportDocument) -> pd.DataFrame:
    """Each stretch of a component and side in one state; the stretches of a side leave no gap.

    Returns
    -------
    pd.DataFrame, shape (stretches, 6)
        ``component``; ``side`` (``sensor`` or ``actuator``); ``state``; ``start_s``, ``stop_s`` (half open [s from the
        mission's start]); ``reason``.
    """
    return _rows(report["states"], _STATE_COLUMNS)


def coverage_frame(report: ReportDocument) -> pd.DataFrame:
    """How long each component and side was in each state, and how much of its driving was judged.

    Returns
    -------
    pd.DataFrame, shape (parts, 5 + states)
        ``component``, ``side``, ``tier`` (evidence); ``driving_s``, ``decided_driving_s`` [s]; ``seconds.<state>`` for every
        state that occurs [s].
    """
    states = dict.fromkeys(state for row in report["coverage"] for state in row["seconds"])
    rows: list[dict[str, object]] = [
        {**row, **{f"seconds.{s}": row["seconds"].get(s, 0.0) for s in states}} for row in report["coverage"]
    ]
    return _rows(rows, (*_COVERAGE_COLUMNS, *(f"seconds.{s}" for s in states)))


def channels_frame(report: ReportDocument) -> pd.DataFrame:
    """Where each signal was found, and how it was recorded.

    Returns
    -------
    pd.DataFrame, shape (signals, 11)
        Indexed by the signal's name. ``channel`` (where it stands in the log), ``unit`` and ``recorded_unit``, ``rate_hz``
        [Hz], ``samples``, ``gaps``, ``longest_gap_s`` [s], ``missing_share`` [1], ``lsb`` (its step [unit]), ``guessed``
        (by its name), ``source`` (file).
    """
    frame = _rows(report["signals"], _CHANNEL_COLUMNS)
    frame.index = pd.Index([row["name"] for row in report["signals"]], dtype="object", name="name")
    return frame


def signals_frame(
    report: ReportDocument, columns: Mapping[str, NDArray[np.floating[Any]]], step: NDArray[np.int64] | None = None
) -> pd.DataFrame:
    """Time series of a result.

    Parameters
    ----------
    report : ReportDocument
        The document.
    columns : Mapping[str, NDArray[np.floating]], each of shape (n,)
        Columns of `diagnosis.results.result.MissionResult`, or of its `Closeups`.
    step : NDArray[np.int64], shape (n,), or None
        Steps of the mission that the rows are; None: the columns hold ``t`` [s].

    Returns
    -------
    pd.DataFrame, shape (n, columns)
        Views of the columns, not to be written. Indexed by ``t`` [s from the mission's start]; NaN where there is no sample. ``attrs["units"]`` has the unit of
        every column.
    """
    t = columns["t"] if step is None else step / report["log"]["rate_hz"]
    shown = {name: _read_only(values) for name, values in columns.items() if name != "t"}
    frame = pd.DataFrame(shown, index=pd.Index(np.asarray(t, np.float64), name="t"), copy=False)
    recorded = {s["name"]: s["unit"] for s in report["signals"]}
    frame.attrs["units"] = {name: recorded.get(name) or unit_of(name, report) for name in shown}
    return frame


def _read_only(values: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """The same numbers without a copy, guarded against being written."""
    view = np.asarray(values).view()
    view.flags.writeable = False
    return view


def _rows(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> pd.DataFrame:
    """Table of rows, of which other keys are left out; members of enumerations become plain text."""
    plain = [{name: str(row[name]) if isinstance(row[name], str) else row[name] for name in columns} for row in rows]
    return pd.DataFrame(plain, columns=list(columns))
