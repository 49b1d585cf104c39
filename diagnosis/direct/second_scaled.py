"""Two speeds that differ by a share: the drive's opening says which of both is off.

A speed sensor that is wrong is off what its drive's opening makes of the speed, whether its loop believes it, so that the opening changes while the second
speed stays with that, or not. A second speed that is wrong leaves the sensor where the opening has it, and is off by itself. Loads move both alike.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.low_speed import left_open
from diagnosis.estimation.lag import low_passed
from diagnosis.results.assessment import Assessment, Finding, Lack, Reason
from replay.arrays.blocks import release
from replay.faults import State

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_CELL_S, _LAGS_S = 0.1, (0.15, 0.5)
_CLOSED = 0.03  # of full opening
_LEAST_S, _LEAST_USUAL_S = 1.5, 20.0  # in which a drive is open, of a finding and outside of all
_FITS = 0.25  # of a speed, root mean square: an opening that leaves more says nothing of it
_OFF, _STAYS, _OF_OTHER = 0.2, 0.12, 0.35  # ln; of the second speed, of the sensor, and of that


def without_second_speeds_scale(
    found: Mapping[str, IdentifiedPair], assessments: Mapping[str, Assessment], openings: Mapping[str, Array]
) -> dict[str, Assessment]:
    """Assessments of speed sensors without findings in which these stay with their drives' openings, and the second speeds do not.

    Parameters
    ----------
    found : Mapping[str, IdentifiedPair]
        Sensors beside their second measurements, by wheel.
    assessments : Mapping[str, Assessment]
        What was found of them.
    openings : Mapping[str, Array], each of shape (n,)
        The drives' measured openings [of full opening], or their commands, by wheel.
    """
    out = dict(assessments)
    for wheel, one in found.items():
        told = [f for f in assessments[wheel].findings if not f.mode.total and not f.mode.varying]
        if told and wheel in openings:
            seconds = _seconds(told, assessments[wheel], one, openings[wheel])
            if seconds:
                out[wheel] = left_open(assessments[wheel], seconds).reasoned(State.NOT_ASSESSED, _reason(seconds, one))
    return out


def _reason(seconds: list[Finding], one: IdentifiedPair) -> Reason:
    start, stop = (
        pick(at) * one.pair.dt for pick, at in ((min, [f.start for f in seconds]), (max, [f.stop for f in seconds]))
    )
    text = (
        f"from {start:.1f} to {stop:.1f} s the second speed, {one.pair.x_name}, is off what the {{valve}}'s opening makes of it, and {one.pair.y_name} is not: "
        "the second one reads wrong"
    )
    return Reason(text, Lack.SECOND_OFF)


def _seconds(told: list[Finding], a: Assessment, one: IdentifiedPair, opening: Array) -> list[Finding]:
    """Findings, of some of a sensor, that are the second speed's."""
    dt, width = one.pair.dt, max(1, round(_CELL_S / one.pair.dt))
    columns, opens = _drives(opening, width, dt)
    y, x = (_means(z, width) for z in (one.pair.y, one.pair.x))
    for z in (one.pair.y, one.pair.x):
        release(z)
    usual = opens & np.isfinite(y) & np.isfinite(x)
    inside = {id(f): usual & _cells_of(f, width, y.size) for f in told}
    for f in a.findings:
        usual &= ~_cells_of(f, width, y.size)
    if np.count_nonzero(usual) * width * dt < _LEAST_USUAL_S:
        return []
    made = [_made(z, columns, usual) for z in (y, x)]
    if any(m is None for m in made):
        return []

    def is_seconds(f: Finding) -> bool:
        use = inside[id(f)]
        if np.count_nonzero(use) * width * dt < _LEAST_S:
            return False
        sensor, second = (_off(z[use], m[use]) for z, m in zip((y, x), made, strict=True) if m is not None)
        return second > _OFF and sensor < min(_STAYS, _OF_OTHER * second)

    return [f for f in told if is_seconds(f)]


def _drives(opening: Array, width: int, dt: float) -> tuple[Array, Flags]:
    """What an opening drives a speed by in every cell, shape (cells, columns), and where it is open."""
    known = np.nan_to_num(opening)
    cell = _means(known, width)
    opens = np.abs(cell) > _CLOSED
    late = [_means(low_passed(known, lag, dt), width) for lag in _LAGS_S]
    return np.column_stack([np.sign(late[0]), *late]), opens


def _made(speed: Array, columns: Array, usual: Flags) -> Array | None:
    """A speed as its drive makes it, shape (cells,), by cells without a finding; None where an opening says little of it."""
    weights = np.linalg.lstsq(columns[usual], speed[usual], rcond=None)[0]
    made = columns @ weights
    size = float(np.sqrt(np.mean(speed[usual] ** 2)))
    return made if float(np.sqrt(np.mean((speed - made)[usual] ** 2))) < _FITS * size else None


def _off(speed: Array, made: Array) -> float:
    """By which factor a speed is off what its drive makes of it [ln]; infinite for another sign, 0 where the drive makes nothing."""
    power = float(made @ made)
    share = float(speed @ made) / power if power > 0.0 else 1.0
    return abs(float(np.log(share))) if share > 0.0 else float(np.inf)


def _cells_of(f: Finding, width: int, cells: int) -> Flags:
    out = np.zeros(cells, np.bool_)
    out[f.start // width : -(-f.stop // width)] = True
    return out


def _means(x: Array, width: int) -> Array:
    """Means of what is known in each whole cell, NaN where nothing is; from shape (n,) to (cells,)."""
    cut = np.asarray(x[: x.size // width * width], dtype=np.float64).reshape(-1, width)
    known = np.isfinite(cut)
    count = np.count_nonzero(known, axis=1)
    return np.where(count > 0, np.where(known, cut, 0.0).sum(axis=1) / np.maximum(count, 1), np.nan)
