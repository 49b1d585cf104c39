"""Abduction: from the aligned mission and its diagnosis to the recorded world and the plant that all worlds share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.assess import ComponentResult
from diagnosis.counterfactual.plant import lightest, measured_angle, wheel_fits
from diagnosis.results.assessment import CODE, Finding
from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.motion import in_motion
from diagnosis.wheels.wheel_channels import wheel_channels
from replay.arrays.numeric import without_nan
from replay.control.loop import Replay, any_finite, stack
from replay.control.mfhca import fill_forward
from replay.counterfactual.world import CoupledPlant, RecordedWorld
from replay.errors import NotJudged
from replay.faults import FaultMode, Side, State
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MOST_SAMPLES = 2_000_000  # steps that fit into memory with all columns of both worlds
_ICE = 0.1  # hold of the ground under a wheel that slips, as a share of firm ground's
_HELD_SPEED, _HELD_OPENING = 0.012, 0.03  # within which a stuck part stands where it was at its onset [m/s], [fraction]
_SMOOTH_S = 0.05  # over which a measured opening is averaged
_LEAST_LET = 0.2  # share of the speed that a sensor must let through for the speed to be read back from it


@dataclass(frozen=True)
class KnownFault:
    """A fault of a wheel, as the diagnosis has it.

    Attributes
    ----------
    wheel : int
        Index among the driven wheels.
    side : Side
        Of the most probable hypothesis, where the finding leaves it open.
    finding : Finding
        The rest.
    """

    wheel: int
    side: Side
    finding: Finding

    def let(self, epsilon: float | None = None) -> float:
        """δ = 1 − ε: share of the signal that is let through; with another ε where one is given."""
        if self.finding.mode.total:
            return 0.0
        own = 0.0 if self.finding.epsilon is None else self.finding.epsilon.value
        return float(np.clip(1.0 - (own if epsilon is None else epsilon), 0.0, 2.0))


@dataclass(frozen=True)
class Abducted:
    """What is kept in every other world.

    Attributes
    ----------
    world : RecordedWorld
        Signals and faults.
    fit : WheelModelFit
        Wheel models behind the plant.
    plant : CoupledPlant
        The plant.
    known : NDArray[np.bool_], shape (n, driven wheels)
        Where the wheel's true speed is known, by a second measurement or a sensor that is not faulty.
    faulty : NDArray[np.bool_], shape (n, driven wheels)
        Where the diagnosis has a fault of the wheel.
    faults : tuple[KnownFault, ...]
        Of the wheels, by start.
    notes : tuple[str, ...]
        What was left out or assumed, one sentence each.
    """

    world: RecordedWorld
    fit: WheelModelFit
    plant: CoupledPlant
    known: Flags
    faulty: Flags
    faults: tuple[KnownFault, ...]
    notes: tuple[str, ...]


def abduct(timeline: Timeline, replay: Replay, machine: Machine, found: ComponentResult, name: str) -> Abducted:
    """Recorded world and plant of a diagnosed mission: of its driven wheels, which alone have commands.

    Parameters
    ----------
    timeline, replay, machine
        The mission.
    found : ComponentResult
        Its diagnosis.
    name : str
        Of the mission, for messages.

    Raises
    ------
    NotJudged
        Where commands, speeds or wheel models are missing, or the mission is too long.
    """
    _check(timeline, replay, machine, name)
    fits = wheel_fits(timeline, replay, machine, found)
    if not fits:
        raise NotJudged(
            f"{name}: no model of every wheel could be found, without which no other law can be predicted; give K and tau of each "
            "wheel in a machine file's [plant] (`mfhca fit`), or a mission that drives more"
        )
    faults = _faults(found, machine)
    channels, driven = wheel_channels(timeline, machine), machine.driven_columns
    v, true, applied = channels.v[:, driven], channels.true[:, driven], channels.applied[:, driven]
    y = _read(v, faults)
    u = _filled(channels.u[:, driven])
    let = {side: np.ones(y.shape) for side in (Side.SENSOR, Side.ACTUATOR)}
    held = {side: np.zeros(y.shape, np.bool_) for side in let}
    faulty = np.zeros(y.shape, np.bool_)
    speed = np.array(v)
    opening = np.array(u)
    for fault in faults:
        rows, i, f = slice(fault.finding.start, fault.finding.stop), fault.wheel, fault.finding
        let[fault.side][rows, i] = fault.let()
        faulty[rows, i] = True
        if fault.side is Side.SENSOR:
            speed[rows, i] = _speed_behind(y[rows, i], fault)
            held[fault.side][rows, i] = _held(y[:, i], y[min(f.start + 1, len(y) - 1), i], f, _HELD_SPEED)
        else:
            stuck = 0.0 if f.sat is None else f.sat.mean
            rest = (1.0 - fault.let()) * stuck
            opening[rows, i] = fault.let() * u[rows, i] + _rest(
                applied[rows, i], fault.let() * u[rows, i], rest, timeline.dt
            )
            held[fault.side][rows, i] = _held(u[:, i], stuck, f, _HELD_OPENING)
    speed = np.where(channels.has_true[driven], true, speed)
    ratio, turn = in_motion(measured_angle(timeline, machine), machine, timeline)
    coupled = bool(np.isfinite(ratio).all()) and machine.plant.coupling != "free"
    world = RecordedWorld(
        dt=timeline.dt,
        v_ref=_filled(replay.v_ref[:, driven]),
        y=y,
        u=u,
        opening=np.clip(opening, -machine.control.u_max, machine.control.u_max),
        speed=speed,
        let_sensor=let[Side.SENSOR],
        let_valve=let[Side.ACTUATOR],
        held_sensor=held[Side.SENSOR],
        held_valve=held[Side.ACTUATOR],
        ratio=np.array(ratio[:, driven]) if coupled else np.ones(y.shape),
        turn=without_nan(np.array(turn[:, driven])),
        ground=_ground(found, machine, y.shape),
    )
    fit, plant = lightest(fits, world, machine, coupled=coupled)
    known = np.isfinite(speed)
    return Abducted(
        world, fit, plant, known, faulty, faults, tuple(_notes(machine, known, faulty, faults, timeline.dt))
    )


def _check(timeline: Timeline, replay: Replay, machine: Machine, name: str) -> None:
    """Raise where the mission lacks what every counterfactual needs."""
    if timeline.open_loop:
        raise NotJudged(
            f"{name}: faults were written into this recording, whose controller never met them; take the recording without them, or "
            "a simulated mission"
        )
    if timeline.size * len(machine.driven) > 4 * _MOST_SAMPLES:
        most = 4 * _MOST_SAMPLES / len(machine.driven) * timeline.dt
        raise NotJudged(f"{name}: is longer than the {most:.0f} s that fit; choose a part with --start and --end")
    for leaf, words in (("u", "valve command"), ("v", "speed")):
        logged = any_finite(stack(timeline, [f"wheel.{w}.{leaf}" for w in machine.driven]))
        if not logged.all():
            wheel = machine.driven[int(np.argmin(logged))]
            raise NotJudged(f"{name}: wheel.{wheel}.{leaf} is not in the log; the {words} of every wheel is needed")
    if not any_finite(replay.v_ref[:, machine.driven_columns]).all():
        raise NotJudged(
            f"{name}: the commanded speeds of the wheels are not known; log cmd.v and cmd.omega, or wheel.*.v_ref"
        )


def _faults(found: ComponentResult, machine: Machine) -> tuple[KnownFault, ...]:
    faults = []
    for (component, _), assessment in found.assessments.items():
        if component in machine.driven:
            i = machine.driven.index(component)
            faults += [KnownFault(i, _side(f), f) for f in assessment.findings]
    return tuple(
        sorted({(f.wheel, f.side, f.finding.start): f for f in faults}.values(), key=lambda f: f.finding.start)
    )


def _side(finding: Finding) -> Side:
    if finding.side is not Side.SENSOR_OR_ACTUATOR:
        return finding.side
    sensor = sum(h.p for h in finding.hypotheses if h.side == Side.SENSOR)
    actuator = sum(h.p for h in finding.hypotheses if h.side == Side.ACTUATOR)
    return Side.SENSOR if sensor > actuator else Side.ACTUATOR


def _filled(x: Array) -> Array:
    """NaN replaced by the value before it, 0 before any; shape (n, wheels)."""
    return np.column_stack([fill_forward(np.ascontiguousarray(x[:, i])) for i in range(x.shape[1])])


def _read(v: Array, faults: tuple[KnownFault, ...]) -> Array:
    """What the controller read: a silent sensor that logs nothing reads 0."""
    y = np.array(v)
    for fault in faults:
        if fault.side is Side.SENSOR and fault.finding.mode is FaultMode.NO_SIGNAL:
            rows = slice(fault.finding.start, fault.finding.stop)
            y[rows, fault.wheel] = without_nan(y[rows, fault.wheel])
    return _filled(y)


def _speed_behind(y: Array, fault: KnownFault) -> Array:
    """True speed behind a faulty sensor: y/δ where it is nothing but a share of it, else not known."""
    let = fault.let()
    return y / let if fault.finding.mode.scaled and let >= _LEAST_LET else np.full(y.shape, np.nan)


def _rest(applied: Array, let: Array, rest: float, dt: float) -> Array:
    """δ̄ of a faulty valve: what it opens beside its share of the command [fraction].

    By the measured opening where there is one, smoothed: it is late, and a command with sgn(e) chatters from sample to sample.
    """
    if not np.isfinite(applied).all():
        return np.full(let.shape, rest)
    width = min(let.size, max(1, round(_SMOOTH_S / dt)))
    total = np.convolve(applied - let, np.ones(width), "same")
    return np.asarray(total / np.convolve(np.ones(let.size), np.ones(width), "same"))


def _held(before: Array, value: float, finding: Finding, within: float) -> bool:
    """Whether a stuck part stands where it was before its onset."""
    if finding.mode is not FaultMode.STUCK or finding.start < 1:
        return False
    usual = float(np.median(before[max(0, finding.start - 6) : finding.start]))
    return abs(value - usual) < within


def _ground(found: ComponentResult, machine: Machine, shape: tuple[int, ...]) -> Array:
    """Share of firm ground's hold under each wheel: less where the diagnosis has it slip."""
    ground = np.ones(shape)
    for i, wheel in enumerate(machine.driven):
        for side in (Side.SENSOR, Side.ACTUATOR):
            assessment = found.assessments.get((wheel, side.value))
            if assessment is not None:
                ground[assessment.states == CODE[State.SLIP], i] = _ICE
    return ground


