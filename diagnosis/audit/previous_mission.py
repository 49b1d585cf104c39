"""The mission of the same machine before a given one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from diagnosis.audit.fleet.read import CALENDAR_NS
from diagnosis.audit.store.folders import holds_report
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.store import Store
from diagnosis.results.document import ReportDocument
from replay.errors import LogError

_QUERY = (
    "SELECT b.id AS id, min(m.name) AS name, b.report AS report, b.start_ns AS start_ns, "
    "b.log_hash, b.config_hash, b.version FROM result a "
    "JOIN result b ON b.machine_id = a.machine_id AND b.start_ns < a.start_ns AND b.start_ns >= ? "
    "JOIN mission m ON m.result = b.id "
    "WHERE a.id = ? AND a.machine_id <> '' AND b.verdict IS NOT NULL AND b.report IS NOT NULL "
    "GROUP BY b.id ORDER BY b.start_ns DESC, b.id DESC LIMIT 1"
)


@dataclass(frozen=True)
class Previous:
    """A mission and where its report stands.

    Attributes
    ----------
    result : int
        Its row of ``result``.
    name : str
        Name of the mission; the first of its copies.
    report : str
        Folder of its report, relative to the store's.
    start_ns : int
        Start on the log's clock [ns since 1970].
    key : Key
        Of its result.
    """

    result: int
    name: str
    report: str
    start_ns: int
    key: Key


def previous_of(store: Store, result: int) -> Previous | None:
    """The judged mission of the same machine that started last before this one.

    None where there is none, where the machine has no identity, or where the log's clock does not know the date.

    Raises
    ------
    OutputError
        Where the store cannot be read.
    """
    rows = store.database.rows(_QUERY, (CALENDAR_NS, result))
    if not rows:
        return None
    number, name, report, start_ns, *key = rows[0]
    return Previous(number, name, report, start_ns, Key(*key))


def previous_report(store: Store, result: int) -> tuple[Previous, ReportDocument] | None:
    """The same with its ``report.json``; None also where that can no longer be read, or another result's stands there.

    Raises
    ------
    OutputError
        Where the store cannot be read.
    """
    from diagnosis.output import load_report

    previous = previous_of(store, result)
    if previous is None:
        return None
    folder = Path(store.folder) / previous.report
    if not holds_report(folder, previous.key):
        return None
    try:
        return previous, load_report(folder / "report.json")
    except LogError:
        return None
