"""Repairs as a user tells of them: which machine and part is meant, kept in the store and shown on the fleet page."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from diagnosis.audit.events import Emit
from diagnosis.audit.fleet.document import Fleet
from diagnosis.audit.fleet.listed import ListedMachine
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.runs import Run
from diagnosis.audit.fleet.words import fault_words
from diagnosis.audit.fleet_files import load_fleet
from diagnosis.audit.fleet_page import FleetPage
from diagnosis.audit.previous_pages import renew_newest
from diagnosis.audit.store.repairs import Repair, read_repairs, record_repair, repaired_at
from diagnosis.audit.store.store import FILE_NAME, Store
from diagnosis.pages.labels import utc
from replay.errors import ConfigError, OutputError
from replay.faults import Side

_MINUTE_NS = 60 * 10**9
_SENSOR, _DRIVE = (
    r"(?:(?:speed|steering|joint) )?sensor",
    r"(?:(?:drive|steering|joint) )?(?:valve|motor|drive|actuator)",
)
#: A side in the words of a report, behind a machine and a part.
_SIDE = re.compile(
    rf" (?:(?P<either>{_SENSOR} or {_DRIVE})|(?P<sensor>{_SENSOR})|(?P<actuator>{_DRIVE}))$", re.IGNORECASE
)
_EXPECTED = 'expected "MACHINE PART", or with "sensor" or "actuator" behind it'
_NAMED = 12


@dataclass(frozen=True)
class Told:
    """One repair that was recorded or withdrawn: the machine's label, the part in words, the faults it closes, and those of it that stay."""

    machine: str
    part: str
    repaired_ns: int
    closes: tuple[str, ...]
    stays: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recorded:
    """What was recorded, the machines of the fleet page afterwards, and the folders of their newest reports that were written anew."""

    told: tuple[Told, ...]
    machines: tuple[ListedMachine, ...]
    reports: tuple[str, ...] = ()


def record_repairs(
    output: Path,
    repairs: Sequence[str],
    repaired_ns: int,
    emit: Emit,
    *,
    withdrawn: bool = False,
    max_size_mb: float = 8.0,
) -> Recorded:
    """Record repairs, or that they were recorded by mistake, and write the newest report of each machine and the fleet page anew.

    Parameters
    ----------
    output : Path
        Folder of an audit.
    repairs : Sequence[str]
        ``MACHINE PART [side]``, as the fleet page calls them.
    repaired_ns : int
        When they were made [ns since 1970].
    emit : Emit
        Takes the events.
    withdrawn : bool
        Whether they are taken back.
    max_size_mb : float
        Size that a page should keep to [MB].

    Raises
    ------
    ConfigError
        Where a machine or part is not known, or the fault was found on the same day and the time of the repair is not given.
    OutputError
        Where there is no audit, or it cannot be written.
    """
    store_path = output / FILE_NAME
    if not store_path.is_file():
        raise OutputError(f"{store_path}: there is no store; run `mfhca audit` first, or give its folder with -o")
    fleet = load_fleet(store_path, output)
    found = [_meant(words, fleet, repaired_ns) for words in repairs]  # all of them, before one is written
    with Store.open(store_path) as store:
        known = read_repairs(store.database)
        for (machine, repair), words in zip(found, repairs, strict=True):
            if withdrawn and repair not in known:
                day = utc(repaired_ns)[:16]
                listed = ", ".join(_dates(r for r in known if r.machine == repair.machine)) or "none"
                raise ConfigError(
                    f"--not-repaired {words!r}: no repair of it on {day} UTC is recorded; of {machine.label}: {listed}"
                )
        for _, repair in found:
            record_repair(store, repair, withdrawn=withdrawn)
        rewritten = renew_newest(store, {machine.id for machine, _ in found if machine.id}, max_size_mb, emit)
    page = FleetPage(output, None, "hours", emit)
    page.renew()
    told = [
        Told(
            m.label,
            f"{r.component} {r.side}".strip(),
            r.repaired_ns,
            *(((), ()) if withdrawn else _closed(m, r, known)),
        )
        for m, r in found
    ]
    return Recorded(tuple(told), page.machines(), tuple(rewritten))


