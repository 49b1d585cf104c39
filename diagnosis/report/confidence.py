"""How sure the tool is, in a plain phrase: probability, how it was decided, and how much of the driving was judged."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.comparison.coverage import SideCoverage, sides_of
from diagnosis.decision.missing import is_commanded
from diagnosis.pages.labels import utc
from diagnosis.report.second_measurements import by_position, second_of
from diagnosis.report.standing import Standing, standings_of
from diagnosis.results.document import IntervalRow, ReportDocument, VerdictRow
from diagnosis.results.fault_rows import state_label
from diagnosis.results.limited import MOST_CLAIMED
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import NOT_CLEARED, Kind, Leave, Severity, Tier, Verdict
from replay.faults import SCALED, Side, State

_WORDS = ((0.99, "Practically certain"), (0.9, "Very likely"), (0.7, "Likely"))
_OPEN, _TIE = 0.9, 1e-3
_SPREAD = 0.05  # of the probabilities of spells that is worth a word
_AT_MOST = f"{100 * MOST_CLAIMED:.0f} %, the highest that is ever stated"
_NOTHING, _MOSTLY = 0.005, 0.5  # of the driving: judged for so little that it is none, and for most of it
_SHORT = (Standing.NOT_LONG_ENOUGH, Standing.NOT_JUDGED, Standing.NOT_STEERED)
_BESIDE = "what the {wheels} and the channels of one show beside each other"  # without any command
_UNLIKE = 0.1  # of the driving: sides that were judged for shares so far apart are told one by one
_ANSWERS = {Verdict.STOP: f"{Leave.MUST_NOT} before repair", Verdict.READY: "", Verdict.NOT_ASSESSED: Leave.CHECK.value}


def percent(p: float) -> str:
    """Probability or share as a percentage that never claims certainty it does not have."""
    return "over 99.9 %" if p > 0.999 else f"{100 * p:.1f} %" if p >= 0.895 else f"{100 * p:.0f} %"


def sure_of(fault: IntervalRow, report: ReportDocument) -> str:
    """How sure the tool is of one fault.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    report : ReportDocument
        The document.
    """
    p, side, hypotheses = fault["probability"], Side(fault["side"]), fault["hypotheses"]
    faulty = 1.0 - sum(h["p"] for h in hypotheses if h["mode"] == State.HEALTHY)
    if p >= _OPEN or faulty <= p + 0.05 or not hypotheses:
        words = [f"{_likely(p)} ({_AT_MOST if abs(p - MOST_CLAIMED) <= _TIE else percent(p)})"]
    else:
        first = max(h["p"] for h in hypotheses if h["mode"] != State.HEALTHY) <= p + _TIE
        row = f"{'most likely' if first else 'perhaps'} {state_label(fault['mode'], side).lower()}"
        words = [f"{_likely(faulty)} faulty ({percent(faulty)}), {row} ({percent(p)})"]
    machine_words = words_of(report["machine"])
    twice = second_of(fault, {s["name"] for s in report["signals"]}) is not None
    how = machine_words.decided(Tier(fault["tier"]), Kind(fault["kind"]), side, twice=twice)
    if by_position(fault):
        how = "against what the position of its own joint shows of the same speed"
    words += [how] if how else []
    shares: dict[str, float] = {
        row["side"]: row["decided_driving_s"] / row["driving_s"]
        for row in report["coverage"]
        if row["component"] == fault["component"] and row["side"] in side.sides and row["driving_s"]
    }
    judged_words = ""
    if len(shares) > 1 and max(shares.values()) - min(shares.values()) > _UNLIKE:
        each = [
            f"its {machine_words.part_name(fault['kind'], s)} was "
            + (
                "not judged"
                if shares[s] < _NOTHING
                else f"judged for {_share(shares[s]).replace('all', '100 %')} of the {machine_words.moving}"
            )
            for s in sorted(shares, key=lambda s: -shares[s])
        ]
        judged_words = " and ".join(each)
    elif shares:
        judged_words = _judged_words(min(shares.values()), machine_words.moving)
    return "; ".join([", ".join(words), *([judged_words] if judged_words else [])])


def sure_of_action(faults: Sequence[IntervalRow], report: ReportDocument) -> str:
    """How sure the tool is of the first fault of an action, and from how little to how much of its spells where they differ.

    Parameters
    ----------
    faults : Sequence[IntervalRow]
        Faults of one action, the worst first; not empty.
    report : ReportDocument
        The document.
    """
    first = faults[0]
    said, p = sure_of(first, report), sorted(f["probability"] for f in faults)
    if p[-1] - p[0] < _SPREAD or any(f["mode"] != first["mode"] for f in faults):
        return said
    return f"{said}; its {len(faults)} spells: from {percent(p[0])} to {percent(p[-1])}"


def _judged_words(share: float, moving: str) -> str:
    """How much of a part's driving was judged: where that is little, the fault may be only what was seen of it."""
    if share < _NOTHING:
        return f"the rest of its {moving} was not judged, so that it may be faulty for longer"
    if share < _MOSTLY:
        return f"only {_share(share)} of its {moving} was judged, so that it may be faulty for longer"
    return f"{_share(share)} of its {moving} was judged"


