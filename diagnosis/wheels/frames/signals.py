"""Signals of all wheels as the features need them: by steps of 40 ms, in units of the machine's usual speed."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR, SILENT
from diagnosis.estimation.lag import low_passed
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.frames.windows import STEP_S
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.models import JointModel
from diagnosis.wheels.motion import body_speeds
from diagnosis.wheels.step_kernel import RESTLESS, RESTS
from replay.arrays.blocks import block_means

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_STANDS = 1e-3  # of the usual speed
_EXACT = 0.03  # of the largest speed: uncertainty up to which sensors of the body stand for it
_SATURATED = 0.95
_MOST_JITTER = 1e4  # of the usual one


@dataclass(frozen=True)
class MissionSignals:
    """Steps of all wheels, shape (n, wheels) each.

    Attributes
    ----------
    speed : Array
        Mean of the known readings [m/s]; the last known one where there is none.
    reference : Array
        Commanded speed [m/s]; NaN where there is none.
    asked : Array
        Speed that the valve alone asks for behind its lag [m/s].
    rolling : Array
        Speed at which the wheel would roll, by sensors of the body where they are exact enough, else by the other wheels
        [m/s]; NaN where nobody knows.
    command, opening : Array
        Mean commanded opening, and of its size [fraction]; 0 where unknown.
    ratio : Array
        Speed of the wheel per speed of the body [1]; NaN where unknown.
    known, silent, rests, restless, quiet, saturated : Array
        Share of the step in which the speed has news; its sensor is silent; rests; is restless (see `WheelBlocks.habit`); the
        wheel is neither commanded nor moving; the command is at its end.
    jitter, root_jitter, constant : Array
        Mean square of the steps between readings in units of the usual one, mean of its root, and share without a step.
    rough, unseen : Array
        Standard deviation of the effective opening within a block, and what of it nobody has seen [fraction].
    """

    speed: Array
    reference: Array
    asked: Array
    rolling: Array
    command: Array
    opening: Array
    ratio: Array
    known: Array
    silent: Array
    rests: Array
    restless: Array
    quiet: Array
    saturated: Array
    jitter: Array
    root_jitter: Array
    constant: Array
    rough: Array
    unseen: Array

    @classmethod
    def of(cls, data: WheelsData, blocks: WheelBlocks, model: JointModel) -> MissionSignals:
        """Signals of a mission."""
        n, wheels = blocks.y.shape
        width = step_width(blocks.dt)
        asked, noise = np.zeros((n, wheels)), np.ones((n, wheels))
        for i, wheel in enumerate(model.wheels):
            if wheel is not None:
                opening = blocks.u[:, i].reshape(n, blocks.width).mean(1)
                asked[:, i] = low_passed(opening * wheel.K, wheel.tau, blocks.dt)
                noise[:, i] = 2.0 * wheel.noise**2 * blocks.white[:, i] + 1e-12
        last = np.maximum.accumulate(np.where(blocks.count > 0, np.arange(n)[:, None], 0), axis=0)
        speed = np.take_along_axis(blocks.y, last, axis=0)
        known = (blocks.count > 0) & (blocks.status == PAIR)
        steps = np.minimum(blocks.jitter / noise, _MOST_JITTER) * known
        command = np.nan_to_num(block_means(data.u, blocks.width))
        found = {
            "speed": speed,
            "reference": block_means(data.reference, blocks.width),
            "asked": asked,
            "rolling": _rolling(speed, blocks, data.span),
            "command": command,
            "opening": np.abs(command),
            "ratio": blocks.ratio,
            "known": known,
            "silent": blocks.status == SILENT,
            "rests": blocks.habit == RESTS,
            "restless": blocks.habit == RESTLESS,
            "quiet": blocks.quiet,
            "saturated": np.abs(command) > _SATURATED,
            "jitter": steps,
            "root_jitter": np.sqrt(steps),
            "constant": (blocks.jitter == 0) & known,
            "rough": blocks.u.reshape(n, blocks.width, wheels).std(axis=1),
            "unseen": blocks.unseen,
        }
        return cls(**{name: block_means(x, width) for name, x in found.items()})

    @cached_property
    def usual(self) -> float:
        """Speed that counts as one: the 90 % quantile of the commanded, else of the measured speeds [m/s]."""
        known = np.abs(np.where(np.isfinite(self.reference), self.reference, self.speed))
        known = known[np.isfinite(known) & (known > 0)]
        return float(np.quantile(known[:: max(1, known.size // 20000)], 0.9)) if known.size else 1.0

    def toward(self, i: int) -> Array:
        """Direction in which wheel i is to turn, shape (n,): −1, 0 or 1."""
        r = np.nan_to_num(self.reference[:, i])
        return np.asarray(np.sign(np.where(np.abs(r) > _STANDS * self.usual, r, np.nan_to_num(self.rolling[:, i]))))

    def part(self, cut: slice) -> MissionSignals:
        """Some steps alone; the usual speed stays that of the mission."""
        out = MissionSignals(*(getattr(self, f.name)[cut] for f in fields(self)))
        out.__dict__["usual"] = self.usual
        return out


@dataclass(frozen=True)
class WheelSignals:
    """One wheel in units of the usual speed, forward counted positive; shape (n,) each.

    Attributes
    ----------
    r, y, d, b : Array
        Commanded, measured, asked of the valve, rolling with the body [1]; 0 where unknown.
    has_r, has_b : NDArray[np.bool_]
        Where the first and the last are known.
    known : Array
        Share of each step in which the second is.
    u : Array
        Commanded opening [fraction].
    toward : Array
        As in `MissionSignals.toward`.
    """

    r: Array
    y: Array
    d: Array
    b: Array
    has_r: Flags
    has_b: Flags
    known: Array
    u: Array
    toward: Array

    @classmethod
    def of(cls, i: int, seen: MissionSignals) -> WheelSignals:
        """Signals of wheel i."""
        toward, usual = seen.toward(i), seen.usual
        r, b = seen.reference[:, i], seen.rolling[:, i]
        return cls(
            r=np.nan_to_num(r) * toward / usual,
            y=seen.speed[:, i] * toward / usual,
            d=seen.asked[:, i] * toward / usual,
            b=np.nan_to_num(b) * toward / usual,
            has_r=np.isfinite(r),
            has_b=np.isfinite(b),
            known=seen.known[:, i],
            u=seen.command[:, i] * toward,
            toward=toward,
        )


def step_width(dt: float) -> int:
    """Blocks of dt [s] in a step."""
    return max(1, round(STEP_S / dt))


def _rolling(speed: Array, blocks: WheelBlocks, span: float) -> Array:
    """Speed at which each wheel would roll [m/s], shape (n, wheels)."""
    by_wheels = body_speeds(speed, blocks.ratio, blocks.turn)
    if blocks.body_speed is None or blocks.body_std is None:
        return by_wheels
    exact = np.isfinite(blocks.body_speed) & (blocks.body_std < _EXACT * span)
    return np.where(exact, blocks.body_speed, by_wheels)