def _dates(repairs: Iterable[Repair]) -> list[str]:
    return [f"{r.component} {r.side}".strip() + f" on {utc(r.repaired_ns)[:16]}" for r in repairs]


def _meant(words: str, fleet: Fleet, repaired_ns: int) -> tuple[Machine, Repair]:
    """Machine and part that are meant."""
    said = _SIDE.search(" ".join(words.split()))
    if said is not None and " " not in said.string[: said.start()]:
        said = None  # a part may be called so
    side = "" if said is None or said["either"] else Side.SENSOR.value if said["sensor"] else Side.ACTUATOR.value
    parts = (words if said is None else said.string[: said.start()]).split()
    if len(parts) < 2:
        raise ConfigError(f"--repaired {words!r}: {_EXPECTED}")
    name, part, machines = " ".join(parts[:-1]), parts[-1], list[Machine]()
    for k in range(len(parts) - 1, 0, -1):  # the rest is a part, known or not
        called = " ".join(parts[:k])
        machines = [m for m in fleet.machines if called.casefold() in (m.id.casefold(), m.label.casefold())]
        if machines:
            name, part = called, " ".join(parts[k:])
            break
    if len(machines) != 1:
        known = ", ".join(m.label for m in fleet.machines[:_NAMED]) + (" …" if len(fleet.machines) > _NAMED else "")
        what = f"{len(machines)} machines are called so" if machines else "no such machine"
        raise ConfigError(f"--repaired {words!r}: {name}: {what}; the audit has {known or 'none'}; {_EXPECTED}")
    machine = machines[0]
    components = list(dict.fromkeys(component for component, _ in machine.parts))
    component = next(
        (c for c in components if part.casefold() in (c.casefold(), c.removesuffix("_steer").casefold())), None
    )
    if component is None:
        raise ConfigError(
            f"--repaired {words!r}: {machine.label} has no part {part}; it has {', '.join(components) or 'none'}; {_EXPECTED}"
        )
    repair = Repair((machine.id, "" if machine.id else machine.name), component, side, repaired_ns)
    _check_day(machine, repair, words)
    return machine, repair


def _check_day(machine: Machine, repair: Repair, words: str) -> None:
    """Refuse a day without a time on which the part's fault was found: it is not known what was first."""
    if repair.repaired_ns % (86_400 * 10**9):
        return
    day = utc(repair.repaired_ns)[:10]
    same = [r for r in machine.dated if utc(r.result.start_ns)[:10] == day and _faults(r, repair)]
    if same:
        last = same[-1].result
        assert last.start_ns is not None
        end = utc(last.start_ns + round((last.duration_s or 0.0) * 1e9) + _MINUTE_NS)
        raise ConfigError(
            f"--repaired {words!r}: a mission that began on {day} at {utc(last.start_ns)[11:16]} UTC shows the fault; give the time of the "
            f"repair; after that mission it is --on {end[:10]}T{end[11:16]} or later"
        )


def _faults(run: Run, repair: Repair) -> bool:
    return any(f.component == repair.component and repair.side in ("", *Side(f.side).sides) for f in run.faults)


def _closed(machine: Machine, repair: Repair, known: Sequence[Repair]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Standing faults of the part that the repair closes, with those that were recorded before; and those that it does not."""
    closes, stays = [], []
    own = [repair, *(r for r in known if r.machine == repair.machine)]
    for f in machine.faults:
        start = f.last.result.start_ns
        if (
            f.status == "past"
            and start is not None
            and (f.component, start < repair.repaired_ns) == (repair.component, True)
        ):
            closes.append(f"{fault_words(f, machine.limits.words)}, which was not seen any more")
        if not f.standing or start is None or f.component != repair.component:
            continue
        if repair.side and repair.side not in Side(f.side).sides:
            continue
        when = repaired_at(own, f.component, f.side)
        words = fault_words(f, machine.limits.words)
        if when is not None and start < when:
            closes.append(words)
        elif start >= repair.repaired_ns:
            stays.append(f"{words}: found again on {utc(start)[:10]}")
        else:
            stays.append(f"{words}: the repair of one side does not tell which it was; without a side both are meant")
    return tuple(closes), tuple(stays)
