"""Faults in words: what to do about each part, and the verdict's sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from diagnosis.decision.severity import halved_words, unanswered, waits_for_no_mission
from diagnosis.results.candidates import UNCLEAR, candidates, unclear_words
from diagnosis.results.consequences import Stated, causes_of
from diagnosis.results.document import ActionRow
from diagnosis.results.durations import covered_s, seconds_words
from diagnosis.results.ending import Ending
from diagnosis.results.fault_rows import mode_words
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import FaultInterval
from diagnosis.results.sizes import gain_words, loss_known
from diagnosis.results.vocabulary import Kind, Severity, Tier
from replay.faults import FaultMode, Side
from replay.machine.quantities import OPENING

#: What follows reasons of which the first ones are named, where the rest stands below them.
MORE = "; more below"
_NAMED = 3  # parts in the verdict's sentence
_PLACES, _WIDE = 2, 0.1  # at which a drive is stuck, and width of the bounds of one [of full opening], to be named
_WIDE_LOSS = 0.4  # between bounds of a loss that need a word
_SPELLS = 6  # of one part, of which each is named with its time
_TWICE_S = 0.5  # for which one part is told to be two things at once: worth a word
_KINDS = 2  # of faults of one part in it: more stand in the part's action


def actions_of(intervals: Sequence[FaultInterval], words: MachineWords) -> tuple[ActionRow, ...]:
    """One action per component and side: drives to stop at once for, then other stops, then the rest, worst first."""
    stop = any(f.severity is Severity.HIGH for f in intervals)
    named = {f.id: f for f in intervals}
    causes = {f: named[g] for f, g in consequences(intervals).items()}
    return tuple(_action(n, faults, words, causes, stop=stop) for n, faults in enumerate(_by_part(intervals), 1))


def consequences(intervals: Sequence[FaultInterval]) -> dict[str, str]:
    """Faults that may be no more than a consequence, each with the one that may be its cause, by their names."""
    return causes_of([Stated(*(getattr(f, key) for key in Stated._fields)) for f in intervals])


def count_faults(stop: Sequence[FaultInterval], watch: Sequence[FaultInterval], *, cleared: bool = False) -> str:
    """How many parts are faulty, each counted once by its worst fault, and in how many spells where that is another number.

    ``1 part to repair, 2 to check, in 5 spells``; of a machine that may go out all the same (`cleared`), ``2 parts to watch``.
    """
    repair = {(f.component, f.side) for f in stop}
    others = {(f.component, f.side) for f in watch} - repair
    counts = [(len(repair), "to repair"), (len(others), "to watch" if cleared else "to check")]
    (n, what), *more = [(n, what) for n, what in counts if n]
    words = ", ".join([f"{count_words(n, 'part')} {what}", *(f"{n} {what}" for n, what in more)])
    spells = len(stop) + len(watch)
    return words if spells == len(repair) + len(others) else f"{words}, in {spells} spells"


def _by_part(intervals: Sequence[FaultInterval]) -> list[list[FaultInterval]]:
    """Faults that are worth an action, those of one part together, the most urgent part first."""
    parts: dict[tuple[str, str], list[FaultInterval]] = {}
    for f in intervals:
        if f.severity is not Severity.INFO:
            parts.setdefault((f.component, f.side), []).append(f)
    return sorted(parts.values(), key=lambda faults: _urgency(faults[0]))


def _action(
    n: int, faults: Sequence[FaultInterval], words: MachineWords, causes: Mapping[str, FaultInterval], *, stop: bool
) -> ActionRow:
    """What to do about one part, with its faults worst first; `stop`: some fault of the mission stops the machine."""
    worst = faults[0]
    found = _course(faults, words)
    if all(f.id in causes for f in faults):
        found += (
            f"; it lies in the time of {cause_words(causes[worst.id], words)}, and may be no more than its consequence"
        )
    lead = f"{_order(faults, stop=stop)} the {words.part_words(worst.kind, worst.component, worst.side)}"
    return {
        "n": n,
        "text": f"{lead}: {found}.",
        "lead": lead,
        "check": worst.check,
        "faults": [f.id for f in faults],
        "severity": worst.severity,
    }


def cause_words(fault: FaultInterval, words: MachineWords) -> str:
    """A fault as the cause of something else: ``F1 (FR drive valve stuck)``."""
    return f"{fault.id} ({words.part_words(fault.kind, fault.component, fault.side)} {fault_words(fault)})"


def _order(faults: Sequence[FaultInterval], *, stop: bool) -> str:
    """What to do with a part, by its worst fault; before it goes out where one of them alone keeps it from being cleared.

    Where another part stops the machine, one of low severity comes after that.
    """
    worst = faults[0]
    if worst.severity is Severity.HIGH:
        return "Stop at once and repair" if worst.side is Side.ACTUATOR else "Stop and repair"
    if stop and worst.severity is Severity.LOW:
        return "Then check"
    if (
        unanswered(worst)
        or any(waits_for_no_mission(f) for f in faults)
        or any(halved_words(f.side, f.mode, f.epsilon) for f in faults)
    ):
        return "Before the machine goes out, check"
    return "Check at the next service" if "at the next service" in worst.advice else "Check"


def remedy_words(of: Sequence[FaultInterval], faults: Sequence[FaultInterval], words: MachineWords) -> str:
    """What the actions of some faults' parts come to, by what is open for each: ``check the FR drive valve (F1) and repair what is found``.

    `faults`: all of the mission, for the worst of a part decides.
    """
    stop = {(f.component, f.side) for f in faults if f.severity is Severity.HIGH}
    parts: dict[bool, list[str]] = {True: [], False: []}
    for f in of:
        part = f"the {words.part_words(f.kind, f.component, f.side)} ({f.id})"
        parts[(f.component, f.side) in stop].append(part)
    said = [f"repair {join_words(parts[True])}"] if parts[True] else []
    return ", ".join([*said, *([f"check {join_words(parts[False])} and repair what is found"] if parts[False] else [])])


def _urgency(worst: FaultInterval) -> int:
    """Place of a part among the actions, by its worst fault; equal ones keep their order."""
    if worst.severity is Severity.HIGH:
        return {Side.ACTUATOR: 0, Side.SENSOR_OR_ACTUATOR: 1}.get(worst.side, 2)
    return {Severity.MEDIUM: 3, Severity.LOW: 4}.get(worst.severity, 5)


def fault_words(f: FaultInterval) -> str:
    """What a fault is: its row, or *faulty* with the candidates where no row has half of the probability of any fault."""
    modes = candidates(f.side.value, ((h.side, h.mode, h.p) for h in f.hypotheses))
    return unclear_words(f.side, modes) if modes else mode_words(f.side, f.mode)


def _course(faults: Sequence[FaultInterval], words: MachineWords) -> str:
    """What one part was, kind by kind, and for how long; what is unclear with its candidates where they are the same ones."""
    kinds = _kinds(faults)
    said = join_words([_how_long(kind, same, words) for kind, same in kinds.items()])
    twice = sum(map(_seconds, kinds.values())) - _seconds(faults)
    return f"{said}, {seconds_words(twice)} of it at the same time" if twice >= _TWICE_S else said


def _seconds(faults: Sequence[FaultInterval]) -> float:
    """Time in which one part is faulty [s]."""
    return covered_s((f.start_s, f.stop_s) for f in faults)


def _summary(faults: Sequence[FaultInterval], words: MachineWords) -> str:
    """The same for the verdict's sentence: for how long it was faulty at all, where that was in many ways."""
    if len(_kinds(faults)) <= _KINDS:
        return _course(faults, words)
    total = seconds_words(_seconds(faults))
    return f"faulty for {total} in {len(faults)} spells"


