"""Machines of a fleet: their missions in order of the log's clock, where each stands, and the faults that return.

Copies of a log count once. Missions whose log does not know the date, or which start at the same moment as another one of
the machine, cannot be ordered: they count, but they take no part in trends or what is new. Where one of them is worse than the last dated one, the machine stands as the worse.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

from diagnosis.audit.fleet_read import Bounds, FoundFault, Mission, Part, Result
from diagnosis.result import SEVERITIES

VERDICTS = ("stop", "watch", "not_assessed", "ready")  # worst first
EITHER = "sensor_or_actuator"
STANDING = 3
_LEAST_SHARE = 0.8

Key = tuple[str, str, str]
Status = Literal["new", "recurring", "once", "past"]


@dataclass(frozen=True)
class Limits:
    """What the machine file says of limits, and which components steer; the defaults are those of the paper's machine."""

    min_epsilon: float = 0.1
    min_assessed: float = 10.0
    wheels: tuple[str, ...] = ("FR", "FL", "RR", "RL")
    axles: tuple[str, ...] = ("front", "rear")


@dataclass(frozen=True)
class Run:
    """A judged mission of a machine; `name` is that of the first of its copies."""

    name: str
    result: Result
    copies: int = 0

    @cached_property
    def faults(self) -> tuple[FoundFault, ...]:
        """Faults that count: those of at least low severity."""
        return tuple(f for f in self.result.faults if f.severity != "info")

    @property
    def worst(self) -> FoundFault | None:
        """The most severe and longest of them."""
        return max(self.faults, key=lambda f: (SEVERITIES.index(f.severity), f.seconds), default=None)

    @cached_property
    def parts(self) -> dict[tuple[str, str], Part]:
        """Its parts by component and side."""
        return {(p.component, p.side): p for p in self.result.parts}

    def assessed(self, component: str, side: str, limits: Limits) -> bool:
        """Whether a part was judged for as long as a verdict of ``ready`` takes."""
        keys = [(component, s) for s in sides_of(side)]
        return all(k in self.parts and is_assessed(self.parts[k], limits) for k in keys)


def sides_of(side: str) -> tuple[str, ...]:
    """The two sides of a fault that may be of either."""
    return ("sensor", "actuator") if side == EITHER else (side,)


def is_assessed(part: Part, limits: Limits) -> bool:
    """Whether a part was judged for `min_assessed` seconds and four fifths of its driving."""
    return part.decided_s > 0 and part.decided_s >= max(limits.min_assessed, _LEAST_SHARE * part.driving_s)


@dataclass(frozen=True)
class FleetFault:
    """All faults of one machine on one component and side in one row.

    Attributes
    ----------
    component, kind, side, mode : str
        As in the missions' reports.
    severity : str
        The worst.
    status : str
        ``new``: in the machine's last mission and in none of the earlier ones, of which one assessed the part;
        ``recurring``: in several missions; ``once``; ``past``: not found in the last three missions that assessed it.
    missions, assessed : int
        Missions with it, and missions that assessed the part.
    first, last : Run
        Its first and last mission.
    last_id : str
        Its number in the report of the last one.
    since : int
        Missions that assessed the part after the last one with it.
    epsilon : Bounds or None
        ε̂ in the last one.
    """

    component: str
    kind: str
    side: str
    mode: str
    severity: str
    status: Status
    missions: int
    assessed: int
    first: Run
    last: Run
    last_id: str
    since: int
    epsilon: Bounds | None

    @property
    def standing(self) -> bool:
        """Whether it counts as there."""
        return self.status != "past"


@dataclass(frozen=True)
class Machine:
    """One machine of the fleet.

    Attributes
    ----------
    id, name : str
        Identity (may be empty) and name.
    dated : tuple[Run, ...]
        Judged missions in order of their logs' clocks.
    undated : tuple[Run, ...]
        Judged missions that cannot be ordered, by name.
    failed : tuple[Mission, ...]
        Missions without a report.
    limits : Limits
        Of its last report.
    faults : tuple[FleetFault, ...]
        Faults by part and row, those that stand and the severe ones first.
    """

    id: str
    name: str
    dated: tuple[Run, ...]
    undated: tuple[Run, ...]
    failed: tuple[Mission, ...]
    limits: Limits = field(default_factory=Limits)
    faults: tuple[FleetFault, ...] = ()

    @property
    def label(self) -> str:
        """What to call it."""
        return self.id or self.name or "machine without a name"

    @property
    def runs(self) -> tuple[Run, ...]:
        """All judged missions."""
        return self.dated + self.undated

    @cached_property
    def verdict(self) -> str:
        """Where it stands: verdict of its last mission that assessed anything.

        Worse where a mission of unknown date says so, or where no later mission assessed the part of an earlier fault.
        """
        known = [r.result.verdict or "not_assessed" for r in self.dated]
        last = next((v for v in reversed(known) if v != "not_assessed"), "not_assessed" if known else None)
        found = [*([last] if last else []), *(r.result.verdict or "not_assessed" for r in self.undated)]
        found += ["stop" if f.severity == "high" else "watch" for f in self.faults if not f.since]
        found = [v for v in found if v != "not_assessed"] or found
        return min(found, key=VERDICTS.index) if found else "not_assessed"

    @property
    def note(self) -> str:
        """What limits that; may be empty."""
        out = []
        trailing = list(itertools.takewhile(lambda r: r.result.verdict == "not_assessed", reversed(self.dated)))
        if trailing and len(trailing) < len(self.dated):
            out.append(f"its last {_count(len(trailing), 'mission')} could not be assessed")
        if self.undated:
            out.append(f"{_count(len(self.undated), 'mission')} of unknown order")
        if self.failed:
            out.append(f"{_count(len(self.failed), 'log')} not read")
        return ", ".join(out)

    @property
    def driving_s(self) -> float:
        """Driving time of all judged missions [s]."""
        return sum(r.result.driving_s or 0.0 for r in self.runs)

    @property
    def with_faults(self) -> int:
        """Judged missions with a fault."""
        return sum(bool(r.faults) for r in self.runs)

    @cached_property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Components and sides of any mission, in the order of the machine's wheels and axles."""
        found = dict.fromkeys((p.component, p.side) for r in self.runs for p in r.result.parts)
        found |= dict.fromkeys((f.component, s) for r in self.runs for f in r.faults for s in sides_of(f.side))
        order = {name: k for k, name in enumerate((*self.limits.wheels, *self.limits.axles))}
        return tuple(sorted(found, key=lambda k: order.get(k[0], len(order))))

    def kind(self, component: str) -> str:
        """Whether a component is a ``wheel`` or steers."""
        if component in self.limits.axles:
            return "steer"
        return next((f.kind for r in self.runs for f in r.result.faults if f.component == component), "wheel")

    @property
    def decided(self) -> float | None:
        """Share of the driving time that was judged, over all parts [1]."""
        parts = [p for r in self.runs for p in r.result.parts]
        driving = sum(p.driving_s for p in parts)
        return sum(p.decided_s for p in parts) / driving if driving > 0 else None


