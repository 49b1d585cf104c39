"""Sentences about a fleet, for page, document and terminal."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

from diagnosis.audit.fleet.fleet_fault import FleetFault
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.may_leave import leave_of
from diagnosis.audit.fleet.repair_words import since_repair
from diagnosis.audit.fleet.trend_types import Axis
from diagnosis.audit.fleet.trends import PartTrend, fast_losses
from diagnosis.audit.trends.trend import Forecast
from diagnosis.decision.wording import join_words
from diagnosis.pages.labels import grouped, utc, utc_moment
from diagnosis.results.candidates import UNCLEAR
from diagnosis.results.fault_rows import state_label
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Leave, Verdict
from replay.faults import Side

#: Where a machine with faults to watch stands while a loss of its grows towards a half.
FAST_GROWTH = "Faults to watch, and a loss that grows fast"
_UNCLEARED = "No fault found, not cleared"
_SHOWN = 3
_NAMED = 12
_WORK = (Verdict.STOP, Verdict.WATCH)  # verdicts that ask for work
_UNITS: Mapping[Axis, str] = {"hours": "h of driving", "days": "days"}
#: Unit of a trend's axis beside its ticks.
TICK_UNITS: Mapping[Axis, str] = {"hours": "h", "days": "days"}


def count(n: int, word: str) -> str:
    """Number and word, the word in the plural where it is not one."""
    return f"{n} {word}{'' if n == 1 else 's'}"


def round_to(value: float, digits: int = 2) -> str:
    """Few significant digits without an exponent."""
    text = f"{float(f'{value:.{digits}g}'):f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def fault_words(f: FleetFault, words: MachineWords) -> str:
    """Part and row: ``RL drive valve inefficient``."""
    return f"{words.part_words(f.kind, f.component, f.side)} {UNCLEAR if f.unclear else state_label(f.mode, f.side).lower()}"


def found_in(missions: int, assessed: int) -> str:
    """In how many missions a fault was found: ``in 3 of the 14 missions that judged the part``."""
    if missions == assessed:
        return f"in {'the one mission' if missions == 1 else f'all {missions} missions'} that judged the part"
    return f"in {missions} of the {count(assessed, 'mission')} that judged the part"


def missions_words(all_missions: int, counted: int) -> str:
    """How many missions count, and of how many logs where that is another number: ``21 missions, of 22 logs``."""
    words = f"{grouped(counted)} mission{'' if counted == 1 else 's'}"
    return (
        words
        if counted == all_missions
        else f"{words}, of {grouped(all_missions)} log{'' if all_missions == 1 else 's'}"
    )


def open_words(is_open: bool, clean: int, needed: int) -> str:
    """How far an open fault is refuted: ``, clean in 3 of the 10 missions that it takes to close it``; empty where it is not, or just found."""
    return f", clean in {clean} of the {needed} missions that it takes to close it" if is_open and clean else ""


def repair_command(label: str, component: str, side: str) -> str:
    """The command that records a part's repair, run in the folder of the fleet page; the date is the user's to give."""
    part = f"{label} {component.removesuffix('_steer')}{'' if side == Side.SENSOR_OR_ACTUATOR else f' {side}'}"
    return f"mfhca audit -o . --repaired {shlex.quote(part)} --on DATE"


def share(value: float) -> str:
    """A loss or its limit [1] as everywhere on the page, in per cent: ``34 %``, ``0.6 %``."""
    return (
        f"{100 * value:.0f} %".replace("-", "−")
        if abs(value) >= 0.095
        else f"{round_to(100 * value)} %".replace("-", "−")
    )


def time_words(value: float, axis: Axis) -> str:
    """A time on a trend's axis: ``4.2 h of driving``, ``1 day``. `value` in its unit [h or d]."""
    words = round_to(value)
    return f"{words} {'day' if axis == 'days' and words == '1' else _UNITS[axis]}"


