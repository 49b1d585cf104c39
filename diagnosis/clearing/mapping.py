"""Signals that look as if the machine file had their sign, their unit or their place wrong."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from math import pi
from typing import NamedTuple

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lowest_passed
from diagnosis.clearing.still import rate_of
from replay.arrays.quantiles import median_known, median_of

_LAG_S = 0.3  # of what follows a command
_MOVED = 0.3  # of the largest value: less of it says nothing
_LEAST_S = 5.0
_AGAINST, _MOVES_AGAINST = -0.8, -0.5  # correlation, about zero and about the means
_STEADY, _SMALL = 0.1, 0.1  # of its size: a command that varies by less, a reading that is less
_APART, _EVEN = 0.08, 0.12  # of a factor from a known one, and how much it may vary [ln]
_BRIEFLY_S, _ELSE_S = (
    1.0,
    3.0,
)  # of a stretch; of all stretches in which a signal has its right size: it is then no other one throughout
_NEARER = 0.5  # of its factor [ln]: a stretch with less of it is nearer to the right size
_TRACKS = 0.3  # by how much a loop usually stays behind its command [ln]
_GEARED = 1.2
_NO_LOOP = 1.1  # ln: a third of its command, or three times as much, over a whole mission
_BETTER = 0.5  # of what is left, once two are swapped
_DIFFER = 0.04  # of the largest value: two that are more alike cannot be told from each other

#: Factors between units that are mixed up, and what they are.
_FACTORS: tuple[tuple[float, str], ...] = (
    (2.0, "twice"),
    (0.5, "half"),
    (3.6, "3.6 times (km/h read as m/s?)"),
    (1 / 3.6, "1/3.6 times (m/s read as km/h?)"),
    (180 / pi, "57.3 times (degrees read as radians?)"),
    (pi / 180, "1/57.3 times (radians read as degrees?)"),
    (30 / pi, "9.55 times (turns per minute read as rad/s?)"),
    (pi / 30, "1/9.55 times (rad/s read as turns per minute?)"),
    (100.0, "100 times (percent read as a fraction?)"),
    (0.01, "1/100 times (a fraction read as percent?)"),
    (1000.0, "1000 times"),
    (0.001, "1/1000 times"),
)

_LOOK = (
    "look at its entry under [signals] of a machine file (channel, sign, unit or scale) before any part is replaced."
)


_OTHERS, _ASKS_MORE = (
    2,
    0.22,
)  # loops beside it; by how much more, or less, one asks than they do [ln]: what wheels usually differ by is .05
_STILL = 0.1  # of the other's size: what is so small follows nothing

_ALL, _ONE_FACTOR = 3, 0.15  # signals that differ by one factor, and by how much it may differ [ln]


class Hint(NamedTuple):
    """A signal that fits another sign, unit or place better.

    Attributes
    ----------
    component : str
        Wheel or axle; the first one of two that are swapped.
    backwards : bool
        Whether it runs against what it should follow.
    text : str
        A sentence.
    exchanged : tuple[str, ...]
        Parts whose measured openings follow each other's commands, or whose signal is off by the factor of all: nothing that is found of them
        is theirs.
    """

    component: str
    backwards: bool
    text: str
    exchanged: tuple[str, ...] = ()


def mapping_hints(cells: Cells) -> tuple[Hint, ...]:
    """Signals that fit another sign, unit or place better over the whole mission; none where all fit.

    A fault that lasts from start to end can look alike: its sentence asks for the machine file to be looked at first.
    """
    return cells.once_beside("mapping hints", lambda: _all_hints(cells))


def _all_hints(cells: Cells) -> tuple[Hint, ...]:
    machine, wanted = cells.machine, cells.reference
    with warnings.catch_warnings():  # means without any value
        warnings.simplefilter("ignore", RuntimeWarning)
        speeds, angles = cells.wheels("v"), cells.axles("phi")
        return (
            *_hints(
                cells,
                speeds,
                wanted,
                [f"wheel.{w}.v" for w in machine.wheels],
                "its commanded speed",
                works=cells.wheels("u"),
            ),
            *_openings(
                cells, cells.wheels("u"), wanted, [f"wheel.{w}.u" for w in machine.wheels], "its commanded speed"
            ),
            *_hints(
                cells, angles, cells.axles("phi_ref"), [f"steer.{a}.phi" for a in machine.axles], "its commanded angle"
            ),
            *_openings(
                cells,
                cells.axles("u"),
                rate_of(angles, cells.dt),
                [f"steer.{a}.u" for a in machine.axles],
                "the rate of its angle",
            ),
            *_measured(cells, "wheel", machine.wheels, cells.wheels),
            *_measured(cells, "steer", machine.axles, cells.axles),
        )


def _measured(cells: Cells, kind: str, parts: Sequence[str], of: Callable[[str], Array]) -> Iterator[Hint]:
    """Hints for measured openings, beside their commands: of their size a fault says as much."""
    names = [f"{kind}.{part}.u_applied" for part in parts]
    yield from _hints(cells, of("u_applied"), of("u"), names, "its command", sizes=False, measured=True)


def _openings(cells: Cells, opening: Array, wanted: Array, names: Sequence[str], what: str) -> Iterator[Hint]:
    """Hints for valve commands, whose size says nothing, by what they cause."""
    scaled = opening * (np.nanmean(np.abs(wanted), axis=0) / np.maximum(np.nanmean(np.abs(opening), axis=0), 1e-6))
    yield from _hints(cells, scaled, wanted, names, what, sizes=False)


def _hints(
    cells: Cells,
    signals: Array,
    wanted: Array,
    names: Sequence[str],
    what: str,
    *,
    sizes: bool = True,
    measured: bool = False,
    works: Array | None = None,
) -> Iterator[Hint]:
    """Hints for signals, each of which follows its own of `wanted`, both (cells, n); `measured`: whatever else is wrong.

    `works`, of that shape too, are the openings that their loops ask for: where one believes what it reads, the size is no matter of the file.
    """
    if not signals.size or not np.isfinite(wanted).any():
        return
    follows = np.where(np.isfinite(wanted), lowest_passed(wanted, cells.dt, _LAG_S if sizes else cells.dt), np.nan)
    told: set[int] = set()
    for i, j in combinations(range(len(names)), 2):
        if _swapped(signals[:, [i, j]], follows[:, [i, j]], cells.dt):
            told |= {i, j}
            one, other = _part(names[i]), _part(names[j])
            text = f"{names[i]} follows {what.replace('its', 'the')} of {other}, and {names[j]} that of {one}: {_LOOK}"
            yield Hint(one, backwards=False, text=text, exchanged=(one, other) if measured else ())
    rest = [i for i in range(len(names)) if i not in told]
    pairs = {i: pair for i in rest if len((pair := _moving(signals[:, i], follows[:, i]))[0]) * cells.dt >= _LEAST_S}
    ratios = {i: _ratio(*pair) for i, pair in pairs.items()}
    usual = float(median_of([r for r in ratios.values() if np.isfinite(r)] or [0.0]))
    known = [r for r in ratios.values() if np.isfinite(r)]
    all_alike = len(known) >= _ALL and len(known) == len(names) and float(np.ptp(known)) < _ONE_FACTOR
    for i, (y, x) in pairs.items():
        if _against(y, x):
            text = f"{names[i]} runs against {what} throughout: {_LOOK}"
            yield Hint(_part(names[i]), backwards=True, text=text)
        elif (
            sizes
            and not (works is not None and _believed(works, follows, i, ratios[i]))
            and _throughout(*pairs[i], ratios[i], cells.dt)
            and (words := _factor(ratios[i] - (usual if abs(usual) < _TRACKS else 0.0), cells.machine.gear_ratio))
        ):
            # one factor of all of them is a unit's or a size's, and no part's fault
            own = (_part(names[i]),) if all_alike else ()
            text = f"{names[i]} is {words} {what} throughout: {_LOOK}"
            yield Hint(_part(names[i]), backwards=False, text=text, exchanged=own)


def _moving(y: Array, x: Array) -> tuple[Array, Array]:
    """Both where x is large."""
    use = np.isfinite(y) & np.isfinite(x) & (np.abs(x) > _MOVED * np.nanmax(np.abs(x), initial=0.0))
    return y[use], x[use]


def _believed(works: Array, follows: Array, i: int, ratio: float) -> bool:
    """Whether the loop of a signal asks for more where that is too small, or for less where it is too large, beside the others' loops.

    A wheel whose drive is dead is dragged along at a share of its speed, with a loop that opens ever more; a channel that the file reads at half is
    none that any loop sees. `works` and `follows` of shape (cells, n), `ratio` its size [ln].
    """
    asked = np.array([_asked(works[:, k], follows[:, k]) for k in range(works.shape[1])])
    others = np.delete(asked, i)
    if np.count_nonzero(np.isfinite(others)) < _OTHERS or not np.isfinite(asked[i]):
        return False
    more = asked[i] - float(median_known(others))
    return bool(more * np.sign(-ratio) > _ASKS_MORE)


def _asked(u: Array, x: Array) -> float:
    """ln of an opening by the commanded speed; NaN where it is not known."""
    opening, speed = _moving(np.abs(u), np.abs(x))
    if not opening.size or not median_of(opening) > 0.0:
        return np.nan
    return float(np.log(median_of(opening / speed)))


def _part(name: str) -> str:
    return name.split(".")[1]


def _against(y: Array, x: Array) -> bool:
    """Whether y is −x by and large, and moves so: a reading that stays where it is runs nowhere."""
    moves = float(np.std(x)) < _STEADY * _rms(x) or _alike(y - y.mean(), x - x.mean()) < _MOVES_AGAINST
    return _alike(y, x) < _AGAINST and moves and _rms(y) > _SMALL * _rms(x)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x)))


def _alike(y: Array, x: Array) -> float:
    """Correlation about zero; 0 where either rests."""
    power = float(y @ y) * float(x @ x)
    return float(y @ x) / power**0.5 if power > 0.0 else 0.0


def _ratio(y: Array, x: Array) -> float:
    """ln of y by x; NaN where it varies."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        ratio = np.log(y / x)
    ratio = ratio[np.isfinite(ratio)]
    if ratio.size < 0.9 * x.size:
        return np.nan
    middle = float(median_of(ratio))
    return middle if 1.4826 * float(median_of(np.abs(ratio - middle))) < _EVEN else np.nan


