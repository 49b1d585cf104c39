"""What the compiled steering filters take and leave: blocks of an axle, states of all models, states along a path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.model_bank import ACTUATOR, SENSOR, STATES
from replay.arrays.compiling import njit
from replay.arrays.known_shape import trailing

Array = NDArray[np.float64]


class Redundancy(NamedTuple):
    """What is measured redundantly in m blocks, each with its variance; NaN where it is not.

    Attributes
    ----------
    angle, angle_variance : Array, shape (m,)
        Second angle [rad].
    opening, opening_variance : Array, shape (m,)
        Opening of the valve [fraction].
    share, share_variance : Array, shape (m,)
        Share of the command's changes that the opening follows [1].
    command : Array, shape (m,)
        The command that belongs to the opening [fraction].
    """

    angle: Array
    angle_variance: Array
    opening: Array
    opening_variance: Array
    share: Array
    share_variance: Array
    command: Array

    @classmethod
    def nothing(cls, size: int) -> Redundancy:
        """`size` blocks without any."""
        return cls(*(np.full(size, np.nan) for _ in cls._fields))

    @property
    def known(self) -> NDArray[np.bool_]:
        """Blocks with any, shape (m,)."""
        return np.asarray(np.logical_or.reduce([np.isfinite(x) for x in self]))


class BlockSeries(NamedTuple):
    """An axle's m blocks for the compiled filters; see `diagnosis.steering.blocks.SteeringBlocks`."""

    mean: Array
    power: Array
    samples: Array
    driven: Array
    spread: Array
    u: Array
    pace: Array
    status: NDArray[np.int8]
    redundancy: Redundancy

    def part(self, blocks: slice) -> BlockSeries:
        """Some of the blocks."""
        known = Redundancy(*(x[blocks] for x in self.redundancy))
        columns = {name: getattr(self, name)[blocks] for name in self._fields if name != "redundancy"}
        return BlockSeries(**columns, redundancy=known)


class Block(NamedTuple):
    """One block of `BlockSeries`, without its redundancy.

    Attributes
    ----------
    mean : float
        Mean of the new samples of the angle [rad].
    power : float
        Power of their white part [rad²].
    samples : float
        New samples.
    driven : float
        Mean rate that the valve's map gives at the command [rad/s]; NaN where nobody knows it.
    spread : float
        Standard deviation of the rate that is expected [rad/s].
    u : float
        Mean opening [fraction].
    pace : float
        What the axle turns at it at the speed of driving, as a multiple of its usual [1].
    status : int
        `PAIR`, `SILENT` or `SKIP` of `diagnosis.channels.sample_status`.
    """

    mean: float
    power: float
    samples: float
    driven: float
    spread: float
    u: float
    pace: float
    status: int


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def resting(block: Block) -> Block:
    """The same block with a valve at rest."""
    return Block(block.mean, block.power, block.samples, 0.0, block.spread, 0.0, block.pace, block.status)


class RedundantBlock(NamedTuple):
    """One block of `Redundancy`."""

    angle: float
    angle_variance: float
    opening: float
    opening_variance: float
    share: float
    share_variance: float
    command: float


class FilterBank(NamedTuple):
    """States of all models at one block.

    Attributes
    ----------
    mean, cov : Array, shape (models, 6) and (models, 6, 6)
        Of x = [φ, r, a, b, d, c].
    noise : Array, shape (models, 2)
        α and β of the inverse gamma distribution of the sensor's noise, where it is learned.
    gap : Array, shape (models, 2)
        How far the cylinder is ahead of the sensor's shaft [rad], and the variance of that [rad²].
    room : Array, shape (6,)
        Room to work in.
    """

    mean: Array
    cov: Array
    noise: Array
    gap: Array
    room: Array


_pairs = trailing(2)
#: Arrays of shape (models, 6) and (models, 6, 6) as kernels know them.
known_states, known_covariances = trailing(STATES), trailing(STATES, STATES)


@njit(cache=True, error_model="numpy", forceinline=True)
def known(bank: FilterBank) -> FilterBank:
    """The same states, whose sizes the compiler knows; an argument of the caller keeps them alive."""
    return FilterBank(
        known_states(bank.mean), known_covariances(bank.cov), _pairs(bank.noise), _pairs(bank.gap), bank.room
    )


class SteeringPath(NamedTuple):
    """A sequence of models, one for each of m blocks, and the states along it.

    Attributes
    ----------
    model : NDArray[np.uint8], shape (m,)
        Model of each block, an index into `diagnosis.steering.model_bank.SENSOR` and `ACTUATOR`.
    mean, cov : Array, shape (m, 6) and (m, 6, 6)
        Of [φ, r, a, b, d, c] along that path.
    noise : Array, shape (m, 2)
        α and β of the sensor's noise where it is learned.
    gap : Array, shape (m, 2)
        How far the cylinder is ahead of the sensor's shaft, and the variance of that.
    """

    model: NDArray[np.uint8]
    mean: Array
    cov: Array
    noise: Array
    gap: Array

    @property
    def variance(self) -> Array:
        """Variances of [φ, r, a, b, d, c], shape (m, 6)."""
        return np.asarray(np.diagonal(self.cov, axis1=1, axis2=2))

    @property
    def sensor(self) -> NDArray[np.int64]:
        """Row of the sensor. Shape (m,)."""
        return np.asarray(SENSOR[self.model])

    @property
    def actuator(self) -> NDArray[np.int64]:
        """Row of the valve. Shape (m,)."""
        return np.asarray(ACTUATOR[self.model])
