"""Options of an audit, and each mission with its machine and configuration."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from diagnosis.audit.discovery.identity import fallback_id, given_id, stated_id
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.staging import machine_at
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.store.folders import holds_report
from diagnosis.audit.store.keys import config_hash
from diagnosis.audit.store.outcome import TRANSIENT
from diagnosis.audit.store.store import Store
from diagnosis.audit.store.stored import StoredResult
from diagnosis.audit.task import key_of, sizes_of
from diagnosis.results.document import PAPER_DEFAULTS
from replay.errors import ConfigError
from replay.machine.config import Machine, haulotte
from replay.machine.questions import open_questions
from replay.machine.toml_text import dump_machine

_REPORT = ("report.json", "report.html")
_CLEARLY = 1.05  # what is free varies from one night to the next


@dataclass(frozen=True)
class AuditOptions:
    """What is asked of an audit.

    Attributes
    ----------
    output : Path
        Folder of the audit.
    machine : Path or None
        Machine file of all missions; None: their own, else the paper's machine.
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
        As in `diagnosis.audit.isolation.run.isolation`.
    judge : str
        As in `diagnosis.audit.isolation.child.Work`; for tests.
    """

    output: Path
    machine: Path | None = None
    machine_id: str = ""
    limits: Limits = field(default_factory=Limits)
    retries: int = 1
    resume: bool = True
    max_size_mb: float = 8.0
    isolation: str = ""
    judge: str = "diagnosis.audit.isolation.child:judge"


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
        From `diagnosis.audit.store.keys.config_hash`.
    problem : str
        Why the mission cannot be audited; empty where it can.
    """

    mission: MissionSource
    machine: Machine
    source: str
    machine_id: str
    config_hash: str
    problem: str = ""


def plan(missions: Iterable[MissionSource], options: AuditOptions) -> list[Planned]:
    """Give each mission its machine and configuration.

    Raises
    ------
    ConfigError
        Where the given machine file is wrong; one of a mission's own costs that mission alone.
    """

    @cache
    def loaded(name: str | None) -> tuple[Machine, bytes]:
        machine = haulotte() if name is None else machine_at(name)
        return machine, dump_machine(machine).encode()

    usual = str(options.machine) if options.machine is not None else None
    loaded(usual)
    hashed = {"max_size_mb": options.max_size_mb}
    planned = []
    for mission in missions:
        name, problem = usual or mission.machine_file, mission.problem
        try:
            machine, document = loaded(name)
        except ConfigError as error:
            problem = problem or str(error)
            machine, document = haulotte(), b""
        if problem:
            document = problem.encode("utf-8", "backslashreplace")
        source = PAPER_DEFAULTS if name is None else Path(name).name
        stated = stated_id(options.machine_id, mission, machine)
        given = given_id(options.machine_id, mission) or ""
        planned.append(Planned(mission, machine, source, given, config_hash(document, hashed, stated), problem))
    return planned


def machine_notes(missions: Iterable[MissionSource], options: AuditOptions) -> tuple[str, ...]:
    """What machine files bring about, one sentence each: those that the given one overrides, folders that an id makes one machine, and drafts with open questions.

    Raises
    ------
    ConfigError
        Where the machine file is wrong.
    """
    missions = list(missions)
    if options.machine is None:
        return (*(() if options.machine_id else _made_one(missions)), *_open(missions))
    notes = []
    own = [
        m.machine_file
        for m in missions
        if m.machine_file is not None and not _same_file(m.machine_file, options.machine)
    ]
    if own:
        logs = (
            f"{len(own)} of {len(missions)} missions, which have"
            if len(own) != 1
            else f"1 of {len(missions)} missions, which has"
        )
        notes.append(
            f"-m {options.machine} counts also for {logs} another machine file beside them: {_few(own)}; without -m each "
            "mission has its own, and a machine.toml in the topmost folder stands for the rest"
        )
    given = [replace(m, machine_file=str(options.machine)) for m in missions]
    return (*notes, *(() if options.machine_id else _made_one(given)), *_open(given))


def _open(missions: Sequence[MissionSource]) -> tuple[str, ...]:
    """Drafts of machine files with open questions, a sentence."""
    files = dict.fromkeys(
        m.machine_file for m in missions if m.machine_file is not None and "://" not in m.machine_file
    )
    drafts = [name for name in files if open_questions(Path(name))]
    if not drafts:
        return ()
    return (
        f"{_few(drafts)}: drafted, with comments marked QUESTION; answer and remove them: what stands in for the right "
        "length leaves missions not assessed",
    )


def _made_one(missions: Sequence[MissionSource]) -> tuple[str, ...]:
    """Ids of machine files that make one machine of several folders, a sentence each; a file that is wrong costs its own missions alone."""
    files: dict[str, list[str]] = {}
    folders: dict[str, list[str]] = {}
    ids: dict[str, str] = {}
    for m in missions:
        if m.machine_file is None or m.machine_id:
            continue
        if m.machine_file not in ids:
            try:
                ids[m.machine_file] = machine_at(m.machine_file).id
            except ConfigError:
                ids[m.machine_file] = ""
        if name := ids[m.machine_file]:
            files.setdefault(name, []).append(m.machine_file)
            folders.setdefault(name, []).append(fallback_id(m))
    return tuple(
        f"{_few(files[name])}: the id {name!r} makes one machine of the logs of {len(set(own))} folders ({_few(own)}), "
        "unless the logs name their own; leave the id out, or give each its own, where each folder is a machine"
        for name, own in folders.items()
        if len(set(own)) > 1
    )


def _same_file(one: str, other: Path) -> bool:
    return "://" not in one and os.path.realpath(one) == os.path.realpath(other)


def _few(names: Sequence[str]) -> str:
    """The first three of different names."""
    names = list(dict.fromkeys(names))
    return ", ".join(names[:3]) + (", …" if len(names) > 3 else "")


def known_hashes(planned: Planned, store: Store) -> tuple[str, ...]:
    """SHA-256 of each file of a mission, as far as they were hashed before and have not changed; else none."""
    mission = planned.mission
    files = zip(mission.files, sizes_of(mission), mission.stamps, strict=True)
    found = [store.known_hash(*file) for file in files]
    return tuple(h for h in found if h) if all(found) else ()


def stored_result(planned: Planned, store: Store) -> StoredResult | None:
    """Result that the store holds for a mission as it is now."""
    if planned.problem:
        return store.lookup(key_of(planned.mission, (), planned.machine, planned.config_hash))
    hashes = known_hashes(planned, store)
    return store.lookup(key_of(planned.mission, hashes, planned.machine, planned.config_hash)) if hashes else None


def allows_more(limits: Limits, result: StoredResult) -> bool:
    """Whether limits are larger than that at which a mission was stopped."""
    met = result.limit
    if met is None:
        return False
    now = {"--timeout": limits.wall_s, "--cpu": limits.cpu_s, "--memory": limits.memory_mb}[met[0]]
    return now is None or now > met[1] * (_CLEARLY if met[0] == "--memory" else 1.00001)


def is_done(result: StoredResult | None, options: AuditOptions) -> bool:
    """Whether a result is final: its report is there; where it failed, no attempts are left and its limit is no larger now."""
    if result is None:
        return False
    if result.state in TRANSIENT and (result.attempts <= options.retries or allows_more(options.limits, result)):
        return False
    if result.report is None:
        return True
    folder = options.output / result.report
    return holds_report(folder, result.key) and all((folder / name).is_file() for name in _REPORT)
