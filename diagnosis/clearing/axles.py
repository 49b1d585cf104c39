"""Checks of steering axles: second measurements, a command that moves nothing, and the steering rate per opening."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from diagnosis.clearing.cells import Array, Cells, Frame
from diagnosis.clearing.measure import lasts, off_reference, worst
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_FLOOR_RAD, _OPEN = 0.06, 0.03  # deviations are shares of at least this angle and opening
_STILL_S, _STILL, _ANSWERED = 1.0, 0.015, 0.06  # s, rad/s, and of full opening
_RATE_S = 8.0
_LEAST_OPENING = 0.01  # r.m.s. of a window: below it, an axle is hardly steered
_RATE = 2.0  # limit of the rate in windows, as a multiple of the loss that counts
_FEW_S = 16.0  # of windows in which an axle is steered, for its usual rate


def axle_checks(cells: Cells, clear_at: float) -> Iterator[Checked]:
    """Checks of all steering axles; `clear_at` is the loss that counts [1]."""
    angle, second, command, opening = (cells.axles(leaf) for leaf in ("phi", "phi_true", "u", "u_applied"))
    either, share = Side.SENSOR_OR_ACTUATOR, -np.log1p(-clear_at)
    used = np.where(np.isfinite(opening), opening, command)
    rate = np.gradient(angle, cells.dt, axis=0) if len(angle) > 1 else np.full(angle.shape, np.nan)
    windows, usual = _rates(cells, rate, used)
    for j, axle in enumerate(cells.machine.axles):
        about = (Kind.STEER, axle)
        if not np.isfinite(angle[:, j]).any():
            continue
        if np.isfinite(second[:, j]).any():
            off = off_reference(cells, angle[:, j], second[:, j], _FLOOR_RAD)
            yield worst(cells, (*about, Side.SENSOR, Check.SECOND_MEASUREMENT), off, clear_at)
        if np.isfinite(opening[:, j]).any() and np.isfinite(command[:, j]).any():
            off = off_reference(cells, opening[:, j], command[:, j], _OPEN)
            yield worst(cells, (*about, Side.ACTUATOR, Check.SECOND_MEASUREMENT), off, clear_at)
        if np.isfinite(command[:, j]).any():
            yield _still(cells, axle, rate[:, j], command[:, j])
            yield worst(cells, (*about, either, Check.RATE), windows[:, j], _RATE * share)
            yield lasts(cells, (*about, either, Check.LASTING_RATE), usual[j], share)


def _still(cells: Cells, axle: str, rate: Array, command: Array) -> Checked:
    """Largest mean command while the axle stands still for a second."""
    frame = Frame(cells.size, max(1, round(_STILL_S / cells.dt)), max(1, round(0.3 / cells.dt)))
    still = frame.rms(rate) < _STILL
    values = np.where(still, np.abs(frame.mean(command)), 0.0)
    values = np.where(np.isfinite(frame.mean(command)), values, np.nan)
    if not np.isfinite(values).any():
        return Checked(Kind.STEER, axle, Side.SENSOR_OR_ACTUATOR, Check.STILL, None, _ANSWERED)
    k = int(np.nanargmax(values))
    start = float(frame.starts[k] * cells.dt)
    stop = start + frame.length * cells.dt
    return Checked(Kind.STEER, axle, Side.SENSOR_OR_ACTUATOR, Check.STILL, float(values[k]), _ANSWERED, start, stop)


def _rates(cells: Cells, rate: Array, opening: Array) -> tuple[Array, list[float | None]]:
    """|ln| of the steering rate per opening: by windows against the axle's usual one, and that against the other axle's."""
    frame = Frame(cells.size, max(1, round(_RATE_S / cells.dt)), cells.frame.hop)
    known = np.isfinite(rate) & np.isfinite(opening)
    power = frame.sums(np.where(known, opening**2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = frame.sums(np.where(known, opening * rate, 0.0)) / power
        steered = np.sqrt(power / np.maximum(frame.sums(known.astype(np.float64)), 1.0)) > _LEAST_OPENING
        log = np.where(steered, np.log(np.maximum(gain, 1e-3)), np.nan)
    middle = [
        float(np.nanmedian(x)) if np.count_nonzero(np.isfinite(x)) * frame.hop * cells.dt >= _FEW_S else np.nan
        for x in log.T
    ]
    out = np.abs(log - np.array(middle))
    wide = np.full((cells.frame.starts.size, log.shape[1]), np.nan)
    place = np.minimum(np.arange(len(wide)), len(out) - 1)
    wide[:] = out[place]
    apart: list[float | None] = [None] * len(middle)
    for a, b in pairwise(range(len(middle))):
        if np.isfinite(middle[a]) and np.isfinite(middle[b]):
            apart[a] = apart[b] = abs(middle[a] - middle[b])
    return wide, apart
