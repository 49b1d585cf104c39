"""Which curves each figure of the report shows: rows of the evidence of a fault and of the loop replay.

A row is plain JSON: the page draws it, the server only chooses. Angles are shown in degrees.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.pages.labels import FAULT_MODES, state_label
from diagnosis.report.compared_channels import DEGREES, VALVE_UNIT, by_valve, sides_of

Columns = Mapping[str, NDArray[np.floating]]

_Z95 = 1.959964


@dataclass(frozen=True)
class Trace:
    """One curve: column, what it is called, the part it plays (its colour and dash), and a factor for its unit."""

    column: str
    label: str
    role: str
    scale: float = 1.0
    right: bool = False


@dataclass(frozen=True)
class Row:
    """One panel of a figure; panels share the time axis."""

    key: str
    title: str
    unit: str
    traces: tuple[Trace, ...]
    band: tuple[str, str] | None = None
    band_scale: float = 1.0
    threshold: str | None = None
    level: float | None = None
    limits: tuple[float, float] | None = None
    clip: tuple[float, float] | None = None
    right: tuple[str, str] | None = None
    component: str = ""

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


def derived(columns: Columns, faults: Sequence[Mapping[str, Any]]) -> dict[str, NDArray[np.floating]]:
    """Columns with ε̂ = 1 − δ̂ and the 95 % bounds of ε̂ and of the saturation term added for the faults shown."""
    result = dict(columns)
    for fault in faults:
        for side in sides_of(fault["side"]):
            base = f"evidence.{fault['component']}.{side}."
            delta, bar = columns.get(base + "delta"), columns.get(base + "delta_bar")
            if delta is not None and base + "epsilon" not in result:
                result[base + "epsilon"] = 1.0 - delta
                if (std := columns.get(base + "delta_std")) is not None:
                    result[base + "epsilon_low"] = 1.0 - delta - _Z95 * std
                    result[base + "epsilon_high"] = 1.0 - delta + _Z95 * std
            if bar is not None and base + "delta_bar_low" not in result:
                if (std := columns.get(base + "delta_bar_std")) is None:
                    continue
                result[base + "delta_bar_low"] = bar - _Z95 * std
                result[base + "delta_bar_high"] = bar + _Z95 * std
    return result


def _row(columns: Columns, key: str, title: str, unit: str, traces: Sequence[Trace], **extra: Any) -> list[Row]:
    """Row with the curves that exist, or nothing; a band or threshold without its column is left out."""
    there = tuple(t for t in traces if t.column in columns)
    if not there:
        return []
    if (band := extra.get("band")) and not set(band) <= set(columns):
        extra["band"] = None
    if (threshold := extra.get("threshold")) and threshold not in columns:
        extra["threshold"] = None
    return [Row(key, title, unit, there, **extra)]


def _first(columns: Columns, *names: str) -> str:
    return next((n for n in names if n in columns), names[0])


def _motion(c: str, kind: str, columns: Columns) -> tuple[str, str, float, str, str, str]:
    """Measured, commanded and second measurement of a component: names, unit and factor."""
    if kind == "steer":
        ref = _first(columns, f"replay.{c}.phi_ref", f"steer.{c}.phi_ref")
        return "Steering angle", "°", DEGREES, f"steer.{c}.phi", ref, f"steer.{c}.phi_true"
    ref = _first(columns, f"replay.{c}.v_ref", f"wheel.{c}.v_ref")
    return "Wheel speed", "m/s", 1.0, f"wheel.{c}.v", ref, f"wheel.{c}.v_true"


def fault_rows(
    fault: Mapping[str, Any], peers: Sequence[str], columns: Columns, limit: float | None = None
) -> tuple[Row, ...]:
    """Rows of evidence for one fault.

    Parameters
    ----------
    fault : Mapping[str, Any]
        One of the report's intervals.
    peers : Sequence[str]
        Components of the same kind, the faulty one included.
    columns : Mapping[str, NDArray[np.floating]]
        Columns with those of `derived`.
    limit : float or None
        Probability from which a fault is stated.
    """
    c, kind, side = fault["component"], fault["kind"], fault["side"]
    group = "steer" if kind == "steer" else "wheel"
    title, unit, scale, measured, commanded, second = _motion(c, kind, columns)
    applied = f"{group}.{c}.u_applied"
    valve_read = by_valve(fault, columns)
    expected = f"evidence.{c}.{sides_of(side)[0]}.expected"
    motion = [
        Trace(commanded, "commanded", "commanded", scale),
        Trace(second, "second measurement", "reference", scale),
        *([] if valve_read else [Trace(expected, "expected", "expected", scale)]),
        Trace(measured, "measured", "measured", scale),
    ]
    valve = [
        Trace(f"{group}.{c}.u", "recorded", "measured"),
        Trace(f"replay.{c}.u", "replayed", "replayed"),
        Trace(applied, "applied", "applied"),
        *([Trace(expected, "expected", "expected")] if valve_read else []),
    ]
    valve_row = _row(columns, "u", "Valve command", "of full opening", valve)
    rows = _row(columns, "v", title, unit, motion)
    if side == "actuator":
        rows += valve_row
    for s in sides_of(side):
        rows += _side_rows(fault, s, (VALVE_UNIT, 1.0) if valve_read else (unit, scale), columns, limit)
    if kind == "wheel":
        rows += _psi_row(c, columns)
    if side != "actuator":
        rows += valve_row
    others = [Trace(f"{group}.{p}.{'phi' if kind == 'steer' else 'v'}", p, "peer", scale) for p in peers if p != c]
    if any(t.column in columns for t in others):
        name = "Other axles" if kind == "steer" else "Peer wheels"
        rows += _row(columns, "peers", name, unit, [*others, Trace(measured, c, "measured", scale)])
    return tuple(rows)


def _side_rows(
    fault: Mapping[str, Any], side: str, residual_unit: tuple[str, float], columns: Columns, limit: float | None
) -> list[Row]:
    """Residual, probability that the side is not healthy, ε̂, saturation term and mode probabilities of one side."""
    base = f"evidence.{fault['component']}.{side}."
    of = f" ({side})" if fault["side"] == "sensor_or_actuator" else ""
    unit, scale = residual_unit
    natural = "rad" if fault["kind"] == "steer" else "m/s"
    sat_unit = (fault.get("sat") or {}).get("unit") or (natural if side == "sensor" else "of full opening")
    sat_scale = DEGREES if sat_unit == "rad" else 1.0
    rows = _row(
        columns,
        f"residual{of}",
        f"Residual{of}",
        unit,
        [Trace(base + "residual", "residual", "measured", scale)],
        threshold=base + "threshold",
        band_scale=scale,
    )
    rows += _row(
        columns,
        f"probability{of}",
        f"Probability that it is not healthy{of}",
        "1",
        [Trace(base + "probability", "not healthy", "measured")],
        level=limit,
        limits=(-0.03, 1.03),
    )
    rows += _row(
        columns,
        f"epsilon{of}",
        f"Loss ε̂{of}",
        "1",
        [Trace(base + "epsilon", "estimate, 95 % band", "measured")],
        band=(base + "epsilon_low", base + "epsilon_high"),
        clip=(-1.0, 2.0),
    )
    rows += _row(
        columns,
        f"sat{of}",
        f"Saturation term ε̂·sat{of}",
        "°" if sat_unit == "rad" else sat_unit,
        [Trace(base + "delta_bar", "estimate, 95 % band", "measured", sat_scale)],
        band=(base + "delta_bar_low", base + "delta_bar_high"),
        band_scale=sat_scale,
    )
    modes = ["healthy", *FAULT_MODES]
    rows += _row(
        columns,
        f"modes{of}",
        f"Mode probability{of}",
        "1",
        [Trace(f"{base}p_{m}", state_label(m, side).lower(), f"mode-{m}") for m in modes],
        limits=(-0.03, 1.03),
    )
    return rows


def _psi_row(c: str, columns: Columns, component: str = "") -> list[Row]:
    traces = [
        Trace(f"replay.{c}.psi_printed", "printed law", "replayed"),
        Trace(f"replay.{c}.psi_implied", "implied by the recorded command", "measured"),
        Trace(f"wheel.{c}.psi", "recorded", "reference"),
        Trace(f"replay.{c}.rho", "ρ (right axis)", "right", right=True),
    ]
    return _row(
        columns,
        "psi",
        f"Ψ̂ {c}",
        "1",
        traces,
        right=("ρ", "1/s") if f"replay.{c}.rho" in columns else None,
        component=component,
    )


def loop_groups(wheels: Sequence[str], axles: Sequence[str], columns: Columns) -> tuple[Group, ...]:
    """Rows of the loop replay over the whole mission, as in the paper's figures; groups without data are left out."""
    speed: list[Row] = []
    drive: list[Row] = []
    steering: list[Row] = []
    psi: list[Row] = []
    for w in wheels:
        _, unit, scale, measured, commanded, _ = _motion(w, "wheel", columns)
        traces = [Trace(measured, "v measured", "measured", scale), Trace(commanded, "v_ref", "commanded", scale)]
        speed += _row(columns, "v", f"Speed {w}", unit, traces, component=w)
        valve = [Trace(f"wheel.{w}.u", "recorded", "measured"), Trace(f"replay.{w}.u", "replayed", "replayed")]
        drive += _row(columns, "u", f"u_a {w}", "of full opening", valve, component=w)
        psi += _psi_row(w, columns, component=w)
    for a in axles:
        _, unit, scale, measured, commanded, _ = _motion(a, "steer", columns)
        traces = [Trace(measured, "φ measured", "measured", scale), Trace(commanded, "φ_c", "commanded", scale)]
        steering += _row(columns, "phi", f"φ {a}", unit, traces, component=a)
        valve = [Trace(f"steer.{a}.u", "recorded", "measured"), Trace(f"replay.{a}.u", "replayed", "replayed")]
        steering += _row(columns, "u", f"u_s {a}", "of full opening", valve, component=a)
    groups = (
        Group("speed", "Wheel speeds", tuple(speed)),
        Group("drive", "Drive valves u_a", tuple(drive)),
        Group("steering", "Steering φ and u_s", tuple(steering)),
        Group("psi", "Ψ̂ printed and implied", tuple(psi)),
    )
    return tuple(g for g in groups if g.rows)


def row_json(row: Row, index: Mapping[str, int]) -> dict[str, Any]:
    """Row as the page reads it; columns become indices of channels."""
    data: dict[str, Any] = {
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
    if row.component:
        data["component"] = row.component
    if row.right:
        data["rightUnit"] = {"title": row.right[0], "unit": row.right[1]}
    return data
