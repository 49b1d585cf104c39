"""Sensors of the body as further views of a wheel's speed: odometry, speed over ground, positions, with a yaw rate between.

A wheel at the distance y from the middle rolls at v − y·ω: its speed is looked for as a gain of the body's speed plus a share of
the yaw rate, late by what the sensor is late. Odometry that is made of the wheels' own speeds says nothing that they do not say,
and is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.body.positions import Positions, news
from diagnosis.body.sources import body_sensors
from replay.signals.speed_doubts import Witness
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_LEAST_BLOCKS = 80
_MOST_DELAY_S = 2.0
_ALIKE = 0.25  # median misfit, of the usual speed, beyond which body and wheel do not move together
_WINDOWS_S = (0.5, 1.0, 2.0, 4.0)  # over which positions become speeds
_SHARP = 0.08  # of the usual speed: what noise of the positions may leave
_MOVES = 0.3  # of the usual speed
_MADE_MEDIAN, _MADE_MOST = 0.006, 0.05  # misfit of what is made of the wheels, of the usual speed: median and 98 of 100


class BodySpeed(NamedTuple):
    """One sensor's speed of the body.

    Attributes
    ----------
    name : str
        The sensor, in words.
    speed : Array, shape (b,)
        Mean of each block [m/s]; NaN where unknown.
    signed : bool
        Whether it tells forwards from backwards.
    reach : int
        Blocks that one value is made from: their errors are one.
    """

    name: str
    speed: Array
    signed: bool
    reach: int


class View(NamedTuple):
    """A wheel's speed as a sensor of the body says.

    Attributes
    ----------
    name : str
        The sensor, in words.
    speed : Array, shape (b,)
        The wheel's speed [m/s]; NaN where unknown.
    reach : int
        As in `BodySpeed`.
    """

    name: str
    speed: Array
    reach: int


def body_speeds(timeline: Timeline, width: int) -> tuple[BodySpeed, ...]:
    """What the log's sensors of the body say of its speed.

    Parameters
    ----------
    timeline : Timeline
        The mission.
    width : int
        Steps of a block.
    """
    from diagnosis.response.inputs import cells

    out = []
    odometry = timeline.get("odom.v")
    if odometry is not None and np.isfinite(odometry).any():
        out.append(BodySpeed("odometry", cells(np.asarray(odometry, np.float64), width), True, 1))
    ground = timeline.get("gnss.speed")
    if ground is not None and np.isfinite(ground).any():
        out.append(BodySpeed("speed over ground", cells(np.abs(ground), width), False, 1))
    blocks = -(-timeline.size // width)
    for name, positions in body_sensors(timeline, width).positions.items():
        if name == "odometry" and out and out[0].name == "odometry":
            continue
        found = _of_positions(name, news(positions), blocks, width * timeline.dt)
        if found is not None:
            out.append(found)
    return tuple(out)


def witnesses_of(timeline: Timeline) -> tuple[Witness, ...]:
    """What measures the body's speed by itself: no odometry, which may be made of the wheels' speeds.

    Parameters
    ----------
    timeline : Timeline
        The mission.
    """
    from diagnosis.response.inputs import cell_of

    width = cell_of(timeline.dt)
    return tuple(Witness(b.name, np.abs(b.speed), width) for b in body_speeds(timeline, width) if b.name != "odometry")


def _of_positions(name: str, fixes: Positions, blocks: int, block_s: float) -> BodySpeed | None:
    """Speed by the slope of a line through the fixes around each block, over the shortest window that is sharp enough."""
    if fixes.t.size < _LEAST_BLOCKS:
        return None
    step = float(np.median(np.diff(fixes.t)))
    noise = float(np.median(np.abs(np.diff(fixes.place, n=2)))) / np.sqrt(6.0) / 1.18
    middle = np.asarray((np.arange(blocks) + 0.5) * block_s, np.float64)
    for window in _WINDOWS_S:
        if window < 3.0 * step:
            continue
        speed = _slopes(fixes, middle, window, 3.0 * step)
        known = np.isfinite(speed)
        if np.count_nonzero(known) < _LEAST_BLOCKS:
            continue
        usual = float(np.quantile(speed[known], 0.9))
        if noise * np.sqrt(12.0 / (window / step)) / window < _SHARP * usual:
            return BodySpeed(name, speed, False, max(1, round(window / block_s)))
    return None


def _slopes(fixes: Positions, middle: Array, window: float, most_gap: float) -> Array:
    """Length of the velocity by least squares within `window` around each time [m/s]; NaN where fixes are missing."""
    first = np.searchsorted(fixes.t, middle - window / 2)
    last = np.searchsorted(fixes.t, middle + window / 2)
    count = last - first

    def total(x: NDArray[np.complex128] | Array) -> NDArray[np.complex128]:
        run = np.concatenate([[0.0], np.cumsum(x)]).astype(np.complex128)
        return np.asarray(run[last] - run[first])

    place = fixes.place - fixes.place.mean()
    t = fixes.t
    n = np.maximum(count, 1)
    st, st2 = total(t).real, total(t * t).real
    spread = st2 - st * st / n
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        slope = (total(t * place) - st * total(place) / n) / spread
    wide = count * most_gap > 1.5 * window
    return np.where((count >= 3) & (spread > 0.0) & wide, np.abs(slope), np.nan)


def made_of(body: BodySpeed, wheels: Sequence[Array], stretch: Array | None = None) -> bool:
    """Whether a speed of the body is put together from the wheels' own speeds, now and up to half a second before.

    Parameters
    ----------
    body : BodySpeed
        The sensor.
    wheels : Sequence[Array], each of shape (b,)
        Measured speeds [m/s].
    stretch : Array or None, shape (b,)
        How much faster than the body the only wheel rolls [1]: then it may be made of its speed along the body, too.
    """
    if stretch is not None and made_of(body, [y / stretch for y in wheels]):
        return True
    kernel = np.ones(body.reach) / body.reach
    columns = []
    for y in wheels:
        smooth = np.convolve(np.nan_to_num(y), kernel, mode="same")
        columns += [np.r_[np.zeros(k), smooth[: smooth.size - k]] for k in range(3)]
    table = np.column_stack(columns)
    target = _with_sign(body, wheels)
    use = np.isfinite(target)
    usual = float(np.quantile(np.abs(target[use]), 0.9)) if use.any() else 0.0
    use &= np.abs(target) > _MOVES * usual
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return False
    a, b = table[use], target[use]
    off = np.abs(b)
    weight = np.ones(b.size)
    for _ in range(8):
        root = np.sqrt(weight)
        off = np.abs(b - a @ np.linalg.lstsq(a * root[:, None], b * root, rcond=None)[0])
        weight = 1.0 / np.maximum(off, 1e-3 * usual)
    return bool(np.median(off) < _MADE_MEDIAN * usual or np.quantile(off, 0.98) < _MADE_MOST * usual)


def view_of(
    y: Array,
    bodies: Sequence[BodySpeed],
    wheels: Mapping[str, Array],
    yaw: Array | None,
    block_s: float,
    stretch: Array | None = None,
) -> View | None:
    """The sharpest view of a wheel by a sensor of the body; None where none moves with it.

    Parameters
    ----------
    y : Array, shape (b,)
        The wheel [m/s].
    bodies : Sequence[BodySpeed]
        Sensors that are not made of the wheels.
    wheels : Mapping[str, Array]
        All wheels, for the sign of a speed that has none.
    yaw : Array or None, shape (b,)
        Measured yaw rate [rad/s]. Without it only a machine with one wheel can be compared: the others roll faster or slower in
        curves.
    block_s : float
        Length of a block [s].
    stretch : Array or None, shape (b,)
        How much faster than the body the only wheel rolls [1].
    """
    if yaw is None and len(wheels) > 1:
        return None
    best: tuple[float, View] | None = None
    for body in bodies:
        signed = _with_sign(body, list(wheels.values()))
        for late in range(round(_MOST_DELAY_S / block_s) + 1):
            speed = np.r_[signed[late:], np.full(late, np.nan)]
            for along in (speed,) if stretch is None else (speed, speed * stretch):
                found = _fitted(y, along, yaw)
                if found is not None and (best is None or found[0] < best[0]):
                    best = found[0], View(body.name, found[1], body.reach)
    return None if best is None else best[1]


def _with_sign(body: BodySpeed, wheels: Sequence[Array]) -> Array:
    if body.signed:
        return body.speed
    count = np.sum([np.nan_to_num(np.sign(y)) for y in wheels], axis=0)
    return np.where(count < 0.0, -body.speed, body.speed)


def _fitted(y: Array, speed: Array, yaw: Array | None) -> tuple[float, Array] | None:
    """Misfit and the wheel's speed by gain and share of the yaw rate, found where most of the mission agrees."""
    turn = np.zeros(y.size) if yaw is None else yaw
    use = np.isfinite(y) & np.isfinite(speed) & np.isfinite(turn)
    usual = float(np.quantile(np.abs(y[use]), 0.9)) if use.any() else 0.0
    moving = use & (np.abs(y) + np.abs(speed) > _MOVES * usual)
    if np.count_nonzero(moving) < _LEAST_BLOCKS:
        return None
    kept, columns = moving.copy(), np.column_stack([speed, turn] if yaw is not None else [speed])
    made = y
    for _ in range(5):
        weights = np.linalg.lstsq(columns[kept], y[kept], rcond=None)[0]
        made = columns @ weights
        off = np.abs(y - made)
        kept = moving & (off <= np.quantile(off[moving], 0.7))
    if not 0.5 < weights[0] < 2.0:
        return None
    misfit = float(np.median(np.abs(y - made)[moving]))
    return (misfit, np.asarray(made)) if misfit < _ALIKE * float(np.median(np.abs(y[moving]))) else None