def forecast_words(f: Forecast, limit: float, axis: Axis = "hours") -> str:
    """When a limit is reached, in one phrase. `limit` has the unit of the trend [1 for ε]."""
    if f.state == "not_known":
        return f"not known: {f.why}"
    if f.state == "above":
        return f"already above the limit of {share(limit)}"
    if f.state == "not_within" or f.soonest is None:
        return f"does not reach the limit of {share(limit)} within {time_words(f.horizon, axis)}"
    if f.latest is None:
        begin = f"in {time_words(f.soonest, axis)} at the soonest" if f.soonest > 0 else "at any time"
        likely = f", likely in {time_words(f.likely, axis)}" if f.likely is not None else ""
        return f"may reach the limit of {share(limit)} {begin}{likely}; latest not known"
    return f"reaches the limit of {share(limit)} in {round_to(f.soonest)} to {round_to(f.latest)} {_UNITS[axis]} (90 %)"


def standing(m: Machine) -> str:
    """Where a machine stands: ``Stop and repair, and what may be later was not judged``."""
    words = m.verdict.short
    if m.verdict is Verdict.READY:
        return words
    if m.waiting_ns is not None:
        return since_repair(m, m.waiting_ns)
    if m.verdict is Verdict.NOT_ASSESSED:
        if m.last_verdict is Verdict.NOT_ASSESSED:
            return words
        last = m.last_judged
        day = utc(last.result.start_ns)[:10] if last and last.result.start_ns is not None else ""
        if m.uncleared:
            return f"{_UNCLEARED}; last judged ready{f' on {day}' if day else ''}" + (
                ", but not cleared" if m.cleared is False else ""
            )
        since = f" since {day}" if day else ""
        return f"{words}{since}: last judged ready" + (", but not cleared" if m.cleared is False else "")
    stopped = m.last_judged is not None and m.last_judged.result.verdict is Verdict.STOP
    if m.verdict is Verdict.STOP and _is_open(m) and not stopped:
        words = "Fault open, no repair recorded"
    elif is_damaged(m):
        words = f"No fault found, but {'a file of its last log was left out' if _lacks_a_file(m) else 'its last log is damaged'}"
    elif m.verdict is Verdict.WATCH:
        lasting = m.last_judged is not None and m.last_judged.result.verdict is Verdict.WATCH
        if lasting and m.cleared is False:
            words += ", not cleared"
        elif lasting and m.cleared and not m.unjudged:
            words = "Ready, with faults to watch"
    later = "its newest mission did not clear the machine" if m.uncleared else "what may be later was not judged"
    return words + (f", and {later}" if m.unjudged else "")


def _standing_now(m: Machine, trends: Sequence[PartTrend]) -> str:
    """Where a machine stands, which is not *ready* while a loss grows towards a half."""
    ready = m.verdict is Verdict.WATCH and leave_of(m.verdict, m.cleared, m.unjudged) is Leave.MAY
    return FAST_GROWTH if ready and fast_losses(m, trends) else standing(m)


def _is_open(m: Machine) -> bool:
    """Whether a fault of high severity is open that the last mission did not show."""
    return any(f.open and f.since for f in m.faults)


def _lacks_a_file(m: Machine) -> bool:
    """Whether nothing is wrong with the logs of a machine's last missions but that a file was left out."""
    return all(r.result.left_out for r in m.newest if r.result.verdict is Verdict.WATCH)


def is_damaged(m: Machine) -> bool:
    """Whether nothing but damage to a log keeps a machine from being ready."""
    watched = [r.result for r in m.newest if r.result.verdict is Verdict.WATCH]
    return m.verdict is Verdict.WATCH and not any(f.standing for f in m.faults) and not any(r.faults for r in watched)


