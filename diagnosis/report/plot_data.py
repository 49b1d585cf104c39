"""What the page's scripts need: encoded columns, their units, faults and the rows of every figure."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from diagnosis.pages import labels
from diagnosis.report import tables
from diagnosis.report.budget import Mission, encode
from diagnosis.report.compared_channels import DEGREES, VALVE_UNIT
from diagnosis.report.encode import Channel, Segment
from diagnosis.report.plot_rows import Columns, Group, Row, fault_rows, row_json
from diagnosis.results.result import Closeups

_OTHERS = 0.1
_LEAST = 50_000
_LEAVES = {
    "v": "m/s", "v_ref": "m/s", "v_true": "m/s", "e": "m/s", "phi": "rad", "phi_ref": "rad", "phi_true": "rad",
    "u": VALVE_UNIT, "u_applied": VALVE_UNIT, "u_difference": VALVE_UNIT, "psi": "1", "psi_printed": "1",
    "psi_implied": "1", "rho": "1/s", "omega": "rad/s", "yaw_rate": "rad/s", "speed": "m/s", "x": "m", "y": "m",
    "lat": "°", "lon": "°",
}  # fmt: skip
_NATURAL = ("residual", "threshold", "expected", "delta_bar", "delta_bar_std")


@dataclass(frozen=True)
class Axis:
    """Time axis of the columns.

    Attributes
    ----------
    start, step : float
        Time of the first row and between rows [s].
    rows : int
        Number of rows; 0 where there is no axis.
    per : int
        Samples whose extremes two rows hold; 1 where each row is a sample.
    """

    start: float
    step: float
    rows: int
    per: int = 1

    @property
    def sample_s(self) -> float:
        """Time between samples [s]."""
        return self.step if self.per == 1 else 2 * self.step / self.per

    @property
    def samples(self) -> int:
        """Samples of the mission."""
        return self.rows if self.per == 1 else self.rows // 2 * self.per


def axis_of(columns: Mapping[str, NDArray[np.floating]], rate: Any) -> Axis:
    """Time axis of some columns.

    Parameters
    ----------
    columns : Mapping[str, NDArray[np.floating]], each of shape (n,)
        Columns with ``t`` [s].
    rate : Any
        Sample rate of the mission [Hz] where known: rows much farther apart than samples are extremes of several.

    Raises
    ------
    ValueError
        Where the columns differ in length or ``t`` is not uniform.
    """
    t = columns.get("t")
    if t is None or len(t) < 2:
        return Axis(0.0, 1.0, 0)
    if wrong := next((k for k, v in columns.items() if v.shape != t.shape), None):
        raise ValueError(f"column {wrong!r} has shape {columns[wrong].shape}, but t has {t.shape}")
    step = float(t[-1] - t[0]) / (len(t) - 1)
    if not step > 0 or np.abs(t - (t[0] + step * np.arange(len(t)))).max() > 0.5 * step:
        raise ValueError("column 't' is not uniform; resample the columns first")
    samples = step * rate if isinstance(rate, int | float) else 1.0
    return Axis(float(t[0]), step, len(t), round(2 * samples) if samples > 1.5 else 1)


def worst(faults: Sequence[Mapping[str, Any]], count: int) -> list[Mapping[str, Any]]:
    """The most severe faults, at most so many, in the order given."""
    if len(faults) <= count:
        return list(faults)
    rank = {"high": 0, "medium": 1, "low": 2, "info": 3}
    order = sorted(range(len(faults)), key=lambda i: rank.get(str(faults[i].get("severity")), 3))
    return [faults[i] for i in sorted(order[:count])]


def figures_of(
    faults: Sequence[Mapping[str, Any]], machine: Mapping[str, Any], columns: Columns, limit: float | None
) -> dict[str, tuple[Row, ...]]:
    """Rows of each fault's figure; those of faults of one part are the same object."""
    wheels, axles = machine.get("wheels") or (), machine.get("axles") or ()
    known: dict[tuple[Any, ...], tuple[Row, ...]] = {}
    out = {}
    for f in faults:
        key = (f["component"], f["kind"], f["side"], f.get("tier"), (f.get("sat") or {}).get("unit"))
        if key not in known:
            known[key] = fault_rows(f, axles if f["kind"] == "steer" else wheels, columns, limit)
        out[f["id"]] = known[key]
    return out


