"""From findings to faults, severity and verdict, by Assumptions 1 and 2 of the paper.

Assumption 1: a sensor that is stuck or silent is tolerable when brief, else stop and repair. Assumption 2: a stuck
actuator, or one without control signal, means stop at once. Everything else is watched.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.decision.caveats import caveats_of, doubt_of
from diagnosis.decision.wording import GONE, actions_of, count_words, join_words, part_words, seconds_words, sentence_of
from diagnosis.results.assessed import needed_s
from diagnosis.results.assessment import STATES, Assessment, Finding
from diagnosis.results.result import FaultInterval, Severity, StateSpan, Verdict
from diagnosis.wheels.identification import WheelModelFit
from replay.faults import FaultMode, Side
from replay.machine.config import Limits

Key = tuple[str, str]

_RANK: dict[Severity, int] = {"high": 0, "medium": 1, "low": 2, "info": 3}
_LIKELY = 0.6  # probability of any fault from which on one is worth a check
_MARKED_EPSILON = 0.3
_MODEL_RESOLUTION = 0.25
_COMPARED_WHEELS = 3
_UNEXPLAINED_S = 0.5
_SHORT_NOISE_S = 1.0
_PROBABLY_DEAD = 0.5


def severity_of(finding: Finding, seconds: float, limits: Limits, kind: str = "wheel") -> tuple[Severity, str]:
    """Severity and advice of one fault of a ``wheel`` or a ``steer`` axle; see the module's docstring."""
    faulty = 1.0 - sum(h.p for h in finding.hypotheses if h.mode == "healthy")
    if faulty < _LIKELY:
        return "info", "Not certain enough to act on. Compare with the next mission."
    if faulty < limits.min_probability:
        if finding.mode in GONE and finding.side is not Side.SENSOR:
            return "medium", "Probably a valve that does not answer: check it before the machine goes out again."
        return "low", "Probable, not certain: check it at the next service, and compare with the next mission."
    if finding.mode is FaultMode.NOISY and finding.tier == "model" and seconds < _SHORT_NOISE_S:
        return "info", "Too short to act on: a model alone shows it. Compare with the next mission."
    if finding.mode in GONE and sum(h.p for h in finding.hypotheses if h.mode in GONE) < _PROBABLY_DEAD:
        return "medium", "Faulty, but more probably in another way than dead: check it before the next mission."
    if finding.mode in GONE and finding.side is Side.ACTUATOR:
        return "high", "Stop at once and repair: the valve does not answer its command (Assumption 2)."
    if finding.mode in GONE and finding.side is Side.SENSOR_OR_ACTUATOR:
        part = "steering valve" if kind == "steer" else "drive"
        return "high", f"Stop and find out whether the {part} or its sensor fails; treat it as the {part} until then."
    if finding.mode in GONE:
        if seconds <= limits.brief:
            return "low", (
                f"Tolerable: no longer than {limits.brief:g} s (Assumption 1). Check plug and cable at the next service."
            )
        return "high", (
            f"Stop and repair the sensor: it gave nothing usable for more than {limits.brief:g} s (Assumption 1)."
        )
    marked = finding.epsilon is not None and finding.epsilon.value >= _MARKED_EPSILON
    severity: Severity = "medium" if marked else "low"
    if finding.mode is FaultMode.OUTSIDE_TABLE:
        return (
            "medium",
            "Check scaling and sign of the channel: its gain lies outside what a fault of the table can give.",
        )
    if finding.side is Side.SENSOR:
        scaling = "wire, mount and scaling" if kind == "steer" else "gap, magnet and scaling"
        what = scaling if finding.mode is FaultMode.INEFFICIENT else "shield, ground and supply"
        return severity, f"By itself no reason to stop; check the sensor's {what}."
    if finding.side is Side.ACTUATOR:
        what = (
            "pressure, leakage and spool travel"
            if finding.mode is FaultMode.INEFFICIENT
            else "command wiring and pilot"
        )
        return severity, f"By itself no reason to stop; check the valve's {what}."
    return (
        severity,
        "By itself no reason to stop; measure "
        f"{'angle' if kind == 'steer' else 'speed'} and valve travel to tell sensor from valve.",
    )


def intervals_of(
    assessments: Mapping[Key, Assessment], axles: Sequence[str], start_ns: int, step_ns: int, limits: Limits
) -> tuple[FaultInterval, ...]:
    """Number the findings of all components: worst first, then by time; a shared finding counts once."""
    found: dict[tuple[str, str, int, int], FaultInterval] = {}
    for (component, _), assessment in assessments.items():
        kind = "steer" if component in axles else "wheel"
        for f in assessment.findings:
            seconds = (f.stop - f.start) * step_ns * 1e-9
            severity, advice = severity_of(f, seconds, limits, kind)
            found[component, f.side.value, f.start, f.stop] = FaultInterval(
                id="",
                component=component,
                kind="steer" if kind == "steer" else "wheel",
                side=f.side,
                mode=f.mode,
                start_s=f.start * step_ns * 1e-9,
                stop_s=f.stop * step_ns * 1e-9,
                start_ns=start_ns + f.start * step_ns,
                stop_ns=start_ns + f.stop * step_ns,
                epsilon=f.epsilon,
                sat=f.sat,
                probability=f.probability,
                hypotheses=f.hypotheses,
                severity=severity,
                advice=advice,
                evidence=f.evidence,
                tier=f.tier,
                detected_s=None if f.detected is None else f.detected * step_ns * 1e-9,
            )
    ordered = sorted(found.values(), key=lambda x: (_RANK[x.severity], x.start_s, x.component, x.side.value))
    return tuple(replace(f, id=f"F{i + 1}") for i, f in enumerate(ordered))


