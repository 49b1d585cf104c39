"""What is said where the speed sensors were judged long enough, and only drives without effort were not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from diagnosis.decision.caveats import Reservations
from diagnosis.decision.open_checks import open_words, several
from diagnosis.decision.short import main_reason, main_state
from diagnosis.decision.wording import fault_words, join_words
from diagnosis.results.assessment import Assessment
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.durations import seconds_words
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Tier
from replay.faults import Side, State

#: A component and its side.
Part = tuple[str, str]

_SOUND = "No speed sensor fault seen"
_OPEN = "No speed sensor fault seen, but a check is open"
_SEVERAL_OPEN = "No speed sensor fault seen, but checks are open"
_DOUBTED = "A sensor is in doubt"
_REST, _WITH_STEERING = "drives not judged", "drives and steering not judged"
_RATES = (Check.RATE, Check.LASTING_RATE, Check.PLANT_RATE)
_NAMED = 2  # drives; where more are all of the machine, their names say nothing
#: Titles of such a mission.
TITLES = tuple(
    f"{title}{';' if title in (_OPEN, _SEVERAL_OPEN) else ','} {rest}"
    for title in (_SOUND, _OPEN, _SEVERAL_OPEN, _DOUBTED)
    for rest in (_REST, _WITH_STEERING)
)


def sensors_alone(
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    axles: Sequence[str],
    against: Reservations,
    intervals: Sequence[FaultInterval],
) -> tuple[str, str] | None:
    """Title and text where every speed sensor was judged long enough and what is missing are drives without effort; else None.

    Parameters
    ----------
    assessments : Mapping
        By (component, side).
    decided_s : Mapping
        Seconds of driving in which each was decided.
    axles : Sequence[str]
        Steering axles.
    against : Reservations
        What stands against ``ready``.
    intervals : Sequence[FaultInterval]
        Faults, none of them worth an action.
    """
    if not against.short or not all(
        side == Side.ACTUATOR and assessments[c, side].tier is Tier.RESPONSE for c, side in against.short
    ):
        return None
    least = min(decided_s.get(p, 0.0) for p in assessments if p[0] not in axles and p[1] == Side.SENSOR)
    drives: dict[str, list[str]] = {}
    for part in against.short:
        drives.setdefault(assessments[part].reasons.get(State.NOT_ASSESSED, ""), []).append(part[0])
    steering = [a for (c, _), a in assessments.items() if c in axles and a.tier is Tier.NONE]
    wheels = {c for c, side in assessments if c not in axles and side == Side.ACTUATOR}
    said = [f"{_drives(who, wheels)} not judged, for {why.partition(', and ')[0]}" for why, who in drives.items()]
    if steering:
        why = main_reason(steering[0], main_state(steering[0]))
        said.append(f"the steering was not judged{f', for {why}' if why else ''}")
    unjudged = "; ".join(said) + "."
    rest_of_it = _WITH_STEERING if steering else _REST
    faults = [f for f in intervals if Side.SENSOR in f.side.sides]
    checks = [c for c in against.open if c.worst is not None and Side.SENSOR in c.side.sides]
    seen = against.words.fill(f"No fault was seen in the {{wheel.sensor}}s over at least {least:.0f} s of {{moving}}")
    if not faults and not checks:
        return f"{_SOUND}, {rest_of_it}", f"{seen}; {unjudged}"
    # a bump, or slip, may be all of it; and a rate per opening is first of all its valve's
    if not faults and not any(c.component in axles and c.check not in _RATES for c in checks):
        return (
            f"{_SEVERAL_OPEN if several(checks) else _OPEN}; {rest_of_it}",
            f"{seen}, but {open_words(checks)}; {unjudged}",
        )
    doubt = join_words(
        [
            *(
                f"the {against.words.part_words(f.kind, f.component, f.side)} may have been {fault_words(f)} for "
                f"{seconds_words(f.stop_s - f.start_s)} (p = {f.probability:.2f})"
                for f in faults[:1]
            ),
            *([open_words(checks)] if checks else []),
        ]
    )
    rest = f"{seen[0].lower()}{seen[1:]}; {unjudged}" if _all_of(axles, faults, checks) else unjudged
    return f"{_DOUBTED}, {rest_of_it}", f"{doubt[0].upper()}{doubt[1:]}; {rest}"


def _drives(wheels: Sequence[str], every: Set[str]) -> str:
    """Which drives of several wheels, or of every one, to go on with *not judged*."""
    if len(wheels) > _NAMED and {*wheels} == every:
        return f"all {len(wheels)} drives were"
    return f"the drive of {wheels[0]} was" if len(wheels) == 1 else f"the drives of {join_words(wheels)} were"


def _all_of(axles: Sequence[str], faults: Sequence[FaultInterval], checks: Sequence[Checked]) -> bool:
    """Whether all of them are about steering axles."""
    return all(c in axles for c in (*(f.component for f in faults), *(c.component for c in checks)))
