"""Other views of a wheel's speed: wheels of its side, the opposite side with the yaw rate between them, sensors of the body.

Wheels of one side are pulled along by each other or skid, so that they tell what a sensor should read, not whether its wheel turns.
The yaw rate beside the only other wheel, or a sensor of the body beside the only wheel, shows the wheel's own motion (`Beside.own`).
Wheels with rollers go sideways: each of them is what the three others make it be, v_FL + v_FR = v_RL + v_RR.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.blame import blame_by_commands, blame_of, off_command
from diagnosis.response.body import BodySpeed, View, made_of, view_of
from diagnosis.response.models import Beside, Blocks
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]

_LEAST_BLOCKS = 80
_ALIKE = 0.4  # median misfit, of the usual speed, beyond which two wheels do not move together
_SHARE = 0.03  # of the speed
_LEAST_TOGETHER, _TOGETHER = 3, 0.15  # other wheels, and their median misfit, of the usual speed
_AGAINST, _AGAINST_BLOCKS = 0.1, 6  # of the top speed; blocks
_DIFFER = 0.3  # of the speed: by as much two wheels that show one speed differ only where one of them is wrong
_OWN_MISFIT = (
    1.5  # times the usual misfit beside the command: from there on a misfit beside the body's sensor is the wheel's
)


class Bodies(NamedTuple):
    """Sensors of the body.

    Attributes
    ----------
    speeds : tuple[BodySpeed, ...]
        Its speed.
    yaw : Array or None, shape (b,)
        Measured yaw rate [rad/s].
    block_s : float
        Length of a block [s].
    sideways : bool
        Whether the machine also moves sideways, so that wheels of one side are not alike.
    stretch : Array or None, shape (b,)
        How much faster than the body the only wheel rolls [1]; None where there are several, or it does not steer.
    """

    speeds: tuple[BodySpeed, ...] = ()
    yaw: Array | None = None
    block_s: float = 0.25
    sideways: bool = False
    stretch: Array | None = None


def views(
    wheels: Mapping[str, str],
    blocks: Mapping[str, Blocks],
    geometry: Geometry | None,
    bodies: Bodies,
    usual: Mapping[str, Array] | None = None,
) -> tuple[dict[str, Beside], dict[str, Beside], tuple[str, ...]]:
    """Views of each wheel that has one, of each wheel by the measured motion of the body, and a sentence on each sensor that was left out.

    Parameters
    ----------
    wheels : Mapping[str, str]
        Channel of each wheel with blocks.
    blocks : Mapping[str, Blocks]
        By wheel.
    geometry : Geometry or None
        Says which wheels are on one side.
    bodies : Bodies
        Sensors of the body.
    usual : Mapping[str, Array] or None, each of shape (b,)
        Readings in which gains are found [m/s]; those of `blocks` for None.
    """
    usual = {w: b.mean for w, b in blocks.items()} if usual is None else usual
    means = {w: blocks[w].mean for w in wheels}
    made = [b for b in bodies.speeds if b.name == "odometry" and made_of(b, list(means.values()), bodies.stretch)]
    notes = tuple(f"Body sensor {b.name} left out: it is computed from the wheels' own speeds." for b in made)
    kept = [b for b in bodies.speeds if b not in made]
    seen = {w: view_of(means[w], kept, means, bodies.yaw, bodies.block_s, bodies.stretch) for w in wheels}
    by_body = {w: v for w, v in seen.items() if v is not None}
    out: dict[str, Beside] = {}
    by_motion: dict[str, Beside] = {}
    for w in wheels:
        if bodies.sideways:
            found = _by_all_others(w, wheels, blocks, usual)
            if found is not None:
                out[w] = found
            continue
        found = _by_wheels(w, wheels, blocks, (geometry, bodies.yaw, by_body), usual)
        found = _by_body(w, wheels, blocks, by_body) if found is None else found
        if found is not None:
            out[w] = found
        moved = _by_motion(w, wheels, blocks, (geometry, bodies.yaw, by_body))
        if moved is not None:
            by_motion[w] = moved
    return out, by_motion, notes


def _by_motion(
    w: str,
    wheels: Mapping[str, str],
    blocks: Mapping[str, Blocks],
    body: tuple[Geometry | None, Array | None, Mapping[str, View]],
) -> Beside | None:
    """How fast the ground passes under a wheel, by the yaw rate beside the wheels of the other side, or by a sensor of the body."""
    geometry, yaw, by_body = body
    far = [o for o in wheels if o != w and not same_side(w, o, geometry)]
    own = blocks[w]
    turned = len(far) == 1 if geometry is None else all(p.axle == "fixed" for p in geometry.wheels.values())
    if yaw is not None and far and turned:  # by its wheels, not by steering
        speed = _turned(own.mean, np.asarray(np.mean([blocks[o].mean for o in far], axis=0)), yaw)
        if speed is not None:
            compared = " and ".join(wheels[o] for o in far)
            return Beside(speed, _noise(own, speed), np.ones(speed.size), np.zeros(speed.size), compared)
    if w in by_body:
        view = by_body[w]
        noise = _noise(own, view.speed) * np.sqrt(view.reach)
        return Beside(view.speed, noise, np.ones(own.mean.size), np.zeros(own.mean.size), view.name)
    return None


def _by_wheels(
    w: str,
    wheels: Mapping[str, str],
    blocks: Mapping[str, Blocks],
    body: tuple[Geometry | None, Array | None, Mapping[str, View]],
    usual: Mapping[str, Array],
) -> Beside | None:
    """What the other wheels say of one."""
    geometry, yaw, by_body = body
    others = [o for o in wheels if o != w and same_side(w, o, geometry)]
    gains = [(o, g) for o in others if (g := _gain(usual[w], usual[o])) is not None]
    speeds = [g * blocks[o].mean for o, g in gains]
    speed: Array | None = None
    across: Array | None = None
    if speeds:
        speed = np.asarray(np.median(np.array(speeds), axis=0))
        if len(speeds) == 2:  # of two that differ none is known to be right
            speed[
                np.abs(speeds[0] - speeds[1]) > _DIFFER * (np.abs(speed) + _DIFFER * np.nanquantile(np.abs(speed), 0.9))
            ] = np.nan
    elif yaw is not None and (far := [o for o in wheels if o != w and not same_side(w, o, geometry)]):
        others = far
        across = np.asarray(np.mean([blocks[o].mean for o in far], axis=0))
        speed = _turned(usual[w], np.asarray(np.mean([usual[o] for o in far], axis=0)), yaw)
        speed = None if speed is None else speed + across - np.mean([usual[o] for o in far], axis=0)
    if speed is None:
        return None
    nobody: Array | None = None
    if len(speeds) > 1:
        blame = np.ones(speed.size)
    elif all(o in by_body for o in (w, *others)):
        blame = blame_of([_off_body(blocks[o], by_body[o]) for o in (w, *others)])
    elif speeds and (away := _off_ground((w, *others), wheels, blocks, (geometry, yaw, by_body))):
        blame = blame_of(away)
    else:
        blame, nobody = blame_by_commands(blocks[w], [blocks[o] for o in others], speed)
    rough = np.asarray(np.max([blocks[o].rough for o in others], axis=0))
    noise = _noise(blocks[w], speed)
    alone = not speeds and len(wheels) == 2 and turns_by_wheels(blocks[w].mean, blocks[others[0]].mean)
    compared = " and ".join(wheels[o] for o in others)
    return Beside(speed, noise, blame, rough, compared, alone, across, nobody)


def _off_ground(
    side: Sequence[str],
    wheels: Mapping[str, str],
    blocks: Mapping[str, Blocks],
    body: tuple[Geometry | None, Array | None, Mapping[str, View]],
) -> list[Array]:
    """How far wheels of one side are off what the ground does under them, in usual misfits; none where commands say more, or it is not known."""
    if any(np.isfinite(blocks[o].low).any() for o in side):
        return []
    seen = [_by_motion(o, wheels, blocks, body) for o in side]
    return (
        [np.abs(blocks[o].mean - m.speed) / m.noise for o, m in zip(side, seen, strict=True) if m is not None]
        if all(seen)
        else []
    )


def turns_by_wheels(y: Array, x: Array) -> bool:
    """Whether two wheels are what turns the machine: they turn against each other, as those of a steered car never do.

    Both of shape (b,) [m/s].
    """
    least = _AGAINST * float(np.nanquantile(np.abs(x), 0.95))
    return bool(np.count_nonzero((y * x < 0.0) & (np.abs(y) > least) & (np.abs(x) > least)) >= _AGAINST_BLOCKS)


def _by_all_others(
    w: str, wheels: Mapping[str, str], blocks: Mapping[str, Blocks], usual: Mapping[str, Array]
) -> Beside | None:
    """What all other wheels together say of one, by how they belong together in most of the mission."""
    others = [o for o in wheels if o != w]
    if len(others) < _LEAST_TOGETHER:
        return None
    y, table = usual[w], np.column_stack([usual[o] for o in others])
    use = np.isfinite(y) & np.isfinite(table).all(axis=1)
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return None
    kept = use.copy()
    speed = y
    weights: Array = np.zeros(len(others))
    for _ in range(5):
        weights = np.asarray(np.linalg.lstsq(table[kept], y[kept], rcond=None)[0], dtype=np.float64)
        speed = table @ weights
        off = np.abs(y - speed)
        kept = use & (off <= np.quantile(off[use], 0.7))
    if np.median(np.abs(y - speed)[use]) > _TOGETHER * np.median(np.abs(y[use])):
        return None
    parts = np.column_stack([blocks[o].mean for o in others]) * weights
    speed = parts.sum(axis=1)
    blame, nobody = blame_by_commands(blocks[w], [blocks[o] for o in others], speed)
    rough = np.asarray(np.max([blocks[o].rough for o in others], axis=0))
    made = np.sqrt((parts**2).sum(axis=1))  # wheels may cancel each other, their errors do not
    compared = " and ".join(wheels[o] for o in others)
    return Beside(speed, _noise(blocks[w], speed, made), blame, rough, compared, nobody=nobody)


def _by_body(
    w: str, wheels: Mapping[str, str], blocks: Mapping[str, Blocks], by_body: Mapping[str, View]
) -> Beside | None:
    """What a sensor of the body says of a wheel; the misfit is the wheel's own where command, or other wheels, say so too."""
    if w not in by_body:
        return None
    view, own = by_body[w], blocks[w]
    rivals = [o for o in wheels if o != w and o in by_body]
    if np.isfinite(own.low).any():
        blame = blame_of([off_command(own), np.full(own.mean.size, _OWN_MISFIT)])
    elif rivals:
        blame = blame_of([_off_body(blocks[o], by_body[o]) for o in (w, *rivals)])
    else:
        return None
    noise = _noise(own, view.speed) * np.sqrt(view.reach)
    return Beside(view.speed, noise, blame, np.zeros(own.mean.size), f"{view.name}", own=not rivals)