def _kinds(faults: Sequence[FaultInterval]) -> dict[str, list[FaultInterval]]:
    """Faults of one part by what they are, in words."""
    said = [fault_words(f) for f in faults]
    if len({kind for kind in said if kind.startswith(UNCLEAR)}) > 1:
        said = [UNCLEAR if kind.startswith(UNCLEAR) else kind for kind in said]
    kinds: dict[str, list[FaultInterval]] = {}
    for kind, f in zip(said, faults, strict=True):
        kinds.setdefault(kind, []).append(f)
    return kinds


def _how_long(kind: str, faults: Sequence[FaultInterval], words: MachineWords) -> str:
    """What faults are, how much they take, the whole time of them on one part, and how many they are."""
    total = seconds_words(_seconds(faults))
    held = "" if kind.startswith(UNCLEAR) else _held(faults, words)
    return f"{kind}{held}{_lost(faults)} for {total}{_times(faults)}"


def _times(faults: Sequence[FaultInterval]) -> str:
    """In how many spells faults of one kind come, each with its time where they are few; empty of one alone."""
    if len(faults) == 1:
        return ""
    what = "gaps" if all(f.mode is FaultMode.NO_SIGNAL and f.side is Side.SENSOR for f in faults) else "spells"
    spells = sorted((f.start_s, f.stop_s) for f in faults)
    if len(spells) > _SPELLS:
        return f" in {len(faults)} {what} from {spells[0][0]:.1f} to {max(b for _, b in spells):.1f} s"
    return f" in {len(faults)} {what} (at {join_words([f'{a:.1f}–{b:.1f}' for a, b in spells])} s)"


