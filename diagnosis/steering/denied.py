"""What a steering model alone claims and the readings deny: noise that shakes nothing, stuck sensors that tremble, valves that obey or meet a stop.

To the filters everything that their plant leaves unexplained for a while looks like noise of one side, and an angle that stays
like a stuck sensor, whoever holds it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.steering.between_readings import between_readings
from diagnosis.steering.blocks import SteeringBlocks
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.jumps import as_sensors, of_sensor
from diagnosis.steering.side_findings import SideFindings, span_of
from replay.faults import FaultMode, Side

_SHAKEN = 2.0  # times the usual power of what changes from reading to reading
_RESTLESS = 0.1  # share of changing readings from which on a sensor lives
_EDGE = 0.15  # of a finding
_MOTION_S, _LATEST_S, _FEW_MOTIONS = 0.5, 0.3, 6  # of an angle, and by how much it may be later than its command
_OBEYS = 0.8  # correlation
_AT_END, _REACHED, _STAYS = (
    0.97,
    0.5,
    0.9,
)  # of the largest angle to that side, which is so much of the machine's; of the time
_READ = 0.5  # of a finding: what delivers less is silent
_LEAST_USUAL_S = 5.0  # for which a reading must be known without its fault
_DISTURBED = 0.4  # probability of noise behind an opening that nobody measured: none of 15 was right on tuning seeds of other machines
_BURST_S = 0.6  # length at which half of the bursts of noise are what a model leaves out of a motion
_PAUSE_S = 0.12  # likewise of a side that does nothing: a reading that did not change, a valve about its middle
_TREMOR = 0.004  # rad: noise of less is no fault
_MIDDLE, _MOSTLY = 0.04, 0.98  # of full opening: about its middle a valve opens nothing; of the time
_HABIT_S, _OFTEN, _HABIT = 1.0, 3, 0.4  # pauses no longer than this, more than so many, are a habit of this probability
_LASTS = 0.99  # a share that says nothing of a finding's length
_PAUSE = "As brief as this, it may be a reading that did not change, or what the model leaves out, which makes it less probable."
_BURST = "Noise as brief as this may be what the model leaves out of a motion, which makes it less probable."
_ENDS = "It stays at the largest angle of the mission, which it came to step by step: the axle may be at its end stop."
_APPROACH_S, _STEP = 0.5, 0.02  # before a stay, and how far the angle is then from where it stays, at most [of it]
_UNSEEN = "Where no opening is logged, a disturbance of the {valve} looks like what the model leaves out, which makes it less probable."


def not_denied(
    found: Mapping[Side, SideFindings], inputs: AxleInputs, blocks: SteeringBlocks, max_steer: float
) -> dict[Side, SideFindings]:
    """Findings of both sides; what a sensor's own readings deny is left unexplained, noise of an unmeasured valve uncertain.

    Parameters
    ----------
    found : Mapping[Side, SideFindings]
        By the model.
    inputs : AxleInputs
        The axle's channels.
    blocks : SteeringBlocks
        The same in blocks.
    max_steer : float
        Largest angle of the machine's axles [rad].
    """
    out = dict(found)
    sensor, valve = found[Side.SENSOR], found[Side.ACTUATOR]
    if not inputs.angle_redundant:
        usual = usual_power(sensor, blocks)
        denied = [
            f
            for f in sensor.findings
            if (
                f.mode is FaultMode.NOISY
                and shaken_power(blocks, *span_of(f, blocks.length)) < max(_SHAKEN * usual, _TREMOR**2)
            )
            or (f.mode.total and _trembles(f, inputs))
        ]
        rest = sensor.left_open(denied, blocks.length)
        kept = tuple(limited(f, _HABIT, _ENDS) if _ends_at_stop(f, inputs, max_steer) else f for f in rest.findings)
        out[Side.SENSOR] = rest._replace(findings=kept)
    valve = _asked(valve, inputs, blocks)
    valve = valve._replace(findings=tuple(f for f in valve.findings if not between_readings(f, inputs)))
    out[Side.ACTUATOR] = valve
    if not inputs.valve_redundant:
        obeyed = [f for f in valve.findings if f.mode.total and _denies(*span_of(f, blocks.length), blocks, max_steer)]
        valve = valve.left_open(obeyed, blocks.length)
        jumping = of_sensor(valve.findings, inputs.angle, inputs.fresh, inputs.timeline.dt)
        if jumping and not inputs.angle_redundant:
            valve = valve._replace(findings=tuple(f for f in valve.findings if f not in jumping))
            own = out[Side.SENSOR]
            moved = sorted((*own.findings, *(as_sensors(f) for f in jumping)), key=lambda f: f.start)
            out[Side.SENSOR] = own._replace(findings=tuple(moved))
        findings = tuple(limited(f, _DISTURBED, _UNSEEN) if f.mode is FaultMode.NOISY else f for f in valve.findings)
        out[Side.ACTUATOR] = valve._replace(findings=findings)
    twice = {Side.SENSOR: inputs.angle_redundant, Side.ACTUATOR: inputs.valve_redundant}
    return {
        side: one._replace(findings=_not_brief(one.findings, inputs.timeline.dt, twice=twice[side]))
        for side, one in out.items()
    }


def _asked(valve: SideFindings, inputs: AxleInputs, blocks: SteeringBlocks) -> SideFindings:
    """A valve's findings without those of times in which it rests about its middle, as it is told to."""
    return valve.left_open([f for f in valve.findings if f.mode.total and _rests(f, inputs)], blocks.length)


