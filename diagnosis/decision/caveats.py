"""What limits a verdict: parts that were not judged long enough, driving that stays open, damage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.decision.wording import count_words, join_words, part_words, unanswered
from diagnosis.results.assessed import needed_s
from diagnosis.results.assessment import STATES, Assessment
from diagnosis.results.result import FaultInterval
from replay.arrays.spill import blocks
from replay.faults import FAULT_STATES, State
from replay.machine.config import Limits, Machine
from replay.mission import Mission
from replay.signals.timeline import Timeline

Key = tuple[str, str]

_OPEN_S, _OPEN_SHARE = 1.0, 0.02  # driving that was not judged and is worth a word
_EMPTY_S = 1.0  # without any wheel speed
_LEFT_OUT = " was left out: its clock "


def doubt_of(watch: Sequence[FaultInterval], short: int, odd: Sequence[Key], alone: bool, damage: Sequence[str]) -> str:
    """Why a mission with faults to watch is not cleared; empty where it is."""
    out = [f"the {part_words(f.kind, f.component, f.side.value)} may not answer" for f in watch if unanswered(f)]
    out = list(dict.fromkeys(out))
    if damage:
        out.append("part of the log was left out" if _LEFT_OUT in damage[0] else "the log is damaged")
    if short:
        out.append(f"{count_words(short, 'part')} {'was' if short == 1 else 'were'} not judged long enough")
    if odd:
        out.append("something deviates that no fault explains")
    if alone:
        out.append("a loss that lasted the whole mission would not show")
    return join_words(out)


def caveats_of(
    short: Sequence[Key],
    assessments: Mapping[Key, Assessment],
    decided_s: Mapping[Key, float],
    driven: Mapping[Key, float],
    axles: Sequence[str],
    limits: Limits,
    damage: Sequence[str],
) -> tuple[str, ...]:
    """Sentences on damage, parts that were not judged long enough, the most driving left open, and unjudged steering."""
    out = []
    if damage:
        said = "" if _LEFT_OUT in damage[0] else "The log is damaged: "
        out.append(f"{said}{damage[0]}" + (f" (and {len(damage) - 1} more)" if len(damage) > 1 else ""))
    for key in short:
        reason = _why_short(assessments[key], driven.get(key), limits)
        out.append(
            f"{part_words('wheel', *key)}: judged for {decided_s.get(key, 0.0):.1f} s of driving, of "
            f"{needed_s(driven.get(key, 0.0), limits.min_assessed):.3g} s needed"
            + (f" ({reason})" if reason else "")
            + "."
        )
    open_s = {
        k: driven[k] - decided_s.get(k, 0.0)
        for k in assessments
        if k in driven and k not in short and k[0] not in axles
    }
    worst = "no other part has more" if not short else "none of the parts judged long enough has more"
    most = max(open_s, key=lambda k: open_s[k], default=None)
    if most is not None and open_s[most] > max(_OPEN_S, _OPEN_SHARE * driven[most]):
        out.append(
            f"{part_words('wheel', *most)}: {open_s[most]:.1f} s of {driven[most]:.1f} s of driving could not be judged"
            + (f" ({reason})" if (reason := _main_reason(assessments[most])) else "")
            + f"; {worst}. The timeline shows when."
        )
    unjudged = [k for k in assessments if k[0] in axles and assessments[k].tier == "none"]
    if unjudged:
        who = join_words([part_words("steer", *k) for k in unjudged])
        out.append(f"Not assessed: {who} ({_main_reason(assessments[unjudged[0]])}).")
    return tuple(out)


def _why_short(assessment: Assessment, driven: float | None, limits: Limits) -> str:
    """Why a part was not judged long enough; a machine at rest is no reason while it drives."""
    if driven is not None and driven < limits.min_assessed and assessment.tier != "none":
        return f"only {driven:.1f} s were driven"
    return _main_reason(assessment)


def _main_reason(assessment: Assessment) -> str:
    """Reason of the commonest state that is no judgement; a machine at rest is one only where nothing else is."""
    best, most = "", 0.0
    for state, reason in assessment.reasons.items():
        if state is State.HEALTHY or state in FAULT_STATES:
            continue
        count = float(np.count_nonzero(assessment.states == STATES.index(state)))
        if state is State.NOT_EXCITED:
            count *= 1e-9
        if count > most:
            best, most = reason, count
    return best


def more_caveats(mission: Mission, first_ns: int, machine: Machine) -> list[str]:
    """What the reader should know beside the verdict: parts of a mission, signals that were named and not found."""
    out = []
    if mission.open_loop:
        out.append(
            "Faults were injected into this recording; the controller did not react to them: evidence that rests on the "
            "closed loop and on controller consistency is switched off."
        )
    empty = _without_speed(mission.timeline, machine)
    if empty > _EMPTY_S:
        out.append(f"For {empty:.1f} s no wheel speed was recorded: nothing is known of that time.")
    absent = [name for name in machine.signals if name not in mission.signals.items]
    if absent:
        reason = mission.signals.missing.get(absent[0], "")
        out.append(
            f"Named in the machine file but not found in the log: {', '.join(absent)}"
            + (f" ({reason})" if reason else "")
            + "."
        )
    cut = (mission.timeline.start_ns - first_ns) * 1e-9
    if cut > mission.timeline.dt:
        out.append(f"Only a part of the mission was judged; times count from its start, {cut:.3f} s into the log.")
    return out


def _without_speed(timeline: Timeline, machine: Machine) -> float:
    """Time in which no wheel speed is valid [s]."""
    names = [f"wheel.{w}.{x}" for w in machine.wheels for x in ("v", "v_true")]
    speeds = [timeline.signals[n] for n in names if n in timeline.signals]
    steps = sum(
        int(np.count_nonzero(~np.isfinite([v[part] for v in speeds]).any(axis=0))) for part in blocks(timeline.size)
    )
    return steps * timeline.dt if speeds else 0.0
