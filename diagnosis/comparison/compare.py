"""Two results of one machine side by side: what is new, worse, gone, unchanged, and what was not assessed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from diagnosis.comparison.coverage import CoverageChange, coverage_changes, sides_of
from diagnosis.comparison.faults import FaultChange, is_worse, match_faults
from diagnosis.comparison.found import FoundFault, found_faults
from diagnosis.comparison.gone import Newer
from diagnosis.comparison.losses import losses_of_both
from diagnosis.results.comparison_document import SCHEMA, ComparisonDocument, Outcome
from diagnosis.results.document import LimitsRow, MachineIdentity, ReportDocument
from diagnosis.results.machine_words import words_of
from diagnosis.results.result import to_json
from diagnosis.results.vocabulary import Severity, Verdict
from diagnosis.results.words_row import WordsRow
from replay.errors import ConfigError

COUNTED: tuple[Outcome, ...] = ("new", "worse", "other", "better", "not_seen_again", "resolved", "unchanged")


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
    verdict : Verdict
        Status.
    title : str
        Sentence of it.
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
    verdict: Verdict
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
    words : WordsRow
        How to speak of the machine, by the newer result.
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
    words: WordsRow


def compare_reports(
    older: ReportDocument, newer: ReportDocument, names: tuple[str, str], *, force: bool = False
) -> Comparison:
    """Compare two report documents.

    Parameters
    ----------
    older, newer : ReportDocument
        Documents of `diagnosis.output.load_report`.
    names : tuple[str, str]
        What to call them.
    force : bool
        Whether to compare even different machines.

    Raises
    ------
    ConfigError
        Where the machines differ and `force` is not set.
    """
    a, b = (_mission(r, n) for r, n in zip((older, newer), names, strict=True))
    difference = machine_difference(older["machine"], newer["machine"], names)
    if difference and not force:
        raise ConfigError(f"{difference}; compare two missions of one machine, or add --force")
    had, has = sides_of(older), sides_of(newer)
    words = words_of(newer["machine"])
    seen = Newer(has, newer["detectability"]["rows"], newer["limits"]["clear_at"], _not_later(older, newer, a, b))
    losses = losses_of_both(older, newer)
    faults = tuple(match_faults(found_faults(older, had), found_faults(newer, has), had, seen, words, losses))
    gone = [c.older for c in faults if c.status == "not_seen_again" and c.older is not None]
    axles = {*older["machine"]["axles"], *newer["machine"]["axles"]}
    outcomes: list[str] = [c.trend or c.status for c in faults]
    return Comparison(
        schema=SCHEMA,
        worse=any(is_worse(c) for c in faults),
        counts={name: outcomes.count(name) for name in COUNTED},
        older=a,
        newer=b,
        faults=faults,
        coverage=coverage_changes(had, has, axles),
        metrics=_metrics(older, newer),
        notes=tuple(_notes(older, newer, a, b, difference, gone)),
        words=words.row(),
    )


def comparison_json(comparison: Comparison) -> ComparisonDocument:
    """The document of a comparison; see `Comparison`."""
    document: ComparisonDocument = to_json(comparison)
    return document


def _mission(report: ReportDocument, name: str) -> ComparedMission:
    log, machine, verdict = report["log"], report["machine"], report["verdict"]
    return ComparedMission(
        name=name,
        files=tuple(f["path"] for f in log["files"]),
        start_ns=log["start_ns"],
        duration_s=log["duration_s"],
        driving_s=log["driving_s"],
        verdict=verdict["status"],
        title=verdict["title"],
        machine=machine["name"],
        machine_id=machine["id"],
        open_loop=log["open_loop"],
        version=report["tool"]["version"],
    )


def machine_difference(older: MachineIdentity, newer: MachineIdentity, names: tuple[str, str]) -> str:
    """Say how two machines of reports differ; empty where nothing shows that they do."""
    ids = older["id"], newer["id"]
    wheels = older["wheels"], newer["wheels"]
    if all(ids) and ids[0] != ids[1]:
        return f"{names[1]}: is of machine {ids[1]}, {names[0]} of machine {ids[0]}"
    if set(wheels[0]) != set(wheels[1]):
        return f"{names[1]}: is of a machine with the wheels {_listed(wheels[1])}, {names[0]} of one with {_listed(wheels[0])}"
    return ""


def _listed(names: list[str]) -> str:
    return ", ".join(names) or "none"


def _not_later(older: ReportDocument, newer: ReportDocument, a: ComparedMission, b: ComparedMission) -> str:
    """Why the newer mission is not known to come after the older one, in a sentence; empty where it does, or no clock says otherwise."""
    if _is_same_log(older, newer):
        return "Both results are of the same log, which shows no repair."
    if min(a.start_ns, b.start_ns) > 0 and b.start_ns < a.start_ns + a.duration_s * 1e9:
        return "By the clocks of the logs the mission without it does not come after the one with it."
    return ""


def _is_same_log(older: ReportDocument, newer: ReportDocument) -> bool:
    hashes = [{f["sha256"] for f in r["log"]["files"]} for r in (older, newer)]
    return bool(hashes[0]) and hashes[0] == hashes[1]


def _notes(
    older: ReportDocument,
    newer: ReportDocument,
    a: ComparedMission,
    b: ComparedMission,
    difference: str,
    open_: Sequence[FoundFault],
) -> list[str]:
    out = [f"Different machines, compared with --force: {difference}."] if difference else []
    if _is_same_log(older, newer):
        out.append("Both results are of the same log.")
    elif b.start_ns < a.start_ns:
        out.append(
            f"By the clocks of their logs, {b.name} was recorded before {a.name}. Give the older one first: unless a clock was "
            "wrong, new and resolved are swapped here."
        )
    elif b.start_ns < a.start_ns + a.duration_s * 1e9:
        same = "start at the same moment" if a.start_ns == b.start_ns else "overlap in time"
        out.append(f"By the clocks of their logs, the two missions {same}, so their order cannot be checked.")
    if not difference and not (a.machine_id and b.machine_id):
        out.append(
            "It cannot be checked whether both are of one machine: "
            + (
                f"{(a if not a.machine_id else b).name} states no machine id."
                if a.machine_id or b.machine_id
                else "neither states a machine id."
            )
            + " Give it as machine.id in the machine file, or with --machine-id."
        )
    out += [f"Faults were injected into the recording of {m.name}." for m in (a, b) if m.open_loop]
    severe = [f for f in open_ if f.severity is Severity.HIGH]
    if severe and b.verdict is Verdict.READY:
        out.append(
            f"The verdict of {b.name} is of that mission alone: a severe fault of the older one is not shown to be repaired, and is open."
        )
    if a.version != b.version:
        out.append(f"They were judged by different versions of the tool ({a.version or '?'}, {b.version or '?'}).")
    out += _different_limits(older["limits"], newer["limits"])
    return out


def _different_limits(older: LimitsRow, newer: LimitsRow) -> list[str]:
    """Sentence that names the limits by which the two were judged differently; none where there are none."""
    before, now = dict(older), dict(newer)
    names = [k for k in dict.fromkeys([*before, *now]) if before.get(k) != now.get(k)]
    words = ", ".join(f"{k} {before.get(k)} and {now.get(k)}" for k in names)
    return [f"They were judged by different [limits]: {words}."] if names else []


def _metrics(older: ReportDocument, newer: ReportDocument) -> tuple[MetricChange, ...]:
    tables = [{**r["metrics"]["wheels"], "average": r["metrics"]["average"]} for r in (older, newer)]
    names = [n for n in dict.fromkeys([*tables[0], *tables[1]]) if n != "average"]
    out = []
    for name in [*names, "average"]:
        a, b = (t.get(name) for t in tables)
        values = (
            None if a is None else a["tracking_error"]["driving"],
            None if b is None else b["tracking_error"]["driving"],
            None if a is None else a["control_effort"]["driving"],
            None if b is None else b["control_effort"]["driving"],
        )
        if any(v is not None for v in values):
            out.append(MetricChange(name, *values))
    return tuple(out)
