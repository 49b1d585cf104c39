"""The channels of one steering axle: angle and valve command, what is measured redundantly, and its blocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.liveness import alive
from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, block_length, blocks_of, sensor_noise
from diagnosis.steering.redundancy import with_second_angle, with_valve_opening
from replay.arrays.sliding import smallest_within
from replay.control.loop import Replay
from replay.machine.config import Machine, Noise
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Counts = Mapping[str, NDArray[np.int16]]

#: Beginning of the names of what the replayed loop gives.
REPLAYED = "replay."

_LEAVES = ("phi", "phi_true", "u", "u_applied")
_NO_NOISE = SensorNoise(1.0, 1.0, 0.0, 0.0)
_SLOW = 0.1  # of the top speed, from which on commands of the body tell an angle
_SET_OFF_S = 1.0  # after which they do
_TOLERANCE = 0.15  # of the smallest saturation term: what two healthy angle sensors may differ by


@dataclass(frozen=True)
class AxleInputs:
    """One axle's channels and, where a model must judge a side, their blocks.

    Attributes
    ----------
    name : str
        The axle.
    timeline : Timeline
        The aligned mission.
    logged : frozenset[str]
        Leaves in the log: ``phi``, ``phi_true``, ``u``, ``u_applied``.
    command : Array, shape (n,)
        Valve opening [fraction]: the command, else the opening itself, else what the replayed loop commands.
    blocks : SteeringBlocks or None
        None where angle or command are missing.
    noise : SensorNoise
        Of the angle.
    valve_deviation : Array, shape (n,), or None
        Opening less command as multiples of its noise; None unless both are logged.
    """

    name: str
    timeline: Timeline
    logged: frozenset[str]
    command: Array
    blocks: SteeringBlocks | None = None
    noise: SensorNoise = _NO_NOISE
    valve_deviation: Array | None = None

    @property
    def measured(self) -> str:
        """Leaf of the angle that is judged: the sensor's, else the second one's."""
        return "phi" if "phi" in self.logged else "phi_true"

    @property
    def angle(self) -> Array:
        """That angle [rad], shape (n,)."""
        return self.values(self.measured)

    @property
    def fresh(self) -> NDArray[np.bool_]:
        """Steps with a new sample of it, shape (n,)."""
        return self.timeline.fresh[self.channel(self.measured)]

    @property
    def angle_redundant(self) -> bool:
        """Whether a second angle is logged."""
        return {"phi", "phi_true"} <= self.logged

    @property
    def valve_redundant(self) -> bool:
        """Whether the valve's opening is logged beside its command."""
        return {"u", "u_applied"} <= self.logged

    @property
    def command_missing(self) -> bool:
        """Whether the valve's opening is logged but not its command."""
        return "u_applied" in self.logged and "u" not in self.logged

    @property
    def redundant(self) -> bool:
        """Whether anything is measured redundantly."""
        return self.angle_redundant or self.valve_redundant

    @property
    def names(self) -> tuple[str, str]:
        """Channels of angle and command; of a command that is not logged, what stands in for it: that of the replayed loop."""
        if self.uncommanded:
            return self.channel(self.measured), f"{REPLAYED}{self.name}.u"
        return self.channel(self.measured), self.channel("u" if "u" in self.logged else "u_applied")

    @property
    def uncommanded(self) -> bool:
        """Whether neither the valve's command nor its opening is logged, so that what the replayed loop commands stands in for them."""
        return not {"u", "u_applied"} & self.logged

    def channel(self, leaf: str) -> str:
        """Canonical name."""
        return f"steer.{self.name}.{leaf}"

    def values(self, leaf: str) -> Array:
        """Values on the timeline; NaN where it is not logged. Shape (n,), SI."""
        if leaf in self.logged:
            return self.timeline.signals[self.channel(leaf)]
        return np.broadcast_to(np.nan, (self.timeline.size,))


def axle_inputs(timeline: Timeline, replay: Replay, machine: Machine, axle: int, counts: Counts) -> AxleInputs:
    """Take an axle's channels from a mission.

    All of shape (n,).

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    axle : int
        Place in `machine.axles`.
    counts : Mapping[str, NDArray[np.int16]]
        From `diagnosis.channels.liveness.alive_sources`.
    """
    name = machine.axles[axle]
    found = {leaf: timeline.get(f"steer.{name}.{leaf}") for leaf in _LEAVES}
    logged = frozenset(leaf for leaf, x in found.items() if x is not None and bool(np.isfinite(x).any()))
    u = found["u"] if "u" in logged else found["u_applied"]
    if u is None or not np.isfinite(u).any():
        u = _replayed(timeline, replay, machine, axle)
    inputs = AxleInputs(name, timeline, logged, u)
    if inputs.measured not in logged or not np.isfinite(u).any():
        return inputs
    return _with_blocks(inputs, machine, counts, _length(timeline, machine))


def _replayed(timeline: Timeline, replay: Replay, machine: Machine, axle: int) -> Array:
    """What the replayed loop commands, NaN where nothing tells an angle, shape (n,).

    An angle that follows from commands of the body is a quotient of both: while these hardly ask for motion it is anything, and machines
    leave their wheels where they are, or straight, and set them only once they move off.
    """
    u, speed = replay.steer_u[:, axle], timeline.get("cmd.v")
    if timeline.get(f"steer.{machine.axles[axle]}.phi_ref") is not None or speed is None:
        return u
    least = max(machine.limits.driving_speed, _SLOW * machine.max_speed)
    width = max(1, round(_SET_OFF_S / timeline.dt))

    def known(u: Array, v: Array) -> Array:
        lately = smallest_within(np.nan_to_num(np.abs(v)), width - 1, 0, "edge")
        return np.where(lately < least, np.nan, u)

    return timeline.map(known, u, speed)


def _length(timeline: Timeline, machine: Machine) -> int:
    """Steps per block, the same for all axles."""
    angles = [timeline.fresh.get(f"steer.{axle}.{leaf}") for axle in machine.axles for leaf in ("phi", "phi_true")]
    return block_length([new for new in angles if new is not None], timeline.dt)


def _with_blocks(inputs: AxleInputs, machine: Machine, counts: Counts, length: int) -> AxleInputs:
    """Add the blocks, the sensor's noise and what is measured redundantly."""
    timeline, channel, y, fresh = inputs.timeline, inputs.names[0], inputs.angle, inputs.fresh
    delivers = alive(timeline, dict(counts), channel)
    blocks = blocks_of(y, inputs.command, fresh, delivers, timeline.dt, timeline.store, length)
    noise = sensor_noise(blocks, y[fresh & np.isfinite(y)], machine.noise.get(channel, Noise()), machine.max_steer)
    deviation = None
    if inputs.angle_redundant:
        # a coarse rounding is no disagreement
        tolerance = _TOLERANCE * machine.limits.min_sat + (0.0 if noise.resolved else noise.lsb)
        new = timeline.fresh[inputs.channel("phi_true")]
        blocks = with_second_angle(blocks, y, inputs.values("phi_true"), new, timeline.dt, tolerance)
    if inputs.valve_redundant:
        new = timeline.fresh[inputs.channel("u_applied")]
        position = inputs.values("u_applied")
        blocks, deviation = with_valve_opening(blocks, inputs.command, position, new, timeline.dt)
    return replace(inputs, blocks=blocks, noise=noise, valve_deviation=deviation)
