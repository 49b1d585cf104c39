"""Openings of valves whose unit the mission itself contradicts: no valve is blamed for what all of them share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of, quantile_of
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.quantities import DOUBTED_UNITS
from replay.machine.toml_text import signal_line
from replay.signals.signal import Signal
from replay.signals.timeline import Timeline
from replay.signals.to_si import factor_of

Array = NDArray[np.float64]

_MOST = 40_000  # moments that are looked at
_OPEN = 0.3  # of a command's largest value: less of it says nothing of a gain
_LEAST, _LEAST_S = 50, 2.0  # samples, and time, of what a gain, or a rest, is taken from
_FOLLOWS = 0.9  # correlation of a position with its command
_GROSS, _NEAR = np.log(3.0), 0.15  # ln; no loss of all valves alike, and how near most of them are then
_SOME, _ALIKE = np.log(1.25), 0.03  # ln; a loss that could be, and how near all of them are then
_VALVES = 2
_KNOWN = (10.0, 100.0, 1000.0)  # factors of units, which one valve alone may show
_FULL = 1.1  # of full opening
_VOLTS, _AT_LIMIT, _HELD = 10.0, 0.005, 0.01  # a saturated command in volts [V], how near it is, share of samples there
_MOST_VOLTS = 10.5  # what an analogue signal of 10 V may reach
_STILL = 0.01  # of the usual speed
_REST, _EVEN = 0.25, 0.05  # of the largest command: where valves rest that rest nowhere near 0, and how alike
_CLOSED = ((5.0, 0.2, -1.0, "0 to 10 V, 5 V closed"), (12.0, 0.125, -1.5, "4 to 20 mA, 12 mA closed"), (4.0, 0.0625, -0.25, "4 to 20 mA, 4 mA closed"))  # fmt: skip
_SCALES = {
    DOUBTED_UNITS[0]: 'unit = "1", gain = 0.1 where 10 V open a valve fully',
    DOUBTED_UNITS[1]: 'unit = "1", gain = 0.0625, offset = -0.25 where 4 mA close it and 20 mA open it fully',
}
_UNJUDGED = "no {valve} was judged"
_NO_FAULT = "which is no {valve}'s fault but their unit or gain: no {valve} was judged"


class OpeningDoubt(NamedTuple):
    """Openings that are no evidence.

    Attributes
    ----------
    text : str
        What speaks against their unit, a sentence without its stop.
    act : str
        What to write in the machine file.
    """

    text: str
    act: str


def opening_doubt(timeline: Timeline, items: Mapping[str, Signal], machine: Machine) -> OpeningDoubt | None:
    """What speaks against the unit of all valves' openings; None where nothing does.

    Parameters
    ----------
    timeline : Timeline
        The mission.
    items : Mapping[str, Signal]
        Its signals, for the unit that each was recorded in; samples are not looked at.
    machine : Machine
        Its wheels and axles.
    """
    names = openings(timeline, machine)
    origins = {n: items[n].origin for n in names if n in items}
    if not origins:
        return None
    every = max(1, timeline.size // _MOST)
    values = {n: np.asarray(timeline.signals[n][::every], dtype=np.float64) for n in origins}
    return (
        _unanswered(origins)
        or _beyond_full(values, items, machine)
        or _apart(values, origins, machine, timeline.dt * every)
        or _saturated(values, origins)
        or _resting_open(timeline, every, values, origins, machine)
    )


def openings(timeline: Timeline, machine: Machine) -> tuple[str, ...]:
    """Canonical names of all openings of a mission, commanded and measured."""
    groups = (("wheel", machine.wheels), ("steer", machine.axles))
    every = [f"{kind}.{part}.{leaf}" for kind, parts in groups for part in parts for leaf in ("u", "u_applied")]
    return tuple(n for n in every if n in timeline.signals)


def _unanswered(origins: Mapping[str, SignalSource]) -> OpeningDoubt | None:
    """Openings of which the machine file still says that their unit is one of two."""
    for unit in DOUBTED_UNITS:
        named = [n for n, o in origins.items() if o.unit == unit]
        if named:
            text = f"The machine file has unit = {unit!r} for {_listed(named)}, and the question was not answered: {_UNJUDGED}"
            return OpeningDoubt(text, f'write unit = "%", or {_SCALES[unit]}, in each of these lines of [signals]')
    return None


def _beyond_full(values: Mapping[str, Array], items: Mapping[str, Signal], machine: Machine) -> OpeningDoubt | None:
    """Openings of which nobody stated a unit, and that are no fractions: several valves go beyond full opening, and stay there."""
    bare = [n for n in values if items[n].origin.unit is None or (items[n].guessed and items[n].origin.unit == "1")]
    full = _FULL * max(machine.control.u_max, 1.0)
    commands = [n for n in bare if n.endswith(".u")]
    beyond = [n for n in commands or bare if np.count_nonzero(np.abs(values[n]) > full) >= _LEAST]
    if not beyond or len(beyond) < min(_VALVES, len(commands or bare)):
        return None
    reach = max(_peak(values[n]) for n in beyond)
    text = f"No unit is stated for {_listed(beyond)}, and they reach {reach:.3g}, where 1 is full opening: {_UNJUDGED}"
    own = items[beyond[0]].origin
    percent = signal_line(beyond[0], replace(own, unit="%"))
    volts = (
        f", or where 10 V open it fully {signal_line(beyond[0], replace(own, unit='1', gain=0.1))}"
        if reach <= _MOST_VOLTS
        else ""
    )
    line = f"{percent}{volts}{_likewise(bare)}"
    return OpeningDoubt(text, f"write under [signals] of a machine file (`mfhca config init` drafts one) {line}")


def _apart(values: Mapping[str, Array], origins: Mapping[str, SignalSource], machine: Machine, dt: float) -> OpeningDoubt | None:  # fmt: skip
    """Positions that are all one factor off their commands."""
    ratios = {n: r for n in values if (r := _gain(values, n, dt)) is not None}
    if not ratios:
        return None
    logs = np.array(list(ratios.values()))
    middle = float(median_of(logs))
    agree = int(np.count_nonzero(np.abs(logs - middle) < _NEAR))
    gross = abs(middle) > _GROSS and agree >= _VALVES and 2 * agree > logs.size
    alike = logs.size > _VALVES and abs(middle) > _SOME and float(np.ptp(logs)) < _ALIKE
    alone = logs.size == 1 and any(abs(abs(middle) - np.log(k)) < _NEAR for k in _KNOWN)
    if not (gross or alike or alone):
        return None
    commands, measured = [n.removesuffix("_applied") for n in ratios], list(ratios)
    largest = {key: max(_peak(values[n]) for n in group) for key, group in (("u", commands), ("a", measured))}
    too_small = commands if middle > 0 else measured
    other = measured if middle > 0 else commands
    mended = too_small if max(largest.values()) <= _FULL else other
    factor = float(np.exp(abs(middle))) if mended is too_small else float(np.exp(-abs(middle)))
    first = mended[0]
    scale = f"{round(100 * np.exp(middle), 1 if middle < 0 else 0):g} %"
    text = f"The measured openings of {'all' if agree == logs.size else 'most'} valves are {scale} of their commands, {_NO_FAULT}"
    if logs.size == 1:
        text = f"The measured opening is {scale} of its command, a factor between units: {_UNJUDGED}"
    line = signal_line(first, _scaled(first, origins[first], machine, factor))
    return OpeningDoubt(text, f"check the unit of both in [signals]; this would fit: {line}{_likewise(mended)}")


def _gain(values: Mapping[str, Array], name: str, dt: float) -> float | None:
    """ln of position per command of a valve; None for a command, for too little of it, and where the position does not follow."""
    command, position = values.get(name.removesuffix("_applied")), values[name]
    if not name.endswith("_applied") or command is None:
        return None
    known = np.isfinite(position) & np.isfinite(command)
    use = known & (np.abs(command) > _OPEN * _peak(command))
    if np.count_nonzero(use) < _LEAST or np.count_nonzero(use) * dt < _LEAST_S:
        return None
    y, u = position[use], command[use]
    if min(np.std(y), np.std(u)) <= 0.0 or np.corrcoef(position[known], command[known])[0, 1] < _FOLLOWS:
        return None
    middle = float(median_of(y / u))
    return float(np.log(middle)) if middle > 0.0 else None


def _saturated(values: Mapping[str, Array], origins: Mapping[str, SignalSource]) -> OpeningDoubt | None:
    """Commands taken as % that are never beyond 10, and saturated there: volts."""
    bare = [
        n for n, o in origins.items() if n.endswith(".u") and (o.unit, o.gain, o.offset) == ("%", 1.0, 0.0)
    ]  # fmt: skip
    sizes = {n: np.abs(values[n][np.isfinite(values[n])]) * 100.0 for n in bare}
    sizes = {n: x for n, x in sizes.items() if x.size >= _LEAST}
    if not sizes or max(float(x.max()) for x in sizes.values()) > _VOLTS * (1.0 + _AT_LIMIT):
        return None
    at_limit = [n for n, x in sizes.items() if np.mean(x > _VOLTS * (1.0 - _AT_LIMIT)) > _HELD]
    if len(at_limit) < min(_VALVES, len(sizes)):
        return None
    text = f"The commands {_listed(at_limit)}, taken as %, stop at 10 and never open further, as volts do that are saturated; {_UNJUDGED}"
    first = bare[0]
    line = signal_line(first, replace(origins[first], unit="1", gain=0.1))
    own = 'unit = "1", gain = 0.01, if this machine really opens its valves by 10 % at most'
    return OpeningDoubt(text, f"write {line}{_likewise(bare)}, measured openings alike; or {own}")


def _resting_open(timeline: Timeline, every: int, values: Mapping[str, Array], origins: Mapping[str, SignalSource], machine: Machine) -> OpeningDoubt | None:  # fmt: skip
    """Commands that all rest at one opening while the machine is told to stand, and stands: their zero is elsewhere."""
    names = [n for w in machine.wheels if (n := f"wheel.{w}.u") in values]
    still = _standing(timeline, every, machine)
    if len(names) < _VALVES or still is None or np.count_nonzero(still) * timeline.dt * every < _LEAST_S:
        return None
    rests, largest = [], max(_peak(values[n]) for n in names)
    for n in names:
        at_rest = values[n][still & np.isfinite(values[n])]
        if at_rest.size < _LEAST or median_of(np.abs(at_rest - median_of(at_rest))) > _EVEN * largest:
            return None
        rests.append(float(median_of(at_rest)))
    rest = float(median_of(rests))
    if abs(rest) < _REST * largest or np.ptp(rests) > _EVEN * largest:
        return None
    first = origins[names[0]]
    recorded = (rest / factor_of(names[0], first, machine) - first.offset) / first.gain
    text = f"All valve commands rest at {recorded:.3g} as recorded while the machine is told to stand and stands, so that their zero is there, {_NO_FAULT}"
    fitting = next((c for c in _CLOSED if abs(recorded - c[0]) < 0.05 * c[0]), None)
    if fitting is None:
        return OpeningDoubt(text, f"give the unit, gain and offset of {names[0]}{_likewise(names)} in [signals]")
    _, gain, offset, what = fitting
    line = signal_line(names[0], replace(first, unit="1", gain=gain, offset=offset))
    return OpeningDoubt(text, f"of {what}, write {line}{_likewise(names)}, measured openings alike")


def _standing(timeline: Timeline, every: int, machine: Machine) -> NDArray[np.bool_] | None:
    """When all wheels stand and are told to, shape (k,); None where speeds or commanded speeds are not logged."""
    speeds = [timeline.signals[n][::every] for w in machine.wheels if (n := f"wheel.{w}.v") in timeline.signals]
    told = [
        timeline.signals[n][::every]
        for n in ("cmd.v", *(f"wheel.{w}.v_ref" for w in machine.wheels))
        if n in timeline.signals
    ]
    if not speeds or not told:
        return None
    usual = max(_peak(np.asarray(v)) for v in speeds)
    most = max(_peak(np.asarray(x)) for x in told)
    stand = np.all([np.abs(v) < _STILL * usual for v in speeds], axis=0)
    return np.asarray(stand & np.all([np.abs(x) <= _STILL * most for x in told], axis=0))


def _scaled(name: str, origin: SignalSource, machine: Machine, factor: float) -> SignalSource:
    """A source with its gain times a factor, as a share of full opening."""
    gain = origin.gain * factor_of(name, origin, machine) * factor
    decade = 10.0 ** round(np.log10(gain))  # a factor of units, where it is near one
    gain = decade if abs(np.log(gain / decade)) < _NEAR else gain
    return replace(origin, unit="1", gain=float(f"{gain:.3g}"), offset=origin.offset * (gain / origin.gain))


def _peak(values: Array) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(quantile_of(finite, 0.99)) if finite.size else 0.0


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:2]) + (f" and {len(names) - 2} more" if len(names) > 2 else "")


def _likewise(names: Sequence[str]) -> str:
    return ", the others likewise" if len(names) > 1 else ""
