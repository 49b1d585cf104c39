"""Compare a report with the truth: states over driving time, faults one to one.

A fault is right where component, side and mode agree and the intervals overlap enough (`diagnosis.evaluation.matching`). Left-over
faults are matched with left-over reports of the same component, then of any other: those have the wrong mode, side or
part. Time in which the truth says that an actuator was masked counts nowhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from diagnosis.evaluation.aligned import Compared
from diagnosis.evaluation.counts import SIDES, Counts
from diagnosis.evaluation.events import match_events
from diagnosis.evaluation.excitation import Speeds
from diagnosis.evaluation.state_time import state_time
from diagnosis.results.document import ReportDocument
from diagnosis.results.vocabulary import Kind
from replay.errors import ConfigError, LogError
from replay.truth import MissionTruth

_BEYOND_S, _BEYOND = 1.0, 0.01  # by which a result may reach beyond its truth [s], or as a share of it


@dataclass(frozen=True)
class MissionScores:
    """Counts of one mission.

    Attributes
    ----------
    groups : Mapping[str, Counts]
        ``wheel`` and ``steer``, each where the result holds such components.
    left_out : tuple[str, ...]
        Components with injected faults that the result does not hold.
    not_driven : tuple[str, ...]
        Injected faults during which their part was not driven at all: nothing could show them.
    """

    groups: Mapping[str, Counts]
    left_out: tuple[str, ...]
    not_driven: tuple[str, ...] = ()


def evaluate_report(
    report: ReportDocument, truth: MissionTruth, name: str = "report.json", *, speeds: Speeds | None = None
) -> MissionScores:
    """Count what a report got right and wrong.

    Parameters
    ----------
    report : ReportDocument
        Contents of a ``report.json``.
    truth : MissionTruth
        What was injected.
    name : str
        The report's name, for messages.
    speeds : Speeds or None
        Commanded speeds of the result, from `diagnosis.evaluation.excitation`; without them nothing is divided by speed.

    Raises
    ------
    ConfigError
        Where the truth is that of another mission or machine.
    LogError
        Where the report lacks parts.
    """
    try:
        return _evaluate(report, truth, name, speeds)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise LogError(
            f"{name}: is not a complete report ({error!r}); run `mfhca diagnose` on the log again"
        ) from error


def _evaluate(report: ReportDocument, truth: MissionTruth, name: str, speeds: Speeds | None) -> MissionScores:
    if not truth.rate_hz > 0:
        raise ConfigError(f"the truth file's rate_hz is {truth.rate_hz:g}; expected the recorded rate, above 0 Hz")
    shift = (int(report["log"]["start_ns"]) - truth.start_ns) * 1e-9
    window = (max(0.0, shift), min(truth.duration_s, shift + float(report["log"]["duration_s"])))
    if window[1] <= window[0]:
        raise ConfigError(
            f"{name}: begins {shift:.1f} s after the truth file's mission, which lasts {truth.duration_s:.1f} s, so they "
            "do not overlap; give the truth file of this log with --truth"
        )
    beyond = max(-shift, 0.0) + max(shift + float(report["log"]["duration_s"]) - truth.duration_s, 0.0)
    if beyond > max(_BEYOND_S, _BEYOND * truth.duration_s):
        raise ConfigError(
            f"{name}: {beyond:.1f} s of its {float(report['log']['duration_s']):.1f} s lie outside of the truth file's mission, "
            f"which lasts {truth.duration_s:.1f} s; expected the mission or a part of it; give the truth file of this log with --truth"
        )
    states: dict[str, dict[str, list[tuple[float, float, str]]]] = {}
    for row in report["states"]:
        spans = states.setdefault(row["component"], {side: [] for side in SIDES})
        spans[row["side"]].append((row["start_s"] + shift, row["stop_s"] + shift, row["state"]))
    if not set(states) & set(truth.wheels):
        raise ConfigError(
            f"{name}: its components are {', '.join(states) or 'none'}, the truth file's wheels {', '.join(truth.wheels)}; "
            "give the truth file of this log with --truth"
        )
    groups: dict[str, Counts] = {}
    for group in Kind:
        parts = [c for c in states if (c in truth.wheels) == (group is Kind.WHEEL)]
        if parts:
            part_states = {c: states[c] for c in parts}
            compared = Compared(report["intervals"], part_states, truth, window, shift, speeds)
            faults, reports = match_events(compared)
            groups[group.value] = replace(state_time(compared), faults=faults, reports=reports)
    left_out = tuple(dict.fromkeys(f.component for f in truth.intervals if f.component not in states))
    return MissionScores(groups, left_out, _not_driven(truth, window))


def _not_driven(truth: MissionTruth, window: tuple[float, float]) -> tuple[str, ...]:
    """Faults within the judged part of the mission that lie wholly outside of their component's driving."""
    out = []
    for fault in truth.intervals:
        driven = [(s.start_s, s.stop_s) for s in truth.driving if s.component == fault.component]
        start, stop = max(fault.start_s, window[0]), min(fault.stop_s, window[1])
        if driven and start < stop and not any(a < stop and start < b for a, b in driven):
            words = (fault.component, fault.side, fault.mode.value.replace("_", " "))
            out.append(f"{' '.join(words)} from {fault.start_s:g} to {fault.stop_s:g} s")
    return tuple(out)
