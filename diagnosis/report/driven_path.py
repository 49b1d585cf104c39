"""The driven path for the picture: logged positions, else one integrated from speed and turning, else why there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.rows import Columns
from diagnosis.results.document import IntervalRow, MachineRow, ReportDocument
from replay.faults import FaultMode, Side

_AXLE_GAP_M = 0.1
_POINTS = 200_000  # enough for a picture
_NO_POSITIONS = "neither odometry nor GNSS was logged."
_NOTHING = "Not shown: neither odometry nor GNSS nor a wheel's speed was logged."
_SKIPPED = ("replay.", "evidence.")
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Path:
    """Positions [m] on the axis of the columns, None where there are none; `words` say where they come from or why not."""

    x: NDArray[np.floating] | None
    y: NDArray[np.floating] | None
    words: str


def driven_path(report: ReportDocument, columns: Columns, step: float) -> Path:
    """Find the machine's path.

    Parameters
    ----------
    report : ReportDocument
        The document.
    columns : Columns
        Filled columns of the result.
    step : float
        Sample time [s].

    Returns
    -------
    Path
        From odometry or GNSS where they were logged and moved with the machine, else integrated from the wheels' speeds and the yaw rate: measured,
        given by the steering angles, or commanded.
    """
    note = report["log"].get("path_note", "")
    if {"path.x", "path.y"} <= set(columns):
        logged = "odom.x" in columns and not note
        source = "odometry" if logged else "GNSS" if "gnss.lat" in columns else "logged positions"
        return Path(columns["path.x"], columns["path.y"], f"from {source}, in metres{_after(note)}")
    machine = report["machine"]
    rows = max((len(v) for v in columns.values()), default=0)
    every = max(1, rows // _POINTS)
    columns, step = {k: v[::every] for k, v in columns.items() if not k.startswith(_SKIPPED)}, step * every
    speed = _speed(machine, report["intervals"], columns, step)
    if speed is None:
        return Path(None, None, f"Not shown: {note} No wheel's speed was logged." if note else _NOTHING)
    turning = _turning(machine, columns, speed)
    if turning is None:
        return Path(
            None,
            None,
            f"Not shown: {note or _NO_POSITIONS} Neither a yaw rate nor steering angles with the machine's "
            "geometry show how it turned.",
        )
    rate, slip, source = turning
    yaw = np.cumsum(np.nan_to_num(rate)) * step
    forward = np.nan_to_num(speed) * step
    x, y = np.cumsum(forward * np.cos(yaw + slip)), np.cumsum(forward * np.sin(yaw + slip))
    x, y = (np.repeat(v, every)[:rows] for v in (x, y))
    return Path(
        x,
        y,
        f"integrated from wheel speeds and {source}: its shape drifts, no position was {'used' if note else 'logged'}{_after(note)}",
    )


def _after(note: str) -> str:
    return f". {note}" if note else ""


def _speed(machine: MachineRow, faults: Sequence[IntervalRow], columns: Columns, step: float) -> Array | None:
    """Median of the wheels' speeds, without those of sensors that were stuck or silent at the time."""
    found = []
    for wheel in machine["wheels"]:
        name = next((n for leaf in ("v_true", "v") if (n := f"wheel.{wheel}.{leaf}") in columns), "")
        if not name:
            continue
        v = columns[name].astype(np.float64)
        for f in faults if name.endswith(".v") else ():
            if f["component"] == wheel and FaultMode(f["mode"]).total and f["side"] != Side.ACTUATOR:
                v[max(0, int(f["start_s"] / step)) : int(f["stop_s"] / step) + 1] = np.nan
        found.append(v)
    if not found:
        return None
    ordered = np.sort(np.array(found), axis=0)  # NaN stands last
    count = np.isfinite(ordered).sum(axis=0)
    middle = [np.take_along_axis(ordered, np.maximum(k, 0)[None], axis=0)[0] for k in ((count - 1) // 2, count // 2)]
    return np.where(count > 0, 0.5 * (middle[0] + middle[1]), np.nan)


def _turning(machine: MachineRow, columns: Columns, speed: Array) -> tuple[Array, Array, str] | None:
    """Yaw rate [rad/s], direction of travel against the body's axis [rad], and where the rate comes from."""
    curvature, slip = _steered(machine, columns)
    if "imu.yaw_rate" in columns:
        measured = columns["imu.yaw_rate"].astype(np.float64)
        return measured, np.zeros(len(speed)) if slip is None else slip, "the measured yaw rate"
    if curvature is not None and slip is not None:
        return curvature * np.nan_to_num(speed) * np.cos(slip), slip, "steering angles"
    if "cmd.omega" in columns:
        return columns["cmd.omega"].astype(np.float64), np.zeros(len(speed)), "the commanded yaw rate"
    return None


def _steered(machine: MachineRow, columns: Columns) -> tuple[Array | None, Array | None]:
    """Curvature [1/m] and direction of travel at the body's origin [rad] by two axles, one of which may be fixed."""
    geometry = machine["geometry"] or {}
    places: dict[str, list[float]] = {}
    for w in geometry.values():
        places.setdefault(w["axle"], []).append(w["x"])
    tangents = []
    for axle, xs in places.items():
        name = f"steer.{axle}.phi_true" if f"steer.{axle}.phi_true" in columns else f"steer.{axle}.phi"
        if name in columns:
            tangents.append((float(np.mean(xs)), np.tan(columns[name].astype(np.float64))))
        elif axle == "fixed":
            tangents.append((float(np.mean(xs)), np.zeros(1)))
    if len(tangents) != 2 or abs(tangents[0][0] - tangents[1][0]) < _AXLE_GAP_M:
        return None, None
    (x0, t0), (x1, t1) = tangents
    curvature = (t0 - t1) / (x0 - x1)
    return curvature, np.nan_to_num(np.arctan(t0 - curvature * x0))