def _lost(faults: Sequence[FaultInterval]) -> str:
    """What faults take of their part's effectiveness, where that is what they are, with 95 % bounds; of several with their course."""
    if all(f.mode is FaultMode.OUTSIDE_TABLE and f.epsilon is not None for f in faults):
        gains = dict.fromkeys(gain_words(f.epsilon.value) for f in faults if f.epsilon is not None)
        return f" ({join_words(list(gains))})" if all(gains) else ""
    if not all(f.mode.scaled and f.mode is not FaultMode.OUTSIDE_TABLE for f in faults):
        return ""
    sized = [f.epsilon for f in faults if f.epsilon is not None]
    known = [e for e in sized if loss_known(e.low, e.high)]
    if not known:
        return " (how much is lost is not known)" if sized else ""
    sizes = [e.value for e in known]
    span = list(dict.fromkeys(f"{100 * x:.0f}" for x in (min(sizes), max(sizes))))
    low, high = (f"{100 * x:.0f}" for x in (min(e.low for e in known), max(e.high for e in known)))
    course = ", from fault to fault" if len(span) > 1 else ""
    bounds = (
        f", 95 % bounds {low} to {high} %{_why_wide(faults)}" if (low, high) != (span[0], span[-1]) else ""
    )  # which the rounding holds
    size = f"{' to '.join(span)} %"
    if all(f.side is Side.SENSOR for f in faults):
        return f" (reads {size} too little{course}{bounds})"
    return f" ({size} lost{course}{bounds})"


def _why_wide(faults: Sequence[FaultInterval]) -> str:
    """Why the bounds of a loss are wide, beside them, where that is what its wheel's own model leaves open; else empty."""
    wide = any(f.epsilon is not None and f.epsilon.high - f.epsilon.low >= _WIDE_LOSS for f in faults)
    modelled = all(f.tier is Tier.MODEL and f.kind is Kind.WHEEL for f in faults)
    return ", for so far may the model of its wheel itself be off" if wide and modelled else ""


def _held(faults: Sequence[FaultInterval], words: MachineWords) -> str:
    """Where a drive's faults hold it, where that is what they are, to follow *stuck*: `` at +34 % of opening (forward)``."""
    if not all(f.mode is FaultMode.STUCK and f.sat is not None and f.sat.unit == OPENING for f in faults):
        return ""
    sats = [f.sat for f in faults if f.sat is not None]
    places = list(dict.fromkeys(round(100 * s.mean) for s in sats))
    if len(places) > _PLACES or any(s.high - s.low > _WIDE for s in sats):
        return ""
    rolls = faults[0].kind is Kind.WHEEL and words.part == "wheel"
    way = {True: " (forward)", False: " (reverse)"} if rolls else {}
    said = [
        f"{x:+d}{words.percent}{way.get(x > 0, '')}".replace("-", "−") if x else f"0{words.percent}" for x in places
    ]
    return f" at {join_words(said)}"


def sentence_of(
    faults: Sequence[FaultInterval], words: MachineWords, endings: Mapping[str, Ending] | None = None
) -> str:
    """The most urgent three parts in one sentence, in the order of the actions; of a machine to stop those that it is stopped for.

    `endings` has how each fault ends by its name: what is not seen to end *has been*, what ended *was*.
    """
    parts = _by_part(faults)
    high = [f for f in parts if f[0].severity is Severity.HIGH]
    which = " to repair" if 0 < len(high) < len(parts) else ""
    parts = high or parts
    said = [
        f"the {words.part_words(f[0].kind, f[0].component, f[0].side)} {_was(f, words, endings or {})}"
        for f in parts[:_NAMED]
    ]
    apart = any(len(f) > 1 or _course_of(f, endings or {}) is not Ending.ENDED for f in parts[:_NAMED])
    text = "; ".join(said) if apart else join_words(said)
    rest = len(parts) - _NAMED
    more = f"; {count_words(rest, 'more part')}{which} {'is' if rest == 1 else 'are'} listed below" if rest > 0 else ""
    return text[0].upper() + text[1:] + more + "."


def _was(faults: Sequence[FaultInterval], words: MachineWords, endings: Mapping[str, Ending]) -> str:
    """What one part was, or has been where that is not seen to end."""
    ending = _course_of(faults, endings)
    if ending is Ending.ENDED:
        return f"was {_summary(faults, words)}"
    last, open_ = fault_words(_last(faults)), ending is not Ending.LASTS
    which = f"the last, {last}, " if 1 < len(_kinds(faults)) <= _KINDS else "and " if open_ else ""
    return f"has been {_summary(faults, words)}, {which}{'was not seen to end' if open_ else 'to the end of the log'}"


def _course_of(faults: Sequence[FaultInterval], endings: Mapping[str, Ending]) -> Ending:
    """How the last of one part's faults ends."""
    return endings.get(_last(faults).id, Ending.ENDED)


def _last(faults: Sequence[FaultInterval]) -> FaultInterval:
    """The one that ends last."""
    return max(faults, key=lambda f: f.stop_s)


def count_words(n: int, word: str) -> str:
    """A number with its noun: ``1 fault``, ``3 faults``."""
    return f"{n} {word}" + ("" if n == 1 else "s")


def misplaced_words(doubt: str) -> str:
    """What turns contradict of the machine file, in a sentence that comes before any fault: the wrong part may be named."""
    return f"The log contradicts the machine's settings: {doubt}. Correct [signals] or [geometry] in a machine file before any part is looked at: another one may be meant."


def join_words(words: Sequence[str]) -> str:
    """Words joined by commas and “and”; empty for none."""
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1] if words else ""
