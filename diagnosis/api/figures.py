"""Figures of a result: the rows of the report's plots, and its timeline, for plotly."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from diagnosis.api.series import Series, Span
from diagnosis.pages.labels import visible
from diagnosis.report.rows import Row
from diagnosis.results.document import IntervalRow
from diagnosis.results.fault_rows import LOOKS, state_label
from diagnosis.results.machine_words import MachineWords
from replay.faults import FaultMode, State

if TYPE_CHECKING:
    import plotly.graph_objects as go

#: Colours of the light page, see ``diagnosis/pages/style.css``.
COLOURS = {
    "text": "#17212b", "muted": "#536170", "accent": "#0a5a9c", "teal": "#00796b", "alt": "#a03080", "peer": "#8b97a4",
    "line2": "#e9edf1",
}  # fmt: skip
_STUCK = LOOKS[State.STUCK].light
#: Colour, width and dash of a curve by the part that it plays, as in ``diagnosis/report/assets/plot.js``.
STYLES = {
    "measured": (COLOURS["accent"], 1.7, "solid"),
    "commanded": (COLOURS["text"], 1.3, "dot"),
    "expected": (COLOURS["teal"], 1.5, "dash"),
    "reference": (COLOURS["text"], 1.0, "solid"),
    "replayed": (COLOURS["alt"], 1.5, "dash"),
    "applied": (COLOURS["teal"], 1.5, "solid"),
    "right": (COLOURS["muted"], 1.0, "dot"),
    "peer": (COLOURS["peer"], 1.1, "solid"),
    "threshold": (_STUCK, 1.3, "dash"),
}
_FREE = ("accent", "alt", "teal", "muted", "text", "peer")
_ROW_PX, _LANE_PX, _MARGIN_PX = 150, 26, 130
_QUIET = {
    State.NOT_EXCITED: "#d5dce3",
    State.MASKED: "#b9c3cd",
    State.SLIP: "#9cc0de",
    State.NO_DATA: "#f0f2f5",
    State.NOT_ASSESSED: "#e2e7ec",
}


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


def colour_of(state: str) -> str:
    """Colour of a mode or state on a light page."""
    return (LOOKS[state].light if state in LOOKS else "") or _QUIET.get(State(state), COLOURS["peer"])


def rows_figure(plot: Plot) -> go.Figure:
    """Panels over one time axis, the faults shaded behind those that show their component."""
    from plotly.subplots import make_subplots

    rows = plot.rows
    titles = [f"{visible(row.title)} ({visible(row.unit)})" for row in rows]
    specs = [[{"secondary_y": row.right is not None}] for row in rows]
    gap = min(0.25 / max(len(rows) - 1, 1), 42 / (_ROW_PX * len(rows)))
    figure = make_subplots(len(rows), 1, shared_xaxes=True, subplot_titles=titles, specs=specs, vertical_spacing=gap)
    coarse = 1
    for number, row in enumerate(rows, 1):
        coarse = max(coarse, _draw(figure, plot, row, number))
    for number, row in enumerate(rows, 1):
        _shade(figure, plot, row, number)
    drawn = "every sample" if coarse == 1 else f"extremes of up to {coarse} samples"
    _finish(figure, f"{visible(plot.title)}<br><sup>{drawn}</sup>", _ROW_PX * len(rows) + _MARGIN_PX)
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

    coarse, unit = 1, "" if row.unit == "1" else f" {visible(row.unit)}"

    def add(name: str, label: str, role: str, scale: float, right: bool = False, **more: Any) -> None:
        nonlocal coarse
        curve = plot.series.curve(name, plot.span, scale, plot.most)
        coarse = max(coarse, curve.stride)
        colour, width, dash = _style(role)
        line = {"color": colour, "width": width, "dash": dash} | more.pop("line", {})
        trace = go.Scatter(
            x=curve.t, y=curve.y, name=visible(label), legend=_legend(number), mode="lines", line=line,
            showlegend=label not in shown, hovertemplate=f"%{{y:.4~g}}{'' if right else unit}", **more,
        )  # fmt: skip
        shown.add(label)
        figure.add_trace(trace, row=number, col=1, secondary_y=right)

    shown: set[str] = set()
    if row.band:
        low, high = row.band
        add(low, "95 % band", "measured", row.band_scale, line={"width": 0}, hoverinfo="skip")
        shown.add("95 % band")
        fill: dict[str, Any] = {"fill": "tonexty", "fillcolor": "rgba(10, 90, 156, 0.18)"}
        add(high, "95 % band", "measured", row.band_scale, line={"width": 0}, hoverinfo="skip", **fill)
    if row.threshold:
        add(row.threshold, "± threshold", "threshold", row.band_scale)
        add(row.threshold, "± threshold", "threshold", -row.band_scale)
    for trace in row.traces:
        add(trace.column, trace.label, trace.role, trace.scale, trace.right)
    if row.level is not None:
        figure.add_hline(row.level, row=number, col=1, line={"color": _STUCK, "width": 1.2, "dash": "dash"})
    if row.limits:
        figure.update_yaxes(range=list(row.limits), row=number, col=1, secondary_y=False)
    if row.clip:
        figure.update_yaxes(
            autorangeoptions={"clipmin": row.clip[0], "clipmax": row.clip[1]}, row=number, col=1, secondary_y=False
        )
    if row.right:
        figure.update_yaxes(
            title_text=f"{row.right[0]} ({row.right[1]})", row=number, col=1, secondary_y=True, showgrid=False
        )
    return coarse


def _legend(number: int) -> str:
    """Name of the legend of a panel."""
    return "legend" if number == 1 else f"legend{number}"


def _style(role: str) -> tuple[str, float, str]:
    if role.startswith("mode-"):
        mode = role.removeprefix("mode-")
        return colour_of(mode), 1.6, LOOKS[mode].dash if mode in LOOKS else "solid"
    if role.startswith("free-"):
        return COLOURS[_FREE[int(role[5:]) % len(_FREE)]], 1.5, "solid"
    return STYLES[role]


def _shade(figure: go.Figure, plot: Plot, row: Row, number: int) -> None:
    for fault in plot.faults:
        if row.component and row.component != fault["component"]:
            continue
        main = fault["id"] == plot.main
        label = {"annotation_text": fault["id"], "annotation_font_size": 11} if number == 1 else {}
        figure.add_vrect(
            fault["start_s"], fault["stop_s"], row=number, col=1, fillcolor=colour_of(fault["mode"]),
            opacity=0.18 if main else 0.1, line_width=1 if main else 0, layer="below", **label,
        )  # fmt: skip
        if main and fault["detected_s"] is not None:
            figure.add_vline(
                fault["detected_s"], row=number, col=1, line={"color": COLOURS["text"], "width": 1.2, "dash": "dash"}
            )


def timeline_figure(
    lanes: Iterable[tuple[str, str, str]],
    spans: Sequence[tuple[str, str, str, float, float, str]],
    title: str,
    words: MachineWords,
) -> go.Figure:
    """States of every part over the mission, one lane for each side of a component.

    Parameters
    ----------
    lanes : Iterable[tuple[str, str, str]]
        Component, kind and side of each lane, from the top.
    spans : Sequence[tuple[str, str, str, float, float, str]]
        Component, side, state, begin and end [s], and what is said of it.
    title : str
        Heading.
    words : MachineWords
        How to speak of the machine.
    """
    import plotly.graph_objects as go

    names = {
        (component, side): visible(f"{words.part_words(kind, component, side)}") for component, kind, side in lanes
    }
    figure = go.Figure()
    for state in dict.fromkeys((*LOOKS, *(span[2] for span in spans))):
        mine = [span for span in spans if span[2] == state and (span[0], span[1]) in names]
        if not mine:
            continue
        figure.add_bar(
            orientation="h", name=state_label(state), marker={"color": colour_of(state), "line": {"width": 0}},
            y=[names[span[0], span[1]] for span in mine], base=[span[3] for span in mine],
            x=[span[4] - span[3] for span in mine], text=[_fault_named(span[5], state) for span in mine], customdata=[[span[3], span[4], visible(span[5])] for span in mine],
            hovertemplate="%{y}<br>" + state_label(state) + ": %{customdata[0]:.3f} to %{customdata[1]:.3f} s<br>"
            "%{customdata[2]}<extra></extra>",
        )  # fmt: skip
    _finish(figure, visible(title), _LANE_PX * len(names) + _MARGIN_PX)
    figure.update_layout(barmode="overlay", hovermode="closest", bargap=0.25)
    figure.update_yaxes(categoryorder="array", categoryarray=list(names.values())[::-1], automargin=True)
    figure.update_xaxes(title_text="mission time (s)")
    return figure


def _fault_named(words: str, state: str) -> str:
    """Name at the beginning of what is said of a fault: ``F1``; empty for other states."""
    return words.partition(":")[0] if ":" in words and state in list(FaultMode) else ""


def _finish(figure: go.Figure, title: str, height: int) -> None:
    figure.update_layout(
        title={"text": title, "font": {"size": 16}}, height=height, hovermode="x unified", template="plotly_white",
        font={"color": COLOURS["text"], "size": 12}, margin={"l": 64, "r": 24, "t": 84, "b": 48},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0, "xanchor": "right", "x": 1.0},
    )  # fmt: skip
    figure.update_xaxes(gridcolor=COLOURS["line2"], zeroline=False)
    figure.update_yaxes(gridcolor=COLOURS["line2"], zerolinecolor=COLOURS["line2"])
