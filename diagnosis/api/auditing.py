"""Audit a folder of missions from Python: each diagnosed in a process of its own, and what came of them as a table."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from diagnosis.api.audit_request import AuditRequest
from diagnosis.api.errors import stated
from diagnosis.api.inputs import StrPath, path_of
from replay.errors import ConfigError, LogError

if TYPE_CHECKING:
    import pandas as pd

    from diagnosis.audit.discovery.discover import Discovery
    from diagnosis.audit.endings import Ending
    from diagnosis.audit.events import Emit, EventFacts
    from diagnosis.audit.fleet.listed import ListedMachine
    from diagnosis.audit.plan import AuditOptions

OUTPUT = "mfhca-audit"


@dataclass(frozen=True)
class Audit:
    """What came of an audit.

    Attributes
    ----------
    output : Path
        Folder of the store, the fleet page and the reports.
    ends : tuple[Ending, ...]
        How each mission stands; see `diagnosis.audit.endings.Ending`.
    skipped, failed, gone : int
        Missions that were done before; that failed (see ``failures.txt``); known ones that are not there any more.
    problems : tuple[str, ...]
        Words, folders and links behind which no mission was found, and what else is to be known.
    unread : bool
        Whether one of them may hide a mission.
    machines : tuple[ListedMachine, ...]
        The machines as the fleet page lists them, worst first; see `diagnosis.audit.fleet.listed.ListedMachine`.
    """

    output: Path
    ends: tuple[Ending, ...]
    skipped: int
    failed: int
    gone: int
    problems: tuple[str, ...] = ()
    unread: bool = False
    machines: tuple[ListedMachine, ...] = ()

    def __repr__(self) -> str:
        missions, machines = len(self.ends), len(self.machines)
        counts = f"{missions} mission{'s' * (missions != 1)} of {machines} machine{'s' * (machines != 1)}"
        return f"<Audit {self.output}: {counts}, {self.failed} failed>"

    @property
    def page(self) -> Path:
        """The fleet page, ``fleet.html``."""
        return self.output / "fleet.html"

    @property
    def missions(self) -> pd.DataFrame:
        """How the missions stand, shape (missions, 11), indexed by ``name``.

        ``state`` (``ok``, ``degraded``, ``unreadable``, ``timeout``, ``out_of_memory``, ``crashed``), ``reason``,
        ``attempts``, ``machine_id``, ``machine_name``, ``verdict``, ``title``, ``report`` (folder below `output`, for
        `mfhca.read_result`), ``faults`` (number), ``severity`` (of the worst), ``limit`` (the limit that it met).
        """
        import pandas as pd

        from diagnosis.audit.endings import Ending

        rows = [{k: str(v) if isinstance(v, str) else v for k, v in asdict(end).items()} for end in self.ends]
        return pd.DataFrame(rows, columns=list(Ending.__dataclass_fields__)).set_index("name")

    def exit_code(self, fail_on: str = "low") -> int:
        """Exit code of `mfhca audit`: 0 no fault, 1 faults, 3 not read or not judged, 70 crashed.

        Parameters
        ----------
        fail_on : str
            Lowest severity that counts as a fault: ``info``, ``low``, ``medium``, ``high``, or ``never``.

        Raises
        ------
        ConfigError
            Where `fail_on` is none of them.
        """
        from diagnosis.api.verdict import check_fail_on
        from diagnosis.audit.endings import NOT_READ, exit_code

        check_fail_on(fail_on)
        return max(exit_code(self.ends, fail_on), NOT_READ if self.unread else 0)


@stated
def audit(
    paths: StrPath | Iterable[StrPath],
    output: StrPath = OUTPUT,
    *,
    machine: StrPath | None = None,
    machine_id: str | None = None,
    jobs: int | None = None,
    memory_mb: float | None = None,
    timeout_s: float = 1800.0,
    cpu_s: float | None = None,
    retries: int = 1,
    resume: bool = True,
    dask: str | None = None,
    baseline: StrPath | None = None,
    trends: Literal["hours", "days"] = "hours",
    max_size_mb: float = 8.0,
    events: Callable[[str, EventFacts], None] | None = None,
) -> Audit:
    """Diagnose every mission behind some paths, as `mfhca audit` does: reports, ``fleet.html``, ``fleet.json``, a store.

    Missions run in processes of their own; what is done and unchanged is left as it is.

    Parameters
    ----------
    paths : str, Path or several
        Folders, logs, globs, or URLs.
    output : str or Path
        Folder of the store, the fleet page and the reports.
    machine : str, Path or None
        Machine file of all missions; None: what their ``mission.toml`` names or the closest ``machine.toml``, else the paper's
        machine.
    machine_id : str or None
        Id of the machine that all missions belong to.
    jobs : int or None
        Missions at once; None: one per processor.
    memory_mb, timeout_s, cpu_s : float or None
        Most memory [MB], time [s] and processor time [s] of each mission; None: a share of the free memory, no limit.
    retries : int
        Further attempts at a mission that crashed or met a limit.
    resume : bool
        Whether missions that are done and unchanged are skipped.
    dask : str or None
        Address of the scheduler of a Dask cluster; None: this machine.
    baseline : str, Path or None
        Store or folder of an audit to compare the fleet with.
    trends : str
        Trends over ``hours`` of driving or over ``days``.
    max_size_mb : float
        Size each page should keep to [MB].
    events : Callable[[str, EventFacts], None] or None
        Called with the name and facts of every event.

    Raises
    ------
    LogError
        Where no mission is found.
    ConfigError
        Where an option or the machine file is wrong.
    OutputError
        Where the output cannot be written.
    """
    given = [paths] if isinstance(paths, str) or not isinstance(paths, Iterable) else list(paths)
    words = tuple(word if isinstance(word, str) and "://" in word else str(path_of(word)) for word in given)
    request = AuditRequest(
        words, path_of(output), None if machine is None else path_of(machine), machine_id, jobs, memory_mb, timeout_s, cpu_s,
        retries, resume, dask, max_size_mb,
    )  # fmt: skip
    request.check()
    if trends not in ("hours", "days"):
        raise ConfigError(f"--trends {trends}: is not known; expected hours or days")
    found, asked = request.found()
    if not found.missions:
        raise LogError("; ".join((none_found(found), *found.problems)))
    return run(request, found, asked, events or (lambda name, facts: None), _store_at(baseline), trends)


def none_found(found: Discovery) -> str:
    """Say that no mission was found."""
    skipped = f" ({found.left_aside} files are not logs)" if found.left_aside else ""
    return f"no mission was found{skipped}"


def _store_at(baseline: StrPath | None) -> Path | None:
    if baseline is None:
        return None
    place = path_of(baseline)
    return place / "fleet.sqlite" if place.is_dir() else place


def run(
    request: AuditRequest,
    found: Discovery,
    asked: AuditOptions,
    emit: Emit,
    baseline: Path | None,
    axis: Literal["hours", "days"],
) -> Audit:
    """Audit missions that were found; see `audit`.

    Parameters
    ----------
    request : AuditRequest
        What is asked for.
    found, asked : Discovery, AuditOptions
        From `AuditRequest.found`.
    emit : Emit
        Takes every event.
    baseline : Path or None
        Store to compare with.
    axis : {"hours", "days"}
        What trends are drawn over.

    Raises
    ------
    LogError
        Where there is no mission.
    ConfigError, OutputError
        See `audit`.
    """
    from diagnosis.audit.session import audit as audit_all

    for text in (*found.problems, *found.notes):
        emit("problem", {"reason": text})
    if not found.missions:
        raise LogError(none_found(found))
    done = audit_all(found, asked, request.engine(asked.isolation), emit, baseline=baseline, axis=axis)
    problems = (*found.problems, *found.notes)
    return Audit(
        asked.output,
        done.ends,
        done.skipped,
        done.failed,
        done.gone,
        problems,
        bool(found.problems),
        done.machines,
    )