def headline(
    machines: Sequence[Machine], unknown: int = 0, lost: Sequence[bool] | None = None
) -> tuple[Verdict, str, str]:
    """Status of the fleet, a few words above its sentence, and the sentence: how many may go out, as the lists have it.

    Parameters
    ----------
    machines : Sequence[Machine]
        All machines.
    unknown : int
        Logs that were not judged, whose machine is not known: none is ready for certain then.
    lost : Sequence[bool] or None
        Of each machine, whether a loss is beyond its limit that no fault says; see `diagnosis.audit.fleet.trends.untold_losses`.
    """
    lost = [False] * len(machines) if lost is None else lost
    verdicts = [m.verdict for m in machines]
    status = max(verdicts, key=lambda verdict: verdict.rank, default=Verdict.NOT_ASSESSED)
    damaged = [m for m in machines if is_damaged(m)]
    if not machines:
        return Verdict.NOT_ASSESSED, "nothing judged", "No mission could be judged"
    tag = f"{count(verdicts.count(status), 'machine')}: {small(status.short)}"
    if status is Verdict.WATCH and len(damaged) == verdicts.count(Verdict.WATCH):
        apart = all(_lacks_a_file(m) for m in damaged)
        tag = f"{count(len(damaged), 'machine')}: {'files left out' if apart else 'damaged logs'}"
    leaves = [leave_of(m.verdict, m.cleared, m.unjudged, lost=x) for m, x in zip(machines, lost, strict=True)]
    title = _leave_words(leaves)
    unsure = leaves.count(Leave.CHECK)
    if status is Verdict.WATCH and any(
        a is Leave.CHECK and v is not status for a, v in zip(leaves, verdicts, strict=True)
    ):
        tag = (
            f"{count(unsure, 'machine')} to check"  # as the title has it, which counts those that were not judged, too
        )
    if status is Verdict.READY and any(lost):
        status, tag = Verdict.WATCH, "a loss beyond its limit"
    if unknown and status is Verdict.READY:
        status, tag = Verdict.NOT_ASSESSED, "not all judged"
        title += f", but {count(unknown, 'log')} of no known machine {_was(unknown)} not judged"
    return status, tag, title


def _leave_words(leaves: Sequence[Leave]) -> str:
    """How many machines must not go out, may, or must be checked first."""
    n, must, may = len(leaves), leaves.count(Leave.MUST_NOT), leaves.count(Leave.MAY)
    rest = n - must - may
    if n == 1:
        return {
            Leave.MUST_NOT: "The machine must not go out",
            Leave.MAY: "The machine may go out",
            Leave.CHECK: "The machine must be checked before it goes out",
        }[leaves[0]]
    if max(must, may, rest) == n:
        said = "may go out" if may else "must not go out" if must else "must be checked before they go out"
        return f"{'Both' if n == 2 else f'All {n}'} machines {said}"
    parts = [f"{k} {words}" for k, words in ((must, "must not go out"), (may, "may go out")) if k]
    parts[0] = f"{must or may} of {n} machines {parts[0].partition(' ')[2]}"
    return ", ".join(parts) + (f", {rest} must be checked first" if rest else "")


def small(text: str) -> str:
    """Text that begins with a small letter, unless with a name in capitals, such as a wheel's."""
    return text if text[:2].isupper() else text[0].lower() + text[1:]


def _was(n: int) -> str:
    return "was" if n == 1 else "were"


