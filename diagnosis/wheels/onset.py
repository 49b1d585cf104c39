"""Onset and end of a run at the raw rate, and what the shape of the onset says."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.plain_numbers import plain
from diagnosis.results.sentence import About, Sentence, is_about
from diagnosis.wheels.models import S_OU_LARGE, S_STUCK, TOTAL_SENSOR, WheelFilterModel
from replay.faults import Side

Array = NDArray[np.float64]

_SILENT = 10  # readings after an onset that are looked at for silence
_BEYOND = 2.0  # times what a wheel can by its model, whose lag is off by so much on machines of other build
_CANNOT = "A sensor can do this, a {wheel} cannot."


def onset_sentence(start: int, y: Array, model: WheelFilterModel, dt: float, name: str, side: Side) -> Sentence:
    """What the shape of the onset says: a sensor's fault may jump by more than a wheel can, a valve's bends.

    `y` of shape (n,); `dt` in s. What decides the side is the part in the middle.
    """
    text = _onset_words(start, y, model, dt, name, side)
    return Sentence(About.ONSET, text.removesuffix(_CANNOT), _CANNOT if text.endswith(_CANNOT) else "")


def only_a_sensor(texts: Iterable[str]) -> bool:
    """Whether evidence says that no wheel can do what a reading did at its onset."""
    return any(
        isinstance(text, Sentence) and is_about(text, About.ONSET) and text.parts[1] == _CANNOT for text in texts
    )


def _onset_words(start: int, y: Array, model: WheelFilterModel, dt: float, name: str, side: Side) -> str:
    low, high = max(1, start - 2), min(y.size, start + 3)
    if side is Side.SENSOR and start and not np.isfinite(y[start + _SILENT : start + 2 * _SILENT]).any():
        return f"At its onset {name} falls silent."
    if high <= low or start == 0:
        return "The fault was present from the first sample, so its onset gives no evidence."
    steps = np.abs(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]))
    largest = float(steps.max())
    fastest = float(np.nan_to_num(np.abs(y[low - 1 : high])).max())
    within = dt * _waited(y, low + int(np.argmax(steps)))
    able = (model.K + fastest) * min(1.0, within / model.tau)  # by a wheel whose valve opens wholly the other way
    jump = f"At its onset {name} jumps by {plain(largest, 2)} {{speed_unit}} within one sample ({largest / model.noise:.0f} times its noise)"
    beyond = largest > max(8 * model.noise, _BEYOND * able)
    if side is Side.ACTUATOR:
        if beyond:
            return f"{jump}: a fault of the {{valve}} alone does not explain this."
        return (
            f"At its onset {name} changes with the lag of the {{wheel}}, and no step exceeds {plain(largest, 2)} {{speed_unit}}: this is how a {{wheel}} "
            "reacts when its {valve} fails."
        )
    if beyond:
        return f"{jump}. {_CANNOT}"
    return (
        f"{jump}."
        if largest > 8 * model.noise
        else f"At its onset no step of {name} exceeds {plain(largest, 2)} {{speed_unit}}."
    )


def _waited(y: Array, at: int) -> int:
    """Samples since a reading last changed before sample `at`: what comes seldom, or is late, moves on meanwhile."""
    before = at - 1
    while before > 0 and y[before] == y[before - 1]:
        before -= 1
    return at - before


def refined(start: int, y: Array, reach: int, m: int, noise: float) -> int:
    """Onset of a sensor's fault at the raw rate: it jumps within one sample, or stops changing.

    Parameters
    ----------
    start : int
        Sample at which the run begins, to a block.
    y : Array, shape (n,)
        Measured speed [m/s].
    reach : int
        Samples to look around.
    m : int
        Model of the run.
    noise : float
        White noise of the sensor [m/s].
    """
    low, high = max(1, start - reach), min(y.size, start + reach + 1)
    if high - low < 2 or not (S_STUCK <= m <= S_OU_LARGE):
        return start
    steps = np.abs(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]))
    at = int(np.argmax(steps))
    if steps[at] > 8 * noise:
        return low + at
    if m in TOTAL_SENSOR:
        moving = np.flatnonzero(steps > 0)
        return low + int(moving[-1]) if moving.size else low - 1
    return start


def released(stop: int, y: Array, reach: int) -> int:
    """First sample at which a constant sensor moves again, within `reach` samples of `stop`. `y` of shape (n,)."""
    low, high = max(1, stop - reach), min(y.size, stop + reach + 1)
    moved = np.flatnonzero(np.nan_to_num(y[low:high] - y[low - 1 : high - 1]) != 0)
    return low + int(moved[0]) if moved.size else stop
