"""Signals of all wheels as the features need them: by steps of 40 ms, in units of the machine's usual speed."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR, SILENT
from diagnosis.estimation.lag import low_passed_on
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.frames.windows import STEP_S
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.models import JointModel
from diagnosis.wheels.motion import body_speeds
from diagnosis.wheels.step_kernel import RESTLESS, RESTS
from replay.arrays.blocks import block_means, release
from replay.arrays.blocks import blocks as rows_in_parts

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
        """Signals of a mission, part by part, so that only steps are ever in memory as a whole."""
        n, wheels = blocks.y.shape
        width = step_width(blocks.dt)
        out = {f.name: np.empty((-(-n // width), wheels)) for f in fields(cls)}
        past = _Past([None] * wheels, blocks.y[:1])
        for cut in rows_in_parts(n, width, max(1, blocks.store.block // blocks.width)):
            steps = slice(cut.start // width, -(-cut.stop // width))
            for name, x in _signals_by_block(cut, data, blocks, model, past).items():
                out[name][steps] = block_means(x, width)
            release(data.u, data.reference, blocks.u)
        return cls(**out)

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


@dataclass
class _Past:
    """What a part of a mission needs of the one before: the state of each valve's lag, and the last speeds, shape (1, wheels)."""

    asked: list[float | None]
    speed: Array


def _signals_by_block(
    cut: slice, data: WheelsData, blocks: WheelBlocks, model: JointModel, past: _Past
) -> dict[str, NDArray[Any]]:
    """Signals of `MissionSignals` for every block of a part, shape (m, wheels) each; `past` becomes that of the next part."""
    part = blocks.part(cut.start, cut.stop)
    samples = slice(cut.start * blocks.width, cut.stop * blocks.width)
    m, wheels = part.y.shape
    openings = part.u.reshape(m, blocks.width, wheels)
    asked, noise = np.zeros((m, wheels)), np.ones((m, wheels))
    for i, wheel in enumerate(model.wheels):
        if wheel is not None:
            wanted = openings[:, :, i].mean(axis=1) * wheel.K
            asked[:, i], past.asked[i] = low_passed_on(wanted, wheel.tau, blocks.dt, past.asked[i])
            noise[:, i] = 2.0 * wheel.noise**2 * part.white[:, i] + 1e-12
    last = np.maximum.accumulate(np.where(part.count > 0, np.arange(1, m + 1)[:, None], 0), axis=0)
    speed = np.take_along_axis(np.concatenate([past.speed, part.y]), last, axis=0)
    past.speed = speed[-1:]
    known = (part.count > 0) & (part.status == PAIR)
    steps = np.minimum(part.jitter / noise, _MOST_JITTER) * known
    command = np.nan_to_num(block_means(data.u[samples], blocks.width))
    return {
        "speed": speed,
        "reference": block_means(data.reference[samples], blocks.width),
        "asked": asked,
        "rolling": _rolling(speed, part, data.span),
        "command": command,
        "opening": np.abs(command),
        "ratio": part.ratio,
        "known": known,
        "silent": part.status == SILENT,
        "rests": part.habit == RESTS,
        "restless": part.habit == RESTLESS,
        "quiet": part.quiet,
        "saturated": np.abs(command) > _SATURATED,
        "jitter": steps,
        "root_jitter": np.sqrt(steps),
        "constant": (part.jitter == 0) & known,
        "rough": openings.std(axis=1),
        "unseen": part.unseen,
    }


def _rolling(speed: Array, blocks: WheelBlocks, span: float) -> Array:
    """Speed at which each wheel would roll [m/s], shape (n, wheels)."""
    by_wheels = body_speeds(speed, blocks.ratio, blocks.turn)
    if blocks.body_speed is None or blocks.body_std is None:
        return by_wheels
    exact = np.isfinite(blocks.body_speed) & (blocks.body_std < _EXACT * span)
    return np.where(exact, blocks.body_speed, by_wheels)
