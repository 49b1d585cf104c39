"""What limits a verdict: parts that were not judged long enough, driving that stays open, damage."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from diagnosis.decision.explained import Explanation, When, explaining
from diagnosis.decision.open_checks import open_words
from diagnosis.decision.severity import halved_words, often_dead, unanswered, unbounded_words
from diagnosis.decision.short import main_reason, main_state, short_parts, unjudged_axles
from diagnosis.decision.wording import MORE, count_words, join_words
from diagnosis.results.assessed import Cut
from diagnosis.results.assessment import Assessment
from diagnosis.results.clearing import Checked
from diagnosis.results.detectability import Detectable, Deviation
from diagnosis.results.left_out import is_left_out
from diagnosis.results.machine_event import MachineEvent
from diagnosis.results.machine_words import HYDRAULIC, MachineWords
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Kind, Severity, Tier
from replay.faults import Side, State
from replay.machine.config import Limits

#: A component and its side.
Part = tuple[str, str]

_OPEN_S, _OPEN_SHARE = 1.0, 0.02  # driving that was not judged and is worth a word
_REASONS = 2  # that the heading names; all of them stand below it
_TOLD_S = 10.0  # length of the losses that are told


@dataclass(frozen=True)
class Reservations:
    """What stands against ``ready`` beside the faults.

    Attributes
    ----------
    short : tuple[Part, ...]
        Parts of wheels that were not judged long enough.
    silent : tuple[Part, ...]
        Those of them that were not judged at all.
    beside_nothing : bool
        Whether their sensors were not judged because nothing in the log shows what they should read.
    unexplained : tuple[Part, ...]
        Parts of wheels at which something deviates that no single fault explains.
    not_compared : bool
        Whether the wheel model comes from this mission alone and from too few wheels to be compared.
    damage : tuple[str, ...]
        What the log lost.
    open : tuple[Checked, ...]
        Checks that do not clear their part.
    scope : tuple[Cut, ...]
        Why what was judged is not the whole mission.
    events : tuple[MachineEvent, ...]
        What happened to the machine as a whole.
    hints : tuple[str, ...]
        Signals that fit another sign, unit or place better.
    misplaced : tuple[str, ...]
        Wheels and axles that are elsewhere than the machine file says; `hints` has them in words.
    words : MachineWords
        How to speak of the machine.
    open_state : Mapping[Part, State]
        The commonest state of each part that is no judgement, while driving.
    uncommanded : bool
        Whether no command of any wheel is in the log.
    twice : frozenset[Part]
        Parts of which a second measurement is in the log.
    rarely_sent : tuple[str, str]
        Commands that may be published on change alone, and what to do then; empty where none is.
    """

    short: tuple[Part, ...] = ()
    silent: tuple[Part, ...] = ()
    beside_nothing: bool = False
    unexplained: tuple[Part, ...] = ()
    not_compared: bool = False
    damage: tuple[str, ...] = ()
    open: tuple[Checked, ...] = ()
    scope: tuple[Cut, ...] = ()
    events: tuple[MachineEvent, ...] = ()
    hints: tuple[str, ...] = ()
    misplaced: tuple[str, ...] = ()
    words: MachineWords = HYDRAULIC
    open_state: Mapping[Part, State] = field(default_factory=dict)
    uncommanded: bool = False
    twice: frozenset[Part] = frozenset()
    rarely_sent: tuple[str, str] = ("", "")


def smallest_loads(assessments: Mapping[Part, Assessment], words: MachineWords) -> tuple[str, ...]:
    """From which size on a load that lasts all through a mission shows on drives that are judged by their effort, a sentence each."""
    out = []
    for (component, side), a in assessments.items():
        if a.tier is not Tier.DRIVE or side != Side.ACTUATOR.value or a.powers is None:
            continue
        sizes = [r.size for r in a.powers.rows if r.deviation is Deviation.INEFFICIENT and r.for_s is None]
        if not sizes:
            continue
        said = "does not show" if sizes[0] is None else f"shows from {100 * sizes[0]:.0f} % of the effort on"
        name = words.part_words(Kind.WHEEL, component, Side.ACTUATOR)
        out.append(
            f"A load on the {name}, or a loss, that lasts the whole mission {said}; healthy missions differ by less than that."
        )
    return tuple(out)


def by_model(assessments: Mapping[Part, Assessment], shown: Sequence[Detectable], words: MachineWords) -> str:
    """What limits parts that a wheel model of this mission judged, with the losses of ten seconds that it would have shown of them."""
    judged = {part for part, a in assessments.items() if a.tier is Tier.MODEL}
    said, sizes_known = [], False
    for side in (Side.SENSOR, Side.ACTUATOR):
        name = words.part_name(Kind.WHEEL, side)
        about = (Kind.WHEEL, side, Deviation.INEFFICIENT, _TOLD_S)
        rows = [
            r
            for r in shown
            if (r.component, r.side.value) in judged and (r.kind, r.side, r.deviation, r.for_s) == about
        ]
        said += [_from_size(name, [r.size for r in rows])] if rows else []
        sizes_known |= any(r.size for r in rows)
    sizes = (
        f"A loss of ten seconds would have shown, at 95 of 100 places where it may begin: {'; '.join(said)}. "
        if said
        else ""
    )
    if said and not sizes_known:
        sizes = "A loss in one of them that lasts only ten seconds need not show, however large. "
    return (
        words.fill(
            "Sensors and {valve}s without a second measurement were judged by a {wheel} model identified from this mission. "
        )
        + f"{sizes}A loss of every {words.part} that lasts the whole mission does not show, one that begins in it where speeds before and after are alike. A second measurement would show more, and "
        f"a machine file with [plant], which `mfhca fit` writes from healthy missions, also a loss of every {words.part}."
    )


def _from_size(name: str, sizes: Sequence[float | None]) -> str:
    """From which size on a loss shows of parts of one kind."""
    known = sorted(x for x in sizes if x)
    if not known:
        return f"on no {name}"
    span = dict.fromkeys(f"{100 * x:.0f}" for x in (known[0], known[-1]))
    size = f"from {' to '.join(span)} % on{' (by part)' if len(span) > 1 else ''}"
    if len(known) == len(sizes):
        return f"on every {name} {size}"
    return (
        f"on {len(known)} of {len(sizes)} {name}s {size}, on the other{'s' if len(sizes) - len(known) > 1 else ''} not"
    )


def _named(by: Explanation, parts: Collection[Part]) -> bool:
    """Whether the part of the fault that explains a check is among some."""
    return (by.faults[0].component, by.faults[0].side.value) in parts


def doubt_of(watch: Sequence[FaultInterval], against: Reservations) -> str:
    """Why a mission with faults to watch is not cleared; empty where it is."""
    by_part: dict[tuple[str, str], tuple[FaultInterval, str]] = {}
    for fault, doubt in sorted(doubts_of(watch, against.words), key=lambda d: not unanswered(d[0])):
        part = fault.component, fault.side
        if part not in by_part or _most(fault) > _most(by_part[part][0]):
            by_part[part] = fault, doubt
    out = list(dict.fromkeys(doubt for _, doubt in by_part.values()))
    if against.damage:
        out.append("part of the log was left out" if is_left_out(against.damage[0]) else "the log is damaged")
    short = short_beside(watch, against)
    silent = sum(part in against.silent for part in short)
    for n, how in ((silent, "not judged"), (len(short) - silent, "not judged long enough")):
        if n:
            out.append(f"{count_words(n, f'{against.words.part} part')} {'was' if n == 1 else 'were'} {how}")
    if against.unexplained:
        out.append("a residual is not explained by any fault")
    if against.not_compared:
        out.append("a loss that lasts the whole mission would not show")
    if against.hints:
        out.append("the machine's settings do not fit the log")
    out += [cut.text for cut in against.scope]
    out += dict.fromkeys(event.doubt for event in against.events)
    why = {c: explaining(c, watch) for c in against.open}
    own = [c for c, by in why.items() if by is None or not by.of_another]
    # what a part that is named is off at another time goes with its fault
    rest = [c for c in own if not ((by := why[c]) is not None and by.when is When.APART and _named(by, by_part))]
    if rest:
        out.append(open_words(rest))
    elif against.open and not own:
        others = join_words(list(dict.fromkeys(c.component for c in against.open)))
        out.append(f"beside a fault nothing shows whether {others} {'are' if ' and ' in others else 'is'} healthy")
    return join_words(out[:_REASONS]) + (MORE if len(out) > _REASONS else "")


def short_beside(faults: Sequence[FaultInterval], against: Reservations) -> tuple[Part, ...]:
    """Parts of wheels that were not judged long enough, without those that are faulty: of these the fault is what is to be checked.

    All of them where only faulty ones were judged too briefly.
    """
    blamed = {(f.component, s.value) for f in faults if f.severity is not Severity.INFO for s in f.side.sides}
    return tuple(p for p in against.short if p not in blamed) or against.short


def _most(fault: FaultInterval) -> float:
    """What a part may have lost at most [1], or may give too much, as a share of that; all of what may not answer."""
    if unanswered(fault) or fault.epsilon is None:
        return 1.0
    return max(fault.epsilon.high, 1.0 - 1.0 / (1.0 - min(fault.epsilon.low, 0.0)))


def doubts_of(faults: Sequence[FaultInterval], words: MachineWords) -> list[tuple[FaultInterval, str]]:
    """Faults to watch that alone keep a machine from being cleared, each with why: one reason for each fault, in their order.

    Of a part that gives nothing usable again and again, each time briefly, the first one stands for all.
    """
    out = [
        (f, f"the {words.part_words(f.kind, f.component, f.side)} {why}")
        for f in faults
        if f.severity in (Severity.MEDIUM, Severity.LOW)
        and (
            why := "may not answer" if unanswered(f) else halved_words(f.side, f.mode, f.epsilon) or unbounded_words(f)
        )
    ]
    told = {(f.component, f.side) for f, _ in out}
    for same in often_dead(faults):
        first, lasts = same[0], sum(f.stop_s - f.start_s for f in same)
        if (first.component, first.side) not in told:
            part = words.part_words(first.kind, first.component, first.side)
            out.append((first, f"the {part} gave nothing usable {len(same)} times, {lasts:.1f} s in all"))
    return out


def caveats_of(
    against: Reservations,
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    driven: Mapping[Part, float],
    axles: Sequence[str],
    limits: Limits,
    *,
    short_named: bool = False,
) -> tuple[str, ...]:
    """Sentences on damage, parts that were not judged long enough, the most driving left open, and unjudged steering.

    `short_named`: the verdict itself names the parts that were not judged long enough.
    """
    out, damage = [*against.hints, *(event.text for event in against.events)], against.damage
    if damage:
        said = "" if is_left_out(damage[0]) else "The log is damaged: "
        out.append(f"{said}{damage[0]}" + (f" (and {len(damage) - 1} more)" if len(damage) > 1 else ""))
    if not short_named:
        out += [
            r.reason
            for r in short_parts(
                against.short, assessments, decided_s, driven, limits, against.words, open_state=against.open_state
            )
        ]
    out += _most_open(against, assessments, decided_s, driven, axles)
    unjudged = [k for k in assessments if k[0] in axles and assessments[k].tier is Tier.NONE]
    if unjudged:
        out.append(unjudged_axles(unjudged, assessments, against.words).reason)
    return tuple(out)


def limits_of(limits: Limits) -> tuple[str, ...]:
    """Sentence on limits of the machine file that make it easier to be cleared; none where there are none."""
    usual = Limits()
    laxer = {
        "min_epsilon": limits.min_epsilon > usual.min_epsilon,
        "min_probability": limits.min_probability > usual.min_probability,
        "min_assessed": limits.min_assessed < usual.min_assessed,
        "clear_at": limits.clear_at > usual.clear_at,
        "brief": limits.brief > usual.brief,
    }
    named = [
        f"{key} = {getattr(limits, key):g} ({getattr(usual, key):g} is usual)" for key, lax in laxer.items() if lax
    ]
    return (f"The machine file's limits clear more than the usual ones: {join_words(named)}.",) if named else ()


def _most_open(
    against: Reservations,
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    driven: Mapping[Part, float],
    axles: Sequence[str],
) -> list[str]:
    """Sentence on the part with the most driving left open, of those judged long enough; none where that is little."""
    open_s = {
        k: driven[k] - decided_s.get(k, 0.0)
        for k in assessments
        if k in driven and k not in against.short and k[0] not in axles
    }
    most = max(open_s, key=lambda k: open_s[k], default=None)
    if most is None or open_s[most] <= max(_OPEN_S, _OPEN_SHARE * driven[most]):
        return []
    reason = main_reason(assessments[most], against.open_state.get(most) or main_state(assessments[most]))
    return [
        f"{against.words.part_words(Kind.WHEEL, *most)}: {open_s[most]:.1f} s of its {driven[most]:.1f} s of {against.words.moving} were not judged"
        + (f" ({reason})" if reason else "")
        + f"; this is the most of all parts of {against.words.part}s{' judged long enough' if against.short else ''}."
        " The timeline shows when."
    ]
