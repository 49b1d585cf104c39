"""Speeds of all wheels that are one factor off their second measurements: a size or a unit of the machine file, and no sensor's fault."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of, quantile_of
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_text import signal_line
from replay.machine.units import known_unit
from replay.signals.signal import Signal
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_MOST = 40_000  # moments that are looked at
_MOVED = 0.3  # of the largest speed: slower says nothing of a factor
_LEAST, _LEAST_S = 60, 5.0  # samples, and time, of what a factor is taken from
_PARTS = 3  # of a mission, in each of which the factor is the same
_EVEN, _ALIKE = 0.12, 0.03  # ln; by how much it varies at a wheel, and from part to part and wheel to wheel
_SOME, _FITS = np.log(1.08), 0.05  # ln; a factor that would be stated as a loss, and one that is none
_SLIPS = 0.1  # ln; a speed of the wheels agrees with one of the body to so much: tyres slip
_STRAIGHT = 0.1  # of the speed, by which wheels that go straight on may differ
_WHEELS = 2
_TURNING = ("rad/s", "rpm", "deg/s", "rev/s")
_SECOND = "_true"


class SpeedDoubt(NamedTuple):
    """Speeds whose scale is in doubt.

    Attributes
    ----------
    names : tuple[str, ...]
        Signals that are to be multiplied before any of them is judged.
    factor : float
        By what [1].
    text : str
        What speaks against their scale, a sentence without its stop.
    act : str
        What to write in the machine file.
    """

    names: tuple[str, ...]
    factor: float
    text: str
    act: str

    @property
    def first_factor(self) -> float:
        """By what the first speeds are multiplied [1]."""
        return 1.0 if self.names[0].endswith(_SECOND) else self.factor


class Witness(NamedTuple):
    """What measures the speed of the body by itself.

    Attributes
    ----------
    name : str
        What it is, in words.
    speed : Array, shape (b,)
        Mean of each block, without its sign [m/s]; NaN where unknown.
    width : int
        Steps of a block.
    """

    name: str
    speed: Array
    width: int


def speed_doubt(
    timeline: Timeline,
    items: Mapping[str, Signal],
    machine: Machine,
    witnesses: Callable[[], Sequence[Witness]] = tuple,
) -> SpeedDoubt | None:
    """What speaks against the scale of all wheels' speeds, or of all second ones; None where nothing does.

    Two speeds of every wheel that differ by one factor from start to end differ by what all of them share: a wheel's size, a gear
    or a unit. Which of both is wrong is told by what measures the body, where one of them agrees with that, else by the commanded speeds,
    which a loop follows by the speed that it reads; without any, the first ones are taken.

    Parameters
    ----------
    timeline : Timeline
        The mission.
    items : Mapping[str, Signal]
        Its signals, for how each was recorded; samples are not looked at.
    machine : Machine
        Its wheels and sizes.
    witnesses : Callable[[], Sequence[Witness]]
        What measures the body, asked for only in doubt; none that is made of the wheels' speeds.
    """
    every = max(1, timeline.size // _MOST)
    pairs = [w for w in machine.wheels if {f"wheel.{w}.v", f"wheel.{w}.v{_SECOND}"} <= timeline.signals.keys()]
    factors = {w: f for w in pairs if (f := _of_wheel(timeline, w, every)) is not None}
    if len(factors) < _WHEELS:
        return None
    logs = np.array(list(factors.values()))
    middle = float(median_of(logs))
    alike = int(np.count_nonzero(np.abs(logs - middle) < _ALIKE))
    if abs(middle) < _SOME or alike < _WHEELS or 2 * alike <= len(pairs) or np.any(np.abs(logs) < _FITS):
        return None
    second, by = next(
        (
            (told, f", where by {w.name} the {'first' if told else 'second'} ones are right")
            for w in witnesses()
            if (told := _by(w, timeline, pairs)) is not None
        ),
        (_second_is_wrong(timeline, pairs, every), ""),
    )
    leaf, factor = (f"v{_SECOND}", np.exp(middle)) if second else ("v", np.exp(-middle))
    wrong = [f"wheel.{w}.{leaf}" for w in pairs]
    names = tuple(wrong if second else [n for w in pairs for n in (f"wheel.{w}.v", f"wheel.{w}.v_position")])
    text = (
        f"The speeds of all {machine.part}s are {np.exp(middle):.2f} times their second speeds (such as {wrong[0].rsplit('.', 1)[0]}.v{_SECOND}) "
        f"throughout{by}, which is no sensor's fault but a size or a unit in the machine file: they were judged as if it were right"
    )
    origins = {n: items[n].origin if n in items else SignalSource() for w in pairs for n in _both(w)}
    lines = _lines(wrong[0], origins, machine, float(factor))
    return SpeedDoubt(tuple(n for n in names if n in timeline.signals), float(factor), text, lines)


def _both(wheel: str) -> tuple[str, str]:
    return f"wheel.{wheel}.v", f"wheel.{wheel}.v{_SECOND}"


def _of_wheel(timeline: Timeline, wheel: str, every: int) -> float | None:
    """ln of first over second speed of a wheel; None for too little motion, and where it is not one factor throughout."""
    y, x = (np.asarray(timeline.signals[n][::every], dtype=np.float64) for n in _both(wheel))
    use = _moves(y) & _moves(x)
    if np.count_nonzero(use) < _LEAST or np.count_nonzero(use) * timeline.dt * every < _LEAST_S:
        return None
    with np.errstate(invalid="ignore", divide="ignore"):
        logs = np.log(y[use] / x[use])
    known = logs[np.isfinite(logs)]
    if known.size < 0.9 * logs.size:
        return None
    middle = float(median_of(known))
    parts = [float(median_of(part)) for part in np.array_split(known, _PARTS)]
    if 1.4826 * float(median_of(np.abs(known - middle))) > _EVEN or np.ptp(parts) > _ALIKE:
        return None
    return middle


def _moves(x: Array) -> NDArray[np.bool_]:
    size = np.where(np.isfinite(x), np.abs(x), 0.0)
    return np.asarray(size > _MOVED * max(float(quantile_of(size, 0.99)), 1e-9))


def _by(witness: Witness, timeline: Timeline, wheels: Sequence[str]) -> bool | None:
    """Whether the second speeds are wrong by what measures the body, and the first are not; None where it agrees with neither or both."""
    off = []
    for leaf in ("v", f"v{_SECOND}"):
        every = [np.asarray(timeline.signals[f"wheel.{w}.{leaf}"], dtype=np.float64) for w in wheels]
        each = np.abs([_blocks(x, witness.width) for x in every])
        speed = median_of(each, axis=0)
        use = _moves(witness.speed) & _moves(speed)
        with np.errstate(invalid="ignore"):  # in a turn no wheel goes as fast as the body
            use &= np.ptp(each, axis=0) < _STRAIGHT * speed
        if np.count_nonzero(use) * witness.width * timeline.dt < _LEAST_S:
            return None
        off.append(abs(float(median_of(np.log(speed[use] / witness.speed[use])))))
    agree = [x < _SLIPS for x in off]
    return agree[0] if agree[0] != agree[1] else None


def _blocks(x: Array, width: int) -> Array:
    """Mean of each block of so many steps, the last one of what there is, shape (b,)."""
    first = np.arange(0, x.size, width)
    known = np.isfinite(x)
    count = np.add.reduceat(known.astype(np.float64), first)
    return np.asarray(
        np.where(count > 0, np.add.reduceat(np.where(known, x, 0.0), first) / np.maximum(count, 1.0), np.nan)
    )


def _second_is_wrong(timeline: Timeline, wheels: list[str], every: int) -> bool:
    """Whether the second speeds are further from the commanded ones than the first; False without commands."""
    apart: list[tuple[float, float]] = []
    for w in wheels:
        told = timeline.signals.get(f"wheel.{w}.v_ref", timeline.signals.get("cmd.v"))
        if told is None:
            continue
        y, x = (np.asarray(timeline.signals[n][::every], dtype=np.float64) for n in _both(w))
        r = np.asarray(told[::every], dtype=np.float64)
        use = _moves(r) & _moves(y) & _moves(x)
        if np.count_nonzero(use) >= _LEAST:
            size = np.log(np.abs(r[use]))
            apart.append(
                (float(median_of(np.log(np.abs(y[use])) - size)), float(median_of(np.log(np.abs(x[use])) - size)))
            )
    if not apart:
        return False
    first, second = np.abs(median_of(np.array(apart), axis=0))
    return bool(second > first)


def _lines(first: str, origins: Mapping[str, SignalSource], machine: Machine, factor: float) -> str:
    """What to write so that speeds become `factor` times as large; `first` is one of them."""
    own = origins[first]
    other = origins[first.removesuffix(_SECOND) if first.endswith(_SECOND) else f"{first}{_SECOND}"]
    turns, others_turn = (known_unit(o.unit) in _TURNING for o in (own, other))
    if turns and not others_turn and machine.geometry is not None:
        given = machine.geometry.wheel_diameter
        at = f" instead of {given:g}" if "geometry" not in machine.assumed else ""
        line = f"measure a wheel; [geometry] wheel_diameter = {given * factor:.3g}{at} would fit"
        if own.at == "motor":
            line += f", or gear_ratio = {machine.gear_ratio / factor:.3g} instead of {machine.gear_ratio:g}"
        return line
    if turns and others_turn and own.at != other.at:
        gear = machine.gear_ratio / factor if own.at == "motor" else machine.gear_ratio * factor
        return f"count the gear; [geometry] gear_ratio = {gear:.3g} instead of {machine.gear_ratio:g} would fit"
    line = signal_line(first, replace(own, gain=float(f"{own.gain * factor:.3g}"), offset=own.offset * factor))
    return f"check the unit of both speeds in [signals]; this would fit: {line}, the others likewise"