def _likely(p: float) -> str:
    return next((words for least, words in _WORDS if round(p, 3) >= least), "Possible" if p < 0.5 else "Probable")


def judged(report: ReportDocument) -> str:
    """How many parts were judged as far as a verdict of *ready* takes of a wheel, and cleared; which for less and which not.

    Empty where there are none; `judged_means` says what the words mean.
    """
    parts, words, axles = standings_of(report), words_of(report["machine"]), report["machine"]["axles"]
    if not parts:
        return ""
    short = [part for part, s in parts.items() if s in _SHORT]
    cleared = sum(s is Standing.CLEARED for s in parts.values())
    many = str(cleared) if cleared else "none"
    out = [
        f"{len(parts) - len(short)} of {len(parts)} parts judged, {many} cleared{'' if cleared else _why_none(report)}"
    ]
    for how in _SHORT:
        told = [
            words.listed(kind, mine)
            for kind in (Kind.WHEEL, Kind.STEER)
            if (mine := [part for part in short if (part[0] in axles) is (kind is Kind.STEER) and parts[part] is how])
        ]
        out += [f"{how}: {'; '.join(told)}"] if told else []
    return "; ".join(out)


def judged_means(report: ReportDocument) -> str:
    """What *judged*, *cleared* and *open* mean on the page; empty where nothing is judged."""
    if not sides_of(report):
        return ""
    moving = words_of(report["machine"]).moving
    return (
        f"Judged: decided, healthy or faulty, for at least {report['limits']['min_assessed']:g} s and four fifths of the part’s {moving}. "
        "Cleared: judged, without a fault, every check of the all-clear passed, and named in nothing that is open. "
        "Open, or not assessed: this mission does not tell whether it is healthy."
    )


def _why_none(report: ReportDocument) -> str:
    """Why no part is cleared, to follow *none cleared*."""
    rows = report["verdict"].get("to_clear")
    if rows is None or any("parts" not in row for row in rows):
        return ", for this report does not say what is open"
    if not any(side.long_enough for side in sides_of(report).values()):
        return ", for none was judged long enough"
    whole = next((row["reason"] for row in rows if not row["parts"]), "")
    if whole:
        return ", for something about the machine as a whole, or its log, is open, as said above"
    return ", for each that was judged has a fault or is named in what is open"


def sure_of_verdict(report: ReportDocument) -> str:
    """How sure the tool is of a verdict without faults: how much was judged, and by what."""
    wheels = _wheel_sides(report)
    if not wheels:
        return ""
    done = [s for s in wheels if s.long_enough]
    words = words_of(report["machine"])
    told = is_commanded({s["name"] for s in report["signals"]}, report["machine"]["wheels"])
    by = {tier: _BESIDE if tier is Tier.RESPONSE and not told else tier.words for tier in Tier}
    tiers = list(dict.fromkeys(words.fill(by[Tier(s.tier)]) for s in wheels if s.tier != Tier.NONE))
    how = f", by {' and '.join(tiers)}" if tiers else ""
    if len(done) < len(wheels):
        return f"{len(done)} of {len(wheels)} {words.part} parts were judged long enough{how}."
    shares = [s.decided_s / s.driving_s for s in wheels if s.driving_s > 0]
    least = f", each for {_least(min(shares))} of its {words.moving}" if shares else ""
    return f"All {len(wheels)} {words.part} parts were judged{least}{how}."


def _wheel_sides(report: ReportDocument) -> list[SideCoverage]:
    return [s for (component, _), s in sides_of(report).items() if component not in report["machine"]["axles"]]


