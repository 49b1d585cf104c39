"""Two results of one machine side by side: what is new, worse, gone, unchanged, and what was not assessed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from diagnosis.comparison.coverage import CoverageChange, coverage_changes, sides_of
from diagnosis.comparison.faults import FaultChange, found_faults, is_worse, match_faults
from diagnosis.results.result import to_json
from replay.errors import ConfigError, LogError

SCHEMA = "mfhca-compare/1"
COUNTED = ("new", "worse", "other", "better", "not_seen_again", "resolved", "unchanged")


@dataclass(frozen=True)
class ComparedMission:
    """One of the two results.

    Attributes
    ----------
    name : str
        As given on the command line.
    files : tuple[str, ...]
        Its logs.
    start_ns : int
        Start on the log's clock [ns since 1970].
    duration_s, driving_s : float
        Length, and driving time [s].
    verdict, title : str
        Status and sentence of the verdict.
    machine, machine_id : str
        Name and identity.
    open_loop : bool
        Whether faults were injected into the recording.
    version : str
        Version of the tool that judged it.
    """

    name: str
    files: tuple[str, ...]
    start_ns: int
    duration_s: float
    driving_s: float
    verdict: str
    title: str
    machine: str
    machine_id: str
    open_loop: bool
    version: str


@dataclass(frozen=True)
class MetricChange:
    """Mean |e| [m/s] and mean |u_a| [fraction] of a wheel while driving, ``average`` for all; None: not known."""

    wheel: str
    tracking_error_older: float | None
    tracking_error_newer: float | None
    control_effort_older: float | None
    control_effort_newer: float | None


@dataclass(frozen=True)
class Comparison:
    """What `mfhca compare --json` prints, as the schema ``mfhca-compare/1``.

    Attributes
    ----------
    schema : str
        ``mfhca-compare/1``; fields may be added within it, not change their meaning.
    worse : bool
        Whether a fault of at least low severity is new or worse; it ends with exit code 1.
    counts : Mapping[str, int]
        Faults by outcome: ``new``, ``worse``, ``better`` and ``other`` (changed), ``not_seen_again``, ``resolved``,
        ``unchanged``. All faults of one component and side in one row count once.
    older, newer : ComparedMission
        The two results.
    faults : tuple[FaultChange, ...]
        Each with ``status``, ``trend``, ``older`` and ``newer`` (null where it was not found), ``changes``, ``note``.
    coverage : tuple[CoverageChange, ...]
        Per component and side: how far it was judged, and whether that was ``lost`` or ``gained``.
    metrics : tuple[MetricChange, ...]
        Tracking error and control effort per wheel.
    notes : tuple[str, ...]
        What to bear in mind: order of the missions, settings and versions that differ.
    """

    schema: str
    worse: bool
    counts: Mapping[str, int]
    older: ComparedMission
    newer: ComparedMission
    faults: tuple[FaultChange, ...]
    coverage: tuple[CoverageChange, ...]
    metrics: tuple[MetricChange, ...]
    notes: tuple[str, ...]


def compare_reports(
    older: Mapping[str, Any], newer: Mapping[str, Any], names: tuple[str, str], *, force: bool = False
) -> Comparison:
    """Compare two report documents.

    Parameters
    ----------
    older, newer : Mapping[str, Any]
        Documents of `diagnosis.output.load_report`.
    names : tuple[str, str]
        What to call them.
    force : bool
        Whether to compare even different machines.

    Raises
    ------
    ConfigError
        Where the machines differ and `force` is not set.
    LogError
        Where a document lacks what every report holds.
    """
    a, b = (_mission(r, n) for r, n in zip((older, newer), names, strict=True))
    difference = machine_difference(older["machine"], newer["machine"], names)
    if difference and not force:
        raise ConfigError(f"{difference}; compare two missions of one machine, or add --force")
    try:
        had, has = sides_of(older), sides_of(newer)
        faults = tuple(
            match_faults(found_faults(older["intervals"], had), found_faults(newer["intervals"], has), had, has)
        )
        axles = {*older["machine"].get("axles", ()), *newer["machine"].get("axles", ())}
        coverage = coverage_changes(had, has, axles)
        metrics = _metrics(older, newer)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise LogError(f"{names[0]} or {names[1]}: {_damaged(error)}") from error
    outcomes = [c.trend or c.status for c in faults]
    return Comparison(
        schema=SCHEMA,
        worse=any(is_worse(c) for c in faults),
        counts={name: outcomes.count(name) for name in COUNTED},
        older=a,
        newer=b,
        faults=faults,
        coverage=coverage,
        metrics=metrics,
        notes=tuple(_notes(older, newer, a, b, difference)),
    )


def comparison_json(comparison: Comparison) -> dict[str, Any]:
    """The document of a comparison; see `Comparison`."""
    document: dict[str, Any] = to_json(comparison)
    return document


def _damaged(error: Exception) -> str:
    return f"not a whole report.json ({type(error).__name__}: {error}); run `mfhca diagnose` on the log again to write it anew"


def _mission(report: Mapping[str, Any], name: str) -> ComparedMission:
    try:
        log, machine, verdict = report["log"], report["machine"], report["verdict"]
        return ComparedMission(
            name=name,
            files=tuple(str(f["path"]) for f in log.get("files", ())),
            start_ns=int(log.get("start_ns") or 0),
            duration_s=float(log["duration_s"]),
            driving_s=float(log.get("driving_s") or 0.0),
            verdict=str(verdict["status"]),
            title=str(verdict.get("title", "")),
            machine=str(machine.get("name", "")),
            machine_id=str(machine.get("id") or ""),
            open_loop=bool(log.get("open_loop", False)),
            version=str(report.get("tool", {}).get("version", "")),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise LogError(f"{name}: {_damaged(error)}") from error


def machine_difference(older: Mapping[str, Any], newer: Mapping[str, Any], names: tuple[str, str]) -> str:
    """Say how two machines of reports differ; empty where nothing shows that they do."""
    ids = [str(m.get("id") or "") for m in (older, newer)]
    wheels = [[str(w) for w in m.get("wheels", ())] for m in (older, newer)]
    if all(ids) and ids[0] != ids[1]:
        return f"{names[1]}: is of machine {ids[1]}, {names[0]} of machine {ids[0]}"
    if set(wheels[0]) != set(wheels[1]):
        return f"{names[1]}: is of a machine with the wheels {_listed(wheels[1])}, {names[0]} of one with {_listed(wheels[0])}"
    return ""


def _listed(names: list[str]) -> str:
    return ", ".join(names) or "none"


def _notes(
    older: Mapping[str, Any], newer: Mapping[str, Any], a: ComparedMission, b: ComparedMission, difference: str
) -> list[str]:
    out = [f"Different machines, compared with --force: {difference}."] if difference else []
    hashes = [{f.get("sha256") for f in r["log"].get("files", ())} - {None} for r in (older, newer)]
    if hashes[0] and hashes[0] == hashes[1]:
        out.append("Both results are of the same log.")
    elif b.start_ns < a.start_ns:
        out.append(
            f"{b.name} was recorded before {a.name} by their logs' clocks: what is called new and resolved here is the "
            "other way round unless a clock was wrong. The older one is given first."
        )
    elif b.start_ns < a.start_ns + a.duration_s * 1e9:
        same = "start at the same moment" if a.start_ns == b.start_ns else "overlap in time"
        out.append(f"The two missions {same} by their logs' clocks, so that their order cannot be checked.")
    if not difference and not (a.machine_id and b.machine_id):
        out.append(
            "That both are of one machine cannot be checked: "
            + (
                f"{(a if not a.machine_id else b).name} states no machine id."
                if a.machine_id or b.machine_id
                else "neither states a machine id."
            )
            + " Give it as machine.id in the machine file, or with --machine-id."
        )
    out += [f"Faults were injected into the recording of {m.name}." for m in (a, b) if m.open_loop]
    if a.version != b.version:
        out.append(f"They were judged by different versions of the tool ({a.version or '?'}, {b.version or '?'}).")
    limits = [r.get("limits") or {} for r in (older, newer)]
    differing = [k for k in dict.fromkeys([*limits[0], *limits[1]]) if limits[0].get(k) != limits[1].get(k)]
    if differing and limits[0] and limits[1]:
        words = ", ".join(f"{k} {limits[0].get(k)} and {limits[1].get(k)}" for k in differing)
        out.append(f"They were judged by different [limits]: {words}.")
    return out


def _metrics(older: Mapping[str, Any], newer: Mapping[str, Any]) -> tuple[MetricChange, ...]:
    tables = []
    for report in (older, newer):
        metrics = report.get("metrics") or {}
        tables.append({**(metrics.get("wheels") or {}), "average": metrics.get("average") or {}})
    names = [n for n in dict.fromkeys([*tables[0], *tables[1]]) if n != "average"]
    out = []
    for name in [*names, "average"]:
        values = [
            (t.get(name, {}).get(q) or {}).get("driving") for q in ("tracking_error", "control_effort") for t in tables
        ]
        if any(v is not None for v in values):
            out.append(MetricChange(name, *values))
    return tuple(out)
