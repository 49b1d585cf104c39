"""The mission report: one HTML file that works offline, from its own text alone.

Words, tables, timeline and thumbnails are in the page's markup and need no JavaScript. Plots are drawn in the page by
plotly.js, which is taken from the installed plotly package and embedded compressed. A content security policy admits
exactly the embedded scripts and no request. Of thousands of faults all stand in the table; the most severe have their
evidence in the markup, the others get it from the page's scripts.
"""

from __future__ import annotations

import base64
import hashlib
import re
import zlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup, escape
from numpy.typing import NDArray

from diagnosis.pages import labels
from diagnosis.pages.environment import SHARED, asset, environment
from diagnosis.pages.svg import icon, path_picture, thumbnail
from diagnosis.report import tables
from diagnosis.report.compared_channels import pair_of
from diagnosis.report.driven_path import driven_path
from diagnosis.report.evidence import evidence_of
from diagnosis.report.machine_picture import machine_picture
from diagnosis.report.plot_data import Axis, axis_of, blocks_of, channels_of, figures_of, packed_intervals, view, worst
from diagnosis.report.plot_rows import Columns, derived, loop_groups
from diagnosis.report.previous import previous_section
from diagnosis.report.timeline import timeline
from diagnosis.results.result import Closeups
from replay.errors import ConfigError

_ASSETS = Path(__file__).parent / "assets"
_STYLES = (SHARED / "style.css", _ASSETS / "evidence.css", _ASSETS / "explorer.css", _ASSETS / "print.css")
_SCRIPTS = tuple(_ASSETS / name for name in ("data.js", "plot.js", "export.js", "explorer.js", "page.js"))
_LISTED, _THUMBNAILS, _DETAILED = 5000, 300, 120