def headline(report: ReportDocument) -> tuple[str, str]:
    """Verdict in a word or two, and whether the machine may go out; the latter empty where the former says it.

    Faults to watch give leave only where every wheel part was judged long enough and nothing of the log is lost; see
    `diagnosis.decision.decide`. No leave is given while an audit holds a fault of an earlier mission open, or the machine in for what it knows
    of other missions; and where what stopped it was repaired since, that is said instead.
    """
    verdict = report["verdict"]
    status = Verdict(verdict["status"])
    if is_repaired(report):
        return "Repaired since this mission", f"{Leave.CHECK}: the fleet page says what is known since"
    alone = "Faults to watch" if status is Verdict.WATCH else "No fault in this mission"
    if holds_open(report) and may_go_out(verdict):
        return alone, "but one of an earlier mission is open: the fleet page says whether it may go out"
    if (held := held_by_fleet(report)) is not None:
        return alone if may_go_out(verdict) else _label(report), f"{held}: the fleet page says why"
    if status is not Verdict.WATCH:
        return _label(report), _ANSWERS[status]
    if not verdict["cleared"]:
        return status.label, f"{Leave.CHECK}: {verdict['not_cleared']}"
    return "Ready, with faults to watch", Leave.MAY.value


def _label(report: ReportDocument) -> str:
    """Words of a verdict: where every part of a wheel was judged, it is not that which is missing."""
    status, wheels = Verdict(report["verdict"]["status"]), _wheel_sides(report)
    judged_all = bool(wheels) and all(s.long_enough for s in wheels)
    return NOT_CLEARED if status is Verdict.NOT_ASSESSED and judged_all else status.label


def going_out(report: ReportDocument) -> tuple[str, str]:
    """Whether the machine may go out again: *Yes* or *No*, and what belongs to it, to follow that word."""
    status = Verdict(report["verdict"]["status"])
    if holds_open(report) and status is not Verdict.STOP:
        asof = report["previous"].get("open_asof_ns")
        when = f"was open on {utc(asof)[:10]}, when this was written" if asof is not None else "is open"
        why = f"a fault of an earlier mission {when}"
        return "No", f", not before the fleet page says so, which holds the newest state: {why}"
    if is_repaired(report):
        return (
            "No",
            ", not before it was checked: what stopped it was repaired since, and the fleet page says what is known since then",
        )
    if status is Verdict.STOP:
        return "No", ", not before repair"
    if (held := held_by_fleet(report)) is not None:
        note = report["fleet"]
        reason = note["reason"].rstrip(".")
        return "No", f": the fleet page said “{held}” on {utc(note['asof_ns'])[:10]}, when this was written: {reason}"
    if not may_go_out(report["verdict"]):
        why = report["verdict"]["not_cleared"]
        return "No", f", it must be checked first{': ' if why else ''}{why}"
    return "Yes", _why_watched(report) if status is Verdict.WATCH else ""


def _why_watched(report: ReportDocument) -> str:
    """Why faults to watch keep no machine in: the bounds of what is lost decide, not the likely loss."""
    highs = [f["epsilon"]["high"] for f in report["intervals"] if f["mode"] in SCALED and f["epsilon"]]
    most = f": by its bounds no part lost more than {100 * max(highs):.0f} %, where half is the limit" if highs else ""
    return f"; the faults to watch are no reason to keep it in{most}"


def may_go_out(verdict: VerdictRow) -> bool:
    """Whether a verdict gives leave, by its own mission alone."""
    status = Verdict(verdict["status"])
    return status is Verdict.READY or (status is Verdict.WATCH and verdict["cleared"])


def own_leave(report: ReportDocument) -> Leave:
    """Whether the machine may go out by its mission alone."""
    if may_go_out(report["verdict"]):
        return Leave.MAY
    return Leave.MUST_NOT if report["verdict"]["status"] == Verdict.STOP else Leave.CHECK


def holds_open(report: ReportDocument) -> bool:
    """Whether an audit has written into a report that a severe fault of an earlier mission is open."""
    return "previous" in report and bool(report["previous"].get("open_faults"))


def is_repaired(report: ReportDocument) -> bool:
    """Whether all that stopped a machine in a mission was repaired since, as an audit has written into its report."""
    note = report.get("fleet")
    stopped = report["verdict"]["status"] == Verdict.STOP
    if note is None or not stopped or not note["repairs"] or note["leave"] == Leave.MUST_NOT:
        return False
    mended = {f for r in note["repairs"] for f in r["faults"]}
    return all(f["id"] in mended for f in report["intervals"] if f["severity"] == Severity.HIGH)


def held_by_fleet(report: ReportDocument) -> Leave | None:
    """The list in which an audit's fleet has a machine, where that lets it go out less than the mission alone does; else None."""
    note = report.get("fleet")
    if note is None or report["verdict"]["status"] == Verdict.STOP:
        return None
    leave, order = Leave(note["leave"]), (Leave.MAY, Leave.CHECK, Leave.MUST_NOT)
    return leave if order.index(leave) > order.index(own_leave(report)) else None


def _share(x: float) -> str:
    return "all" if x >= 1 else f"{min(99.0, 100 * x):.0f} %"


def _least(x: float) -> str:
    return "all" if x >= 1 else f"at least {_share(x)}"
