"""What a plot of the report is: rows of curves over one time axis, the columns that they need, and their JSON.

Which plots there are says `diagnosis.report.plot_rows`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.document import ReportDocument
from diagnosis.results.stated_sizes import mode_columns, size_columns
from replay.faults import Side, State

Columns = Mapping[str, NDArray[np.floating]]


@dataclass(frozen=True)
class Trace:
    """One curve.

    Attributes
    ----------
    column : str
        Column that it shows.
    label : str
        What it is called.
    role : str
        Part it plays, which gives its colour and dash: ``measured``, ``reference``, ``commanded``, ``expected``, ``replayed``,
        ``applied``, ``peer``, ``right``, or ``mode-`` and a mode; see ``assets/figure_looks.js``.
    scale : float
        Factor from the column's unit to the row's.
    right : bool
        Whether it belongs to the axis on the right.
    """

    column: str
    label: str
    role: str
    scale: float = 1.0
    right: bool = False


@dataclass(frozen=True)
class Row:
    """One panel of a figure; panels share the time axis.

    Attributes
    ----------
    key : str
        Name of the row within its figure.
    title, unit : str
        Heading and unit of the axis.
    traces : tuple[Trace, ...]
        Curves.
    band : tuple[str, str] or None
        Columns of the lower and upper bound about a curve.
    threshold : str or None
        Column of half the height of a band about zero.
    band_scale : float
        Factor of `band` and `threshold` to the row's unit.
    level : float or None
        Value of a dashed line.
    limits : tuple[float, float] or None
        Range of the axis; None: all values.
    clip : tuple[float, float] or None
        Range beyond which the axis does not grow.
    right : tuple[str, str] or None
        Title and unit of the axis on the right.
    component : str
        Component that the row is of, where a figure has several.
    unknown : tuple[tuple[float, float], ...]
        Stretches in which what the row shows cannot be known: first and last time [s].
    small : tuple[tuple[float, float], ...]
        Stretches in which the part deviates by less than counts as a fault and was called healthy [s].
    untold : tuple[tuple[float, float], ...]
        Stretches in which the part is most probably stuck or without signal, though no fault is stated [s].
    steps : bool
        Whether what it shows holds until it changes: drawn as steps.
    """

    key: str
    title: str
    unit: str
    traces: tuple[Trace, ...]
    band: tuple[str, str] | None = None
    threshold: str | None = None
    band_scale: float = 1.0
    level: float | None = None
    limits: tuple[float, float] | None = None
    clip: tuple[float, float] | None = None
    right: tuple[str, str] | None = None
    component: str = ""
    unknown: tuple[tuple[float, float], ...] = ()
    small: tuple[tuple[float, float], ...] = ()
    untold: tuple[tuple[float, float], ...] = ()
    steps: bool = False

    def shown(self, columns: Columns) -> list[Row]:
        """The row with the curves that exist, or nothing; a band or threshold without its column is left out.

        `columns` are arrays of shape (n,).
        """
        traces = tuple(t for t in self.traces if t.column in columns)
        if not traces:
            return []
        band = self.band if self.band and all(b in columns for b in self.band) else None
        return [
            replace(self, traces=traces, band=band, threshold=self.threshold if self.threshold in columns else None)
        ]

    def columns(self) -> tuple[str, ...]:
        """Columns that the row needs."""
        extra = (*(self.band or ()), *((self.threshold,) if self.threshold else ()))
        return (*(t.column for t in self.traces), *extra)


@dataclass(frozen=True)
class Group:
    """Rows of the loop replay under one button."""

    key: str
    title: str
    rows: tuple[Row, ...]


def derived(
    columns: Columns, report: ReportDocument, times: tuple[NDArray[np.floating], float] | None = None
) -> dict[str, NDArray[np.floating]]:
    """Columns with ε̂, saturation terms and probabilities of rows of the parts with faults, as the document states them.

    Every column of shape (n,).

    Parameters
    ----------
    columns : Columns
        Columns by name.
    report : ReportDocument
        The document.
    times : tuple[NDArray[np.floating], float] or None
        Time of every row, and between samples [s]; None: by the column ``t``.
    """
    t: NDArray[np.floating] = columns["t"] if times is None and "t" in columns else np.empty(0)
    step = float(t[-1] - t[0]) / (t.size - 1) if t.size > 1 else 0.0
    if times is not None:
        t, step = times
    parts = {(f["component"], side.value) for f in report["intervals"] for side in Side(f["side"]).sides}
    known = frozenset(p for p in parts if any(k.startswith(f"evidence.{p[0]}.{p[1]}.") for k in columns))
    if not t.size:
        return dict(columns)
    whole = frozenset(p for p in known if f"evidence.{p[0]}.{p[1]}.p_{State.HEALTHY}" not in columns)
    return {**columns, **size_columns(report, t, step, known), **mode_columns(report, t, step, whole)}


def row_json(row: Row, index: Mapping[str, int]) -> dict[str, object]:
    """Row as the page reads it; columns become indices of channels."""
    data: dict[str, object] = {
        "key": row.key,
        "title": row.title,
        "unit": row.unit,
        "traces": [
            {"c": index[t.column], "name": t.label, "role": t.role, "k": t.scale, "right": t.right} for t in row.traces
        ],
    }
    if row.band:
        data["band"] = [index[c] for c in row.band]
    if row.threshold:
        data["threshold"] = index[row.threshold]
    if row.band or row.threshold:
        data["bandScale"] = row.band_scale
    if row.level is not None:
        data["level"] = row.level
    if row.limits:
        data["limits"] = list(row.limits)
    if row.clip:
        data["clip"] = list(row.clip)
    if row.unknown:
        data["unknown"] = [list(stretch) for stretch in row.unknown]
    if row.small:
        data["small"] = [list(stretch) for stretch in row.small]
    if row.untold:
        data["untold"] = [list(stretch) for stretch in row.untold]
    if row.steps:
        data["steps"] = True
    if row.component:
        data["component"] = row.component
    if row.right:
        data["rightUnit"] = {"title": row.right[0], "unit": row.right[1]}
    return data
