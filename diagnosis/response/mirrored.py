"""Wheels whose answer to their commands was learned from a fault: held against the wheels that mirror them.

A wheel that is scaled, or slips, over a whole mission is so in speed and in turns alike, and a wrong track is wrong for both sides. So the
share of the turn beside that of the speed is one for all wheels as far out, or a fault that came and went is in one of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.beside import same_side
from diagnosis.response.identification import Response, as_another, beyond
from diagnosis.response.inputs import FollowerData, cells
from diagnosis.results.plain_numbers import plain
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ALIKE = 0.75  # of the turn of another wheel as far out, by the speed of each: healthy ones are nearer
_LIKE_SPEED = 0.8  # of the speed that another wheel makes of a command: less is said of a wheel elsewhere
_FAR = 3.0  # usual misfits by which two answers differ
_SHOWN_S = 2.0  # for which they must: else it is all one
_BETTER = 0.67  # of the time that a wheel is off another's answer: so much less says which of two is right
_AS_BUILT = 0.25  # of the turn by the geometry: so near is right, if the other is further
_COLUMNS = 2  # speed and yaw rate


class Mirrored(NamedTuple):
    """Answers after they were held against each other, and a sentence for each wheel whose own one cannot be right."""

    answers: dict[str, Response]
    doubts: dict[str, str]


def mirrored(
    data: Mapping[str, FollowerData],
    answers: Mapping[str, Response],
    geometry: Geometry | None,
    cell: int,
    dt: float,
) -> Mirrored:
    """Answers to commands of the body, that of a wheel which turns otherwise than its mirror replaced by what that makes of them.

    Parameters
    ----------
    data : Mapping[str, FollowerData]
        All drives, by wheel.
    answers : Mapping[str, Response]
        What each was found to make of its commands.
    geometry : Geometry or None
        Says how far out wheels are, and on which side.
    cell : int
        Steps of a cell.
    dt : float
        Step [s].
    """
    made = turns_made(data, answers, geometry)
    if geometry is None or len(made) < 2:
        return Mirrored(dict(answers), {})
    odd = [w for w, x in made.items() if not _alike(x, float(np.median([y for o, y in made.items() if o != w])))]
    pairs = [(w, o) for w in odd for o in made if o != w and _comparable(answers, data, w, o)]
    swapped = {
        p: as_another(answers[p[1]], data[p[0]].commands, _share(p, geometry, data, answers), cell * dt) for p in pairs
    }
    pairs = [p for p in pairs if _matters(answers[p[0]], swapped[p], cell * dt)]
    out, doubts = dict(answers), {}
    for w in dict.fromkeys(w for w, _ in pairs):
        others = [o for a, o in pairs if a == w and o not in odd] or [o for a, o in pairs if a == w]
        off: dict[tuple[str, str], int] = {}
        for o in others:
            both = [x for p, x in swapped.items() if {*p} == {w, o}]
            usual = np.minimum(answers[w].noise, answers[o].noise)  # a fault of long makes its own misfit look usual
            # what is too small lies within a change of the answer, what is too large does not
            calm = np.logical_and.reduce([x.high - x.low < usual for x in both])
            # elsewhere both say the same, and a fault there is off either
            turns = calm & (np.abs(answers[w].expected - swapped[w, o].expected) > _FAR * usual)
            off |= {p: _off(data[p[0]], x, usual, turns, cell) for p, x in swapped.items() if {*p} == {w, o}}
        other = min(others, key=lambda o: off[w, o])
        if other not in odd or _right(other, (w, other), made, off):
            out[w], doubts[w] = swapped[w, other], _words(w, other, made) + "it was off in most of the turns"
    return Mirrored(out, doubts)


def turns_made(
    data: Mapping[str, FollowerData], answers: Mapping[str, Response], geometry: Geometry | None
) -> dict[str, float]:
    """What each fixed wheel makes of a turn beside what it makes of a speed, by its place: 1 as the machine is built, below 0 the other way.

    Parameters are those of `mirrored`.
    """
    out: dict[str, float] = {}
    for w, answer in answers.items():
        place = None if geometry is None else geometry.wheels.get(w)
        if place is None or place.axle != "fixed" or place.y == 0.0 or data[w].commands.shape[1] != _COLUMNS:
            continue
        speed, turn = answer.left(data[w].commands)
        if speed > 0.0:
            out[w] = float(-turn / speed / place.y)
    return out


def _alike(one: float, other: float) -> bool:
    small, large = sorted((one, other))
    return large > 0.0 and small >= _ALIKE * large


def _speed(answer: Response, data: FollowerData) -> float:
    return float(answer.left(data.commands)[0])


def _comparable(answers: Mapping[str, Response], data: Mapping[str, FollowerData], one: str, other: str) -> bool:
    a, b = _speed(answers[one], data[one]), _speed(answers[other], data[other])
    return b > 0.0 and _LIKE_SPEED <= a / b <= 1.0 / _LIKE_SPEED


def _share(
    pair: tuple[str, str], geometry: Geometry, data: Mapping[str, FollowerData], answers: Mapping[str, Response]
) -> Array:
    """Of the weights of the second wheel, what the first one makes if it answers as that does, in its own size."""
    one, other = pair
    size = _speed(answers[one], data[one]) / _speed(answers[other], data[other])
    out = abs(geometry.wheels[one].y / geometry.wheels[other].y)
    return size * np.array([1.0, out if same_side(one, other, geometry) else -out])


def _matters(own: Response, swapped: Response, h: float) -> bool:
    """Whether two answers say something else of this mission for long enough."""
    apart = np.abs(own.expected - swapped.expected) > _FAR * np.minimum(own.noise, swapped.noise)
    return bool(np.count_nonzero(apart) * h >= _SHOWN_S)


def _off(data: FollowerData, answer: Response, usual: Array, turns: Flags, cell: int) -> int:
    """Cells of `turns` in which a wheel is far off an answer; `usual` misfit [m/s] and `turns` of shape (cells,)."""
    return int(np.count_nonzero(turns & (np.abs(beyond(cells(data.y, cell), answer.low, answer.high)) > _FAR * usual)))


def _right(wheel: str, pair: tuple[str, str], made: Mapping[str, float], off: Mapping[tuple[str, str], int]) -> bool:
    """Whether the answer of a wheel of a pair that contradicts each other is the right one: it explains more of both, or is as built.

    `off` are cells in which the first of two wheels is off the answer of the second.
    """
    other = pair[0] if wheel == pair[1] else pair[1]
    if (other, wheel) in off and (wheel, other) in off:
        mine, its = off[other, wheel], off[wheel, other]
        if min(mine, its) < _BETTER * max(mine, its):
            return mine < its
    near = {w: abs(made[w] - 1.0) <= _AS_BUILT for w in pair}
    return near[wheel] and not near[other]


def _words(wheel: str, other: str, made: Mapping[str, float]) -> str:
    return (
        f"beside what it makes of a commanded speed, it makes {plain(made[wheel], 2)} of a commanded turn where {{wheel}} {other} makes "
        f"{plain(made[other], 2)} (1 is what the machine file says): "
    )
