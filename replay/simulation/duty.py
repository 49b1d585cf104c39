"""Duty cycles and ground: what the operator commands and what the machine drives over, as functions of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.simulation.options import PAPER_DRIVES, SimulationOptions

_STEER_RATE = 0.2  # fastest commanded steering [rad/s]: below what the cylinders can follow
_WOBBLE = 0.08  # share by which an operator's hand varies the speed

# The paper's mission: from [s], speed [m/s], front steering angle [deg]; forward and backward, at most 35 deg.
_PAPER_DUTY = (
    (0.0, 0.0, 0.0),
    (2.0, 0.30, 0.0),
    (14.0, 0.26, 20.0),
    (26.0, 0.30, -10.0),
    (40.0, -0.26, -10.0),
    (54.0, -0.22, 15.0),
    (68.0, 0.33, 0.0),
    (82.0, 0.20, 35.0),
    (98.0, 0.20, -35.0),
    (116.0, -0.30, 0.0),
    (130.0, -0.20, 25.0),
    (144.0, 0.34, 0.0),
    (158.0, 0.28, 12.0),
    (170.0, 0.24, -20.0),
    (184.0, -0.30, -5.0),
    (197.0, 0.30, 0.0),
    (212.0, 0.26, 18.0),
    (224.0, -0.20, 10.0),
    (237.0, 0.0, 10.0),
)
_PAPER_SLOPES = ((0.0, 0.0), (60.0, 0.07), (88.0, 0.0), (150.0, -0.06), (178.0, 0.0))


@dataclass(frozen=True)
class Profile:
    """A signal that moves smoothly from value to value.

    Attributes
    ----------
    start : NDArray[np.float64], shape (m,)
        When each move begins [s]; the first is 0.
    ramp : NDArray[np.float64], shape (m,)
        How long it takes [s].
    value : NDArray[np.float64], shape (m,)
        Where it ends.
    """

    start: NDArray[np.float64]
    ramp: NDArray[np.float64]
    value: NDArray[np.float64]

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Value at times t [s], shape (n,)."""
        row = np.maximum(np.searchsorted(self.start, t, side="right") - 1, 0)
        before = np.concatenate([self.value[:1], self.value[:-1]])[row]
        x = np.clip((t - self.start[row]) / self.ramp[row], 0.0, 1.0)
        moved: NDArray[np.float64] = before + (self.value[row] - before) * x * x * (3.0 - 2.0 * x)
        return moved


@dataclass(frozen=True)
class Duty:
    """One mission's commands and ground.

    Attributes
    ----------
    speed, steer, slope : Profile
        v_c before limits [m/s], angle of the front axle [rad], rise of the ground [rad].
    wobble_phase : float
        Phase of the operator's hand [rad].
    axle_x, half_track, offset, max_speed : float
        Front axle's place, joint's distance from the middle, wheel offset [m]; top speed at the rim [m/s].
    """

    speed: Profile
    steer: Profile
    slope: Profile
    wobble_phase: float
    axle_x: float
    half_track: float
    offset: float
    max_speed: float

    def command(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """v_c [m/s] and ω_c [rad/s] at times t [s], shape (n, 2); no wheel's reference exceeds `max_speed`."""
        kappa = np.tan(self.steer.at(t)) / self.axle_x
        v = self.speed.at(t) * (1.0 + _WOBBLE * np.sin(2 * np.pi * t / 3.7 + self.wobble_phase))
        outer = np.hypot(1.0 + np.abs(kappa) * self.half_track, kappa * self.axle_x) + np.abs(kappa) * self.offset
        v = np.clip(v, -self.max_speed / outer, self.max_speed / outer)
        return np.column_stack([v, kappa * v])


def duty_of(options: SimulationOptions, rng: np.random.Generator) -> Duty:
    """Duty cycle of a scenario: the paper's (repeated where the mission is longer), or a random one."""
    geometry = options.machine.geometry
    assert geometry is not None  # checked by SimulationOptions
    paper = options.scenario in PAPER_DRIVES
    moves = _paper_moves(options.duration_s) if paper else _random_moves(options, rng)
    slopes = _paper_slopes(options.duration_s) if paper else _random_slopes(options.duration_s, rng)
    start, speed, steer = np.array(moves).T
    start_slope, slope = np.array(slopes).T
    return Duty(
        speed=Profile(start, np.full(start.size, 1.2), speed),
        steer=_steering(start, speed, steer, options.duration_s),
        slope=Profile(
            start_slope, np.full(start_slope.size, 3.0), slope * (options.steepness if options.slopes else 0.0)
        ),
        wobble_phase=float(rng.uniform(0.0, 2 * np.pi)),
        axle_x=geometry.axle_x("front"),
        half_track=max(abs(w.y) for w in geometry.wheels.values()),
        offset=max(abs(w.offset) for w in geometry.wheels.values()),
        max_speed=options.machine.max_speed,
    )


def _steering(
    start: NDArray[np.float64], speed: NDArray[np.float64], steer: NDArray[np.float64], duration: float
) -> Profile:
    """Steer only while driving, one second after each change of speed, never faster than the operator's limit.

    At standstill the commanded direction is undefined: a change there would make φ_c jump at the next start.
    """
    stop = np.append(start[1:], max(duration, start[-1] + 1.0))
    begin, ramp, value = [0.0], [1.0], [0.0]
    for i in range(start.size):
        room = stop[i] - start[i] - 2.5
        if abs(speed[i]) < 0.05 or room < 0.5:
            continue
        # A smooth step is 1.5 times as steep in its middle as on average.
        reach = room * _STEER_RATE / 1.5
        target = float(np.clip(steer[i], value[-1] - reach, value[-1] + reach))
        if target != value[-1]:
            begin.append(start[i] + 1.0)
            ramp.append(max(1.0, 1.5 * abs(target - value[-1]) / _STEER_RATE))
            value.append(target)
    return Profile(np.array(begin), np.array(ramp), np.array(value))


def _paper_moves(duration: float) -> list[tuple[float, float, float]]:
    return [
        (240.0 * lap + t, v, float(np.radians(phi)))
        for lap in range(int(duration // 240.0) + 1)
        for t, v, phi in _PAPER_DUTY
        if t < duration - 240.0 * lap or t == 0.0
    ]


def _paper_slopes(duration: float) -> list[tuple[float, float]]:
    return [(240.0 * lap + t, s) for lap in range(int(duration // 240.0) + 1) for t, s in _PAPER_SLOPES]


def _random_moves(options: SimulationOptions, rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """Stop at first, then stretches of 6–16 s: some standstill, one in three backward, one in three straight."""
    top = options.machine.max_speed
    moves, t = [(0.0, 0.0, 0.0)], 1.0
    while t < options.duration_s:
        standing, backward, straight = rng.random(3) < (0.15, 0.33, 0.35)
        v = 0.0 if standing else float(rng.uniform(0.35, 0.95)) * top * (-1.0 if backward else 1.0)
        phi = 0.0 if straight else float(rng.uniform(-1.0, 1.0)) * float(np.radians(35.0))
        moves.append((t, v, phi))
        t += float(rng.uniform(4.0, 9.0) if standing else rng.uniform(6.0, 16.0))
    return moves


def _random_slopes(duration: float, rng: np.random.Generator) -> list[tuple[float, float]]:
    slopes, t = [(0.0, 0.0)], float(rng.uniform(10.0, 30.0))
    while t < duration:
        slopes.append((t, float(rng.uniform(-0.08, 0.08)) if len(slopes) % 2 else 0.0))
        t += float(rng.uniform(12.0, 35.0))
    return slopes