def build_page(
    report: Mapping[str, Any],
    columns: Mapping[str, NDArray[np.floating]],
    *,
    closeups: Closeups | None = None,
    max_size_mb: float = 15.0,
    plotlyjs: Path | None = None,
) -> str:
    """Page for one diagnosed mission; the same input gives the same text.

    Parameters
    ----------
    report : Mapping[str, Any]
        The parsed ``report.json``.
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
    every: Sequence[Mapping[str, Any]] = whole.get("intervals") or ()
    report = tables.repaired({**whole, "intervals": worst(every, _LISTED)})
    cols = {labels.visible(k): np.asarray(v) for k, v in columns.items()}
    axis = axis_of(cols, (report.get("log") or {}).get("rate_hz"))
    faults: Sequence[Mapping[str, Any]] = report["intervals"]
    detailed = worst(faults, _DETAILED)
    machine = report.get("machine") or {}
    filled = {k: v for k, v in cols.items() if np.isfinite(v).any()} if axis.rows else {}
    shown = derived(filled, faults)
    limit = (report.get("limits") or {}).get("min_probability")
    figures = figures_of(faults, machine, shown, limit)
    groups = loop_groups(machine.get("wheels") or (), machine.get("axles") or (), shown)
    near = None
    if closeups is not None:
        samples = {labels.visible(k): v for k, v in closeups.columns.items()}
        near = Closeups(closeups.step, derived(samples, faults))
    plots = len(filled) > 1
    plotly, packed, version = _plotly(plotlyjs) if plots else ("", "", "none, no plots")
    duration = _duration(report, axis)
    place = (axis.start, axis.step)
    path = driven_path(report, filled, axis.step)
    context = {
        **tables.context(report, duration),
        "css": Markup("".join(asset(path) for path in _STYLES)),
        "timeline": timeline(report, duration, {f["id"] for f in detailed}),
        "picture": machine_picture(report),
        "path": Markup("") if path.x is None or path.y is None else path_picture(path.x, path.y, *place, detailed),
        "path_words": path.words,
        "path_modes": [m for m in labels.FAULT_MODES if any(f["mode"] == m for f in detailed)],
        "previous": previous_section(report),
        "thumbs": {f["id"]: _thumbnail(f, shown, *place) for f in worst(faults, _THUMBNAILS)} if axis.rows else {},
        "evidence": evidence_of(report, shown, place, axis.per, detailed, near),
        "unlisted": len(every) - len(faults),
        "groups": groups,
        "has_plots": plots,
        "empty": [k for k in cols if k not in filled],
        "plotly_version": version,
    }
    head, scripts = asset(SHARED / "theme.js"), [asset(path) for path in _SCRIPTS]
    context |= {"head": Markup(head), "scripts": [Markup(s) for s in scripts], "plotly": packed}
    context["csp"] = _policy([head, *scripts, *([plotly] if plots else [])])
    intervals = packed_intervals(worst(every, _LISTED))
    drawn = sum(len(p.picture) for e in context["evidence"].values() for p in (*e.edges, *e.course))
    words = 400_000 + 6_000 * len(detailed) + 1_500 * len(faults) + len(intervals)
    budget = int(max_size_mb * 1e6) - len(packed) - words - drawn
    worst_first = {**report, "intervals": detailed}
    channels = channels_of(worst_first, shown, figures, groups, axis, max(budget, 200_000), near)
    context["blocks"] = [(f"b{i}", s.text) for i, s in enumerate(blocks_of(channels))]
    context["blocks"].append(("intervals", intervals))
    context["view"] = htmlsafe_json_dumps(view(report, channels, figures, groups, axis, duration), sort_keys=True)
    return _environment().get_template("template.html.j2").render(context)


def _duration(report: Mapping[str, Any], axis: Axis) -> float:
    ends = [s["stop_s"] for key in ("states", "phases", "intervals") for s in report.get(key) or ()]
    known = (report.get("log") or {}).get("duration_s") or 0.0
    return float(max([known, axis.start + axis.step * axis.rows if axis.rows else 0.0, *ends]))


def _thumbnail(fault: Mapping[str, Any], columns: Columns, start: float, step: float) -> Markup:
    pair = pair_of(fault, columns)
    if pair is None:
        return Markup("")
    return thumbnail(fault, columns[pair.measured], columns[pair.reference] if pair.reference else None, start, step)


@lru_cache
def _plotly(path: Path | None) -> tuple[str, str, str]:
    """Source of plotly.js, the same deflated in base64, and its version."""
    if path is None:
        from plotly.offline import get_plotlyjs

        source = str(get_plotlyjs())
    else:
        try:
            source = path.read_text("utf-8-sig")
        except (OSError, UnicodeDecodeError) as e:
            raise ConfigError(f"--plotlyjs {path}: cannot be read ({e}); expected a plotly.js bundle") from e
    found = re.search(r"plotly\.js(?: \([\w-]+ - minified\))? v([\d.]+)", source[:2000])
    packed = base64.b64encode(zlib.compress(source.encode(), 9)).decode("ascii")
    return source, packed, found[1] if found else "unknown"


def _policy(scripts: Sequence[str]) -> str:
    """Content security policy that admits these scripts and nothing else."""
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(s.encode()).digest()).decode()}'" for s in scripts)
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _headed(rows: Markup, heads: Sequence[str]) -> Markup:
    """Rows of a table whose cells carry their column's heading, for screens on which they stand below each other."""

    def row(text: str) -> str:
        words = (str(escape(h.removeprefix(">"))) for h in heads)
        return re.sub(r"<(td|th scope=\"row\")", lambda cell: f'{cell[0]} data-h="{next(words, "")}"', text)

    return Markup("</tr>").join(Markup(row(part)) for part in str(rows).split("</tr>"))


@lru_cache
def _environment() -> jinja2.Environment:
    found = environment(_ASSETS)
    found.filters |= {"clock": labels.clock, "span": labels.span, "num": labels.number, "state": labels.state_label}
    found.filters["headed"] = _headed
    found.globals |= {"icon": icon, "known": labels.known, "part": labels.part, "title": labels.fault_title}
    return found
