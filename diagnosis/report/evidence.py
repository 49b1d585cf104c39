"""What the page shows of each fault beside the linked plots: on what it rests, its edges and its course."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from diagnosis.pages.labels import clock, grouped, number
from diagnosis.report.compared_channels import Pair, pair_of, rests_on, shape_sentence
from diagnosis.report.edges import edge_of, edge_words, time_words
from diagnosis.report.momentary import momentary_words
from diagnosis.report.panels import course_picture, edge_picture
from diagnosis.report.plot_rows import course_rows
from diagnosis.report.rows import Columns, Row
from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.machine_words import words_of
from diagnosis.results.result import Closeups

Stretch = tuple[Columns, tuple[float, float]]

_COURSES = 40


@dataclass(frozen=True)
class Panel:
    """One small picture: heading, what stands beside it, the picture, a sentence below."""

    title: str
    unit: str
    picture: Markup
    words: str = ""


@dataclass(frozen=True)
class Evidence:
    """Everything of one fault that is drawn without JavaScript.

    Attributes
    ----------
    rests : str
        Kind of evidence and channels.
    delay : str
        When the fault would have been raised.
    shape : str
        What the onset's shape says; empty where nothing was said.
    keys : tuple[tuple[str, str], ...]
        Marks and what they stand for.
    edges, course : tuple[Panel, ...]
        Pictures of onset and end, and of the whole fault.
    note : str
        What keeps the pictures from showing every recorded sample.
    momentary : str
        Which row is the most probable from moment to moment, where that is not the stated one; else empty.
    """

    rests: str
    delay: str
    shape: str
    keys: tuple[tuple[str, str], ...]
    edges: tuple[Panel, ...]
    course: tuple[Panel, ...]
    note: str
    momentary: str = ""


def evidence_of(
    report: ReportDocument,
    columns: Columns,
    axis: tuple[float, float],
    per: int = 1,
    faults: Sequence[IntervalRow] | None = None,
    closeups: Closeups | None = None,
) -> dict[str, Evidence]:
    """Evidence of faults by their names; the course is drawn for the first ones only.

    Parameters
    ----------
    report : ReportDocument
        The document.
    columns : Columns
        Columns that hold samples.
    axis : tuple[float, float]
        Time of the first row and between rows [s].
    per : int
        Samples whose extremes two rows hold, 1 where each row is a sample.
    faults : Sequence[IntervalRow] or None
        Those of the report's intervals that are wanted; None: all.
    closeups : Closeups or None
        Where rows are extremes: the samples from which onset and end can be drawn.
    """
    limit, every, words = report["limits"]["min_probability"], report["intervals"], words_of(report["machine"])
    rates = {s["name"]: s["rate_hz"] for s in report["signals"]}
    peers: dict[str, list[IntervalRow]] = {}
    for fault in every:
        peers.setdefault(fault["component"], []).append(fault)
    step = axis[1] if per == 1 else 2 * axis[1] / per
    stretches = _stretches(closeups, axis[0], step)
    out = {}
    for i, fault in enumerate(every if faults is None else faults):
        pair = pair_of(fault, columns, words)
        whole = (columns, axis) if per == 1 else None
        edges = _edges(fault, peers[fault["component"]], pair, whole, stretches) if pair else ()
        course = _course(fault, pair, columns, axis, limit) if pair and i < _COURSES else ()
        keys = _keys(pair) if pair and edges else ()
        note = _note(pair, rates, step) if pair and edges else _missing(pair, columns, per)
        out[fault["id"]] = Evidence(
            rests_on(fault, {*columns, *rates}, words),
            delay_words(fault),
            shape_sentence(fault),
            keys,
            edges,
            course,
            note,
            momentary_words(fault, columns, axis, per),
        )
    return out


def delay_words(fault: IntervalRow) -> str:
    """When a causal reading of the same evidence would have raised a fault."""
    detected = fault["detected_s"]
    if detected is None:
        return "when it would have been detected is not known"
    delay = detected - fault["start_s"]
    return f"detected {time_words(delay)} after onset" if delay > 0 else "detected at its first sample"


def _keys(pair: Pair) -> tuple[tuple[str, str], ...]:
    keys = [("smp", pair.measured)]
    return (*keys, ("ref", f"{pair.reference} ({pair.words})")) if pair.reference else tuple(keys)


def _note(pair: Pair, rates: Mapping[str, float | None], step: float) -> str:
    """Channels that are slower than the time axis: between their samples the last one stands."""
    rate = 1.0 / step
    slow = [n for n in (pair.measured, pair.reference) if n and (rates.get(n) or rate) < 0.75 * rate]
    each = ", ".join(f"{n} came at {number(rates[n])} Hz" for n in slow)
    return f"{each}; until its next sample the last one is shown at {number(rate)} Hz." if slow else ""


def _missing(pair: Pair | None, columns: Columns, per: int) -> str:
    """Why a fault has no pictures of its edges; empty where the whole page has none."""
    if not columns:
        return ""
    if pair is None:
        return "The channel of this fault is not among the saved time series."
    return (
        f"Of this long mission the smallest and largest of every {grouped(per)} samples are kept, "
        "so single samples around onset and end cannot be shown."
    )


def _stretches(closeups: Closeups | None, start: float, step: float) -> list[Stretch]:
    """Stretches with every sample: their columns, and time of their first sample and between samples [s]."""
    if closeups is None:
        return []
    return [
        ({k: v[a:b] for k, v in closeups.columns.items()}, (start + float(closeups.step[a]) * step, step))
        for a, b in closeups.runs()
    ]


def _holds(part: Stretch, pair: Pair, at: float) -> bool:
    """Whether a stretch has the pair's samples at a time."""
    columns, (start, step) = part
    names = {pair.measured, *([pair.reference] if pair.reference else [])}
    return names <= set(columns) and -0.5 <= (at - start) / step <= len(columns[pair.measured]) + 0.5


def _edges(
    fault: IntervalRow,
    faults: Sequence[IntervalRow],
    pair: Pair,
    whole: Stretch | None,
    parts: Sequence[Stretch],
) -> tuple[Panel, ...]:
    out = []
    for name, at in (("onset", fault["start_s"]), ("end", fault["stop_s"])):
        part = whole or next((p for p in parts if _holds(p, pair, at)), None)
        if part is None:
            continue
        edge = edge_of(name, fault, faults, pair, *part)
        title = f"{name.capitalize()} at {clock(at, 3)}"
        if edge is None:
            where = "begins with" if name == "onset" else "lasts to the end of"
            out.append(Panel(title, "", Markup(""), f"The fault {where} the samples of {pair.measured}."))
        else:
            out.append(Panel(title, pair.unit, edge_picture(edge, fault), edge_words(edge, pair)))
    return tuple(out)


def _course(
    fault: IntervalRow, pair: Pair, columns: Columns, axis: tuple[float, float], limit: float
) -> tuple[Panel, ...]:
    """Channel against reference, residual against threshold, probability against its limit: those that exist."""
    rows = course_rows(fault, pair, columns, limit)
    panels = (
        Panel(r.title, "" if r.unit == "1" else r.unit, course_picture(r, fault, columns, axis), _marks(r))
        for r in rows
    )
    return tuple(p for p in panels if p.picture)


def _marks(row: Row) -> str:
    """What a row shows beside the measured curve, to follow its title and unit."""
    dashed = "".join(f", dashed the {t.label}" for t in row.traces if t.role == "reference")
    return dashed + (", band: ± threshold" if row.threshold else "")