def sentences(
    machines: Sequence[Machine],
    trends: Sequence[Sequence[PartTrend]],
    failed: tuple[int, int, int],
    axis: Axis = "hours",
    unknown: int = 0,
) -> list[str]:
    """What stands behind the headline: the worst machines, limits that come near, logs that were not judged.

    Parameters
    ----------
    machines, trends
        Machines, worst first, and their trends.
    failed : tuple[int, int, int]
        Logs that were not read, missions that were read but not assessed, and those not audited yet.
    axis : str
        ``hours`` or ``days``.
    unknown : int
        As for `headline`.
    """
    bad = [m for m in machines if m.verdict in _WORK]
    out = []
    must = [m for m in machines if m.verdict is Verdict.STOP]
    if must and len(bad) > _SHOWN:
        named = ", ".join(m.label for m in must[:_NAMED])
        more = f" and {len(must) - _NAMED} more: listed below" if len(must) > _NAMED else ""
        out.append(f"Must not go out ({len(must)}): {named}{more}.")
    for m in bad[:_SHOWN]:
        faults = [_found(m, f) for f in m.faults if f.standing][:2]
        note = f" ({m.note})" if m.note else ""
        words = _standing_now(m, trends[machines.index(m)])
        what = f": {join_words(faults)}" if faults else ""
        out.append(f"{m.label} – {small(words)}{what}{note}.")
    rest = [m for m in machines if m.verdict is Verdict.NOT_ASSESSED]
    out += [
        f"{m.label} – {small(_standing_now(m, trends[machines.index(m)]))}: check it before it goes out."
        for m in rest[:_SHOWN]
    ]
    if len(rest) > _SHOWN:
        out.append(f"{count(len(rest) - _SHOWN, 'more machine')} not assessed: listed below.")
    near = [(m, t) for m, own in zip(machines, trends, strict=True) for t in own if t.approaching]
    near.sort(key=lambda p: p[1].trend.forecast.likely or 0.0)
    for m, t in near[:2]:
        words = forecast_words(t.trend.forecast, t.limit, axis)
        out.append(f"{m.label}: the loss of the {m.limits.words.part_words(t.kind, t.component, t.side)} {words}.")
    unread, open_, pending = failed
    if unread or open_:
        said = [f"{count(unread, 'log')} could not be read"] if unread else []
        said += (
            [f"{count(open_, 'mission')} found no fault, but did not clear {'its' if open_ == 1 else 'their'} machine"]
            if open_
            else []
        )
        out.append(f"{'; '.join(said)}.")
    if unknown and any(m.verdict is not Verdict.READY for m in machines):  # else the headline says so
        out.append(
            f"{count(unknown, 'log')} {_was(unknown)} not judged and may be of a machine that is shown as ready."
        )
    if pending:
        out.append(f"{count(pending, 'mission')} {'is' if pending == 1 else 'are'} not audited yet.")
    return out


def new_words(missions: int, faults: Sequence[tuple[Machine, FleetFault]]) -> list[str]:
    """What the last audit run brought, in no or one sentence; see `diagnosis.audit.fleet.news.news`."""
    if not missions:
        return []
    named = [f"{m.label} {fault_words(f, m.limits.words)} ({f.severity}{_often(f)})" for m, f in faults[:_NAMED]]
    more = f" and {len(faults) - len(named)} more" if len(faults) > len(named) else ""
    known = "and no new fault"
    first = "found" if any(f.repaired_ns is not None for _, f in faults) else "first seen"
    said = f"{first} in {'it' if missions == 1 else 'them'}: {'; '.join(named) + more}" if named else known
    return [f"The last audit run brought {count(missions, 'mission')} with a report{';' if named else ','} {said}."]


def as_sentence(note: str) -> str:
    """A note with a capital and a full stop, unless it begins with a path."""
    head = note.partition(" ")[0].rstrip(":,")
    return f"{note[0].upper() + note[1:] if head.isalpha() else note}."


def _often(f: FleetFault) -> str:
    """That a fault is back since its repair; or that it came in several missions of the last run at once, and so is called recurring."""
    if f.repaired_ns is not None:
        return f", back since its repair on {utc_moment(f.repaired_ns)}"
    return f", recurring in {f.missions} of them" if f.missions > 1 else ""


def _found(m: Machine, f: FleetFault) -> str:
    many = f" {found_in(f.missions, f.assessed)}" if len(m.runs) > 1 else ""
    return f"{fault_words(f, m.limits.words)}{many}{open_words(f.open, f.clean, f.needed)}"
