"""Which figure is asked for: the mission's timeline, groups of the replayed loop, columns, or the evidence of a fault."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from diagnosis.api.figures import Plot, rows_figure
from diagnosis.api.series import Series, Span
from diagnosis.api.timeline_figure import timeline_figure
from diagnosis.pages.labels import fault_title
from diagnosis.report.judged_parts import kind_of
from diagnosis.report.plot_rows import fault_rows, loop_groups
from diagnosis.report.rows import Row, Trace
from diagnosis.report.units import on_page, unit_of
from diagnosis.results.machine_words import words_of
from diagnosis.results.vocabulary import Kind
from replay.errors import ConfigError
from replay.faults import Side

if TYPE_CHECKING:
    import plotly.graph_objects as go


def mission_figure(series: Series, names: Sequence[str], start_s: float | None, stop_s: float | None) -> go.Figure:
    """Timeline of a mission, or rows by the names of groups and columns.

    Parameters
    ----------
    series : Series
        Time series of the result.
    names : Sequence[str]
        Groups of the loop replay, and columns; none: the timeline.
    start_s, stop_s : float or None
        Part of the mission [s].

    Raises
    ------
    ConfigError
        Where a name is not known, or the times are not in order.
    """
    span = _span(series, start_s, stop_s)
    if not names:
        return _timeline(series, span)
    machine = series.report["machine"]
    groups = {
        g.key: g.rows for g in loop_groups(machine["wheels"], machine["axles"], series.columns, words_of(machine))
    }
    rows: list[Row] = []
    for name in names:
        if name not in groups and name not in series.columns:
            known = ", ".join(groups) or "none"
            raise ConfigError(
                f"plot: {name!r} is not known; this result has the groups {known}, and the columns of its signals"
            )
        rows += groups[name] if name in groups else [_column_row(series, name)]
    title = ", ".join(str(file["path"]) for file in series.report["log"]["files"]) or "Mission"
    return rows_figure(Plot(series, rows, span, title, series.report["intervals"]))


def fault_figure(series: Series, fault: str, margin_s: float | None) -> go.Figure:
    """Rows of one fault.

    Parameters
    ----------
    series : Series
        Time series of the result.
    fault : str
        Its name.
    margin_s : float or None
        Time before and behind it [s].

    Raises
    ------
    ConfigError
        Where there is no such fault, or no time series of it.
    """
    report = series.report
    faults = {f["id"]: f for f in report["intervals"]}
    if fault not in faults:
        raise ConfigError(f"plot_fault: no fault {fault!r}; this result has {', '.join(faults) or 'none'}")
    if margin_s is not None and not margin_s >= 0:
        raise ConfigError(f"plot_fault: margin_s = {margin_s:g}: expected 0 s or more")
    one, machine = faults[fault], report["machine"]
    peers = machine["axles"] if one["kind"] == Kind.STEER else machine["wheels"]
    rows = fault_rows(one, peers, series.columns, words_of(machine), report["limits"]["min_probability"])
    if not rows:
        raise ConfigError(f"plot_fault: no time series of {fault} was kept")
    margin = max(0.5, 0.35 * (one["stop_s"] - one["start_s"])) if margin_s is None else margin_s
    near = [f for f in report["intervals"] if f["component"] == one["component"] and f["kind"] == one["kind"]]
    span = (one["start_s"] - margin, one["stop_s"] + margin)
    return rows_figure(Plot(series, rows, span, f"{fault}: {fault_title(one, words_of(machine))}", near, fault))


def _span(series: Series, start_s: float | None, stop_s: float | None) -> Span:
    axis, duration = series.axis, series.report["log"]["duration_s"]
    low = min(axis.start, 0.0) if start_s is None else start_s
    high = max(duration, axis.start + axis.step * axis.rows if axis.rows else 0.0) if stop_s is None else stop_s
    if not low < high:
        raise ConfigError(f"plot: {low:g} to {high:g} s is no stretch of time; stop_s must be later than start_s")
    return low, high


def _timeline(series: Series, span: Span) -> go.Figure:
    """Lanes in the machine's order, sensor before actuator; the faults over the states."""
    report = series.report
    machine = report["machine"]
    parts = [*machine["wheels"], *machine["axles"]]
    lanes = [(c, kind_of(c, machine), side.value) for c in parts for side in (Side.SENSOR, Side.ACTUATOR)]
    spans = [
        (s["component"], str(s["side"]), str(s["state"]), s["start_s"], s["stop_s"], s["reason"])
        for s in report["states"]
    ]
    machine_words = words_of(machine)
    for f in report["intervals"]:
        words = f"{f['id']}: {fault_title(f, machine_words)}"
        spans += [
            (f["component"], s.value, str(f["mode"]), f["start_s"], f["stop_s"], words) for s in Side(f["side"]).sides
        ]
    used = {(c, s) for c, s, *_ in spans}
    figure = timeline_figure(
        [lane for lane in lanes if (lane[0], lane[2]) in used], spans, report["verdict"]["title"], machine_words
    )
    figure.update_xaxes(range=list(span))
    return figure


def _column_row(series: Series, name: str) -> Row:
    recorded = {s["name"]: s["unit"] for s in series.report["signals"]}
    unit, scale = on_page(recorded.get(name) or unit_of(name, series.report), words_of(series.report["machine"]))
    return Row(name, name, unit, (Trace(name, name, "measured", scale),))
