"""What turns of the machine say against the places that the machine file gives to wheels and steering axles.

A machine turns to the left by what its right wheels run faster, whatever fails in it. Where the wheels' difference, the measured
yaw rate, the steering angles and the commanded yaw rate do not turn alike, in turns to both sides, one of them is somewhere else
than the machine file says, or counts the other way round.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of, quantile_of
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_STEP_S = 0.1
_MOST = 100_000  # moments that are looked at
_TURNS = 0.3  # of the usual turn, and [rad/s] or [1/m] at least `_LEAST_TURN`: less of one is none
_USUAL = 0.9  # quantile
_LEAST_TURN = 0.02
_LEAST_S = 3.0  # of turning to each side
_MOST_OF = 0.85  # of that time, which must agree
_MOVES = 0.2  # of the usual speed
_STILL, _STILL_S = 0.01, 1.0  # m/s; at rest for this long, a gyro shows its bias
_LATE_S = 0.5  # by which the machine may follow a command
_SHORTEST = 0.1  # m
_TRIMMED, _SOUND, _APART = 0.2, 0.8, 0.95
_HALF = 0.5
_STRAFES = 0.05  # m/s
_ONE_VALUE = 0.98  # of the moments


class _Pair(NamedTuple):
    """Two wheels that stand beside each other, and the turn by their difference [rad/s], shape (n,)."""

    left: str
    right: str
    turn: Array


class _View(NamedTuple):
    """A turn [rad/s], shape (n,), by something else than the wheels, and what it is called."""

    name: str
    what: str
    turn: Array


def place_doubts(line: Timeline, machine: Machine) -> tuple[str, ...]:
    """Sentences on wheels, axles and signs that the turns of a mission contradict; none where all agree, or little turned.

    Parameters
    ----------
    line : Timeline
        The mission.
    machine : Machine
        With the places of its wheels.
    """
    if machine.geometry is None or machine.speed_unit != "m/s":
        return ()
    step = max(1, round(_STEP_S / line.dt), line.size // _MOST)
    seen = {n: np.asarray(v[::step], dtype=np.float64) for n, v in line.signals.items()}
    if "cmd.lateral" in seen and np.nanstd(seen["cmd.lateral"]) > _STRAFES:
        return ()
    dt = line.dt * step
    speed = _speed(seen, machine)
    pairs = list(_pairs(seen, machine))
    views = [*_measured(seen, speed, dt), *_steered(seen, machine, speed), *_commanded(seen, dt)]
    return tuple(_doubts(pairs, views, seen, machine, speed, dt))


def measured_turns(line: Timeline, machine: Machine) -> tuple[Array, Array, float, float] | None:
    """Turn by the wheels' differences and by the gyro [rad/s], each of shape (m,), the mean track [m], and the step of both [s].

    None where wheels without places, or no gyro, are in the log, or the machine also goes sideways.
    """
    if machine.geometry is None or machine.speed_unit != "m/s":
        return None
    step = max(1, round(_STEP_S / line.dt), line.size // _MOST)
    names = ["imu.yaw_rate", "cmd.lateral", *(f"wheel.{w}.v" for w in machine.wheels)]
    seen = {n: _medians(line.signals[n], step) for n in names if n in line.signals}
    if "cmd.lateral" in seen and np.nanstd(seen["cmd.lateral"]) > _STRAFES:
        return None
    dt, pairs = line.dt * step, list(_pairs(seen, machine))
    if not pairs or "imu.yaw_rate" not in seen:
        return None
    places = machine.geometry.wheels
    track = float(np.mean([places[p.left].y - places[p.right].y for p in pairs]))
    return np.asarray(np.mean([p.turn for p in pairs], axis=0)), seen["imu.yaw_rate"], track, dt


def _medians(x: Array, width: int) -> Array:
    """Medians of `width` steps each, shape (m,); NaN where one is not known. `x` of shape (n,)."""
    return np.asarray(median_of(x[: x.size // width * width].reshape(-1, width), axis=1), dtype=np.float64)


def _doubts(
    pairs: list[_Pair], views: list[_View], seen: Mapping[str, Array], machine: Machine, speed: Array, dt: float
) -> Iterator[str]:
    signs = {view.name: [_alike(p.turn, view.turn, dt) for p in pairs] for view in views}
    for k, pair in enumerate(pairs):
        own = [s[k] for s in signs.values() if s[k]]
        rest = [s[j] for s in signs.values() for j in range(len(pairs)) if j != k and s[j]]
        if own and rest and set(own) == {-1} and set(rest) == {1}:
            yield f"{pair.left} and {pair.right} are exchanged: they turn against {_joined(['the other wheels', *(v.what for v in views if signs[v.name][k])])}"
            return
    whole = {name: next(iter(set(s) - {0})) for name, s in signs.items() if len(set(s) - {0}) == 1}
    against = [v for v in views if whole.get(v.name) == -1]
    if against and 1 not in whole.values():
        wheels = " and ".join(f"{p.left} with {p.right}" for p in pairs)
        named = _joined([v.what for v in against])
        if len(against) > 1:
            yield f"left and right are exchanged ({wheels}): the wheels turn against {named}"
        else:
            yield f"left and right are exchanged ({wheels}), or {against[0].name} has the wrong sign: the wheels turn against {named}"
        return
    axles = _axles(seen, machine, speed, views, pairs, whole, dt)
    if axles:
        yield axles
    others = [v for v in views if whole.get(v.name) == 1]
    for view in against:
        if view.name.startswith("steer.") and axles:
            continue
        who = view.name
        if who.startswith("steer."):
            two = " and " in who
            who += (
                f" {'are exchanged or have' if two else 'stands at the other end of the machine or has'} the wrong sign"
            )
        else:
            who += " has the wrong sign"
        yield f"{who}: {view.what} turns against {_joined(['the wheels', *(v.what for v in others)])}"


def _joined(names: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return " and ".join(n for n in (", ".join(names[:-1]), *names[-1:]) if n)


def _speed(seen: Mapping[str, Array], machine: Machine) -> Array:
    """Speed of the machine by the median of its wheels [m/s], shape (n,)."""
    speeds = [seen[n] for w in machine.wheels if (n := f"wheel.{w}.v") in seen]
    if not speeds:
        return np.full(len(next(iter(seen.values()), np.empty(0))), np.nan)
    side = np.column_stack(speeds)
    known = np.isfinite(side).all(axis=1)
    return np.where(known, median_of(np.where(np.isfinite(side), side, 0.0), axis=1), np.nan)


def _pairs(seen: Mapping[str, Array], machine: Machine) -> Iterator[_Pair]:
    """Wheels beside each other on one axle or at one place along the machine."""
    assert machine.geometry is not None
    places = machine.geometry.wheels
    live = [w for w in machine.wheels if w in places and _lives(seen.get(f"wheel.{w}.v"))]
    for a, b in combinations(live, 2):
        left, right = (a, b) if places[a].y > places[b].y else (b, a)
        apart = places[left].y - places[right].y
        if apart < _SHORTEST or abs(places[a].x - places[b].x) > 0.1 * apart:
            continue
        if sum(abs(p.x - places[a].x) <= 0.1 * apart for p in places.values()) != 2:
            continue  # twin wheels: which is the other's is not told
        yield _Pair(left, right, (seen[f"wheel.{right}.v"] - seen[f"wheel.{left}.v"]) / apart)


def _lives(speed: Array | None) -> bool:
    """Whether a speed is logged, and is more than one value: a dead one turns the machine by nothing that it does."""
    known = np.zeros(0) if speed is None else speed[np.isfinite(speed)]
    return bool(known.size and np.mean(known == median_of(known)) < _ONE_VALUE)


def _measured(seen: Mapping[str, Array], speed: Array, dt: float) -> Iterator[_View]:
    yaw = seen.get("imu.yaw_rate")
    if yaw is None:
        return
    rest = (np.abs(speed) < _STILL) & np.isfinite(yaw)
    bias = float(median_of(yaw[rest])) if np.count_nonzero(rest) * dt >= _STILL_S else 0.0
    yield _View("imu.yaw_rate", "the measured yaw rate", yaw - bias)


def _tangents(seen: Mapping[str, Array], machine: Machine) -> list[tuple[str, float, Array]]:
    """Axles with a measured angle, and the unsteered wheels: name, place along the machine [m], tangent of the angle, from front to rear."""
    geometry = machine.geometry
    assert geometry is not None
    found = [
        (a, geometry.axle_x(a), np.tan(np.clip(seen[n], -1.5, 1.5)))
        for a in geometry.axles
        if (n := f"steer.{a}.phi") in seen
    ]
    if found and any(w.axle == "fixed" for w in geometry.wheels.values()):
        found.append(("fixed", geometry.still_x, np.zeros_like(found[0][2])))
    return sorted(found, key=lambda row: -row[1])


def _steered(seen: Mapping[str, Array], machine: Machine, speed: Array) -> Iterator[_View]:
    ends = _tangents(seen, machine)
    if len(ends) < 2 or (length := ends[0][1] - ends[-1][1]) < _SHORTEST:
        return
    names = [f"steer.{a}.phi" for a, _, _ in (ends[0], ends[-1]) if a != "fixed"]
    yield _View(" and ".join(names), "the steering", speed * (ends[0][2] - ends[-1][2]) / length)


def _commanded(seen: Mapping[str, Array], dt: float) -> Iterator[_View]:
    turn = seen.get("cmd.omega")
    if turn is not None:
        late = min(round(_LATE_S / dt), len(turn) - 1)
        yield _View(
            "cmd.omega", "the commanded yaw rate", np.concatenate([np.full(late, np.nan), turn[: len(turn) - late]])
        )


def _alike(a: Array, b: Array, dt: float) -> int:
    """1 where two turns are to the same side nearly always, −1 where nearly never, 0 where neither, or too little is known.

    Turns to both sides must say so: a difference that stays is none.
    """
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    if not a.size:
        return 0
    least = [max(_TURNS * float(quantile_of(np.abs(x), _USUAL)), _LEAST_TURN) for x in (a, b)]
    clear = (np.abs(a) > least[0]) & (np.abs(b) > least[1])
    shares = []
    for side in (clear & (b > 0), clear & (b < 0)):
        if np.count_nonzero(side) * dt < _LEAST_S:
            return 0
        shares.append(float(np.mean(a[side] * b[side] > 0)))
    return 1 if min(shares) >= _MOST_OF else -1 if max(shares) <= 1 - _MOST_OF else 0


def _axles(
    seen: Mapping[str, Array],
    machine: Machine,
    speed: Array,
    views: list[_View],
    pairs: list[_Pair],
    whole: Mapping[str, int],
    dt: float,
) -> str:
    """What the turns say of two steered axles: ω·L/v = c₁·tan φ₁ − c₂·tan φ₂ with both c near 1; empty where they are right or not told."""
    ends = _tangents(seen, machine)
    if len(ends) != 2 or "fixed" in (ends[0][0], ends[1][0]) or not pairs:
        return ""
    yaw = next((v.turn for v in views if v.name == "imu.yaw_rate" and whole.get(v.name) == 1), None)
    turn = yaw if yaw is not None else np.mean([p.turn for p in pairs], axis=0)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        path = turn * (ends[0][1] - ends[1][1]) / speed
    x = np.column_stack([ends[0][2], -ends[1][2]])
    known = np.isfinite(path) & np.isfinite(x).all(axis=1)
    known &= np.abs(speed) > _MOVES * float(quantile_of(np.abs(speed[np.isfinite(speed)]), _USUAL))
    x, y = x[known], path[known]
    if len(y) * dt < 4 * _LEAST_S or min(np.std(x, axis=0)) < _LEAST_TURN:
        return ""
    first, second = (f"steer.{a}" for a, _, _ in ends)
    if abs(float(np.corrcoef(x[:, 0], x[:, 1])[0, 1])) > _APART:
        return ""  # both always steer alike: the sign of the steering as a whole is all that shows
    kept = np.ones(len(y), np.bool_)
    for _ in range(3):
        c = np.linalg.lstsq(x[kept], y[kept], rcond=None)[0]
        off = np.abs(y - x @ c)
        kept = off <= quantile_of(off, 1 - _TRIMMED)
    if 1 - float(np.sum(off[kept] ** 2)) / float(np.sum(y[kept] ** 2)) < _SOUND or min(abs(c)) < _HALF:
        return ""
    by = "the measured yaw rate" if yaw is not None else "what the wheels turn"
    if max(c) < 0:
        return f"{first} and {second} are exchanged, or both have the wrong sign: {by} contradicts their angles"
    wrong = [n for n, k in zip((first, second), c, strict=True) if k < 0]
    return f"{wrong[0]}.phi has the wrong sign: {by} contradicts it" if wrong else ""
