"""Missions of a store gathered by machine: their order, what was not judged, and the faults that return."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from diagnosis.audit.fleet.fault_types import Status
from diagnosis.audit.fleet.fleet_fault import OPEN, STANDING, FleetFault
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.owners import Owner, Owners
from diagnosis.audit.fleet.read import FoundFault, Mission
from diagnosis.audit.fleet.runs import Limits, Run, sides_of
from diagnosis.audit.fleet.suspicions import suspicions_of
from diagnosis.audit.store.outcome import MissionState
from diagnosis.audit.store.repairs import Repair, repaired_at
from diagnosis.results.vocabulary import Severity, Verdict

Key = tuple[str, str, str]
_LIKELY = 0.5  # that ten missions all miss a fault of theirs is then less probable than 1 in 1000


def machines_of(
    missions: Iterable[Mission],
    limits: Callable[[str], Limits] | None = None,
    first_seen: Callable[[str], int | None] | None = None,
    folder: str = ".",
    repairs: Sequence[Repair] = (),
) -> tuple[list[Machine], list[Mission]]:
    """Gather missions by machine.

    Parameters
    ----------
    missions : Iterable[Mission]
        From `read_missions`.
    limits : Callable[[str], Limits] or None
        Gives the limits by the folder of a report, asked for the last one of each machine; None for the defaults.
    first_seen : Callable[[str], int or None] or None
        Gives when a mission was first seen by its name, from `diagnosis.audit.fleet.first_seen`; None: not known.
    folder : str
        Folder of the store.
    repairs : Sequence[Repair]
        Repairs that were recorded.

    Returns
    -------
    tuple[list[Machine], list[Mission]]
        Machines by identity and name; and missions that were not judged, whose machine is not known and that are still
        there, as far as they may be later than the last judged mission of a machine that is ready.
    """
    runs: dict[Owner, dict[int, Run]] = defaultdict(dict)
    failed: dict[Owner, list[Mission]] = defaultdict(list)
    nowhere: list[Mission] = []
    missions = list(missions)
    limits = cache(limits) if limits else None
    owners = Owners(missions, folder)
    for m in missions:
        if m.result is not None and m.result.no_log:
            continue
        key, other = owners.of(m)
        if other:
            nowhere.append(m)
        if key is None:
            continue
        if m.result is not None and m.result.judged:
            known = runs[key].get(m.result.id)
            runs[key][m.result.id] = Run(known.name if known else m.name, m.result, known.copies + 1 if known else 0)
        else:
            failed[key].append(m)
    first_seen = first_seen or (lambda _: None)
    out = []
    for key in sorted({*runs, *failed}):
        own = _Known(limits, first_seen, tuple(r for r in repairs if r.machine == key))
        out.append(_machine(key, runs[key].values(), failed[key], own))
    ready = [_began(m, first_seen) for m in out if m.verdict is Verdict.READY]
    later = [m for m in nowhere if not m.gone and any(_may_be_later(m.name, began, first_seen) for began in ready)]
    return out, later


@dataclass(frozen=True)
class _Known:
    """What is known of a machine beside its missions: reports, when an audit first saw a mission, repairs."""

    limits: Callable[[str], Limits] | None
    first_seen: Callable[[str], int | None]
    repairs: tuple[Repair, ...]

    def is_repaired(self, run: Run, key: Key) -> bool:
        """Whether a mission's fault is of the time before its part was repaired; one without a date if it was seen before."""
        at = repaired_at(self.repairs, key[0], key[1])
        if at is None:
            return False
        start = run.result.start_ns
        when = self.first_seen(run.name) if start is None else start
        return when is not None and when < at

    def would_show(self, run: Run, key: Key) -> bool:
        """Whether a mission would have shown a fault more often than not; also where its report does not say."""
        if self.limits is None or run.result.report is None:
            return True
        return self.limits(run.result.report).found.get(key, 1.0) >= _LIKELY


def _machine(key: Owner, runs: Iterable[Run], failed: Sequence[Mission], known: _Known) -> Machine:
    limits, first_seen = known.limits, known.first_seen
    found = list(runs)
    starts = Counter(r.result.start_ns for r in found if r.result.start_ns is not None)
    alone = {start for start, count in starts.items() if count == 1}
    dated = sorted((r for r in found if r.result.start_ns in alone), key=lambda r: r.result.start_ns or 0)
    undated = sorted((r for r in found if r.result.start_ns not in alone), key=lambda r: r.name)
    last = next((r for r in (*reversed(dated), *undated) if r.result.report is not None), None)
    own = limits(last.result.report or "") if limits and last else Limits()
    name = key[1] or (last.result.machine_name if last else "")
    m = Machine(key[0], name, tuple(dated), tuple(undated), tuple(failed), own)
    cleared, why = _cleared(m, limits)
    open_ = suspicions_of(m.dated, limits, known.repairs)
    told = m.told(cleared=cleared, not_cleared=why, unjudged=_unjudged(m, first_seen), suspicions=open_)
    return _with_faults(told, known)


def _cleared(m: Machine, limits: Callable[[str], Limits] | None) -> tuple[bool | None, str]:
    """Whether its last judged mission lets it go out, and every judged one that may be later; and why the first of those does not."""
    said = [limits(r.result.report) if limits and r.result.report else None for r in m.newest]
    cleared = {None if x is None else x.cleared for x in said}
    why = next((x.not_cleared for x in said if x is not None and x.cleared is False), "")
    return False if False in cleared else None if None in cleared or not cleared else True, why


def _unjudged(m: Machine, first_seen: Callable[[str], int | None]) -> int:
    """Missions that were not judged and may be later than the last judged one."""
    last, began = m.last_judged, _began(m, first_seen)
    after = len(m.dated) - (m.dated.index(last) + 1 if last else 0)
    others = [r.name for r in m.undated if r.result.verdict is Verdict.NOT_ASSESSED] + [f.name for f in m.failed_once]
    return after + sum(_may_be_later(name, began, first_seen) for name in others)