def _rests(f: Finding, inputs: AxleInputs) -> bool:
    every = [inputs.values(leaf)[f.start : f.stop] for leaf in ("u", "u_applied") if leaf in inputs.logged]
    largest = [float(np.nanquantile(np.abs(u), _MOSTLY)) for u in every if np.isfinite(u).any()]
    return bool(largest) and max(largest) < _MIDDLE


def _not_brief(findings: tuple[Finding, ...], dt: float, *, twice: bool) -> tuple[Finding, ...]:
    """Findings; brief noise is no more probable than it is elsewhere, nor is a brief pause of what is not measured `twice`."""
    out = []
    pauses = [
        f
        for f in findings
        if f.mode is FaultMode.STUCK and f.side is Side.SENSOR and (f.stop - f.start) * dt < _HABIT_S
    ]
    for f in findings:
        seconds = (f.stop - f.start) * dt
        half, why = (_BURST_S, _BURST) if f.mode is FaultMode.NOISY else (_PAUSE_S, _PAUSE)
        brief = seconds**2 / (seconds**2 + half**2)
        told = (
            limited(f, f.probability * brief, why)
            if brief < _LASTS and (f.mode is FaultMode.NOISY or (f.mode.total and not twice))
            else f
        )
        often = not twice and len(pauses) > _OFTEN and any(f is p for p in pauses)
        out.append(
            limited(told, _HABIT, f"The reading pauses {len(pauses)} times in this mission: that is its habit.")
            if often
            else told
        )
    return tuple(out)


def _trembles(finding: Finding, inputs: AxleInputs) -> bool:
    """Whether the last digits of a reading go on changing, as those of a stuck sensor do not; its ends may come late."""
    edge = round(_EDGE * (finding.stop - finding.start))
    part = slice(finding.start + edge, finding.stop - edge)
    known = np.isfinite(inputs.angle[part])
    y = inputs.angle[part][known & inputs.fresh[part]]
    return bool(y.size > 1 and np.mean(known) > _READ and np.mean(np.diff(y) != 0.0) > _RESTLESS)


def _ends_at_stop(f: Finding, inputs: AxleInputs, max_steer: float) -> bool:
    """Whether an angle that seems stuck came to the mission's largest one by and by, as an axle that runs against its end stop."""
    if f.mode is not FaultMode.STUCK or f.side is not Side.SENSOR:
        return False
    y, before = inputs.angle, round(_APPROACH_S / inputs.timeline.dt)
    inside, lead = y[f.start : f.stop], y[max(0, f.start - before) : f.start]
    inside, lead = inside[np.isfinite(inside)], lead[np.isfinite(lead)]
    if not inside.size or not lead.size:
        return False
    level = float(np.median(inside))
    largest = float(np.nanmax(np.sign(level) * y))
    moving = abs(lead[0] - level) > 0.0 and bool(np.all(np.sign(level) * np.diff(lead) >= -_STEP * abs(level)))
    ends = abs(level) >= max(_AT_END * largest, _REACHED * max_steer)
    return ends and moving and abs(lead[-1] - level) <= _STEP * abs(level)


def _denies(a: int, b: int, blocks: SteeringBlocks, max_steer: float) -> bool:
    return _obeys(a, b, blocks) or _at_stop(a, b, blocks, _REACHED * max_steer)


def _at_stop(a: int, b: int, blocks: SteeringBlocks, least: float) -> bool:
    """Whether an axle stands at the largest angle of the mission in blocks [a, b) and is told to go on, as against an end stop."""
    angle = np.where(blocks.count > 0, blocks.mean, np.nan)
    known = np.isfinite(angle[a:b])
    if not known.any():
        return False
    sign = np.sign(np.nanmedian(angle[a:b]))
    largest = float(np.nanmax(sign * angle))
    there = (sign * angle[a:b] >= _AT_END * largest)[known]
    return bool(
        largest >= least and np.mean(there) > _STAYS and np.mean(sign * blocks.u[a:b][known][there] > 0.0) > _STAYS
    )


def _obeys(a: int, b: int, blocks: SteeringBlocks) -> bool:
    """Whether the angle moves as its command asks in blocks [a, b), by however much: no valve does that without its command.

    That of a closed loop turns against whatever a stuck valve does.
    """
    n = max(2, round(_MOTION_S / blocks.dt))
    known = np.where(blocks.count > 0, blocks.mean, np.nan)
    moved = known[a + n : b : n // 2] - known[a : b - n : n // 2]
    driven = np.concatenate([[0.0], np.cumsum(np.nan_to_num(blocks.u)) * blocks.dt])
    for late in range(0, round(_LATEST_S / blocks.dt) + 1, max(1, n // 4)):
        first = np.arange(a, b - n, n // 2)[: moved.size] - late
        use = (first >= 0) & np.isfinite(moved)
        x, y = driven[first[use] + n] - driven[first[use]], moved[use]
        power = float(x @ x) * float(y @ y)
        if x.size >= _FEW_MOTIONS and power > 0.0 and float(x @ y) > _OBEYS * power**0.5:
            return True
    return False


def shaken_power(blocks: SteeringBlocks, a: int, b: int) -> float:
    """Mean power of what changes from reading to reading in blocks [a, b) [rad²]; infinite where there is none."""
    use = blocks.count[a:b] > 0
    return float(np.mean(blocks.power[a:b][use])) if use.any() else float("inf")


def usual_power(side: SideFindings, blocks: SteeringBlocks) -> float:
    """That power where the side has no fault [rad²]; 0 where too little is left."""
    use = np.asarray(blocks.count > 0)
    for f in side.findings:
        use[slice(*span_of(f, blocks.length))] = False
    return float(np.mean(blocks.power[use])) if np.count_nonzero(use) * blocks.dt >= _LEAST_USUAL_S else 0.0
