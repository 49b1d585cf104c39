"""Parts that were not judged, or not for long enough: why, and what somebody does to have them judged."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.decision.short_advice import act_of_axle, act_of_wheel, lack_of, steering_signals
from diagnosis.decision.wording import join_words
from diagnosis.results.assessed import is_judged, needed_s
from diagnosis.results.assessment import STATES, Assessment, Lack
from diagnosis.results.document import ToClearRow
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import DECIDED, Side, State
from replay.machine.config import Limits

#: A component and its side.
Part = tuple[str, str]

SAID_S = 0.05  # of judged driving: less is nothing
#: Why a part was not judged where a finding leaves it as probable that it is healthy.
AS_WELL_HEALTHY = "what was found there may as well be no fault"


@dataclass(frozen=True)
class ToClear:
    """What keeps a machine from being cleared, and what would clear it.

    Attributes
    ----------
    reason : str
        A sentence.
    act : str
        What would clear it, to follow *to clear it*.
    parts : tuple[Part, ...]
        The parts that it is of; empty where it is of the whole machine.
    fault : str
        The fault that alone is the reason, by its name; else empty.
    why : str
        Of parts that were not judged why not, without their names; else empty.
    """

    reason: str
    act: str
    parts: tuple[Part, ...] = ()
    fault: str = ""
    why: str = ""

    def row(self) -> ToClearRow:
        """The same for ``report.json``."""
        return {
            "reason": self.reason,
            "act": self.act,
            "parts": [{"component": component, "side": side} for component, side in self.parts],
            "fault": self.fault,
            "why": self.why,
        }


def sides_of(parts: Iterable[tuple[str, Side]]) -> tuple[Part, ...]:
    """Components with each of their sides, once."""
    return tuple(dict.fromkeys((component, side.value) for component, both in parts for side in both.sides))


def short_parts(
    short: Sequence[Part],
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    driven: Mapping[Part, float],
    limits: Limits,
    words: MachineWords,
    kind: Kind = Kind.WHEEL,
    *,
    open_state: Mapping[Part, State] | None = None,
) -> list[ToClear]:
    """Parts that were not judged long enough, those together that are so for the same reason.

    Parameters
    ----------
    short : Sequence[Part]
        The parts.
    assessments : Mapping[Part, Assessment]
        Of all parts.
    decided_s, driven : Mapping[Part, float]
        Driving that was decided, and all of it [s].
    limits : Limits
        What counts.
    words : MachineWords
        How to speak of the machine.
    kind : Kind
        Of the parts' components.
    open_state : Mapping[Part, State] or None
        The commonest state that is no judgement, while driving.
    """
    alike: dict[tuple[str, str, bool], list[Part]] = {}
    for part in short:
        state = (open_state or {}).get(part) or main_state(assessments[part])
        reason = _why_short(assessments[part], driven.get(part), limits, state)
        act = (
            act_of_wheel(part, assessments[part], driven.get(part), limits, words, state)
            if kind is Kind.WHEEL
            else act_of_axle(part[1], state, lack_of(assessments[part], state), words)
        )
        alike.setdefault((reason, act, decided_s.get(part, 0.0) < SAID_S), []).append(part)
    out = []
    for (reason, act, silent), parts in alike.items():
        who, why = words.listed(kind, parts), f" ({reason})" if reason else ""
        named = act.replace("{who}", f"the {who}").replace("{c}", _components(parts))
        if silent:
            out.append(ToClear(f"Not judged: {who}{why}.", named, tuple(parts), why=reason))
            continue
        judged = _span(
            [math.floor(10.0 * decided_s[part]) / 10.0 for part in parts], ".1f"
        )  # never as long as it should
        asked = [needed_s(driven.get(part, 0.0), limits.min_assessed) for part in parts]
        needed = _span(asked if max(asked) - min(asked) >= 1.0 else [max(asked)], ".3g")
        out.append(
            ToClear(f"{who}: judged for {judged} s of {words.moving}, of {needed} s needed{why}.", named, tuple(parts))
        )
    return out


def _components(parts: Sequence[Part]) -> str:
    """Components as a name of a signal has them: ``FR``, of several ``*``."""
    names = {component for component, _ in parts}
    return names.pop() if len(names) == 1 else "*"


def _span(values: Sequence[float], form: str) -> str:
    """One value, or the least and the largest of several."""
    said = list(dict.fromkeys(format(x, form) for x in (min(values), max(values))))
    return " to ".join(said)


def unjudged_axles(axles: Sequence[Part], assessments: Mapping[Part, Assessment], words: MachineWords) -> ToClear:
    """Parts of the steering that nothing judged."""
    who = join_words([words.part_words(Kind.STEER, *part) for part in axles])
    first = assessments[axles[0]]
    state = main_state(first)
    reason = main_reason(first, state)
    lack = lack_of(first, state)
    act = (
        act_of_axle(axles[0][1], state, lack, words).replace("{c}", _components(axles))
        if lack is Lack.OPENING_UNIT
        else f"log {steering_signals(lack, words)}, and steer from stop to stop twice while driving"
        if lack in (Lack.SIGNALS, Lack.COMMAND)
        else "steer from stop to stop twice at standstill and several times while driving, with the log running"
    )
    return ToClear(f"Not judged: {who} ({reason}).", act, tuple(axles), why=reason)


def exempt_axles(
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    driven: Mapping[Part, float],
    axles: Sequence[str],
    limits: Limits,
    words: MachineWords,
    *,
    open_state: Mapping[Part, State] | None = None,
) -> tuple[str, ...]:
    """Sentence on parts of the steering that were judged for less of the driving than a wheel's must be; none where all were.

    Such a part keeps no machine from being cleared, for an axle at rest shows nothing of its valve: its checks must pass instead.

    Parameters
    ----------
    assessments : Mapping[Part, Assessment]
        Of all parts.
    decided_s, driven : Mapping[Part, float]
        Driving that was decided, and all of it [s].
    axles : Sequence[str]
        Steering axles.
    limits : Limits
        What counts.
    words : MachineWords
        How to speak of the machine.
    open_state : Mapping[Part, State] or None
        The commonest state that is no judgement, while driving.
    """
    part = [
        p
        for p in assessments
        if p[0] in axles and p in driven and not is_judged(decided_s.get(p, 0.0), driven[p], limits.min_assessed)
    ]
    if not part:
        return ()
    why = list(
        dict.fromkeys(
            main_reason(assessments[p], (open_state or {}).get(p) or main_state(assessments[p])) for p in part
        )
    )
    reason = f" ({'; '.join(w for w in why if w)})" if any(why) else ""
    judged, whole = _span([decided_s.get(p, 0.0) for p in part], ".0f"), _span([driven[p] for p in part], ".0f")
    return (
        f"The {words.listed(Kind.STEER, part)} {'was' if len(part) == 1 else 'were'} judged for {judged} of {whole} s only{reason}, "
        f"and the checks of {'its axle' if len({c for c, _ in part}) == 1 else 'the axles'} over the whole mission passed.",
    )


def _why_short(assessment: Assessment, driven: float | None, limits: Limits, state: State | None) -> str:
    """Why a part was not judged long enough."""
    if driven is not None and driven < limits.min_assessed and assessment.tier is not Tier.NONE:
        return f"driven for less than {limits.min_assessed:g} s"
    return main_reason(assessment, state)


def main_reason(assessment: Assessment, state: State | None) -> str:
    """Reason of a state that is no judgement, or of a finding that decides nothing; empty where there is none."""
    if state in DECIDED:
        return AS_WELL_HEALTHY
    return "" if state is None else assessment.reasons.get(state, "")


def main_state(assessment: Assessment) -> State | None:
    """The commonest state that is no judgement; a machine at rest is one only where nothing else is."""
    best, most = None, 0.0
    for state in assessment.reasons:
        if state in DECIDED:
            continue
        count = float(np.count_nonzero(assessment.states == STATES.index(state)))
        if state is State.NOT_EXCITED:
            count *= 1e-9
        if count > most:
            best, most = state, count
    return best


def beside_nothing(assessment: Assessment) -> bool:
    """Whether a side was not judged because nothing in the log shows what it should read, rather than for too short."""
    return lack_of(assessment, main_state(assessment)) in (Lack.SECOND, Lack.BESIDE)
