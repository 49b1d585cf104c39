"""Machines of a fleet: their missions in order of the log's clock, where each stands, and the faults that return.

Copies of a log count once. Missions whose log does not know the date (or says one after an audit had seen it), or which
start at the same moment as another one of the machine, cannot be ordered: they count, but they take no part in trends or what is new. Where one of them is worse than the last dated one, the machine stands as the worse.

A fault of high severity that does not show any more may be a loose contact: it stays open until its part is repaired, or until
ten missions that would have shown it are clean.

A machine is ``ready`` only where no mission that was not judged may be later than its last judged one. A log that was not
read, or does not know the date, may be later unless an audit saw it before that mission began.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.audit.fleet.fleet_fault import FleetFault
from diagnosis.audit.fleet.parts import PartKey, PartTable, columns_of
from diagnosis.audit.fleet.read import Mission
from diagnosis.audit.fleet.runs import Limits, Run, sides_of
from diagnosis.audit.fleet.suspicions import Suspicion
from diagnosis.results.vocabulary import Kind, Severity, Verdict

_OF_RUNS = ("_columns", "_assessed", "runs", "judged_s", "_kinds")


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
        Missions without a report, also those that name no machine but lie among its logs alone.
    limits : Limits
        Of its last report.
    cleared : bool or None
        Whether the report of its last judged mission lets it go out, and that of each one which may be later; None where
        one does not say.
    not_cleared : str
        Why that report does not let it go out; empty where it does, or is not of faults to watch.
    unjudged : int
        Missions that were not judged and may be later than the last judged one.
    faults : tuple[FleetFault, ...]
        Faults by part and row, those that stand and the severe ones first.
    suspicions : tuple[Suspicion, ...]
        What earlier missions held against parts without a fault, and nothing has settled since.
    repaired : frozenset[tuple[int, str, str, str]]
        Faults of missions before the repair of their part: result, component, side and mode.
    """

    id: str
    name: str
    dated: tuple[Run, ...]
    undated: tuple[Run, ...]
    failed: tuple[Mission, ...]
    limits: Limits = field(default_factory=Limits)
    cleared: bool | None = None
    not_cleared: str = ""
    unjudged: int = 0
    faults: tuple[FleetFault, ...] = ()
    suspicions: tuple[Suspicion, ...] = ()
    repaired: frozenset[tuple[int, str, str, str]] = frozenset()

    @property
    def outdated(self) -> bool:
        """Whether its last report holds a fault of an earlier mission open that is not open any more: it was repaired since."""
        return self.limits.holds_open and not any(f.open and f.since for f in self.faults)

    def told(self, **more: Any) -> Machine:
        """The same with other values than missions and limits; what was found about those is kept, for there is much of it."""
        out = replace(self, **more)
        out.__dict__.update({name: self.__dict__[name] for name in _OF_RUNS if name in self.__dict__})
        return out

    @property
    def label(self) -> str:
        """What to call it."""
        return self.id or self.name or "machine without a name"

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """All judged missions."""
        return self.dated + self.undated

    @cached_property
    def failed_once(self) -> tuple[Mission, ...]:
        """Missions without a report, each content once (copies, and a file that was moved): of one that is there and one that is gone the first."""
        out: dict[object, Mission] = {}
        for m in sorted(self.failed, key=lambda m: m.gone):
            out.setdefault(m.name if m.result is None else m.result.id, m)
        return tuple(out.values())

    @property
    def last_judged(self) -> Run | None:
        """The last dated mission that assessed anything."""
        return next((r for r in reversed(self.dated) if r.result.verdict not in (None, Verdict.NOT_ASSESSED)), None)

    @property
    def newest(self) -> tuple[Run, ...]:
        """Missions that assessed anything and of which each may be the last: the last dated one, and those without order."""
        undated = tuple(r for r in self.undated if r.result.verdict not in (None, Verdict.NOT_ASSESSED))
        return ((self.last_judged,) if self.last_judged else ()) + undated

    @cached_property
    def last_verdict(self) -> Verdict:
        """Where it stood when it was judged last.

        Worse where a mission of unknown date says so, where no later mission assessed the part of an earlier fault, or while a
        fault of high severity is open. What was repaired since does not count: of a machine of which nothing else is known it
        is not known whether it is ready.
        """
        found = [self._now(r) for r in self.newest]
        standing = [f for f in self.faults if f.standing]
        found += [Verdict.STOP if f.severity is Severity.HIGH else Verdict.WATCH for f in standing if not f.since]
        found += [Verdict.STOP for f in standing if f.open]
        known = [v for v in found if v is not None]
        return max(known, key=lambda verdict: verdict.rank, default=Verdict.NOT_ASSESSED)

    def _now(self, run: Run) -> Verdict | None:
        """Verdict of a mission without the faults that were repaired since, or refuted by enough later missions."""
        verdict = run.result.verdict
        if verdict not in (Verdict.STOP, Verdict.WATCH):
            return verdict
        past = {(f.component, f.side, f.mode) for f in self.faults if f.status == "past"}
        left = [
            f
            for f in run.faults
            if (run.result.id, f.component, f.side, f.mode) not in self.repaired
            and (f.component, f.side, f.mode) not in past
        ]
        if len(left) == len(run.faults):
            return verdict
        if not left:
            return Verdict.NOT_ASSESSED
        return Verdict.STOP if any(f.severity is Severity.HIGH for f in left) else Verdict.WATCH

    @property
    def waiting_ns(self) -> int | None:
        """Date of the last repair of a machine of which nothing was assessed since; None of any other."""
        if self.verdict is not Verdict.NOT_ASSESSED or all(self._now(r) is r.result.verdict for r in self.newest):
            return None
        return max((f.repaired_ns or 0 for f in self.faults if f.status == "repaired"), default=None)

    @property
    def verdict(self) -> Verdict:
        """Where it stands: as it was judged last, but ready only where that is known of its newest mission too."""
        held = self.unjudged > 0 or self.cleared is False
        return Verdict.NOT_ASSESSED if self.last_verdict is Verdict.READY and held else self.last_verdict

    @property
    def _trailing(self) -> int:
        """How many of its last missions gave no verdict."""
        return len(list(itertools.takewhile(lambda r: r.result.verdict is Verdict.NOT_ASSESSED, reversed(self.dated))))

    @property
    def _trailing_seen(self) -> bool:
        """Whether these judged any part long enough."""
        last = range(len(self.dated) - self._trailing, len(self.dated))
        return any(column[k] for column in self._assessed.values() for k in last)

    @property
    def uncleared(self) -> bool:
        """Whether all that may be later than its last verdict was judged, and showed no fault, but did not clear the machine."""
        return self.unjudged > 0 and self.unjudged == self._trailing and self._trailing_seen

    @property
    def note(self) -> str:
        """What limits that; may be empty."""
        out = []
        trailing = self._trailing
        if trailing and trailing < len(self.dated):
            how = "showed no fault, but did not clear the machine" if self._trailing_seen else "could not be judged"
            missions = "mission" if trailing == 1 else f"{trailing} missions"
            out.append(f"its last {missions} {how}")
        if self.undated:
            out.append(f"{_count(len(self.undated), 'mission')} of unknown order")
        failed = self.failed_once
        unread = [m for m in failed if m.result is not None]
        if unread:
            gone = sum(m.gone for m in unread)
            lost = (
                ""
                if not gone
                else " and no longer there"
                if gone == len(unread)
                else f", {gone} of them no longer there"
            )
            out.append(f"{_count(len(unread), 'log')} not read{lost}")
        if len(failed) > len(unread):
            out.append(f"{_count(len(failed) - len(unread), 'log')} not audited yet")
        return ", ".join(out)

    @property
    def driving_s(self) -> float:
        """Driving time of all judged missions [s]."""
        return sum(r.result.driving_s or 0.0 for r in self.runs)

    @property
    def with_faults(self) -> int:
        """Judged missions with a fault."""
        return sum(bool(r.faults) for r in self.runs)

    @property
    def columns(self) -> dict[PartKey, NDArray[np.intp]]:
        """Each component and side in every judged mission, in the order of `runs`: its row in `table`, −1 where it has none; shape (runs,)."""
        return self._columns[1]

    @property
    def table(self) -> PartTable:
        """Parts of its store."""
        return self._columns[0]

    @cached_property
    def _columns(self) -> tuple[PartTable, dict[PartKey, NDArray[np.intp]]]:
        return columns_of([r.result.parts for r in self.runs])

    @cached_property
    def _assessed(self) -> dict[PartKey, list[bool]]:
        least = self.limits.min_assessed
        return {key: self.table.assessed(rows, least).tolist() for key, rows in self.columns.items()}

    def judged_all(self) -> set[int]:
        """Results of missions that judged every part of a wheel for as long as a verdict of ``ready`` takes."""
        wheels = [column for (c, _), column in self._assessed.items() if c not in self.limits.axles]
        return {r.result.id for k, r in enumerate(self.runs) if wheels and all(column[k] for column in wheels)}

    def assessed(self, component: str, side: str) -> list[bool]:
        """Which missions judged a part for as long as a verdict of ``ready`` takes, in the order of `runs`."""
        none = [False] * len(self.runs)
        found = [self._assessed.get((component, s), none) for s in sides_of(side)]
        return found[0] if len(found) == 1 else [all(column) for column in zip(*found, strict=True)]

    @cached_property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Components and sides of any mission, in the order of the machine's wheels and axles."""
        found = dict.fromkeys(self.columns)
        found |= dict.fromkeys((f.component, s) for r in self.runs for f in r.faults for s in sides_of(f.side))
        order = {name: k for k, name in enumerate((*self.limits.wheels, *self.limits.axles))}
        return tuple(sorted(found, key=lambda k: order.get(k[0], len(order))))

    def kind(self, component: str) -> str:
        """Whether a component is a ``wheel`` or steers."""
        return Kind.STEER if component in self.limits.axles else self._kinds.get(component, Kind.WHEEL)

    @cached_property
    def _kinds(self) -> dict[str, str]:
        """Kind of each component that a fault names, by the first of them."""
        return {f.component: f.kind for r in reversed(self.runs) for f in reversed(r.result.faults)}

    @cached_property
    def judged_s(self) -> tuple[float, float]:
        """Driving time over all parts of all missions, and how much of it was judged [s]."""
        rows = np.concatenate([np.empty(0, np.intp), *self.columns.values()])
        rows = rows[rows >= 0]
        return float(self.table.driving_s[rows].sum()), float(self.table.decided_s[rows].sum())

    @property
    def decided(self) -> float | None:
        """Share of the driving time that was judged, over all parts [1]."""
        driving, decided = self.judged_s
        return decided / driving if driving > 0 else None


def _count(n: int, word: str) -> str:
    return f"{n} {word}{'' if n == 1 else 's'}"
