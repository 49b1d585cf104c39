"""All drives read nothing though they are told to move: the machine stands, or goes on, as an inertial unit shakes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import FollowerData
from diagnosis.response.vibration import Unit, Vibration, vibration_of
from diagnosis.results.said import Said, Stated

Array = NDArray[np.float64]

_JUMP = 0.25  # of the usual speed, between readings
_READINGS = 2  # over which it may come
_NEAR_S = 0.5  # around an end of the time
_LEAST_S = 2.0


def shaking_of(
    unit: Unit | None, drives: Sequence[FollowerData], aside: Sequence[tuple[int, int]], dt: float
) -> Vibration | None:
    """How the unit shakes at rest and in motion; None where there is none, or the mission does not show it.

    Parameters
    ----------
    unit : Unit or None
        The inertial unit.
    drives : Sequence[FollowerData]
        All drives.
    aside : Sequence[tuple[int, int]]
        Steps [start, stop) that are in question.
    dt : float
        Step [s].
    """
    return None if unit is None or not drives else vibration_of(unit, _fastest(drives), aside, dt)


def shakes_on(span: tuple[int, int], drives: Sequence[FollowerData], shaking: Vibration, dt: float) -> bool:
    """Whether all speeds fall to nothing, or come back, from one reading to the next, and the unit shakes as in motion all the time between.

    A machine that is held shakes as its motors strain, but its speeds take their time to stop.

    Parameters
    ----------
    span : tuple[int, int]
        Steps [start, stop) in which all stand.
    drives : Sequence[FollowerData]
        All drives.
    shaking : Vibration
        How the unit shakes.
    dt : float
        Step [s].
    """
    if not shaking.moves(*span):
        return False
    top = np.nan_to_num(_fastest(drives))
    usual = float(np.quantile(top[top > 0.0], 0.9)) if top.any() else 0.0
    steps = [np.flatnonzero(d.fresh) for d in drives]
    between = _READINGS * max((int(np.median(np.diff(s))) for s in steps if s.size > 1), default=1)
    reach = round(_NEAR_S / dt)
    for end in span:
        near = top[max(0, end - reach - between) : end + reach + 1]
        if near.size > between and np.max(np.abs(near[between:] - near[:-between])) > _JUMP * usual > 0.0:
            return True
    return False


def _fastest(drives: Sequence[FollowerData]) -> Array:
    """Largest size of all readings at each step, shape (n,) [m/s]; NaN where none is known."""
    return np.asarray(np.fmax.reduce([np.abs(d.y) for d in drives]))


def told_shaken(spans: Sequence[tuple[int, int]], drives: Sequence[FollowerData], dt: float) -> tuple[Said, ...]:
    """What is said where the unit shows that the speeds failed together, not the machine, in steps [start, stop) of `spans`; `dt` in s."""
    total = sum(b - a for a, b in spans) * dt
    if total < _LEAST_S:
        return ()
    names = " and ".join(d.name for d in drives)
    start, stop = max(spans, key=lambda s: s[1] - s[0])
    longest = Stated.of(start * dt, stop * dt)
    text = (
        f"For {total:.1f} s {names} read nothing{' together' if len(drives) > 1 else ''} though told to move (longest {longest}), from one reading to "
        "the next, while the inertial unit (imu.acceleration) shook as it does in motion and not as at rest: what they have in common "
        "failed, such as their supply, a controller or a driver, unless something else shakes the machine; no {wheel} is blamed for it."
    )
    return (Said(text, tuple((a * dt, b * dt) for a, b in spans)),)


def quiet_meanwhile(spans: Sequence[tuple[int, int]], dt: float) -> str:
    """To follow what is said of a machine that stood, where an inertial unit was quiet, in steps [start, stop); empty where none was; `dt` in s."""
    total = sum(b - a for a, b in spans) * dt
    if total <= 0.0:
        return ""
    return f" The inertial unit (imu.acceleration) was as quiet as at rest for {total:.1f} s of it: the machine really stood."