def _began(m: Machine, first_seen: Callable[[str], int | None]) -> int | None:
    """When the last judged mission began; a clock of the log that runs ahead of the audit's does not count."""
    last = m.last_judged
    seen = first_seen(last.name) if last else None
    return None if last is None or seen is None else min(last.result.start_ns or 0, seen)


def _may_be_later(name: str, began: int | None, first_seen: Callable[[str], int | None]) -> bool:
    seen = first_seen(name) if began is not None else None
    return began is None or seen is None or seen >= began


def _with_faults(m: Machine, own: _Known) -> Machine:
    groups: dict[Key, list[tuple[Run, FoundFault]]] = defaultdict(list)
    for run in m.runs:
        for f in run.faults:
            groups[f.component, f.side, f.mode].append((run, f))
    repaired = frozenset(
        (run.result.id, *key) for key, found in groups.items() for run, _ in found if own.is_repaired(run, key)
    )
    on_part: dict[tuple[str, str], set[int]] = defaultdict(set)
    for (component, side, _), found in groups.items():
        for one in sides_of(side):
            on_part[component, one] |= {run.result.id for run, _ in found}
    faults = [_fleet_fault(m, found, own, on_part) for found in groups.values()]
    faults.sort(key=lambda f: (not f.standing, -f.severity.rank, -f.missions, f.component, f.side, f.mode))
    return m.told(faults=tuple(faults), repaired=repaired)


def _fleet_fault(
    m: Machine, found: Sequence[tuple[Run, FoundFault]], own: _Known, on_part: Mapping[tuple[str, str], Collection[int]]
) -> FleetFault:
    """One fault of a machine over its missions; `on_part`: results with any fault of a component's side, which judged it."""
    f = found[0][1]
    key = (f.component, f.side, f.mode)
    ids = list(dict.fromkeys(r.result.id for r, _ in found))
    live = [(r, g) for r, g in found if not own.is_repaired(r, key)]
    shown = live or found
    now = list(dict.fromkeys(r.result.id for r, _ in shown))
    in_ids, in_now = set(ids), set(now)
    every = [k for k, r in enumerate(m.dated) if r.result.id in in_ids]
    dated = [k for k, r in enumerate(m.dated) if r.result.id in in_now]
    last_run = m.dated[dated[-1]] if dated else shown[-1][0]
    in_last = [g for r, g in shown if r.result.id == last_run.result.id]
    worst = max(in_last, key=lambda g: (g.severity.rank, g.seconds))
    every_assessed = m.assessed(f.component, f.side)
    assessed = every_assessed[: len(m.dated)]
    ordered = bool(dated) and len(dated) == len(now)
    since = sum(assessed[dated[-1] + 1 :]) if ordered else 0
    before = sum(assessed[: dated[0]]) if dated else 0
    told = {name for side in sides_of(f.side) for name in on_part[f.component, side]}
    judged = sum(a or run.result.id in told for a, run in zip(every_assessed, m.runs, strict=True))
    with_it = set(dated)
    without = [k for k in range(dated[-1]) if assessed[k] and k not in with_it] if dated else []
    past = {m.dated[k].result.id for k in dated if without and k < without[-1]}
    episode = _episode(m, shown, assessed, own)
    needed, clean = (OPEN, episode.clean if ordered else 0) if episode.high and live else (STANDING, since)
    status: Status = "recurring" if len(ids) > 1 else "once"
    if not live:
        status = "repaired"
    elif clean >= needed:
        status = "past"
    elif len(ids) == 1 and dated and dated[0] == len(m.dated) - 1 and before:
        status = "new"
    return FleetFault(
        component=f.component,
        kind=f.kind,
        side=f.side,
        mode=f.mode,
        severity=max((g.severity for r, g in shown if r.result.id not in past), key=lambda severity: severity.rank),
        status=status,
        missions=len(ids),
        assessed=max(len(ids), judged),
        first=m.dated[every[0]] if every else found[0][0],
        last=last_run,
        last_id=worst.id,
        since=since,
        epsilon=worst.epsilon,
        unclear=worst.unclear,
        needed=needed,
        clean=clean,
        repaired_ns=repaired_at(own.repairs, f.component, f.side),
    )


def _damaged(run: Run) -> bool:
    """Whether something of a mission's log is lost: what it does not show may be in that."""
    return run.result.state is MissionState.DEGRADED and not run.result.left_out


class _Episode(NamedTuple):
    """The last time that a fault came and was not refuted: whether it ever was of high severity, and clean missions since.

    They are counted up to as many as refute it, and not at all of a fault that never was severe.
    """

    high: bool
    clean: int


def _episode(m: Machine, found: Sequence[tuple[Run, FoundFault]], assessed: Sequence[bool], own: _Known) -> _Episode:
    """Go through a fault's missions: enough clean ones end an episode, ten that would have shown it where it was severe."""
    severe: dict[int, bool] = {}
    for run, f in found:
        severe[run.result.id] = severe.get(run.result.id, False) or f.severity is Severity.HIGH
    key = found[0][1].component, found[0][1].side, found[0][1].mode
    high, clean = any(severe[run.result.id] for run in m.undated if run.result.id in severe), 0
    if not any(severe.values()):
        return _Episode(False, 0)
    for k, run in enumerate(m.dated):
        if run.result.id in severe:
            high = severe[run.result.id] or (high and clean < OPEN)
            clean = 0
        elif high and clean < OPEN and assessed[k] and own.would_show(run, key) and not _damaged(run):
            clean += 1
    return _Episode(high, clean)
