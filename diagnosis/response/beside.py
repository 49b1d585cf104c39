"""Other views of a wheel's speed: wheels of its side, and the opposite side with the yaw rate between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.models import Beside, Blocks
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]

_LEAST_BLOCKS = 80
_ALIKE = 0.4  # median misfit, of the usual speed, beyond which two wheels do not move together
_SHARE = 0.03  # of the speed
_BLAME_BLOCKS = 9  # over which it is asked whose command misfit is the larger


def views(
    wheels: Sequence[str], blocks: Mapping[str, Blocks], geometry: Geometry | None, yaw: Array | None
) -> dict[str, Beside]:
    """Views of each wheel that has one.

    Parameters
    ----------
    wheels : Sequence[str]
        Wheels with blocks.
    blocks : Mapping[str, Blocks]
        By wheel.
    geometry : Geometry or None
        Says which wheels are on one side.
    yaw : Array or None, shape (b,)
        Measured yaw rate [rad/s].
    """
    out: dict[str, Beside] = {}
    for w in wheels:
        others = [o for o in wheels if o != w and _same_side(w, o, geometry)]
        speeds = [s for o in others if (s := _scaled(blocks[w].mean, blocks[o].mean)) is not None]
        speed: Array | None = None
        if speeds:
            speed = np.asarray(np.median(np.array(speeds), axis=0))
        elif yaw is not None and (far := [o for o in wheels if o != w and not _same_side(w, o, geometry)]):
            others = far
            mean = np.asarray(np.mean([blocks[o].mean for o in far], axis=0))
            speed = _turned(blocks[w].mean, mean, yaw)
        if speed is None:
            continue
        noise = _noise(blocks[w], speed)
        blame = np.ones(speed.size) if len(speeds) > 1 else _blame(blocks[w], [blocks[o] for o in others])
        rough = np.asarray(np.max([blocks[o].rough for o in others], axis=0))
        out[w] = Beside(speed, noise, blame, rough)
    return out


def _same_side(a: str, b: str, geometry: Geometry | None) -> bool:
    if geometry is None or a not in geometry.wheels or b not in geometry.wheels:
        return False
    one, two = geometry.wheels[a], geometry.wheels[b]
    return one.axle == two.axle == "fixed" and one.y * two.y > 0.0


def _scaled(y: Array, x: Array) -> Array | None:
    """x times the gain that brings it to y; None where they do not move together."""
    use = np.isfinite(y) & np.isfinite(x) & (np.abs(x) > 0.1 * np.nanquantile(np.abs(x), 0.9))
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return None
    gain = float(np.median(y[use] / x[use]))
    off = np.abs(y[use] - gain * x[use])
    return gain * x if 0.5 < gain < 2.0 and np.median(off) < _ALIKE * np.median(np.abs(y[use])) else None


def _turned(y: Array, x: Array, yaw: Array) -> Array | None:
    """x and a share of the yaw rate, as they are beside y; None where these do not belong together."""
    use = np.isfinite(y) & np.isfinite(x) & np.isfinite(yaw)
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return None
    kept = use.copy()
    k = 0.0
    for _ in range(4):
        power = float(yaw[kept] @ yaw[kept])
        k = float(yaw[kept] @ (y - x)[kept]) / power if power > 0 else 0.0
        off = np.abs(y - x - k * yaw)
        kept = use & (off <= np.quantile(off[use], 0.7))
    moved = float(np.median(np.abs(y[use])))
    return x + k * yaw if np.median(np.abs(y - x - k * yaw)[use]) < _ALIKE * moved else None


def _noise(blocks: Blocks, speed: Array) -> Array:
    """Usual misfit of a view, larger where the speed changes."""
    off = np.abs(blocks.mean - speed)
    known = np.isfinite(off)
    change = np.abs(np.gradient(np.where(np.isfinite(speed), speed, 0.0)))
    floor = 1.5 * float(np.median(off[known]))
    return np.asarray(
        floor + _SHARE * np.abs(speed) + 0.5 * change + 0.01 * float(np.quantile(np.abs(speed[known]), 0.9))
    )


def _blame(own: Blocks, others: Sequence[Blocks]) -> Array:
    """Share of a misfit that is the wheel's own, by which of them is further off its command."""
    away = [np.minimum(np.abs(b.mean - np.clip(b.mean, b.low, b.high)) / b.noise, 8.0) for b in (own, *others)]
    kernel = np.ones(_BLAME_BLOCKS) / _BLAME_BLOCKS
    smooth = [np.convolve(np.nan_to_num(a), kernel, mode="same") for a in away]
    return np.asarray(1.0 / (1.0 + np.exp(-4.0 * (smooth[0] - np.max(smooth[1:], axis=0)))))
