"""The mission report: one HTML file that works offline, from its own text alone.

Words, tables, timeline and thumbnails are in the page's markup and need no JavaScript. Plots are drawn in the page by
plotly.js, which is taken from the installed plotly package and embedded compressed. A content security policy admits
exactly the embedded scripts and no request.
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

from diagnosis.report import names, tables
from diagnosis.report.encode import Channel, encode
from diagnosis.report.evidence import evidence_of
from diagnosis.report.figures import Columns, Group, Row, derived, fault_rows, loop_groups, row_json
from diagnosis.report.pair import pair_of
from diagnosis.report.picture import machine_picture
from diagnosis.report.svg import icon, path_picture, thumbnail
from diagnosis.report.timeline import timeline
from replay.errors import ConfigError

_HERE = Path(__file__).parent
_SCRIPTS = ("data.js", "plot.js", "page.js")
_THUMBNAILS = 300


def build_page(
    report: Mapping[str, Any],
    columns: Mapping[str, NDArray[np.floating]],
    *,
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
    report = tables.repaired(names.made_visible(report))
    cols = {names.visible(k): np.asarray(v) for k, v in columns.items()}
    start, step, samples = _time_axis(cols)
    faults: Sequence[Mapping[str, Any]] = report.get("intervals") or ()
    machine = report.get("machine") or {}
    wheels, axles = machine.get("wheels") or (), machine.get("axles") or ()
    shown = derived({k: v for k, v in cols.items() if np.isfinite(v).any()}, faults) if samples else {}
    limit = (report.get("limits") or {}).get("min_probability")
    figures = {
        f["id"]: fault_rows(f, axles if f["kind"] == "steer" else wheels, shown, limit) if samples else ()
        for f in faults
    }
    groups = loop_groups(wheels, axles, shown) if samples else ()
    plots = bool(groups or any(figures.values()))
    plotly, packed, version = _plotly(plotlyjs) if plots else ("", "", "none, no plots")
    duration = _duration(report, start, step, samples)
    context = {
        **tables.context(report, duration),
        "css": Markup("".join(_script(name) for name in ("report.css", "evidence.css"))),
        "timeline": timeline(report, duration),
        "picture": machine_picture(report),
        "path": path_picture(cols["path.x"], cols["path.y"], start, step, faults)
        if samples and {"path.x", "path.y"} <= set(cols)
        else Markup(""),
        "thumbs": {f["id"]: _thumbnail(f, shown, start, step) for f in faults[:_THUMBNAILS]} if samples else {},
        "evidence": evidence_of(report, shown, (start, step)),
        "groups": groups,
        "has_plots": plots,
        "plotly_version": version,
    }
    head, scripts = _script("theme.js"), [_script(name) for name in _SCRIPTS]
    context |= {"head": Markup(head), "scripts": [Markup(s) for s in scripts], "plotly": packed}
    context["csp"] = _policy([head, *scripts, *([plotly] if plots else [])])
    drawn = sum(len(p.picture) for e in context["evidence"].values() for p in (*e.edges, *e.course))
    budget = int(max_size_mb * 1e6) - len(packed) - 400_000 - 6_000 * len(faults) - drawn
    channels = _channels(report, shown, figures, groups, (start, step), max(budget, 200_000))
    context["blocks"] = [(f"c{i}-{j}", s.text) for i, c in enumerate(channels) for j, s in enumerate(c.segments)]
    context["channels"] = [c.name for c in channels]
    context["view"] = htmlsafe_json_dumps(
        _view(report, channels, figures, groups, (start, step, samples, duration)), sort_keys=True
    )
    return _environment().get_template("template.html.j2").render(context)


def _time_axis(columns: Mapping[str, NDArray[np.floating]]) -> tuple[float, float, int]:
    """First time [s], sample time [s] and number of samples; zero samples where there is no axis."""
    t = columns.get("t")
    if t is None or len(t) < 2:
        return 0.0, 1.0, 0
    if wrong := next((k for k, v in columns.items() if v.shape != t.shape), None):
        raise ValueError(f"column {wrong!r} has shape {columns[wrong].shape}, but t has {t.shape}")
    step = float(t[-1] - t[0]) / (len(t) - 1)
    if not step > 0 or np.abs(t - (t[0] + step * np.arange(len(t)))).max() > 0.5 * step:
        raise ValueError("column 't' is not uniform; resample the columns first")
    return float(t[0]), step, len(t)


def _duration(report: Mapping[str, Any], start: float, step: float, samples: int) -> float:
    ends = [s["stop_s"] for key in ("states", "phases", "intervals") for s in report.get(key) or ()]
    known = (report.get("log") or {}).get("duration_s") or 0.0
    return float(max([known, start + step * samples if samples else 0.0, *ends]))


def _thumbnail(fault: Mapping[str, Any], columns: Columns, start: float, step: float) -> Markup:
    pair = pair_of(fault, columns)
    if pair is None:
        return Markup("")
    return thumbnail(fault, columns[pair.measured], columns[pair.reference] if pair.reference else None, start, step)


def _channels(
    report: Mapping[str, Any],
    columns: Columns,
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
    axis: tuple[float, float],
    budget: int,
) -> list[Channel]:
    """Encode the columns that some figure shows, in the order of first use."""
    rows = [r for group in figures.values() for r in group] + [r for g in groups for r in g.rows]
    used = dict.fromkeys(c for r in rows for c in r.columns())
    lsb = {s["name"]: s["lsb"] for s in report.get("signals") or () if s.get("lsb")}
    start, step = axis
    faults = [
        (f["start_s"] - start, f["stop_s"] - start, frozenset(c for r in figures[f["id"]] for c in r.columns()))
        for f in report.get("intervals") or ()
    ]
    return encode({c: columns[c] for c in used}, lsb, faults, step, budget)


def _view(
    report: Mapping[str, Any],
    channels: Sequence[Channel],
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
    axis: tuple[float, float, int, float],
) -> dict[str, Any]:
    """What the page's scripts need to know."""
    index = {c.name: i for i, c in enumerate(channels)}
    start, step, samples, duration = axis
    faults = [
        {
            "id": f["id"],
            "start": f["start_s"],
            "stop": f["stop_s"],
            "detected": f.get("detected_s"),
            "mode": names.known(f["mode"]),
            "component": f["component"],
            "title": names.fault_title(f),
            "rows": [row_json(r, index) for r in figures[f["id"]]],
        }
        for f in report.get("intervals") or ()
    ]
    return {
        "t0": start,
        "dt": step,
        "n": samples,
        "duration": duration,
        "name": tables.machine_name(report),
        "faults": faults,
        "loop": [{"key": g.key, "title": g.title, "rows": [row_json(r, index) for r in g.rows]} for g in groups],
        "channels": [
            {
                "name": c.name,
                "step": c.step,
                "base": c.base,
                "segments": [[s.start, s.count, s.stride, s.planes] for s in c.segments],
            }
            for c in channels
        ],
    }


@lru_cache
def _script(name: str) -> str:
    return (_HERE / name).read_text("utf-8")


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
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"clock": names.clock, "span": names.span, "num": names.number, "state": names.state_label}
    environment.filters["headed"] = _headed
    environment.globals |= {"icon": icon, "known": names.known, "part": names.part, "title": names.fault_title}
    return environment