def spans_of(assessments: Mapping[Key, Assessment], step_ns: int) -> tuple[StateSpan, ...]:
    """States of every component and side as spans without gaps."""
    out = []
    for (component, side), assessment in assessments.items():
        codes = assessment.states
        cut = np.flatnonzero(np.r_[True, codes[1:] != codes[:-1]])
        for a, b in zip(cut, np.r_[cut[1:], codes.size], strict=True):
            state = STATES[int(codes[a])]
            out.append(
                StateSpan(
                    component=component,
                    side="sensor" if side == "sensor" else "actuator",
                    state=state,
                    start_s=float(a) * step_ns * 1e-9,
                    stop_s=float(b) * step_ns * 1e-9,
                    reason=assessment.reasons.get(state, ""),
                )
            )
    return tuple(out)


@dataclass(frozen=True)
class Decision:
    """The verdict and what to do.

    Attributes
    ----------
    cleared : bool
        Whether the machine may go out: ``ready``, or faults to watch in a mission that is ``ready`` but for them.
    not_cleared : str
        Why ``watch`` gives no such leave, to follow *not cleared:*; empty otherwise.
    """

    status: Verdict
    title: str
    text: str
    caveats: tuple[str, ...]
    actions: tuple[dict[str, object], ...]
    cleared: bool = False
    not_cleared: str = ""


def decide(
    intervals: Sequence[FaultInterval],
    assessments: Mapping[Key, Assessment],
    decided_s: Mapping[Key, float],
    axles: Sequence[str],
    limits: Limits,
    damage: Sequence[str],
    *,
    driving_s: Mapping[Key, float] | None = None,
    model: WheelModelFit | None = None,
) -> Decision:
    """Give the verdict.

    ``stop`` with a fault of high severity, ``watch`` with one of low or medium; without faults ``ready`` only where
    every wheel and side was decided for `min_assessed` seconds and for four fifths of its driving, and the log lost
    nothing, else ``not_assessed``. A wheel model found in the mission itself is compared across wheels; with fewer
    than three of them a loss that lasts the whole mission would not show, so that it gives no ``ready`` either. What
    stands against ``ready`` beside the faults keeps ``watch`` from being cleared.

    Parameters
    ----------
    intervals : Sequence[FaultInterval]
        Faults.
    assessments : Mapping
        By (component, side).
    decided_s : Mapping
        Seconds of driving in which the component and side was healthy or faulty rather than undecided.
    axles : Sequence[str]
        Steering axles.
    limits : Limits
        What ``ready`` needs.
    damage : Sequence[str]
        What the log lost.
    driving_s : Mapping or None
        Seconds of driving of the component; None: only `min_assessed` counts.
    model : WheelModelFit or None
        Wheel models behind the judgement, where any.
    """
    driven = driving_s or {}
    short = [
        k
        for k in assessments
        if k[0] not in axles and decided_s.get(k, 0.0) < needed_s(driven.get(k, 0.0), limits.min_assessed)
    ]
    modelled = [k for k, a in assessments.items() if a.tier == "model"]
    caveats = caveats_of(short, assessments, decided_s, driven, axles, limits, damage)
    if modelled and model is not None and model.identified:
        caveats += (
            "Speed sensors and valves that are not measured twice were judged by a wheel model found in this mission: a "
            f"loss below about {100 * _MODEL_RESOLUTION:.0f} %, or one that lasts the whole mission on every wheel, does "
            "not show. A machine file with [plant], or a second measurement, would.",
        )
    odd = [k for k, a in assessments.items() if k[0] not in axles and a.unexplained_s >= _UNEXPLAINED_S]
    alone = bool(modelled) and model is not None and model.identified and len(model.plants) < _COMPARED_WHEELS
    actions = actions_of(intervals)
    worst = intervals[0].severity if intervals else None
    stop = [f for f in intervals if f.severity == "high"]
    watch = [f for f in intervals if f.severity in ("medium", "low")]
    if worst == "high":
        title = f"{count_words(len(stop), 'fault')} to repair" + (f", {len(watch)} to watch" if watch else "")
        return Decision("stop", title, sentence_of(stop), caveats, actions)
    if watch:
        title, doubt = f"{count_words(len(watch), 'fault')} to watch", doubt_of(watch, len(short), odd, alone, damage)
        return Decision("watch", title, sentence_of(watch), caveats, actions, not doubt, doubt)
    if short:
        who = join_words(sorted({part_words("wheel", c, s) for c, s in short}))
        text = f"No fault was found, but {who} could not be judged long enough to say that they are healthy."
        return Decision("not_assessed", "Not judged long enough", text, caveats, actions)
    if odd:
        who = join_words(sorted({part_words("wheel", c, "sensor_or_actuator") for c, _ in odd}))
        most = max(assessments[k].unexplained_s for k in odd)
        text = (
            f"No fault can be stated, but something deviates at the {who} for up to {seconds_words(most)} that no single fault "
            "explains well enough. Measure speed or valve position a second time, or inspect."
        )
        return Decision("not_assessed", "Deviations that are not explained", text, caveats, actions)
    if alone:
        text = (
            "No fault was found, but the wheel model comes from this mission alone: a loss that lasted all of it would "
            "not show. Give the wheels' K and tau in a machine file's [plant]."
        )
        return Decision("not_assessed", "No fault found, not fully assessed", text, caveats, actions)
    if damage:
        title, doubt = "No fault found in a damaged log", doubt_of((), 0, (), False, damage)
        return Decision("watch", title, "Parts of the log are lost: " + damage[0], caveats, actions, False, doubt)
    least = min((decided_s[k] for k in assessments if k[0] not in axles), default=0.0)
    text = f"Every wheel's speed sensor and drive valve was judged healthy over at least {least:.0f} s of driving."
    return Decision("ready", "No fault found", text, caveats, actions, cleared=True)
