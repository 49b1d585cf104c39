"""Wheels that move in step with the machine's command, but many times slower or faster: a size, ratio or unit is wrong."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.signals.signal import Signal
from replay.signals.to_si import peak_of

_TIMES = 3.0
_IN_STEP = 0.8  # correlation of magnitudes
_MOST, _LEAST = 4000, 50  # samples


def scale_doubt(items: Mapping[str, Signal], machine: Machine) -> str:
    """Sentence on the scale of all wheels against the commanded speed; empty where it is plausible, or cannot be compared.

    A drive that does not answer its command is no question of scale: the wheels must follow it.

    Parameters
    ----------
    items : Mapping[str, Signal]
        Signals in SI.
    machine : Machine
        Its wheels, in m/s.
    """
    asked = items.get("cmd.v")
    wheels = [s for w in machine.wheels if (s := items.get(f"wheel.{w}.v")) is not None and len(s.stamps) >= _LEAST]
    if asked is None or not wheels or len(asked.stamps) < 2 or machine.speed_unit != "m/s":
        return ""
    most = peak_of(asked.values)
    speeds = [peak_of(s.values) for s in wheels]
    if most <= 0 or min(speeds) <= 0:
        return ""
    times = float(np.median(speeds)) / most
    if 1 / _TIMES <= times <= _TIMES or max(speeds) > _TIMES * min(speeds):
        return ""
    at = wheels[0].stamps[:: max(1, len(wheels[0].stamps) // _MOST)]
    moved = np.median([np.abs(_held(s, at)) for s in wheels], axis=0)
    told = np.abs(_held(asked, at))
    known = np.isfinite(moved) & np.isfinite(told)
    if known.sum() < _LEAST or min(np.std(moved[known]), np.std(told[known])) <= 0:
        return ""
    if np.corrcoef(moved[known], told[known])[0, 1] < _IN_STEP:
        return ""
    how = f"{times:.3g} times as fast as" if times > 1 else f"{1 / times:.3g} times slower than"
    return (
        f"all wheels move in step with cmd.v, but {how} it commands: is geometry.wheel_diameter, gear_ratio, "
        "or the unit of wheel.*.v or cmd.v right?"
    )


def _held(signal: Signal, at: NDArray[np.int64]) -> NDArray[np.float64]:
    """Last value before each moment; NaN before the first."""
    index = np.searchsorted(signal.stamps, at, side="right") - 1
    return np.asarray(np.where(index >= 0, signal.values[np.maximum(index, 0)], np.nan))
