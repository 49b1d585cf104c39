"""From recorded stamps and values to SI, with doubts about units stated in figures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks, release
from replay.arrays.column_store import ColumnStore
from replay.arrays.quantiles import quantile_of
from replay.errors import ConfigError
from replay.log.source_options import SignalSource
from replay.log.stamp_order import spread_ticks
from replay.machine.config import Machine
from replay.machine.quantities import SI_UNITS
from replay.machine.signal_table import quantity_of
from replay.machine.units import known_unit, si_factor
from replay.signals.restarts import continued
from replay.signals.uneven_times import evened

LARGEST = 1e30
_WIDE = 1.5
_PEAK_SAMPLES = 1 << 15


@dataclass(frozen=True)
class Converted:
    """A signal in SI.

    Attributes
    ----------
    stamps : NDArray[np.int64], shape (n,)
        Strictly increasing [ns].
    values : NDArray[np.float64], shape (n,)
        SI values.
    notes : tuple[str, ...]
        What was sorted or dropped.
    """

    stamps: NDArray[np.int64]
    values: NDArray[np.float64]
    notes: tuple[str, ...]


def usable_unit(signal: str, unit: str | None) -> str | None:
    """Return a recorded unit that can describe the signal, else None."""
    if not unit:
        return None
    try:
        si_factor(signal, unit, wheel_radius=1.0, gear_ratio=1.0, at="wheel")
    except ConfigError:
        return None
    return unit


def factor_of(signal: str, origin: SignalSource, machine: Machine) -> float:
    """Factor from the recorded unit to SI; raises `ConfigError` where the unit does not fit.

    In SI units per recorded unit.
    """
    unit = origin.unit
    if not unit:
        quantity = quantity_of(signal)
        unit = machine.speed_unit if quantity == "speed" and signal.startswith("wheel.") else SI_UNITS[quantity]
        if origin.derivative:
            unit = {"m/s": "m", "rad/s": "rad", "deg/s": "deg"}.get(unit, unit)
    return si_factor(
        signal,
        unit,
        wheel_radius=machine.wheel_radius,
        gear_ratio=machine.gear_ratio,
        at=origin.at,
        derivative=origin.derivative,
        speed_unit=machine.speed_unit,
    )


def convert(
    signal: str,
    data: tuple[NDArray[np.int64], NDArray[Any]],
    origin: SignalSource,
    machine: Machine,
    store: ColumnStore,
) -> Converted:
    """Order stamps, continue positions over their restarts and differentiate where asked, convert: (recorded · gain + offset) · factor.

    Speeds that were divided by uneven times are divided by the usual one.

    Numbers beyond `LARGEST` are damage, not readings: their squares and sums would overflow. They become missing.

    Parameters
    ----------
    signal : str
        Canonical name.
    data : tuple[NDArray[np.int64], NDArray]
        Stamps [ns] and recorded values, each of shape (n,).
    origin : SignalSource
        Conversion.
    machine : Machine
        For wheel size and gear ratio.
    store : ColumnStore
        Where long columns stand.

    Raises
    ------
    ConfigError
        Where the unit does not fit the signal.
    """
    factor = factor_of(signal, origin, machine)
    stamps, recorded, notes = _ordered(*data)
    if origin.derivative and recorded.dtype.kind in "iu" and len(recorded):
        recorded = recorded.astype(np.int64) - np.int64(recorded[0])  # exact before they become floats
    if origin.derivative:
        recorded, restarts = continued(recorded, origin)
        notes = (*notes, *((restarts,) if restarts else ()))
    beyond = 0

    def in_si(x: NDArray[Any]) -> NDArray[np.float64]:
        nonlocal beyond
        y: NDArray[np.float64] = (np.asarray(x, np.float64) * origin.gain + origin.offset) * factor
        far = np.abs(y) > LARGEST
        if far.any():
            far &= np.isfinite(y)
            beyond += int(far.sum())
            y[far] = np.nan
        return y

    with np.errstate(all="ignore"):  # damaged logs hold any bits
        values = store.map(in_si, recorded)
        values = store.keep(slope(stamps, values)) if origin.derivative else values
    release(stamps, recorded)
    if beyond:
        notes = (*notes, f"{beyond} numbers beyond {LARGEST:g} are no readings and were left out")
    if (
        not origin.derivative
        and quantity_of(signal) == "speed"
        and not signal.startswith("cmd.")
        and not signal.endswith("_ref")
    ):
        values, uneven = evened(stamps, values)
        notes = (*notes, *((uneven,) if uneven else ()))
    return Converted(stamps, values, notes)


def _ordered(
    stamps: NDArray[np.int64], values: NDArray[Any]
) -> tuple[NDArray[np.int64], NDArray[Any], tuple[str, ...]]:
    """Sort by stamp, spread the ticks of a coarse clock, and keep the last of equal stamps."""
    notes = []
    back = _beside_the_next(np.less, stamps)
    if back:
        order = np.argsort(stamps, kind="stable")
        stamps, values = stamps[order], values[order]
        notes.append(f"stamps ran backwards {'once' if back == 1 else f'{back} times'} and were sorted")
    ticks = spread_ticks(stamps, values)
    if ticks is not None:
        stamps, tick = ticks
        notes.append(f"its clock ticks every {tick / 1e6:g} ms only; samples of one tick were spread evenly over it")
    n = _beside_the_next(np.equal, stamps)
    if n:
        last = np.append(stamps[1:] != stamps[:-1], True)
        shared = (
            "1 sample shares its stamp with a later one and was"
            if n == 1
            else f"{n} samples share their stamps with later ones and were"
        )
        notes.append(f"{shared} dropped")
        stamps, values = stamps[last], values[last]
    return stamps, values, tuple(notes)


def _beside_the_next(compared: np.ufunc, stamps: NDArray[np.int64]) -> int:
    """How many stamps compare so with the one before them, block by block. Of shape (n,)."""
    return sum(
        int(np.count_nonzero(compared(near[1:], near[:-1])))
        for part in blocks(len(stamps))
        if len(near := stamps[max(0, part.start - 1) : part.stop])
    )


def slope(stamps: NDArray[np.int64], position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slope between each sample's neighbours.

    Parameters
    ----------
    stamps : NDArray[np.int64], shape (n,)
        Strictly increasing [ns].
    position : NDArray[np.float64], shape (n,)
        Any unit.

    Returns
    -------
    NDArray[np.float64], shape (n,)
        Unit per second; one-sided at the ends, NaN for a single sample.
    """
    if len(stamps) < 2:
        return np.full(len(stamps), np.nan)
    left = np.maximum(np.arange(len(stamps)) - 1, 0)
    right = np.minimum(np.arange(len(stamps)) + 1, len(stamps) - 1)
    speed: NDArray[np.float64] = (position[right] - position[left]) / ((stamps[right] - stamps[left]) * 1e-9)
    return speed


