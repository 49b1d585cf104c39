"""Figures of a result for plotly: the rows of the report's plots over one time axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.api.figure_style import BAND, COLOURS, MARGIN_PX, STUCK, colour_of, finish, inert, style_of
from diagnosis.api.series import Curve, Series, Span
from diagnosis.report.plot_data import worst
from diagnosis.report.rows import Row
from diagnosis.results.document import IntervalRow
from replay.arrays.runs import runs_of
from replay.faults import State

if TYPE_CHECKING:
    import plotly.graph_objects as go

_ROW_PX = 150
_SHADED = 100

Shapes = list[dict[str, Any]]


@dataclass(frozen=True)
class Plot:
    """What a figure of rows is drawn from.

    Attributes
    ----------
    series : Series
        Its columns.
    rows : Sequence[Row]
        Its panels, from `diagnosis.report.plot_rows`.
    span : tuple[float, float]
        Time that it shows [s].
    title : str
        Heading.
    faults : Sequence[IntervalRow]
        Faults that are shaded.
    main : str
        Name of the fault that the figure is of; empty for none.
    most : int
        Points of each curve at most.
    """

    series: Series
    rows: Sequence[Row]
    span: Span
    title: str
    faults: Sequence[IntervalRow]
    main: str = ""
    most: int = 20_000


def rows_figure(plot: Plot) -> go.Figure:
    """Panels over one time axis, the faults shaded behind those that show their component."""
    from plotly.subplots import make_subplots

    rows = plot.rows
    titles = [f"{inert(row.title)} ({inert(row.unit)})" for row in rows]
    specs = [[{"secondary_y": row.right is not None}] for row in rows]
    gap = min(0.25 / max(len(rows) - 1, 1), 42 / (_ROW_PX * len(rows)))
    figure = make_subplots(len(rows), 1, shared_xaxes=True, subplot_titles=titles, specs=specs, vertical_spacing=gap)
    coarse = max([_draw(figure, plot, row, number) for number, row in enumerate(rows, 1)], default=1)
    drawn = "every sample" if coarse == 1 else f"extremes of up to {coarse} samples"
    finish(figure, f"{inert(plot.title)}<br><sup>{drawn}{_shade(figure, plot)}</sup>", _ROW_PX * len(rows) + MARGIN_PX)
    figure.update_xaxes(range=list(plot.span))
    figure.update_xaxes(title_text="mission time (s)", row=len(rows), col=1)
    figure.update_annotations(font_size=12, x=0.0, xanchor="left", selector={"xref": "paper"})
    for number in range(1, len(rows) + 1):
        top = next(figure.select_yaxes(row=number, col=1)).domain[1]
        place = {"x": 1.0, "y": top, "xanchor": "right", "yanchor": "bottom", "orientation": "h"}
        figure.update_layout({_legend(number): {**place, "font": {"size": 11}, "bgcolor": "rgba(0,0,0,0)"}})
    return figure


def _draw(figure: go.Figure, plot: Plot, row: Row, number: int) -> int:
    """Draw the curves of one panel; of how many samples two of their points are the extremes."""
    import plotly.graph_objects as go

    unit = "" if row.unit == "1" else f" {inert(row.unit)}"
    strides, shown = [1], set[str]()

    def curve(name: str, scale: float) -> Curve:
        found = plot.series.curve(name, plot.span, scale, plot.most)
        strides.append(found.stride)
        return found

    def add(x: NDArray[Any], y: NDArray[Any], label: str, role: str, right: bool = False, **more: Any) -> None:
        colour, width, dash = style_of(role)
        looks = {"line": {"color": colour, "width": width, "dash": dash}, "hovertemplate": f"%{{y:.4~g}}{unit}"} | more
        trace = go.Scatter(
            x=x, y=y, name=inert(label), legend=_legend(number), mode="lines", showlegend=label not in shown, **looks
        )
        shown.add(label)
        figure.add_trace(trace, row=number, col=1, secondary_y=right)

    if row.band:
        outline = _outline(*(curve(name, row.band_scale) for name in row.band))
        looks: dict[str, Any] = {"fill": "toself", "fillcolor": BAND, "hoverinfo": "skip", "hovertemplate": None}
        add(*outline, "95 % band", "measured", line={"width": 0}, **looks)
    if row.threshold:
        found = curve(row.threshold, row.band_scale)
        add(found.t, found.y, "± threshold", "threshold")
        add(found.t, -found.y, "± threshold", "threshold")
    for trace in row.traces:
        found = curve(trace.column, trace.scale)
        more = {"hovertemplate": "%{y:.4~g}"} if trace.right else {}
        add(found.t, found.y, trace.label, trace.role, trace.right, **more)
    if row.level is not None:
        figure.add_hline(row.level, row=number, col=1, line={"color": STUCK, "width": 1.2, "dash": "dash"})
    for colour, stretches in ((COLOURS["muted"], row.unknown), (colour_of(State.HEALTHY), row.small)):
        for start, stop in stretches:
            if start < plot.span[1] and stop > plot.span[0]:
                figure.add_vrect(
                    start, stop, row=number, col=1, line_width=0, fillcolor=colour, opacity=0.2, layer="below"
                )
    if row.limits:
        figure.update_yaxes(range=list(row.limits), row=number, col=1, secondary_y=False)
    if row.clip:
        clip = {"clipmin": row.clip[0], "clipmax": row.clip[1]}
        figure.update_yaxes(autorangeoptions=clip, row=number, col=1, secondary_y=False)
    if row.right:
        title = f"{row.right[0]} ({row.right[1]})"
        figure.update_yaxes(title_text=title, row=number, col=1, secondary_y=True, showgrid=False)
    return max(strides)


def _outline(low: Curve, high: Curve) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Closed outlines between two curves, one for each stretch without a gap, divided by NaN."""
    below = low.y if len(low.t) == len(high.t) else np.interp(high.t, low.t, low.y)
    known = np.isfinite(below) & np.isfinite(high.y)
    x, y = [np.empty(0)], [np.empty(0)]
    for a, b in runs_of(known):
        x += [high.t[a:b], high.t[a:b][::-1], np.array([np.nan])]
        y += [high.y[a:b], below[a:b][::-1], np.array([np.nan])]
    return np.concatenate(x), np.concatenate(y)


