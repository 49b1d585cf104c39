"""Which fault of either side holds on which wheel, where only openings and speeds are known: filters of all wheels.

Wheel: τ·v̇ = −v + K(δ_a·u + b_a)·share + load; sensor: y = δ_s·v + b_s + n. Every row of the two tables is a Kalman
model, and Viterbi's recursion keeps the most probable entry of each. A sensor's loss of gain scales ν at once when its
model is entered; an actuator's only bends it, so the shape of an onset tells the two apart without a test of its own.
The wheels share one pump and, on the ground, one body: `wheel_joint` runs them side by side.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import STAY, trace
from diagnosis.wheels import joint_kernel
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.models import JointModel, JointPass, JointState, WheelFilterModel
from diagnosis.wheels.runs import Runs
from diagnosis.wheels.step_kernel import A_GAIN, HEALTHY, MODELS, enter
from replay.arrays import spill
from replay.arrays.spill import Column, release

Array = NDArray[np.float64]


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
    spill = np.zeros((count, 4))
    spill[:, 3] = first
    return JointState(score, mean, cov, spill)


def first_speeds(blocks: WheelBlocks) -> Array:
    """First known speed of each wheel [m/s], 0 where there is none."""
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
    back = [Column(np.uint8, (MODELS,)) for _ in range(wheels)]
    best, fault, inputs = Column(np.uint8, (wheels,)), Column(np.float64, (wheels,)), Column(np.float64, (wheels, 8))
    for cut in cuts(n, width=blocks.width):
        part = blocks if cut.stop - cut.start == n else blocks.part(cut.start, cut.stop)
        taken = np.full(part.y.shape, STAY, dtype=np.uint8) if given is None else given[cut]
        done = _forward(part, model, state, taken)
        state = done.state
        best.append(done.best)
        fault.append(done.fault)
        inputs.append(done.inputs)
        for column, pointers in zip(back, done.back, strict=True):
            column.append(pointers)
        release(blocks.u)
    return JointPass(tuple(column.finish() for column in back), best.finish(), fault.finish(), inputs.finish(), state)


def cuts(size: int, width: int) -> Iterator[slice]:
    """Parts of `size` blocks of `width` samples that hold about `ColumnStore.block` samples each."""
    step = max(1, spill.STORE.block // width)
    return (slice(at, min(at + step, size)) for at in range(0, size, step))


def _forward(blocks: WheelBlocks, model: JointModel, state: JointState, given: NDArray[np.uint8]) -> JointPass:
    """Run the recursion over blocks that are in memory at once."""
    n, wheels = blocks.y.shape
    dt, raw_dt = blocks.dt, blocks.raw_dt
    dummy = WheelFilterModel(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    used = [dummy if w is None else w for w in model.wheels]
    per_opening = np.array([w.K * raw_dt / w.tau for w in used])
    back = np.full((n, wheels, MODELS), STAY, dtype=np.uint8)
    best, fault = np.zeros((n, wheels), dtype=np.uint8), np.zeros((n, wheels))
    inputs = np.zeros((n, wheels, 8))
    score, mean, cov, rest = (x.copy() for x in (state.score, state.mean, state.cov, state.spill))
    joint_kernel.forward(
        blocks.u,
        blocks.y,
        blocks.count,
        blocks.jitter,
        blocks.unsteady * per_opening,
        blocks.wander(per_opening),
        blocks.ratio,
        blocks.turn,
        blocks.status,
        blocks.quiet,
        np.array([w is not None for w in model.wheels]),
        given,
        np.array([A_GAIN if w.measured else MODELS for w in used]),
        model.flow,
        model.switch_cost,
        tuple(w.constants(dt, raw_dt) for w in used),
        score,
        mean,
        cov,
        rest,
        back,
        best,
        fault,
        inputs,
    )
    pointers = tuple(np.ascontiguousarray(back[:, i]) for i in range(wheels))
    return JointPass(pointers, best, fault, inputs, JointState(score, mean, cov, rest))


def most_probable(done: JointPass, wheel: int) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Most probable models of one wheel, shape (n,), and the blocks at which one was entered."""
    models, entered = trace(done.back[wheel], int(np.argmax(done.state.score[wheel])))
    return models, entered


@dataclass(frozen=True)
class RunEvidence:
    """Every model entered at every run's start and followed to its end.

    Attributes
    ----------
    evidence : Array, shape (runs, models)
        Log-likelihoods over the run.
    mean, cov : Array, shape (runs, models, 4) and (runs, models, 4, 4)
        States at its end.
    expected, spread : Array, shape (n,)
        Speed that a healthy wheel would have [m/s], carried on by the model alone during faults, and its variance.
    """

    evidence: Array
    mean: Array
    cov: Array
    expected: Array
    spread: Array


def evidence_of_runs(blocks: WheelBlocks, model: JointModel, done: JointPass, wheel: int, runs: Runs) -> RunEvidence:
    """Weigh all models over the runs of one wheel's path.

    Parameters
    ----------
    blocks, model, done
        As in `forward`, and what it gave.
    wheel : int
        Which.
    runs : Runs
        Of its path.
    """
    own = model.wheels[wheel]
    assert own is not None
    k = own.constants(blocks.dt, blocks.raw_dt)
    per_opening = np.array([own.K * blocks.raw_dt / own.tau])
    n, size = blocks.y.shape[0], runs.model.size
    evidence, mean, cov = np.zeros((size, MODELS)), np.zeros((size, MODELS, 4)), np.zeros((size, MODELS, 4, 4))
    expected, spread = np.zeros(n), np.zeros(n)
    count = A_GAIN if own.measured else MODELS
    joint_kernel.along_runs(
        np.ascontiguousarray(blocks.y[:, wheel]),
        np.ascontiguousarray(blocks.count[:, wheel]),
        np.ascontiguousarray(blocks.jitter[:, wheel]),
        blocks.unsteady[:, wheel] * per_opening[0],
        np.ascontiguousarray(blocks.wander(per_opening)[:, wheel]),
        np.ascontiguousarray(done.inputs[:, wheel]),
        np.ascontiguousarray(blocks.status[:, wheel]),
        np.ascontiguousarray(blocks.quiet[:, wheel]),
        count,
        k,
        runs.entry,
        runs.stop,
        runs.model,
        float(first_speeds(blocks)[wheel]),
        (0.2 * own.span) ** 2,
        np.zeros((MODELS, 4)),
        np.zeros((MODELS, 4, 4)),
        evidence,
        mean,
        cov,
        expected,
        spread,
    )
    evidence[:, count:] = -np.inf
    return RunEvidence(evidence, mean, cov, expected, spread)