def same_side(a: str, b: str, geometry: Geometry | None) -> bool:
    """Whether two wheels are fixed on one side of the machine."""
    if geometry is None or a not in geometry.wheels or b not in geometry.wheels:
        return False
    one, two = geometry.wheels[a], geometry.wheels[b]
    return one.axle == two.axle == "fixed" and one.y * two.y > 0.0


def _gain(y: Array, x: Array) -> float | None:
    """The gain that brings x to y; None where they do not move together."""
    use = np.isfinite(y) & np.isfinite(x) & (np.abs(x) > 0.1 * np.nanquantile(np.abs(x), 0.9))
    use &= y != 0.0  # a wheel at rest, or a dead sensor, tells no gain, for however long
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return None
    gain = float(np.median(y[use] / x[use]))
    off = np.abs(y[use] - gain * x[use])
    return gain if 0.5 < gain < 2.0 and np.median(off) < _ALIKE * np.median(np.abs(y[use])) else None


def _turned(y: Array, x: Array, yaw: Array) -> Array | None:
    """x and a share of the yaw rate, as they are beside y; None where these do not belong together."""
    use = np.isfinite(y) & np.isfinite(x) & np.isfinite(yaw)
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return None
    # every curve has one vote first: where a fault whirls the machine around, its yaw rate outweighs that of all others
    turning = use & (np.abs(yaw) >= float(np.median(np.abs(yaw[use])))) & (yaw != 0.0)
    k = float(np.median((y - x)[turning] / yaw[turning])) if turning.any() else 0.0
    off = np.abs(y - x - k * yaw)
    kept = use & (off <= np.quantile(off[use], 0.7))
    for _ in range(4):
        power = float(yaw[kept] @ yaw[kept])
        k = float(yaw[kept] @ (y - x)[kept]) / power if power > 0 else 0.0
        off = np.abs(y - x - k * yaw)
        kept = use & (off <= np.quantile(off[use], 0.7))
    moved = max(float(np.median(np.abs(z[use]))) for z in (y, x))
    return x + k * yaw if np.median(np.abs(y - x - k * yaw)[use]) < _ALIKE * moved else None


def _noise(blocks: Blocks, speed: Array, made: Array | None = None) -> Array:
    """Usual misfit of a view, larger where the speed changes; `made` is the size of what it is put together from, its own where that is None."""
    off = np.abs(blocks.mean - speed)
    known = np.isfinite(off)
    change = np.abs(np.gradient(np.where(np.isfinite(speed), speed, 0.0)))
    floor = 1.5 * float(np.median(off[known]))
    return np.asarray(
        floor
        + _SHARE * np.abs(speed if made is None else made)
        + 0.5 * change
        + 0.01 * float(np.quantile(np.abs(speed[known]), 0.9))
    )


def _off_body(blocks: Blocks, view: View) -> Array:
    """Misfit beside a sensor of the body, in usual ones."""
    return np.abs(blocks.mean - view.speed) / _noise(blocks, view.speed)
