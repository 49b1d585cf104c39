"""The fleet of an audit as page, document and table: `fleet.html`, `fleet.json` and `fleet.csv` beside the store."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import orjson

from diagnosis.audit.fleet.document import Fleet, fleet_document, fleet_of
from diagnosis.audit.fleet.elsewhere import copies_elsewhere
from diagnosis.audit.fleet.first_seen import first_seen_times, newest_result_ns, without_false_dates
from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.audit.fleet.gather import machines_of
from diagnosis.audit.fleet.news import first_runs
from diagnosis.audit.fleet.open_points import open_points, suspected_parts
from diagnosis.audit.fleet.read import Mission, content_mark, fleet_repairs, read_missions, read_notes, read_run
from diagnosis.audit.fleet.runs import Limits
from diagnosis.audit.fleet.table import fleet_csv
from diagnosis.audit.fleet.trend_types import Axis
from diagnosis.audit.store.database import unless_damaged
from diagnosis.audit.store.folders import holds_report
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.store import FILE_NAME
from diagnosis.results.document import ReportDocument
from diagnosis.results.machine_words import words_of
from replay.atomic_write import atomic_path
from replay.errors import ConfigError

_MOST_BYTES = 50_000_000
_FAULT_S = 10.0  # length of the faults by which missions are asked whether they would have shown one


@dataclass(frozen=True)
class FleetFiles:
    """Where the three stand."""

    html: Path
    json: Path
    csv: Path


def write_fleet(store_path: Path, out: Path, *, baseline: Path | None = None, axis: Axis = "hours") -> FleetFiles:
    """Read the store and write page, document and table; each appears whole or not at all.

    Parameters
    ----------
    store_path : Path
        ``fleet.sqlite`` of an audit, or the folder that holds it.
    out : Path
        Folder of the audit, to which the reports' folders in the store are relative.
    baseline : Path or None
        Store of another, earlier audit to compare with, or its folder.
    axis : str
        Trends over ``hours`` of driving or ``days``.

    Raises
    ------
    ConfigError
        Where the baseline is the store itself.
    OutputError
        Where a store cannot be read, or a file cannot be written.
    """
    if baseline is not None:
        check_baseline(baseline, store_path)
    files = FleetFiles(out / "fleet.html", out / "fleet.json", out / "fleet.csv")
    with _uncollected(), unless_damaged(_store(store_path)):
        contents = _contents(store_path, out, baseline, axis)
    for path, content in zip((files.json, files.csv, files.html), contents, strict=True):
        with atomic_path(path) as temporary:
            temporary.write_bytes(content)
    return files


def _contents(store_path: Path, out: Path, baseline: Path | None, axis: Axis) -> tuple[bytes, bytes, bytes]:
    """Document, table and page; all else is gone before the search for cycles sets in again."""
    from diagnosis.audit.fleet.page.page import build_fleet_page

    mark = content_mark(store_path)  # first: what is written meanwhile makes the page an old one
    fleet = load_fleet(store_path, out, axis)
    fleet = replace(fleet, first_runs=first_runs(out / "fleet.json", fleet.missions, fleet.run))
    document = fleet_json(fleet, baseline)
    document["mark"] = mark
    return (
        orjson.dumps(document, option=orjson.OPT_APPEND_NEWLINE),
        fleet_csv(document).encode("utf-8-sig", "backslashreplace"),
        build_fleet_page(document).encode("utf-8", "backslashreplace"),
    )


@contextmanager
def _uncollected() -> Iterator[None]:
    """Do without the search for cycles, of which a fleet's millions of rows hold none, and which takes a third of the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def check_baseline(baseline: Path, store_path: Path) -> None:
    """See that a store to compare with can be read and is another one.

    Raises
    ------
    ConfigError
        Where it is the store itself.
    OutputError
        Where it cannot be read.
    """
    if _store(baseline).resolve() == _store(store_path).resolve():
        raise ConfigError(
            f"--baseline {baseline}: is the store of this audit itself; give that of another, earlier audit"
        )
    content_mark(baseline)


def load_fleet(store_path: Path, out: Path | None = None, axis: Axis = "hours") -> Fleet:
    """Missions, machines and trends of a store.

    Parameters
    ----------
    store_path : Path
        Store or its folder.
    out : Path or None
        Folder of the reports; None for the store's. Where a machine's last report is not there, its limits are the
        defaults.
    axis : str
        ``hours`` or ``days``.

    Raises
    ------
    OutputError
        Where the store cannot be read.
    """
    with _uncollected():
        place = _store(store_path).parent
        folder = out if out is not None else place
        missions = [_with_own_report(mission, str(folder)) for mission in read_missions(store_path)]
        first_seen = first_seen_times(place, missions)
        missions = without_false_dates(missions, first_seen)
        copies = copies_elsewhere(missions, first_seen, str(place))
        machines, unknown = machines_of(
            [m for m in missions if m.name not in copies],
            lambda report: _limits(folder / report / "report.json"),
            first_seen,
            str(place),
            fleet_repairs(store_path),
        )
        fleet = fleet_of(machines, missions, axis, unknown)
        made_ns, notes = newest_result_ns(place, missions), read_notes(store_path)
        return replace(fleet, run=read_run(store_path), made_ns=made_ns, notes=notes, copies=copies)


def fleet_json(fleet: Fleet, baseline: Path | None = None) -> FleetDocument:
    """Document of a fleet, compared with an earlier audit where one is given.

    Raises
    ------
    OutputError
        Where the baseline cannot be read.
    """
    if baseline is None:
        return fleet_document(fleet)
    from diagnosis.audit.fleet.compare import compare_fleets

    return fleet_document(fleet, compare_fleets(load_fleet(baseline), fleet))


def _store(path: Path) -> Path:
    """Store at a path, or in a folder."""
    return path / FILE_NAME if path.is_dir() else path


def _with_own_report(mission: Mission, folder: str) -> Mission:
    """Mission without the report of its result where another result's report has taken that one's place."""
    result = mission.result
    if result is None or result.report is None:
        return mission
    place = os.path.join(folder, result.report)  # noqa: PTH118 - asked of every mission of a fleet
    if holds_report(place, Key(result.log_hash, result.config_hash, result.version)):
        return mission
    return replace(mission, result=replace(result, report=None))


def _limits(path: Path) -> Limits:
    """Limits and components from a machine's last report; defaults where it cannot be read."""
    try:
        if path.stat().st_size > _MOST_BYTES:
            return Limits()
        report: ReportDocument = orjson.loads(path.read_bytes())
        limits, machine = report["limits"], report["machine"]
        return Limits(
            min_epsilon=float(limits["min_epsilon"]),
            min_assessed=float(limits["min_assessed"]),
            wheels=tuple(map(str, machine["wheels"])),
            axles=tuple(map(str, machine["axles"])),
            cleared=report["verdict"]["cleared"],
            not_cleared=str(report["verdict"].get("not_cleared", "")),
            open_points=open_points(report),
            suspected=suspected_parts(report),
            holds_open=bool(report.get("previous", {}).get("open_faults")),
            found={
                (r["component"], r["side"], r["deviation"]): float(r["share"])
                for r in report.get("detectability", {}).get("rows", ())
                if r["for_s"] == _FAULT_S and r["share"] is not None
            },
            words=words_of(machine),
        )
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return Limits()