def _notes(machine: Machine, known: Flags, faulty: Flags, faults: tuple[KnownFault, ...], dt: float) -> list[str]:
    notes = []
    if machine.unpowered:
        notes.append(
            f"{', '.join(machine.unpowered)}: without a drive, in no law's hands; what they weigh is in the load."
        )
    for i, wheel in enumerate(machine.driven):
        lost = float(np.count_nonzero(~known[:, i] & faulty[:, i])) * dt
        if lost > 0.0:
            notes.append(
                f"{wheel}: its sensor hides the wheel's speed for {lost:.1f} s and there is no second one; errors there are left out."
            )
    both = [f for f in faults if f.finding.side is Side.SENSOR_OR_ACTUATOR]
    if both:
        count = f"{len(both)} losses are" if len(both) > 1 else "One loss is"
        notes.append(f"{count} of the sensor or of the valve; the more probable side was taken.")
    outside = [f for f in faults if f.finding.mode is FaultMode.OUTSIDE_TABLE]
    if outside:
        notes.append(f"{len(outside)} deviations lie outside of the fault tables; they are kept as they were recorded.")
    return notes


def weighted(abducted: Abducted, epsilon: Mapping[int, float]) -> tuple[Array, Array]:
    """δ_s and δ_a with another ε of some faults, by their place in `Abducted.faults`.

    Both of shape (n, wheels), gains [1].
    """
    world = abducted.world
    sensor, valve = np.array(world.let_sensor), np.array(world.let_valve)
    for j, value in epsilon.items():
        fault = abducted.faults[j]
        column = sensor if fault.side is Side.SENSOR else valve
        column[fault.finding.start : fault.finding.stop, fault.wheel] = fault.let(value)
    return sensor, valve
