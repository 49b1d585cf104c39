"""All models over the runs of one wheel's path: each entered at a run's start, and its log-likelihoods summed."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.entry_kernel import enter
from diagnosis.wheels.filter import JointPass, first_speeds
from diagnosis.wheels.joint_types import (
    BODY,
    DOUBT,
    DRIVE,
    DRIVE_HALF,
    DRIVE_NONE,
    SHARE_NONE,
    SHARE_SOME,
)
from diagnosis.wheels.models import HEALTHY, MODELS, JointModel, WheelConstants
from diagnosis.wheels.runs import Runs
from diagnosis.wheels.step_kernel import WheelInput, advance, correct, least_steps, predict
from replay.arrays.compiling import njit
from replay.arrays.copying import put, put_rows
from replay.arrays.numeric import uncounted

Array = NDArray[np.float64]


class RunInput(NamedTuple):
    """Blocks of one wheel, shape (n,)."""

    y: Array
    samples: Array
    jitter: Array
    white: Array
    slack: Array
    habit: NDArray[np.int8]
    chatter: Array
    wander: Array
    unseen: Array
    inputs: Array  # (n, 8) as in `JointOutput`
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]


class RunEvidence(NamedTuple):
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


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _enter_all(models: int, old: int, k: WheelConstants, z: Array, P: Array) -> None:
    """Enter every model from model `old`, as that one ended."""
    fresh_z, fresh_P, hold_z, hold_P = z.copy(), P.copy(), z[old].copy(), P[old].copy()
    for m in range(models):
        enter(m, old, k, fresh_z, fresh_P)
        put(z[m], fresh_z[m])
        put_rows(P[m], fresh_P[m])
        put(fresh_z[old], hold_z)
        put_rows(fresh_P[old], hold_P)


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _block(n: int, blocks: RunInput) -> WheelInput:
    """Block n of the wheel."""
    x = blocks.inputs[n]
    return WheelInput(
        y=blocks.y[n],
        samples=blocks.samples[n],
        jitter=blocks.jitter[n],
        white=blocks.white[n],
        slack=blocks.slack[n],
        habit=blocks.habit[n],
        drive=x[DRIVE],
        drive_half=x[DRIVE_HALF],
        drive_none=x[DRIVE_NONE],
        share_none=x[SHARE_NONE],
        share_some=x[SHARE_SOME],
        chatter=blocks.chatter[n],
        wander=blocks.wander[n],
        body=x[BODY],
        doubt=x[DOUBT],
        unseen=blocks.unseen[n],
    )


@njit(cache=True, error_model="numpy", nogil=True)
def _scan_runs(
    blocks: RunInput,
    runs: Runs,
    weighed: NDArray[np.bool_],
    models: int,
    k: WheelConstants,
    z: Array,
    P: Array,
    out: RunEvidence,
) -> None:
    """Follow one wheel's path run by run.

    z (models, 4) and P (models, 4, 4) hold the state of a healthy wheel before the first block, and change. `expected`
    is carried on by the model alone during faults. Models do not touch each other between entries, and the next run is entered
    from the path's own: where a run is not `weighed`, and behind its end, no other one is followed.
    """
    blocks, runs, weighed, out = uncounted(blocks), uncounted(runs), uncounted(weighed), uncounted(out)
    z, P, gain = uncounted(z), uncounted(P), np.zeros(MODELS)
    old = np.int64(HEALTHY)
    for m in range(1, models):
        enter(m, old, k, z, P)
    free_z, free_P = z[:1].copy(), P[:1].copy()
    alike = False  # whether the expectation stands where the healthy model does
    for r in range(runs.model.size):
        own = runs.model[r]
        if r > 0:
            if weighed[r]:
                _enter_all(models, old, k, z, P)
            elif own < models:
                enter(own, old, k, z, P)
            alike = False
        last = runs.entry[r + 1] if r + 1 < runs.model.size else blocks.y.size
        for n in range(runs.entry[r] if r > 0 else 0, last):
            block, status, within = _block(n, blocks), blocks.status[n], n < runs.stop[r]
            every = weighed[r] and within
            ahead = not every and alike and within
            if not ahead:
                predict(np.int64(HEALTHY), block, k, free_z, free_P)
                out.expected[n], out.spread[n] = free_z[HEALTHY, 0], free_P[HEALTHY, 0, 0]
            if every:
                advance(models, block, status, blocks.quiet[n], k, z, P, gain)
                for m in range(models):
                    out.evidence[r, m] += gain[m]
                if n + 1 == runs.stop[r]:
                    put_rows(out.mean[r], z)
                    for m in range(MODELS):
                        put_rows(out.cov[r, m], P[m])
            elif own < models:
                share = predict(own, block, k, z, P)
                if ahead:
                    out.expected[n], out.spread[n] = z[HEALTHY, 0], P[HEALTHY, 0, 0]
                if status == PAIR:
                    correct(own, block, share, k, z, P, np.log(least_steps(block, k)))
            alike = own == HEALTHY and within
            if alike:  # a fault leaves the expectation alone
                put(free_z[0], z[HEALTHY])
                put_rows(free_P[0], P[HEALTHY])
        old = own


def evidence_of_runs(
    blocks: WheelBlocks,
    model: JointModel,
    done: JointPass,
    wheel: int,
    runs: Runs,
    weighed: Collection[int] | None = None,
) -> RunEvidence:
    """Weigh all models over the runs of one wheel's path.

    Parameters
    ----------
    blocks, model, done
        As in `diagnosis.wheels.filter.forward`, and what it gave.
    wheel : int
        Which.
    runs : Runs
        Of its path.
    weighed : Collection[int] or None
        Runs over which all models are weighed; evidence, mean and covariance of the others are 0. None: all.
    """
    own = model.wheels[wheel]
    assert own is not None
    per_opening = np.array([own.K * blocks.raw_dt / own.tau])
    n, size = blocks.y.shape[0], runs.model.size
    z, P = np.zeros((MODELS, 4)), np.zeros((MODELS, 4, 4))
    z[HEALTHY, 0], z[HEALTHY, 1] = first_speeds(blocks)[wheel], 1.0
    P[HEALTHY, 0, 0], P[HEALTHY, 2, 2] = (0.2 * own.span) ** 2, 1.0
    out = RunEvidence(
        evidence=np.zeros((size, MODELS)),
        mean=np.zeros((size, MODELS, 4)),
        cov=np.zeros((size, MODELS, 4, 4)),
        expected=np.zeros(n),
        spread=np.zeros(n),
    )
    seen = RunInput(
        y=np.ascontiguousarray(blocks.y[:, wheel]),
        samples=np.ascontiguousarray(blocks.count[:, wheel]),
        jitter=np.ascontiguousarray(blocks.jitter[:, wheel]),
        white=np.ascontiguousarray(blocks.white[:, wheel]),
        slack=np.ascontiguousarray(blocks.slack[:, wheel]),
        habit=np.ascontiguousarray(blocks.habit[:, wheel]),
        chatter=blocks.unsteady[:, wheel] * per_opening[0],
        wander=np.ascontiguousarray(blocks.wander(per_opening)[:, wheel]),
        unseen=(own.K if blocks.ended else 0.0) * blocks.unseen[:, wheel],
        inputs=np.ascontiguousarray(done.inputs[:, wheel]),
        status=np.ascontiguousarray(blocks.status[:, wheel]),
        quiet=np.ascontiguousarray(blocks.quiet[:, wheel]),
    )
    chosen = np.full(size, weighed is None)
    chosen[[*(weighed or ())]] = True
    _scan_runs(seen, runs, chosen, own.models, own.constants(blocks.dt, blocks.raw_dt), z, P, out)
    out.evidence[:, own.models :] = -np.inf
    return out