def _legend(number: int) -> str:
    """Name of the legend of a panel."""
    return "legend" if number == 1 else f"legend{number}"


def _shade(figure: go.Figure, plot: Plot) -> str:
    """Shade the faults in view, the worst of very many; say so where some are left out."""
    near = [f for f in plot.faults if f["start_s"] < plot.span[1] and f["stop_s"] > plot.span[0]]
    faults = worst(near, _SHADED)
    shapes: Shapes = []
    names: Shapes = []
    for number, row in enumerate(plot.rows, 1):
        axes = next(figure.select_yaxes(row=number, col=1)).plotly_name.removeprefix("yaxis")
        place = {"xref": f"x{number if number > 1 else ''}", "yref": f"y{axes} domain"}
        for fault in faults:
            if row.component and row.component != fault["component"]:
                continue
            main, colour = fault["id"] == plot.main, colour_of(fault["mode"])
            edge = {"color": colour, "width": 1.0 if main else 0.0}
            box = {**place, "y0": 0, "y1": 1, "x0": fault["start_s"], "x1": fault["stop_s"], "line": edge}
            shapes.append(
                {**box, "type": "rect", "fillcolor": colour, "opacity": 0.18 if main else 0.1, "layer": "below"}
            )
            if number == 1 and len(faults) <= _SHADED // 3:
                middle = (fault["start_s"] + fault["stop_s"]) / 2
                names.append({**place, "x": middle, "y": 1, "yanchor": "top", "showarrow": False, "text": fault["id"]})
            if main and (at := fault["detected_s"]) is not None:
                line = {"color": COLOURS["text"], "width": 1.2, "dash": "dash"}
                shapes.append({**box, "type": "line", "x0": at, "x1": at, "line": line})
    figure.update_layout(shapes=[*figure.layout.shapes, *shapes], annotations=[*figure.layout.annotations, *names])
    return f"; the {len(faults)} most severe of {len(near)} faults are shaded" if len(faults) < len(near) else ""
