"""The mission report: one HTML file that works offline, from its own text alone.

Words, tables, timeline and thumbnails are in the page's markup and need no JavaScript. Plots are drawn in the page by
plotly.js, which is taken from the installed plotly package and embedded compressed. A content security policy admits
exactly the embedded scripts and no request. Of thousands of faults all stand in the table; the most severe have their
evidence in the markup, the others get it from the page's scripts.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import jinja2
import numpy as np
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup, escape
from numpy.typing import NDArray

from diagnosis.decision.wording import join_words
from diagnosis.pages import labels
from diagnosis.pages.environment import SHARED, asset, environment, shared_style, unbroken
from diagnosis.pages.scripts import packed, packed_plotly, script_policy
from diagnosis.pages.svg import icon
from diagnosis.report import tables
from diagnosis.report.compared_channels import pair_of
from diagnosis.report.driven_path import driven_path
from diagnosis.report.evidence import evidence_of
from diagnosis.report.fleet_note import fleet_section, repaired_faults
from diagnosis.report.healthy_lanes import healthy_lanes
from diagnosis.report.machine_lane import machine_lane
from diagnosis.report.machine_picture import axles_in_words, machine_picture, places_in_words
from diagnosis.report.path_picture import path_picture, unnamed_words
from diagnosis.report.plot_data import Axis, axis_of, blocks_of, channels_of, figures_of, packed_intervals, view, worst
from diagnosis.report.plot_rows import loop_groups
from diagnosis.report.previous import previous_section
from diagnosis.report.rows import Columns, derived
from diagnosis.report.shown import HEADS, longer_is_harder, shown_lanes, shown_parts
from diagnosis.report.thumbnail import thumbnail
from diagnosis.report.timeline import timeline
from diagnosis.results.document import IntervalRow, ReportDocument
from diagnosis.results.fault_rows import FAULT_ROWS, state_label
from diagnosis.results.machine_words import MachineWords, words_of
from diagnosis.results.result import Closeups
from replay.faults import FaultMode

_ASSETS = Path(__file__).parent / "assets"
_STYLES = (_ASSETS / "evidence.css", _ASSETS / "explorer.css", _ASSETS / "reading.css", _ASSETS / "print.css")
_FIRST = _ASSETS / "data.js"
#: Scripts that a page holds packed, and expands when it is opened.
_MAIN = tuple(
    _ASSETS / name
    for name in (
        "figure_looks.js",
        "plot.js",
        "export.js",
        "explorer.js",
        "sight.js",
        "address.js",
        "stage.js",
        "page.js",
    )
)
#: Scripts that it expands when its first plot is drawn.
_LATER = tuple(
    _ASSETS / name for name in ("reading.js", "pictures.js", "lanes.js", "replay.js", "views.js", "whatif.js")
)
_LISTED, _THUMBNAILS, _DETAILED = 5000, 300, 120


@dataclass(frozen=True)
class _Series:
    """Time series of a page: all with their axis, those that hold samples, and these with what is derived from them."""

    all: Columns
    filled: Columns
    shown: Columns
    closeups: Closeups | None
    axis: Axis

    @property
    def place(self) -> tuple[float, float]:
        """Time of the first row and between rows [s]."""
        return self.axis.start, self.axis.step


@np.errstate(over="ignore", invalid="ignore")  # a column may hold infinite and absurd values
def build_page(
    report: ReportDocument,
    columns: Mapping[str, NDArray[np.floating]],
    *,
    closeups: Closeups | None = None,
    max_size_mb: float = 8.0,
    plotlyjs: Path | None = None,
) -> str:
    """Page for one diagnosed mission; the same input gives the same text.

    Parameters
    ----------
    report : ReportDocument
        The document.
    columns : Mapping[str, NDArray[np.floating]], each of shape (n,)
        Time series on the uniform axis ``t`` [s]; NaN where there is no sample. May be empty.
    closeups : Closeups or None
        Every sample of some stretches, where the columns of a long mission are envelopes.
    max_size_mb : float
        Size the page should keep to [MB]; beyond it, extremes per block stand for samples except around faults.
    plotlyjs : Path or None
        Bundle of plotly.js to embed instead of the installed package's.

    Raises
    ------
    ConfigError
        Where `plotlyjs` cannot be read.
    ValueError
        Where the columns differ in length or ``t`` is not uniform.
    """
    whole = labels.made_visible(report)
    report = {**whole, "intervals": worst(whole["intervals"], _LISTED)}
    intervals = packed_intervals(report["intervals"])
    detailed = worst(report["intervals"], _DETAILED)
    series = _series(report, columns, closeups)
    duration = _duration(report, series.axis)
    plots = len(series.filled) > 1
    plotly, bundle, version = packed_plotly(plotlyjs) if plots else ("", "", "none, no plots")
    main, later = ("\n".join(asset(path) for path in paths) for paths in (_MAIN, _LATER))
    evidence = evidence_of(report, series.shown, series.place, series.axis.per, detailed, series.closeups)
    drawn = sum(len(p.picture) for e in evidence.values() for p in (*e.edges, *e.course))
    words = 470_000 + 6_000 * len(detailed) + 1_500 * len(report["intervals"]) + len(intervals)
    budget = max(int(max_size_mb * 1e6) - len(bundle) - words - drawn, 200_000)
    context = {
        **tables.context(report, duration),
        **_pictures(report, detailed, series, duration),
        **_plots(report, detailed, series, duration, budget),
        **_scripts([main, plotly, later] if plots else [main]),
        "main": Markup(packed(main.encode())),
        "later": Markup(packed(later.encode()) if plots else ""),
        "previous": previous_section(report),
        "fleet": fleet_section(report),
        "repaired": repaired_faults(report),
        "evidence": evidence,
        "unlisted": len(whole["intervals"]) - len(report["intervals"]),
        "has_plots": plots,
        "empty": [k for k in series.all if k not in series.filled],
        "plotly": Markup(bundle),
        "plotly_version": version,
    }
    context["blocks"].append(("intervals", Markup(intervals)))
    return _environment().get_template("template.html.j2").render(context)


def _series(report: ReportDocument, columns: Columns, closeups: Closeups | None) -> _Series:
    """Columns with visible names, and what the plots derive from them."""
    every = {labels.visible(k): np.asarray(v) for k, v in columns.items()}
    axis = axis_of(every, report["log"]["rate_hz"])
    filled = {k: v for k, v in every.items() if np.isfinite(v).any()} if axis.rows else {}
    near = None
    if closeups is not None:
        samples = {labels.visible(k): v for k, v in closeups.columns.items()}
        times = axis.start + closeups.step * axis.sample_s, axis.sample_s
        near = Closeups(closeups.step, derived(samples, report, times))
    return _Series(every, filled, derived(filled, report), near, axis)


def _pictures(
    report: ReportDocument, detailed: Sequence[IntervalRow], series: _Series, duration: float
) -> tables.Context:
    """Timeline, machine, driven path and thumbnails."""
    words, parts = words_of(report["machine"]), shown_parts(report)
    path = driven_path(report, series.filled, series.axis.step)
    thumbs = worst(report["intervals"], _THUMBNAILS) if series.axis.rows else []
    return {
        "shown": {
            "parts": parts,
            "gaps": any(not cell for part in parts for cell in part.cells),
            "longer": longer_is_harder(report),
            "lanes": shown_lanes(report, duration),
            "heads": HEADS,
        },
        "timeline": timeline(report, duration, {f["id"] for f in detailed}),
        "machine_lane": machine_lane(report, duration),
        "duration": duration,
        "lane_details": healthy_lanes(report),
        "picture": machine_picture(report),
        "picture_notes": axles_in_words(report),
        "places": places_in_words(report),
        "path": Markup("")
        if path.x is None or path.y is None
        else path_picture(path.x, path.y, *series.place, detailed),
        "path_words": path.words + ("" if path.x is None else unnamed_words(detailed)),
        "tested": join_words(list(dict.fromkeys(row.words for row in FAULT_ROWS))),
        "path_modes": [m for m in FaultMode if any(f["mode"] == m for f in detailed)],
        "thumbs": {f["id"]: _thumbnail(f, words, series.shown, *series.place) for f in thumbs},
    }


def _plots(
    report: ReportDocument, detailed: Sequence[IntervalRow], series: _Series, duration: float, budget: int
) -> tables.Context:
    """Rows of the linked plots and the encoded columns behind them, within a budget [bytes]."""
    machine, shown, axis = report["machine"], series.shown, series.axis
    figures = figures_of(report["intervals"], machine, shown, report["limits"]["min_probability"])
    groups = loop_groups(machine["wheels"], machine["axles"], shown, words_of(machine))
    worst_alone: ReportDocument = {**report, "intervals": list(detailed)}
    channels = channels_of(worst_alone, shown, figures, groups, axis, budget, series.closeups)
    return {
        "groups": groups,
        # base64, megabytes of it, holds nothing to escape
        "blocks": [(f"b{i}", Markup(s.text)) for i, s in enumerate(blocks_of(channels))],
        "view": htmlsafe_json_dumps(view(report, channels, figures, groups, axis, duration), sort_keys=True),
    }


def _scripts(expanded: Sequence[str]) -> tables.Context:
    """Style, scripts, and the policy that admits these scripts and those that the page expands."""
    head, scripts = asset(SHARED / "theme.js"), [asset(_FIRST)]
    return {
        "css": Markup(shared_style() + "".join(asset(path) for path in _STYLES)),
        "head": Markup(head),
        "scripts": [Markup(s) for s in scripts],
        "csp": script_policy([head, *scripts, *expanded]),
    }


def _duration(report: ReportDocument, axis: Axis) -> float:
    rows = (*report["states"], *report["phases"], *report["intervals"])
    columns_end = axis.start + axis.step * axis.rows if axis.rows else 0.0
    return max(report["log"]["duration_s"], columns_end, *(row["stop_s"] for row in rows), 0.0)


def _thumbnail(fault: IntervalRow, words: MachineWords, columns: Columns, start: float, step: float) -> Markup:
    pair = pair_of(fault, columns, words)
    if pair is None:
        return Markup("")
    return thumbnail(fault, columns[pair.measured], columns[pair.reference] if pair.reference else None, start, step)


def _headed(rows: Markup, heads: Sequence[str]) -> Markup:
    """Rows of a table whose cells carry their column's heading, for screens on which they stand below each other."""

    def row(text: str) -> str:
        words = (str(escape(h.removeprefix(">"))) for h in heads)
        return re.sub(r"<(td|th scope=\"row\")", lambda cell: f'{cell[0]} data-h="{next(words, "")}"', text)

    return Markup("</tr>").join(Markup(row(part)) for part in str(rows).split("</tr>"))


def _coded(text: str) -> Markup:
    """A text whose commands and names, between backticks, are set as such."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(unbroken(text)))))


@lru_cache
def _environment() -> jinja2.Environment:
    found = environment(_ASSETS)
    found.filters |= {"clock": labels.clock, "span": labels.span, "num": labels.number, "state": state_label}
    found.filters |= {"headed": _headed, "coded": _coded}
    found.globals |= {"icon": icon, "title": labels.fault_title}
    return found
