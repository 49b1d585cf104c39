"""Which side of one of two drives fails, by what the body does at the ends of the fault: it neither brakes nor turns for a wrong reading.

Each of two drives moves one side of the machine. A wheel that jams, or comes free, changes the speed of the middle by half of its own change, and
the yaw rate by that over the track; what a sensor loses changes neither. One of the two alone proves nothing: at a unit that is mounted above one
wheel, the other one's stop leaves the acceleration as it is, and a yaw rate may be dead.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.acceleration import ENOUGH, Relation, acceleration_of, relation
from diagnosis.response.by_acceleration import Jump, filled, jumps_of, lives_about
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.vibration import Unit, Vibration, vibration_of
from diagnosis.response.wheel import SENSOR_SHARE, sensor_finding
from diagnosis.results.assessment import CODE, Assessment, Finding
from replay.faults import Side, State

Array = NDArray[np.float64]

_TWO = 2
_NEAR_S = 0.5  # between an end of a finding and a jump of its reading
_GAINS = 0.05, 20.0  # of a yaw rate by the difference of the sides [rad/m]
Sides = tuple[Assessment, Assessment]


def by_both_motions(
    parts: Mapping[str, Sides], data: Mapping[str, FollowerData], yaw: Array | None, unit: Unit | None, dt: float
) -> dict[str, Sides]:
    """Sides of two drives, where faults of which neither is known are the sensor's by the body's acceleration and yaw rate.

    Parameters
    ----------
    parts : Mapping[str, tuple[Assessment, Assessment]]
        Sensor and drive of each wheel, as judged without the unit.
    data : Mapping[str, FollowerData]
        Channels of all drives.
    yaw : Array or None, shape (n,)
        Measured yaw rate [rad/s].
    unit : Unit or None
        The inertial unit.
    dt : float
        Step [s].
    """
    open_ = {w: [f for f in s.findings if f.side is Side.SENSOR_OR_ACTUATOR] for w, (s, _) in parts.items()}
    if yaw is None or unit is None or len(data) != _TWO or not any(open_.values()):
        return dict(parts)
    body = _Body(data, yaw, unit, dt)
    out = dict(parts)
    for w, findings in open_.items():
        jumps = jumps_of(data[w]) if findings else []
        decided = {f: made for f in findings if (made := body.decided(f, jumps, data[w].name)) is not None}
        if decided:
            out[w] = _replaced(parts[w], decided)
    return out


class _Body:
    """What the body does beside two drives."""

    def __init__(self, data: Mapping[str, FollowerData], yaw: Array, unit: Unit, dt: float) -> None:
        self.dt, self.width = dt, cell_of(dt)
        self.unit = unit
        one, other = (d.y for d in data.values())
        self.readings = one, other
        self.sides = [filled(cells(y, self.width)) for y in (one, other)]
        self.acceleration = filled(cells(unit.acceleration, self.width))
        self.yaw = filled(cells(yaw, self.width))

    def decided(self, f: Finding, jumps: list[Jump], name: str) -> Finding | None:
        """A finding as its sensor's; None where the body does not say so."""
        near = round(_NEAR_S / self.dt)
        ends = [j for j in jumps if min(abs(j.step - f.start), abs(j.step - f.stop)) <= near]
        if not ends:
            return None
        a, b = self.sides
        aside = np.zeros(a.size, np.bool_)
        steps = [f.start, f.stop, *(j.step for j in ends)]
        aside[min(steps) // self.width : max(steps) // self.width + 1] = True
        h = self.width * self.dt
        moves = acceleration_of(0.5 * (a + b), self.acceleration, aside, h)
        turns = relation(b - a, self.yaw, aside, h, _GAINS)
        fastest = np.fmax(np.abs(self.readings[0]), np.abs(self.readings[1]))
        shaking = vibration_of(self.unit, fastest, [(f.start, f.stop)], self.dt)
        if moves is None or turns is None:
            return None
        if not all(self._neither(j, moves, turns, shaking) for j in ends):
            return None
        both = [[r.says(j.step // self.width) for j in ends] for r in (moves, turns)]
        if min(sum(s[0] for s in said) for said in both) < 2.0 * ENOUGH:
            return None
        shares = [sum(s[2] * np.sign(s[1]) for s in said) / sum(abs(s[1]) for s in said) for said in both]
        text = (
            f"When {name} {'jumps' if len(ends) > 1 else 'jumped'}, the body's acceleration (imu.acceleration) has {shares[0]:.2f} × and its yaw rate "
            f"(imu.yaw_rate) {shares[1]:.2f} × of what the machine would do if the {{wheel}} did: it goes on, and the reading is wrong."
        )
        any_ = 1.0 - sum(h.p for h in f.hypotheses if h.side == "none")
        return sensor_finding(f.start, f.stop, f.mode, any_, f.epsilon, f.sat, (*f.evidence, text), SENSOR_SHARE)

    def _neither(self, jump: Jump, moves: Relation, turns: Relation, shaking: Vibration | None) -> bool:
        """Whether neither motion speaks for the body at a jump, of a unit that is alive."""
        at = jump.step // self.width
        said = moves.says(at), turns.says(at)
        return lives_about(shaking, jump.step, self.dt) and all(np.isfinite(s[1]) and s[0] >= 0.0 for s in said)


def _replaced(sides: Sides, decided: Mapping[Finding, Finding]) -> Sides:
    """Sensor and drive with findings that have become the sensor's."""
    sensor, drive = sides
    states = drive.states.copy()
    for f in decided.values():
        states[f.start : f.stop] = CODE[State.MASKED]
    known = tuple(f for f in drive.findings if f not in decided)
    findings = tuple(decided.get(f, f) for f in sensor.findings)
    reasons = {State.MASKED: "its {wheel.sensor} is faulty", **drive.reasons}
    return replace(sensor, findings=findings), replace(drive, states=states, findings=known, reasons=reasons)
