"""Signals of all wheels by block, as the features need them: in units of the machine's usual speed, forward where it is asked."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.estimation.lag import low_passed
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.models import JointModel
from diagnosis.wheels.motion import body_speeds

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_STANDS = 1e-3  # of the usual speed
_EXACT = 0.03  # of the largest speed: uncertainty up to which sensors of the body stand for it


@dataclass(frozen=True)
class MissionSignals:
    """Blocks of all wheels, shape (n, wheels) each.

    Attributes
    ----------
    reference : Array
        Commanded speed [m/s]; NaN where there is none.
    command : Array
        Valve opening as it was commanded [fraction]; 0 where unknown.
    asked : Array
        Speed that the valve alone asks for behind its lag [m/s].
    rolling : Array
        Speed at which the wheel would roll, by sensors of the body where they are exact enough, else by the other wheels
        [m/s]; NaN where nobody knows.
    rough : Array
        Standard deviation of the effective opening within a block [fraction].
    measured : Array
        Last known mean of the measured speed [m/s].
    """

    reference: Array
    command: Array
    asked: Array
    rolling: Array
    rough: Array
    measured: Array

    @classmethod
    def of(cls, data: WheelsData, blocks: WheelBlocks, model: JointModel) -> MissionSignals:
        """Signals of a mission."""
        n, wheels = blocks.y.shape
        asked = np.zeros((n, wheels))
        for i, wheel in enumerate(model.wheels):
            if wheel is not None:
                opening = blocks.u[:, i].reshape(n, blocks.width).mean(1)
                asked[:, i] = low_passed(opening * wheel.K, wheel.tau, blocks.dt)
        last = np.maximum.accumulate(np.where(blocks.count > 0, np.arange(n)[:, None], 0), axis=0)
        measured = np.take_along_axis(blocks.y, last, axis=0)
        return cls(
            reference=_block_means(data.reference, blocks),
            command=np.nan_to_num(_block_means(data.u, blocks)),
            asked=asked,
            rolling=_rolling(measured, blocks, data.span),
            rough=blocks.u.reshape(n, blocks.width, wheels).std(axis=1),
            measured=measured,
        )

    @cached_property
    def usual(self) -> float:
        """Speed that counts as one: the 90 % quantile of the commanded, else of the measured speeds [m/s]."""
        known = np.abs(np.where(np.isfinite(self.reference), self.reference, self.measured))
        known = known[np.isfinite(known) & (known > 0)]
        return float(np.quantile(known[:: max(1, known.size // 20000)], 0.9)) if known.size else 1.0

    def toward(self, i: int) -> Array:
        """Direction in which wheel i is to turn, shape (n,): −1, 0 or 1."""
        r = np.nan_to_num(self.reference[:, i])
        return np.asarray(np.sign(np.where(np.abs(r) > _STANDS * self.usual, r, np.nan_to_num(self.rolling[:, i]))))

    def part(self, cut: slice) -> MissionSignals:
        """Some blocks alone; the usual speed stays that of the mission."""
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
    has_r, has_b, known : NDArray[np.bool_]
        Where the first, the last and the second are known.
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
    known: Flags
    u: Array
    toward: Array

    @classmethod
    def of(cls, i: int, blocks: WheelBlocks, seen: MissionSignals) -> WheelSignals:
        """Signals of wheel i."""
        toward, usual = seen.toward(i), seen.usual
        r, b = seen.reference[:, i], seen.rolling[:, i]
        return cls(
            r=np.nan_to_num(r) * toward / usual,
            y=blocks.y[:, i] * toward / usual,
            d=seen.asked[:, i] * toward / usual,
            b=np.nan_to_num(b) * toward / usual,
            has_r=np.isfinite(r),
            has_b=np.isfinite(b),
            known=(blocks.count[:, i] > 0) & (blocks.status[:, i] == PAIR),
            u=seen.command[:, i] * toward,
            toward=toward,
        )


def _rolling(measured: Array, blocks: WheelBlocks, span: float) -> Array:
    """Speed at which each wheel would roll [m/s], shape (n, wheels)."""
    by_wheels = body_speeds(measured, blocks.ratio, blocks.turn)
    if blocks.body_speed is None or blocks.body_std is None:
        return by_wheels
    exact = np.isfinite(blocks.body_speed) & (blocks.body_std < _EXACT * span)
    return np.where(exact, blocks.body_speed, by_wheels)


def _block_means(x: Array, blocks: WheelBlocks) -> Array:
    """Mean of each block, shape (n, wheels); the last block is filled up with the last sample."""
    n, wheels = blocks.y.shape
    filled = np.pad(x, ((0, n * blocks.width - len(x)), (0, 0)), mode="edge")
    return np.asarray(filled.reshape(n, blocks.width, wheels).mean(axis=1))