def _count(n: int, word: str) -> str:
    return f"{n} {word}{'' if n == 1 else 's'}"


def machines_of(
    missions: Iterable[Mission], limits: Callable[[str], Limits] | None = None
) -> tuple[list[Machine], list[Mission]]:
    """Gather missions by machine.

    Parameters
    ----------
    missions : Iterable[Mission]
        From `read_missions`.
    limits : Callable[[str], Limits] or None
        Gives the limits by the folder of a report, asked for the last one of each machine; None for the defaults.

    Returns
    -------
    tuple[list[Machine], list[Mission]]
        Machines by identity and name; and missions without a report whose machine is not known.
    """
    runs: dict[tuple[str, str], dict[int, Run]] = defaultdict(dict)
    failed: dict[tuple[str, str], list[Mission]] = defaultdict(list)
    nowhere: list[Mission] = []
    for m in missions:
        if m.result is None:
            continue
        key = (m.result.machine_id, "" if m.result.machine_id else m.result.machine_name)
        if m.result.judged:
            known = runs[key].get(m.result.id)
            runs[key][m.result.id] = Run(known.name if known else m.name, m.result, known.copies + 1 if known else 0)
        elif m.result.machine_id:
            failed[key].append(m)
        else:
            nowhere.append(m)
    out = []
    for key in sorted({*runs, *failed}):
        found = list(runs[key].values())
        starts = Counter(r.result.start_ns for r in found if r.result.start_ns is not None)
        alone = {start for start, count in starts.items() if count == 1}
        dated = sorted((r for r in found if r.result.start_ns in alone), key=lambda r: r.result.start_ns or 0)
        undated = sorted((r for r in found if r.result.start_ns not in alone), key=lambda r: r.name)
        last = next((r for r in (*reversed(dated), *undated) if r.result.report is not None), None)
        own = limits(last.result.report or "") if limits and last else Limits()
        name = key[1] or (last.result.machine_name if last else "")
        machine = Machine(key[0], name, tuple(dated), tuple(undated), tuple(failed[key]), own)
        out.append(_with_faults(machine))
    return out, nowhere


def _with_faults(m: Machine) -> Machine:
    groups: dict[Key, list[tuple[Run, FoundFault]]] = defaultdict(list)
    for run in m.runs:
        for f in run.faults:
            groups[f.component, f.side, f.mode].append((run, f))
    faults = [_fleet_fault(m, found) for found in groups.values()]
    faults.sort(key=lambda f: (not f.standing, -SEVERITIES.index(f.severity), -f.missions, f.component, f.side, f.mode))
    return replace(m, faults=tuple(faults))


def _fleet_fault(m: Machine, found: Sequence[tuple[Run, FoundFault]]) -> FleetFault:
    f = found[0][1]
    ids = list(dict.fromkeys(r.result.id for r, _ in found))
    last_run = found[-1][0]
    dated = [k for k, r in enumerate(m.dated) if r.result.id in set(ids)]
    if dated:
        last_run = m.dated[dated[-1]]
    in_last = [g for r, g in found if r.result.id == last_run.result.id]
    worst = max(in_last, key=lambda g: (SEVERITIES.index(g.severity), g.seconds))
    assessed = [r.assessed(f.component, f.side, m.limits) for r in m.dated]
    since = sum(assessed[dated[-1] + 1 :]) if dated and len(dated) == len(ids) else 0
    before = sum(assessed[: dated[0]]) if dated else 0
    undated = sum(r.assessed(f.component, f.side, m.limits) for r in m.undated)
    status: Status = "past" if since >= STANDING else "recurring" if len(ids) > 1 else "once"
    if len(ids) == 1 and dated and dated[0] == len(m.dated) - 1 and before:
        status = "new"
    return FleetFault(
        component=f.component,
        kind=f.kind,
        side=f.side,
        mode=f.mode,
        severity=max((g.severity for _, g in found), key=SEVERITIES.index),
        status=status,
        missions=len(ids),
        assessed=max(len(ids), sum(assessed) + undated),
        first=m.dated[dated[0]] if dated else found[0][0],
        last=last_run,
        last_id=worst.id,
        since=since,
        epsilon=worst.epsilon,
    )
