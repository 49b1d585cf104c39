"""Which fault of either side holds on which wheel, where only openings and speeds are known: filters of all wheels.

Wheel: τ·v̇ = −v + K(δ_a·u + b_a)·share + load; sensor: y = δ_s·v + b_s + n. Every row of the two tables is a Kalman
model, and Viterbi's recursion keeps the most probable entry of each. A sensor's loss of gain scales ν at once when its
model is entered; an actuator's only bends it, so the shape of an onset tells the two apart without a test of its own.
The wheels share one pump and, on the ground, one body: `diagnosis.wheels.joint_kernel` runs them side by side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.back_pointers import STAY, trace
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.entry_kernel import enter
from diagnosis.wheels.joint_kernel import scan_wheels
from diagnosis.wheels.joint_types import (
    GAIN,
    LAGGED_DRIVE,
    JointConstants,
    JointInput,
    JointOutput,
    JointState,
    JointWork,
)
from diagnosis.wheels.models import HEALTHY, MODELS, JointModel, WheelFilterModel
from replay.arrays.blocks import blocks as cut_in
from replay.arrays.blocks import release

Array = NDArray[np.float64]


@dataclass(frozen=True)
class JointPass:
    """One run of the recursion over n blocks.

    Attributes
    ----------
    back : tuple of NDArray[np.uint8], one per wheel, shape (n, models)
        Back-pointers.
    best : NDArray[np.uint8], shape (n, wheels)
        Most probable model by what came before: a causal reading.
    fault : Array, shape (n, wheels)
        Probability by the same that the wheel is not healthy.
    inputs : Array, shape (n, wheels, 8)
        Openings as fed, shares, speed and uncertainty of the body, log-likelihood; see `JointOutput`.
    state : JointState
        For the next blocks.
    """

    back: tuple[NDArray[np.uint8], ...]
    best: NDArray[np.uint8]
    fault: Array
    inputs: Array
    state: JointState

    @property
    def evidence(self) -> float:
        """Log-likelihood of the most probable paths."""
        return float(self.gains.sum())

    @cached_property
    def gains(self) -> Array:
        """Log-likelihood of each block of each wheel, shape (n, wheels)."""
        return np.ascontiguousarray(self.inputs[:, :, GAIN])


def initial_state(first: Array, model: JointModel, dt: float, raw_dt: float) -> JointState:
    """State before the first block of a mission that may begin with a fault; `first` (wheels,) is the speed [m/s]."""
    count = len(model.wheels)
    score = np.full((count, MODELS), -0.5 * model.switch_cost)
    score[:, HEALTHY] = 0.0
    mean, cov = np.zeros((count, MODELS, 4)), np.zeros((count, MODELS, 4, 4))
    for i, wheel in enumerate(model.wheels):
        if wheel is None:
            continue
        k = wheel.constants(dt, raw_dt)
        mean[i, HEALTHY] = [first[i], 1.0, 0.0, 0.0]
        cov[i, HEALTHY, 0, 0], cov[i, HEALTHY, 2, 2] = (0.2 * wheel.span) ** 2, 1.0
        for m in range(1, MODELS):
            enter(m, HEALTHY, k, mean[i], cov[i])
    carried = np.zeros((count, 4))
    carried[:, LAGGED_DRIVE] = first
    return JointState(score, mean, cov, carried)


def first_speeds(blocks: WheelBlocks) -> Array:
    """First known speed of each wheel [m/s], 0 where there is none. Shape (wheels,)."""
    out = np.zeros(blocks.y.shape[1])
    for i in range(out.size):
        known = np.flatnonzero(blocks.count[:, i] > 0)
        if known.size:
            out[i] = blocks.y[known[0], i]
    return out


def forward(
    blocks: WheelBlocks,
    model: JointModel,
    state: JointState | None = None,
    given: NDArray[np.uint8] | None = None,
) -> JointPass:
    """Run the recursion.

    Parameters
    ----------
    blocks, model
        The wheels.
    state : JointState or None
        From the blocks before; None: the mission's beginning.
    given : NDArray[np.uint8], shape (n, wheels), or None
        In which model each wheel is taken to be by the others; `STAY`, and None: in its own most probable one.
    """
    n, wheels = blocks.y.shape
    if state is None:
        state = initial_state(first_speeds(blocks), model, blocks.dt, blocks.raw_dt)
    column = blocks.store.column
    back = [column(np.uint8, (MODELS,)) for _ in range(wheels)]
    best, fault, inputs = column(np.uint8, (wheels,)), column(np.float64, (wheels,)), column(np.float64, (wheels, 8))
    for cut in cut_in(n, rows=max(1, blocks.store.block // blocks.width)):
        part = blocks if cut.stop - cut.start == n else blocks.part(cut.start, cut.stop)
        taken = np.full(part.y.shape, STAY, dtype=np.uint8) if given is None else given[cut]
        done = _forward(part, model, state, taken)
        state = done.state
        best.append(done.best)
        fault.append(done.fault)
        inputs.append(done.inputs)
        for kept, pointers in zip(back, done.back, strict=True):
            kept.append(pointers)
        release(blocks.u)
    return JointPass(tuple(kept.finish() for kept in back), best.finish(), fault.finish(), inputs.finish(), state)


def _forward(blocks: WheelBlocks, model: JointModel, state: JointState, given: NDArray[np.uint8]) -> JointPass:
    """Run the recursion over blocks that are in memory at once."""
    n, wheels = blocks.y.shape
    constants = _joint_constants(model, blocks.dt, blocks.raw_dt)
    per_opening = np.array([w.K * blocks.raw_dt / w.tau for w in _filled(model)])
    seen = JointInput(
        u=blocks.u,
        y=blocks.y,
        samples=blocks.count,
        jitter=blocks.jitter,
        white=blocks.white,
        slack=blocks.slack,
        habit=blocks.habit,
        chatter=blocks.unsteady * per_opening,
        wander=blocks.wander(per_opening),
        unseen=blocks.unseen * np.array([w.K if blocks.ended else 0.0 for w in _filled(model)]),
        ratio=blocks.ratio,
        turn=blocks.turn,
        sensed=_or_unknown(blocks.body_speed, blocks.y.shape),
        sensed_std=_or_unknown(blocks.body_std, blocks.y.shape),
        status=blocks.status,
        quiet=blocks.quiet,
        given=given,
    )
    out = JointOutput(
        back=np.full((n, wheels, MODELS), STAY, dtype=np.uint8),
        best=np.zeros((n, wheels), dtype=np.uint8),
        fault=np.zeros((n, wheels)),
        inputs=np.zeros((n, wheels, 8)),
    )
    after = JointState(*(x.copy() for x in state))
    scan_wheels(seen, constants, after, out, JointWork.of(wheels, blocks.width))
    pointers = tuple(np.ascontiguousarray(out.back[:, i]) for i in range(wheels))
    return JointPass(pointers, out.best, out.fault, out.inputs, after)


def _or_unknown(values: Array | None, shape: tuple[int, ...]) -> Array:
    """Values of blocks; NaN where there are none."""
    return np.full(shape, np.nan) if values is None else np.ascontiguousarray(values)


def _filled(model: JointModel) -> list[WheelFilterModel]:
    """Models of all wheels, with a placeholder that nothing reads where one is not modelled."""
    none = WheelFilterModel(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    return [none if w is None else w for w in model.wheels]


def _joint_constants(model: JointModel, dt: float, raw_dt: float) -> JointConstants:
    """Constants of the recursion for blocks of dt of samples of raw_dt [s]."""
    wheels = _filled(model)
    return JointConstants(
        wheels=np.array([w.constants(dt, raw_dt) for w in wheels], np.float64),
        K=np.array([w.K for w in wheels]),
        known=np.array([w is not None for w in model.wheels]),
        models=np.array([w.models for w in wheels]),
        flow=model.flow,
        cost=model.switch_cost,
    )


def most_probable(done: JointPass, wheel: int) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Most probable models of one wheel, shape (n,), and the blocks at which one was entered."""
    models, entered = trace(done.back[wheel], int(np.argmax(done.state.score[wheel])))
    return models, entered
