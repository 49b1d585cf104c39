"""What an audit is asked to do, and each mission with its machine and configuration."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from diagnosis.audit.discover import MissionSource
from diagnosis.audit.identity import given_id, stated_id
from diagnosis.audit.keys import config_hash
from diagnosis.audit.limits import Limits
from diagnosis.audit.outcome import TRANSIENT
from diagnosis.audit.staging import machine_at
from diagnosis.audit.store import Store, StoredResult
from diagnosis.audit.task import key_of, sizes_of
from replay.errors import ConfigError
from replay.machine import Machine, haulotte
from replay.machine_file import dump_machine

PAPER = "paper defaults"


@dataclass(frozen=True)
class Asked:
    """What an audit is asked to do.

    Attributes
    ----------
    output : Path
        Folder of the audit.
    machine : Path or None
        Machine file of missions that name none of their own; None: the paper's machine.
    machine_id : str
        Identity of all missions; empty: their own.
    limits : Limits
        Of each mission.
    retries : int
        Further attempts at a mission that crashed or met a limit.
    resume : bool
        Whether finished missions are left as they are.
    max_size_mb : float
        Size each page should keep to [MB].
    isolation : str
        As in `diagnosis.audit.isolated.isolation`.
    judge : str
        As in `diagnosis.audit.child.Work`; for tests.
    """

    output: Path
    machine: Path | None = None
    machine_id: str = ""
    limits: Limits = field(default_factory=Limits)
    retries: int = 1
    resume: bool = True
    max_size_mb: float = 15.0
    isolation: str = ""
    judge: str = "diagnosis.audit.child:judge"


@dataclass(frozen=True)
class Planned:
    """A mission with its machine.

    Attributes
    ----------
    mission : MissionSource
        As found.
    machine : Machine
        Its machine.
    source : str
        Where the machine's settings come from.
    machine_id : str
        Identity for trends; empty: what the log and the machine file say.
    config_hash : str
        From `diagnosis.audit.keys.config_hash`.
    problem : str
        Why the mission cannot be audited; empty where it can.
    """

    mission: MissionSource
    machine: Machine
    source: str
    machine_id: str
    config_hash: str
    problem: str = ""


def plan(missions: Iterable[MissionSource], asked: Asked) -> list[Planned]:
    """Give each mission its machine and configuration.

    Raises
    ------
    ConfigError
        Where the given machine file is off; one that a mission names costs that mission alone.
    """

    @cache
    def loaded(name: str | None) -> tuple[Machine, bytes]:
        machine = haulotte() if name is None else machine_at(name)
        return machine, dump_machine(machine).encode()

    usual = str(asked.machine) if asked.machine is not None else None
    loaded(usual)
    options = {"max_size_mb": asked.max_size_mb}
    planned = []
    for mission in missions:
        name, problem = mission.machine_file or usual, ""
        try:
            machine, document = loaded(name)
        except ConfigError as error:
            problem = str(error)
            machine, document = haulotte(), problem.encode("utf-8", "backslashreplace")
        source = PAPER if name is None else Path(name).name
        stated = stated_id(asked.machine_id, mission, machine)
        given = given_id(asked.machine_id, mission) or ""
        planned.append(Planned(mission, machine, source, given, config_hash(document, options, stated), problem))
    return planned


def known_hashes(planned: Planned, store: Store) -> tuple[str, ...]:
    """SHA-256 of each file of a mission, as far as they were hashed before and have not changed; else none."""
    mission = planned.mission
    files = zip(mission.files, sizes_of(mission), mission.stamps, strict=True)
    found = [store.known_hash(*file) for file in files]
    return tuple(h for h in found if h) if all(found) else ()


def stored_result(planned: Planned, store: Store) -> StoredResult | None:
    """Result that the store holds for a mission as it is now."""
    hashes = known_hashes(planned, store)
    return store.lookup(key_of(planned.mission, hashes, planned.machine, planned.config_hash)) if hashes else None


def is_done(result: StoredResult | None, asked: Asked) -> bool:
    """Whether a result is final: its report is there, and no attempts are left where it failed."""
    if result is None:
        return False
    if result.state in TRANSIENT and result.attempts <= asked.retries:
        return False
    return result.report is None or (asked.output / result.report / "report.json").is_file()
