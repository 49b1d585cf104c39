"""Axles that deviate at the same time: what their models miss of the machine, and no fault of each.

Two valves, or two sensors, that begin and cease to fail in the same second have one cause: a motion, a supply, a clock. That both
lose their signal may be; that both stick, lose or shake likewise is left open where nothing is measured twice.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.steering.path import AxleFilter
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.faults import FaultMode, Side

_ENDS_S = 1.5  # within which both begin, or cease
_COMMON = 0.7  # of the time of the longer one
#: What axles lack together: rad that both must be told to turn, of that, and of what the accused one lacks.
_TRAVEL, _LACKS, _LIKEWISE = 0.05, 0.1, 0.5
_FEW = 5  # readings
_BRIEF_S = 3.0  # of what a surge makes
_SURGES = (
    FaultMode.NOISY,
    FaultMode.INEFFICIENT,
    FaultMode.OUTSIDE_TABLE,
)  # of two valves at once; a stuck one is none
_MOST, _NO_SURER = 0.5, 0.6  # of the mission; of a partial fault while so much of it is one on two axles
_NO_MODEL = "The steering model finds such faults on two axles for most of this mission: that it does not fit the machine is as probable."


def not_together(
    found: Mapping[str, Mapping[Side, SideFindings]], length: int, dt: float
) -> dict[str, dict[Side, SideFindings]]:
    """Findings by axle and side without those that another axle shares; they are left unexplained.

    Parameters
    ----------
    found : Mapping[str, Mapping[Side, SideFindings]]
        Of all axles whose quantities are measured once.
    length : int
        Samples per block.
    dt : float
        Sample [s].
    """
    out: dict[str, dict[Side, SideFindings]] = {}
    for axle, sides in found.items():
        out[axle] = {}
        for side, one in sides.items():
            others = [f for name, of in found.items() if name != axle for f in of[side].findings]
            shared = [f for f in one.findings if any(_together(f, g, dt) for g in others)]
            out[axle][side] = one.left_open(shared, length)
    return out


def not_shaken_together(
    found: Mapping[str, Mapping[Side, SideFindings]], length: int, dt: float
) -> dict[str, dict[Side, SideFindings]]:
    """Findings by axle and side without brief noise, losses and offsets of a valve that another axle's has at the same time: a supply that surges.

    Parameters
    ----------
    found : Mapping[str, Mapping[Side, SideFindings]]
        Of all axles of which a quantity is measured twice.
    length : int
        Samples per block.
    dt : float
        Sample [s].
    """
    side = Side.ACTUATOR
    brief = {
        name: [f for f in sides[side].findings if f.mode in _SURGES and (f.stop - f.start) * dt < _BRIEF_S]
        for name, sides in found.items()
    }
    out: dict[str, dict[Side, SideFindings]] = {}
    for axle, sides in found.items():
        others = [f for name, of in brief.items() if name != axle for f in of]
        shared = [f for f in brief[axle] if any(_together(f, g, dt) for g in others)]
        out[axle] = {**sides, side: sides[side].left_open(shared, length)}
    return out


def less_sure_all_along(
    found: Mapping[str, Mapping[Side, SideFindings]], size: int
) -> dict[str, dict[Side, SideFindings]]:
    """Findings by axle and side whose partial faults are no claims where two axles have some for most of the mission.

    Parameters
    ----------
    found : Mapping[str, Mapping[Side, SideFindings]]
        Of all axles whose quantities are measured once.
    size : int
        Samples of the mission.
    """
    partly = {
        name: [f for one in sides.values() for f in one.findings if not f.mode.total] for name, sides in found.items()
    }
    many = sum(sum(f.stop - f.start for f in fs) > _MOST * size for fs in partly.values())
    if many < 2:
        return {name: dict(sides) for name, sides in found.items()}
    return {
        name: {
            side: one._replace(
                findings=tuple(f if f.mode.total else limited(f, _NO_SURER, _NO_MODEL) for f in one.findings)
            )
            for side, one in sides.items()
        }
        for name, sides in found.items()
    }


def not_starved(
    found: Mapping[str, Mapping[Side, SideFindings]], axles: Mapping[str, AxleFilter]
) -> dict[str, dict[Side, SideFindings]]:
    """Findings by axle and side without losses of a sensor that another axle's has at the same time, or while another axle turns less than its valve gives.

    That is a want of oil, or a motion that the model does not have.

    Parameters
    ----------
    found : Mapping[str, Mapping[Side, SideFindings]]
        Of all axles whose angle is measured once.
    axles : Mapping[str, AxleFilter]
        All axles; the rates that their plants give.
    """
    out: dict[str, dict[Side, SideFindings]] = {}
    for name, sides in found.items():
        sensor, length = sides[Side.SENSOR], axles[name].blocks.length
        lost = [f for f in sensor.findings if f.mode is FaultMode.INEFFICIENT]
        others = [f for k, of in found.items() if k != name for f in of[Side.SENSOR].findings]
        dt = axles[name].blocks.dt / length
        starved = [
            f for f in lost if any(_together(f, g, dt) for g in others) or _starved(name, span_of(f, length), axles)
        ]
        out[name] = {**sides, Side.SENSOR: sensor.left_open(starved, length)}
    return out


def _starved(name: str, span: tuple[int, int], axles: Mapping[str, AxleFilter]) -> bool:
    """Whether another axle lacks enough of its motion while this one does, in such blocks of this one."""
    own = _lack(axles[name], *span)
    times = [k * axles[name].blocks.dt for k in span]
    others = [_lack(a, *(round(t / a.blocks.dt) for t in times)) for k, a in axles.items() if k != name]
    return any(lack >= max(_LACKS, _LIKEWISE * own) for lack in others)


def _lack(axle: AxleFilter, start: int, stop: int) -> float:
    """Share of the motion that its plant gives an axle in blocks [start, stop), that it does not make [1]; NaN of hardly any."""
    known = np.where(axle.blocks.count > 0, axle.blocks.mean, np.nan)[start:stop]
    given = axle.driven.command[start:stop] * axle.blocks.dt
    at = np.flatnonzero(np.isfinite(known))
    if at.size < _FEW:
        return float("nan")
    asked = np.add.reduceat(np.nan_to_num(given), at[:-1])
    total = float(np.abs(asked).sum())
    made = float((np.diff(known[at]) * np.sign(asked)).sum())
    return 1.0 - made / total if total >= _TRAVEL else float("nan")


def _together(a: Finding, b: Finding, dt: float) -> bool:
    """Whether two findings of two axles are one of the machine."""
    if a.mode is not b.mode or a.mode is FaultMode.NO_SIGNAL:
        return False
    common = min(a.stop, b.stop) - max(a.start, b.start)
    ends = sorted((abs(a.start - b.start) * dt, abs(a.stop - b.stop) * dt))
    return ends[1] <= _ENDS_S or (ends[0] <= _ENDS_S and common >= _COMMON * max(a.stop - a.start, b.stop - b.start))
