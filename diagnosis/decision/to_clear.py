"""What keeps a machine from being cleared: each reason in a sentence, and what somebody does to clear it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from diagnosis.decision.caveats import Reservations, doubts_of, short_beside
from diagnosis.decision.check_advice import COMPARE, STEER, TURNED, act_of
from diagnosis.decision.explained import Explanation, explaining
from diagnosis.decision.open_checks import furthest_first
from diagnosis.decision.short import Part, ToClear, short_parts, sides_of, unjudged_axles
from diagnosis.decision.unexplained_axles import unexplained_points
from diagnosis.decision.wording import count_words, join_words, remedy_words
from diagnosis.results.assessed import CutKind, is_judged
from diagnosis.results.assessment import Assessment, Lack
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.left_out import by_its_clock, is_left_out
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import Side, State
from replay.machine.config import Limits

_NAMED = 2  # open checks


def to_clear(
    against: Reservations,
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    driven: Mapping[Part, float],
    axles: Sequence[str],
    limits: Limits,
    faults: Sequence[FaultInterval] = (),
) -> tuple[ToClear, ...]:
    """Every reservation with what would clear it, in the order in which a verdict names them.

    Parameters
    ----------
    against : Reservations
        What stands against ``ready`` beside the faults.
    assessments : Mapping[Part, Assessment]
        Of all parts.
    decided_s, driven : Mapping[Part, float]
        Driving that was decided, and all of it [s].
    axles : Sequence[str]
        Steering axles.
    limits : Limits
        What counts.
    faults : Sequence[FaultInterval]
        What is stated: checks that deviate while a fault lasts may be its doing.
    """
    words = against.words
    out = []
    if against.uncommanded:
        out.append(
            ToClear(
                f"No command is in the log, so that nothing tells what the {words.parts} were asked to do.",
                "record the commands as well (/cmd_vel of a ROS robot, or the topic by which it is driven), or name them under [signals] "
                "in the machine file if they were recorded under another name",
            )
        )
    if against.rarely_sent[0] and (against.short or any(cut.kind is CutKind.DATA for cut in against.scope)):
        said, act = against.rarely_sent
        out.append(ToClear(f"{said}.", f"{act}, and diagnose again; else record them all the time"))
    cut = [cut.text for cut in against.scope if cut.kind in (CutKind.LOG, CutKind.WHEELS)]
    if cut:
        out.append(
            ToClear(
                f"{_sentence(join_words(cut))}.",
                "diagnose the whole log, with every part (no --start, --end, --wheel)",
            )
        )
    out += [ToClear(event.text, event.act) for event in against.events]
    out += [ToClear(text, "correct [signals] in a machine file, and diagnose again") for text in against.hints]
    short = short_beside(faults, against)
    out += short_parts(short, assessments, decided_s, driven, limits, words, open_state=against.open_state)
    twice = against.twice | {part for part, a in assessments.items() if a.tier is Tier.DIRECT}
    if against.unexplained:
        for kind, second in (
            (Kind.WHEEL, "wheel.*.v_true (a second speed)"),
            (Kind.STEER, "steer.*.phi_true (a second angle)"),
        ):
            parts = {c for c, _ in against.unexplained if (c in axles) is (kind is Kind.STEER)}
            if not parts:
                continue
            who = words.listed(kind, [(c, Side.SENSOR_OR_ACTUATOR) for c in sorted(parts)])
            asked = words.drive == "valve" and kind is Kind.WHEEL and not all((c, "actuator") in twice for c in parts)
            wanted = [] if all((c, "sensor") in twice for c in parts) else [second]
            wanted += ["wheel.*.u_applied (the valve position)"] if asked else []
            act = f"log {' or '.join(wanted)}" if wanted else COMPARE
            out.append(
                ToClear(
                    f"{who}: no single fault explains the residual.",
                    f"{act}: parts fail one at a time, so that what several {_several(kind, words)} leave unexplained is rather the model's"
                    if len(parts) > 1
                    else f"inspect these parts, and {act}",
                    sides_of((c, Side.SENSOR_OR_ACTUATOR) for c in sorted(parts)),
                )
            )
    if against.not_compared:
        out.append(
            ToClear(
                f"The {words.part} model was identified from this mission alone, so a loss that lasts the whole mission would not show.",
                f"run `mfhca fit` on healthy missions, and diagnose with the file that it writes (-m): it gives K and tau of the {words.parts} in [plant]",
            )
        )
    if against.damage:
        left_out = is_left_out(against.damage[0])
        said = against.damage[0] if left_out else f"The log is damaged: {against.damage[0]}"
        out.append(
            ToClear(
                f"{said.rstrip('.')}.",
                "do so, or record a moving signal in both files"
                if by_its_clock(against.damage[0])
                else "diagnose the files of one mission together, and others apart"
                if left_out
                else "copy the log from the machine once more, or record another mission",
            )
        )
    others = [cut.text for cut in against.scope if cut.kind is CutKind.OTHERS]
    if others:
        out.append(
            ToClear(
                f"{_sentence(join_words(others))}.",
                "write a machine file from this log (`mfhca config init --log LOG -o machine.toml`) in which every wheel has its lines, and diagnose "
                "with it",
            )
        )
    empty = [cut.text for cut in against.scope if cut.kind is CutKind.DATA and not cut.components]
    if empty:
        out.append(ToClear(f"{_sentence(join_words(empty))}.", "record another mission, without gaps"))
    gaps = [cut for cut in against.scope if cut.kind is CutKind.DATA and cut.components]
    if gaps:
        out.append(
            ToClear(
                f"{_sentence(join_words([cut.text for cut in gaps]))}.",
                "record again, with the steering in the log all the time",
                sides_of((c, Side.SENSOR_OR_ACTUATOR) for cut in gaps for c in cut.components),
            )
        )
    steered = [k for k in assessments if k[0] in axles]
    unjudged = [k for k in steered if assessments[k].tier is Tier.NONE]
    dark = [unjudged_axles(unjudged, assessments, words)] if unjudged else []
    first = any(cut.kind is CutKind.STEERING for cut in against.scope)  # the verdict's own reason comes first
    out += dark if first else []
    out += _of_doubts(faults, words)
    at_rest = {k for k, state in against.open_state.items() if state is State.NOT_EXCITED}  # exempt: its checks count
    brief = [k for k in steered if k not in {*unjudged, *at_rest} and _brief(k, decided_s, driven, limits)]
    seen_twice = {c for c, side in twice if side == Side.SENSOR}
    blamed = {k: by for k, c in enumerate(against.open) if (by := explaining(c, faults)) is not None}
    deviating = _of_faults([(against.open[k], by) for k, by in blamed.items()], faults, words)
    told = {component for component, _ in (*unjudged, *brief)}  # what has them judged lets their checks pass
    left = [c for k, c in enumerate(against.open) if k not in blamed and not _waits_for_unit(c, assessments)]
    deviating += _of_checks(
        [c for c in left if c.component not in told or not _asks_for_steering(c, seen_twice)], seen_twice
    )
    ranks = {check: k for k, check in enumerate(furthest_first(against.open))}
    out += [point for _, point in sorted(deviating, key=lambda d: ranks[d[0]])]
    out += short_parts(brief, assessments, decided_s, driven, limits, words, Kind.STEER, open_state=against.open_state)
    out += unexplained_points(assessments, axles, against.unexplained, twice, words)
    out += [] if first else dark
    open_for_steering = {
        c.component for c in left if _asks_for_steering(c, seen_twice)
    }  # which has the parts judged as well
    at_rest -= {k for k in at_rest if k[0] in open_for_steering}
    rested = [k for k in steered if k in at_rest and k not in unjudged and _brief(k, decided_s, driven, limits)]
    return tuple(  # these keep no machine in, and come last: what has them judged is said all the same
        out
        + short_parts(rested, assessments, decided_s, driven, limits, words, Kind.STEER, open_state=against.open_state)
    )


def _several(kind: Kind, words: MachineWords) -> str:
    """What is moved, of several."""
    return "axles" if kind is Kind.STEER else words.parts


def _waits_for_unit(check: Checked, assessments: Mapping[Part, Assessment]) -> bool:
    """Whether a check asks for a command that is in the log, in a unit that is in doubt: with the unit it is asked again."""
    valve = assessments.get((check.component, Side.ACTUATOR.value))
    return check.check is Check.ANGLE_SCALE and valve is not None and Lack.OPENING_UNIT in valve.lacks.values()


def _asks_for_steering(check: Checked, twice: Collection[str]) -> bool:
    """Whether a check is open for want of steering alone: nothing deviates, and steering would let it pass."""
    return check.worst is None and act_of(check, twice) == STEER


def _brief(part: Part, decided_s: Mapping[Part, float], driven: Mapping[Part, float], limits: Limits) -> bool:
    """Whether a part of an axle was judged for less than a part of a wheel must be."""
    return part in driven and not is_judged(decided_s.get(part, 0.0), driven[part], limits.min_assessed)


def _of_doubts(faults: Sequence[FaultInterval], words: MachineWords) -> list[ToClear]:
    """Faults to watch that alone keep the machine from being cleared."""
    return [
        ToClear(
            f"{f.id}: {doubt}.",
            f"{remedy_words([f], faults, words)}, then diagnose the next mission",
            sides_of([(f.component, f.side)]),
            f.id,
        )
        for f, doubt in doubts_of(faults, words)
    ]


def _of_faults(
    blamed: Sequence[tuple[Checked, Explanation]], faults: Sequence[FaultInterval], words: MachineWords
) -> list[tuple[Checked, ToClear]]:
    """Checks that deviate while faults last, or just after, those of the same faults together: of each component the furthest beyond its limit.

    Each with the furthest of its checks.
    """
    by: dict[Explanation, list[Checked]] = {}
    of = dict(blamed)
    for check in furthest_first(list(of)):
        mine = by.setdefault(of[check], [])
        if all(check.component != c.component for c in mine):
            mine.append(check)
    out = []
    for why, checks in by.items():
        said = _some([check.text for check in checks])
        point = ToClear(
            f"Explained by {_named(why, words)}: {said}. "
            f"This speaks against no part of {_components_in_words(checks)}, and clears none."
            if why.of_another
            else f"{why.when.before} {why.faults[0].id}, which may explain it: {said}.",
            f"{remedy_words(why.faults, faults, words)}, then diagnose the next mission",
            sides_of((check.component, check.side) for check in checks),
        )
        out.append((checks[0], point))
    return out


def _named(why: Explanation, words: MachineWords) -> str:
    """The faults of an explanation with their parts, and how their time lies to it."""
    parts = [(f.id, words.part_words(f.kind, f.component, f.side)) for f in why.faults]
    if len(parts) == 1:
        return f"{parts[0][0]}, the {parts[0][1]}{why.when.after.format(its='its', it='it')}"
    return join_words([f"{name} ({part})" for name, part in parts]) + why.when.after.format(its="their", it="them")


def _components_in_words(checks: Sequence[Checked]) -> str:
    """Components of checks: ``RR and the rear axle``."""
    return join_words([f"the {c.component} axle" if c.kind is Kind.STEER else c.component for c in checks])


def _of_checks(checks: Sequence[Checked], twice: Collection[str]) -> list[tuple[Checked, ToClear]]:
    """Open checks, of each component that which is furthest beyond its limit; `twice`: components with a second speed in the log.

    Each with the furthest of its checks.
    """
    worst: dict[str, Checked] = {}
    for c in furthest_first(checks):
        worst.setdefault(c.component, c)
    alike: dict[str, list[Checked]] = {}
    same: dict[str, list[Checked]] = {}
    for first in worst.values():
        act = act_of(first, twice)
        same.setdefault(act, []).append(first)
        told = alike.setdefault(act, [])
        if first.check is Check.LASTING_RATE and told:
            continue  # one axle against the other: said of the one is said of both
        turned = told if first.check in TURNED else []
        twin = next((k for k, c in enumerate(turned) if replace(c, component=first.component).text == first.text), None)
        if twin is None:
            told.append(first)
        else:  # the yaw rate does not say which axle it is
            told[twin] = replace(told[twin], component=f"{told[twin].component} or {first.component}")
    return [
        (
            same[act][0],
            ToClear(
                f"{_sentence(_some([c.text for c in told]))}.",
                act,
                sides_of((c.component, c.side) for c in same[act]),
            ),
        )
        for act, told in alike.items()
    ]


def _some(texts: Sequence[str]) -> str:
    """The first reasons, and how many more there are."""
    rest = len(texts) - _NAMED
    return "; ".join([*texts[:_NAMED], *([f"and {count_words(rest, 'more check')}"] if rest > 0 else [])])


def _sentence(text: str) -> str:
    """With a capital, unless it begins with a name."""
    return text[:1].upper() + text[1:]
