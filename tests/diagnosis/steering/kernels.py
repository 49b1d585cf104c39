"""A block of one model of the steering filter, compiled once for all tests: the diagnosis has it inside its loops alone."""

from __future__ import annotations

from diagnosis.steering.filter_constants import FilterConstants
from diagnosis.steering.filter_state import Block, FilterBank, RedundantBlock
from diagnosis.steering.step_kernel import advance as _advance
from replay.arrays.compiling import njit


@njit(cache=True, error_model="numpy")
def advance(m: int, block: Block, seen: RedundantBlock, constants: FilterConstants, bank: FilterBank) -> float:
    """`diagnosis.steering.step_kernel.advance`; the status of `block` is an `np.int8`, as in a mission."""
    return _advance(m, block, seen, constants, bank)
