"""What is asked of an audit: its options, whether they can be, and the missions and limits that they stand for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from replay.arrays.processors import processors
from replay.errors import ConfigError

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from diagnosis.audit.discovery.discover import Discovery
    from diagnosis.audit.engines import Engine
    from diagnosis.audit.plan import AuditOptions


@dataclass(frozen=True)
class AuditRequest:
    """What is asked for; names and defaults as on the command line.

    Attributes
    ----------
    words : tuple[str, ...]
        Folders, logs, globs and URLs.
    output : Path
        Folder of the store, the fleet page and the reports.
    machine : Path or None
        Machine file of missions that name none of their own.
    machine_id : str or None
        Id of the machine that all missions belong to.
    jobs : int or None
        Missions at once; None: one per processor.
    memory_mb, timeout_s, cpu_s : float or None
        Limits of each mission [MB], [s], [s].
    retries : int
        Further attempts at a mission that crashed or met a limit.
    resume : bool
        Whether finished missions are left as they are.
    dask : str or None
        Scheduler of a Dask cluster.
    max_size_mb : float
        Size each page should keep to [MB].
    """

    words: tuple[str, ...]
    output: Path
    machine: Path | None = None
    machine_id: str | None = None
    jobs: int | None = None
    memory_mb: float | None = None
    timeout_s: float = 1800.0
    cpu_s: float | None = None
    retries: int = 1
    resume: bool = True
    dask: str | None = None
    max_size_mb: float = 8.0

    @property
    def at_once(self) -> int:
        """Missions at once on this machine."""
        return self.jobs or processors()

    def engine(self, kind: str = "") -> Callable[[], AbstractContextManager[Engine]]:
        """What runs missions: processes of this machine, which start as `diagnosis.audit.isolation.run.isolation` says, or a Dask cluster."""
        from diagnosis.audit import engines

        address = self.dask
        return (lambda: engines.dask(address)) if address else (lambda: engines.local(self.at_once, kind))

    def check(self) -> None:
        """Raise a `ConfigError` where an option cannot be."""
        if self.machine_id is not None and not self.machine_id.strip():
            raise ConfigError("--machine-id: is empty; give a name or leave it out")
        for name, value, least in (
            ("--jobs", self.jobs, 1), ("--memory", self.memory_mb, 16), ("--timeout", self.timeout_s, 0.1),
            ("--cpu", self.cpu_s, 1), ("--retries", self.retries, 0), ("--max-size", self.max_size_mb, 0.5),
        ):  # fmt: skip
            if value is not None and not value >= least:
                raise ConfigError(f"{name} {value:g}: expected {least:g} or more")

    def found(self) -> tuple[Discovery, AuditOptions]:
        """Missions, and how each is to be diagnosed."""
        from diagnosis.audit.discovery.discover import discover
        from diagnosis.audit.discovery.machine_files import with_machine_files
        from diagnosis.audit.isolation.limits import Limits, usual_memory_mb
        from diagnosis.audit.isolation.run import isolation_for
        from diagnosis.audit.plan import AuditOptions, machine_notes

        found = discover(self.words, exclude=self.output)
        memory = self.memory_mb or (usual_memory_mb(self.at_once) if self.dask is None else Limits.memory_mb)
        limits = Limits(memory, self.timeout_s, self.cpu_s)
        asked = AuditOptions(
            self.output, self.machine, self.machine_id or "", limits, self.retries, self.resume, self.max_size_mb
        )
        if self.dask is None:
            asked = replace(asked, isolation=isolation_for(len(found.missions), limits))
        missions, told = found.missions, machine_notes(found.missions, asked)
        if self.machine is None:
            missions, told = with_machine_files(found.missions, asked.machine_id)
        return replace(found, missions=missions, notes=(*told, *found.notes)), asked