def _throughout(y: Array, x: Array, ratio: float, dt: float) -> bool:
    """Whether y has its ratio [ln] to x in all parts of a mission: what fails has its right size before, or after.

    Of shape (n,) each, where x is large.
    """
    width = max(1, round(_BRIEFLY_S / dt))
    count = y.size // width
    if not count or not np.isfinite(ratio):
        return True
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.log(np.abs(y[: count * width]) / np.abs(x[: count * width])).reshape(count, width)
    right = np.abs(median_of(size, axis=1)) < _NEARER * abs(ratio)
    return bool(np.count_nonzero(right) * width * dt < _ELSE_S)


def _factor(ratio: float, gear: float) -> str:
    """A factor in words: a known one, that of the gear, or one that no loop stays behind by; empty for any other."""
    words = next((words for factor, words in _FACTORS if abs(ratio - np.log(factor)) < _APART), "")
    if not words and gear > _GEARED and abs(abs(ratio) - np.log(gear)) < _TRACKS:
        read = "(the motor's speed read as the wheel's?)", "(the wheel's speed read as the motor's?)"
        words = f"{gear:g} times {read[0]}" if ratio > 0.0 else f"1/{gear:g} times {read[1]}"
    return words or (f"{np.exp(ratio):.2g} times" if abs(ratio) > _NO_LOOP else "")


def _swapped(measured: Array, wanted: Array, dt: float) -> bool:
    """Whether two signals, (cells, 2), follow each other's command much better than their own; `dt` in s."""
    use = np.isfinite(measured).all(axis=1) & np.isfinite(wanted).all(axis=1)
    y, x = measured[use], wanted[use]
    if len(y) * dt < _LEAST_S or np.mean(np.abs(x[:, 0] - x[:, 1])) < _DIFFER * np.max(np.abs(x)):
        return False
    sizes = [_rms(z) for z in y.T]
    if min(sizes) < _STILL * max(sizes):
        return False
    own, other = (np.mean(np.abs(y - z), axis=0) for z in (x, x[:, ::-1]))
    if np.any(own < _BETTER * other):
        return False  # a weak valve opens as its neighbour is told, whose loop asks for less; the neighbour follows its own command
    y = y * (np.abs(x).sum() / max(float(np.abs(y).sum()), 1e-9))  # loops stay behind their commands
    own, other = (np.mean(np.abs(y - z)) for z in (x, x[:, ::-1]))
    return bool(other < _BETTER * own)