def channels_of(
    report: Mapping[str, Any],
    columns: Columns,
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
    axis: Axis,
    budget: int,
    closeups: Closeups | None = None,
) -> list[Channel]:
    """Encode all columns: those that a figure shows first, the others with what is left of the budget [bytes]."""
    rows = [r for group in {id(g): g for g in figures.values()}.values() for r in group]
    rows += [r for g in groups for r in g.rows]
    used = dict.fromkeys(c for r in rows for c in r.columns())
    others = [c for c in columns if c not in used and c != "t"]
    lsb = {s["name"]: s["lsb"] for s in report.get("signals") or () if s.get("lsb")}
    rank = {"high": 0, "medium": 1, "low": 2}
    faults = [
        (
            f["start_s"] - axis.start,
            f["stop_s"] - axis.start,
            frozenset(c for r in figures[f["id"]] for c in r.columns()),
        )
        for f in sorted(report.get("intervals") or (), key=lambda f: rank.get(str(f.get("severity")), 3))
    ]
    near = closeups if axis.per > 1 else None
    first = int((1 - _OTHERS) * budget) if others else budget
    shown = encode(Mission({c: columns[c] for c in used}, lsb, faults, axis.sample_s, axis.per, near), first)
    left = max(budget - sum({id(s): len(s.text) for c in shown for s in c.segments}.values()), _LEAST)
    return shown + encode(Mission({c: columns[c] for c in others}, lsb, [], axis.sample_s, axis.per), left)


def units_of(
    columns: Sequence[str],
    report: Mapping[str, Any],
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
) -> list[tuple[str, float]]:
    """Unit shown and factor to it, for each column."""
    known: dict[str, tuple[str, float]] = {}
    for row in (r for rows in [*figures.values(), *(g.rows for g in groups)] for r in rows):
        for t in row.traces:
            known.setdefault(t.column, (row.right[1] if t.right and row.right else row.unit, t.scale))
        for c in (*(row.band or ()), *((row.threshold,) if row.threshold else ())):
            known.setdefault(c, (row.unit, row.band_scale))
    recorded = {s["name"]: s.get("unit") or "" for s in report.get("signals") or ()}
    axles = set((report.get("machine") or {}).get("axles") or ()) - set(
        (report.get("machine") or {}).get("wheels") or ()
    )
    return [known.get(c) or _shown(recorded.get(c) or _unit(c, axles)) for c in columns]


def _unit(column: str, axles: set[str]) -> str:
    head, _, rest = column.partition(".")
    component, _, leaf = rest.rpartition(".")
    if head != "evidence":
        return _LEAVES.get(leaf, "1")
    part, _, side = component.rpartition(".")
    if leaf not in _NATURAL:
        return "1"
    return VALVE_UNIT if side == "actuator" else "rad" if part in axles else "m/s"


def _shown(unit: str) -> tuple[str, float]:
    return ("°", DEGREES) if unit == "rad" else ("°/s", DEGREES) if unit == "rad/s" else (unit, 1.0)


def packed_intervals(faults: Sequence[Mapping[str, Any]]) -> str:
    """All faults as JSON by their names, deflated, in base64."""
    return base64.b64encode(zlib.compress(orjson.dumps({f["id"]: f for f in faults}), 6)).decode("ascii")


def blocks_of(channels: Sequence[Channel]) -> list[Segment]:
    """The segments of all channels, those that several channels share once."""
    return list({id(s): s for c in channels for s in c.segments}.values())


def view(
    report: Mapping[str, Any],
    channels: Sequence[Channel],
    figures: Mapping[str, Sequence[Row]],
    groups: Sequence[Group],
    axis: Axis,
    duration: float,
) -> dict[str, Any]:
    """What the page's scripts need to know, as JSON; a segment's last number is its place among `blocks_of`."""
    block = {id(s): i for i, s in enumerate(blocks_of(channels))}
    index = {c.name: i for i, c in enumerate(channels)}
    distinct = {id(rows): rows for rows in figures.values()}
    place = {key: i for i, key in enumerate(distinct)}
    faults = [
        {
            "id": f["id"],
            "start": f["start_s"],
            "stop": f["stop_s"],
            "detected": f.get("detected_s"),
            "mode": labels.known(f["mode"]),
            "component": f["component"],
            "severity": f.get("severity"),
            "title": labels.fault_title(f),
            "rows": place[id(figures[f["id"]])],
        }
        for f in report.get("intervals") or ()
    ]
    units = units_of([c.name for c in channels], report, figures, groups)
    return {
        "t0": axis.start,
        "dt": axis.sample_s,
        "n": axis.samples,
        "closeups": any(len(c.segments) > 1 for c in channels),
        "duration": duration,
        "name": tables.machine_name(report),
        "faults": faults,
        "figures": [[row_json(r, index) for r in rows] for rows in distinct.values()],
        "loop": [{"key": g.key, "title": g.title, "rows": [row_json(r, index) for r in g.rows]} for g in groups],
        "channels": [
            {
                "name": c.name,
                "unit": unit,
                "k": k,
                "step": c.step,
                "base": c.base,
                "segments": [[s.start, s.count, s.stride, s.planes, block[id(s)]] for s in c.segments],
            }
            for c, (unit, k) in zip(channels, units, strict=True)
        ],
    }