def magnitudes(values: NDArray[Any]) -> NDArray[np.float64]:
    """Magnitudes of the numbers of a signal, of a long one those of every few samples.

    From shape (n,) to (k,), in the recorded unit.
    """
    some = values[:: max(1, len(values) // _PEAK_SAMPLES)]
    out: NDArray[np.float64] = np.abs(some[np.isfinite(some)].astype(np.float64))
    return out


def peak_of(values: NDArray[Any]) -> float:
    """99th percentile of the magnitude; 0 where there is no number. `values` of shape (n,), the peak in their unit."""
    finite = magnitudes(values)
    return float(quantile_of(finite, 0.99)) if len(finite) else 0.0


def choose_motor_or_wheel(signal: str, origin: SignalSource, values: NDArray[Any], machine: Machine) -> SignalSource:
    """Decide where a guessed rotation was measured: at the motor where only that fits the machine's top speed.

    `values` of shape (n,), as recorded.
    """
    if not signal.startswith("wheel.") or known_unit(origin.unit) != "rpm" or machine.gear_ratio == 1.0:
        return origin
    motor = replace(origin, at="motor")
    try:
        at_motor = peak_of(values) * factor_of(signal, motor, machine)
    except ConfigError:
        return origin
    at_wheel = at_motor * machine.gear_ratio
    return origin if at_wheel < _WIDE * machine.max_speed and at_motor < 0.02 * machine.max_speed else motor
