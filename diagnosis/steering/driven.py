"""What an axle's valve map gives in every block at the command, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.blocks import SteeringBlocks, between
from diagnosis.steering.filter_state import BlockSeries
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.valve_map import rates_at

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Driven:
    """Rates that a plant's valve gives in m blocks.

    Attributes
    ----------
    command : Array, shape (m,)
        Mean rate at the command between the middles of blocks [rad/s]; NaN where nobody knows it.
    spread : Array, shape (m,)
        Standard deviation of the rate that is expected [rad/s].
    """

    command: Array
    spread: Array

    def series(self, blocks: SteeringBlocks) -> BlockSeries:
        """The blocks as the compiled filters take them."""
        return BlockSeries(
            blocks.mean,
            blocks.power,
            blocks.count,
            self.command,
            self.spread,
            blocks.u,
            blocks.pace,
            blocks.status,
            blocks.redundancy,
        )


def driven_by(plant: SteeringPlant, blocks: SteeringBlocks, share: float = 0.0) -> Driven:
    """What a plant's valve gives in an axle's blocks; `share`: what its rates err by, relative to them [1]."""
    rates = between(blocks.raw_u, blocks.length, blocks.mean.size, lambda part: rates_at(part, plant.valve))
    rates *= blocks.pace
    spread = np.hypot(blocks.pace * plant.spread(blocks.u), share * np.abs(rates))
    return Driven(np.where(blocks.blind, np.nan, rates), spread)
