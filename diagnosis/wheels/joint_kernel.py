"""Compiled forward recursion of all wheels together: Viterbi over each one's models, coupled by pump and body.

The pump's share of a demand depends on what the other valves take, and the load on a wheel on the speed of the body:
both are read off the other wheels' most probable models of the block before, so that no fault is explained by another
wheel's healthy valve, nor the reverse.
"""

from __future__ import annotations

# ruff: noqa: SIM109 (compiled: a tuple of constants costs a search)
import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import SKIP
from diagnosis.wheels.entry_kernel import enter
from diagnosis.wheels.joint_types import (
    BODY,
    DOUBT,
    DRIVE,
    DRIVE_HALF,
    DRIVE_NONE,
    GAIN,
    LAGGED_DRIVE,
    SHARE_NONE,
    SHARE_SOME,
    JointConstants,
    JointInput,
    JointOutput,
    JointState,
    JointWork,
)
from diagnosis.wheels.models import A_NONE, HEALTHY, ODD, S_NONE, S_OU_LARGE, S_WHITE_3, WheelConstants
from diagnosis.wheels.shared_kernel import LEAST_DOUBT, constants_of, feed, lagged, rolls_at, see, weights, with_sensors
from diagnosis.wheels.step_kernel import WheelInput, advance
from replay.arrays.compiling import njit
from replay.arrays.numeric import uncounted

Array = NDArray[np.float64]

_RECOVERY = 14.0  # minus the log-probability that a fault ends in one block
_LEARNING = 6.0  # by which a model with unknowns must beat the entry's cost
_OTHER_LOAD = 9.0  # minus the log-probability that an unusual load begins or ends in one block
_OTHER_NOISE = 4.0  # the same for noise of another strength


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _enter_models(
    models: int, top: int, cost: float, k: WheelConstants, score: Array, z: Array, P: Array, back: NDArray[np.uint8]
) -> None:
    """Enter every model of one wheel from the most probable one where that pays."""
    for m in range(models):
        if m == top:
            continue
        price = cost if m != HEALTHY else _RECOVERY
        if m == ODD or (m == HEALTHY and top == ODD):
            price = _OTHER_LOAD
        if m >= S_WHITE_3 and m <= S_OU_LARGE and top >= S_WHITE_3 and top <= S_OU_LARGE:
            price = _OTHER_NOISE
        learning = 0.0 if m <= ODD or m == S_NONE or m == A_NONE else _LEARNING
        if score[top] - price - learning > score[m]:
            score[m] = score[top] - price
            back[m] = top
            enter(m, top, k, z, P)


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _rank(models: int, score: Array, gain: Array) -> tuple[int, float, float]:
    """Add log-likelihoods to the scores: the best model, the probability of a fault, and the best score, which becomes 0."""
    most = -1e300
    for m in range(models):
        score[m] += gain[m]
        most = max(most, score[m])
    total, lead = 0.0, 0
    for m in range(models):
        score[m] -= most
        if score[m] > score[lead]:
            lead = m
        total += np.exp(max(score[m], -600.0))
    sound = np.exp(max(score[HEALTHY], -600.0)) + np.exp(max(score[ODD], -600.0))
    return lead, 1.0 - sound / total, most


@njit(cache=True, error_model="numpy")
def scan_wheels(
    blocks: JointInput, constants: JointConstants, state: JointState, out: JointOutput, work: JointWork
) -> None:
    """Run all wheels over n blocks; changes `state` and fills `out`."""
    blocks, constants, state = uncounted(blocks), uncounted(constants), uncounted(state)
    out, work = uncounted(out), uncounted(work)
    score, z, P, inputs, back = state.score, state.mean, state.cov, out.inputs, out.back
    for i in range(work.top.size):
        weights(constants_of(constants.wheels[i]).lag, work.here[i], work.after[i])
    for n in range(blocks.y.shape[0]):
        for i in range(work.top.size):
            see(n, i, constants_of(constants.wheels[i]), constants.known[i], constants.models[i], blocks, state, work)
        feed(n, blocks, constants, state, work, inputs[n])
        for i in range(work.top.size):
            if not constants.known[i]:
                continue
            k, x, models, status = (
                constants_of(constants.wheels[i]),
                inputs[n, i],
                constants.models[i],
                blocks.status[n, i],
            )
            body, doubt = rolls_at(i, work.speed, work.trust)
            body = body * blocks.ratio[n, i] - blocks.turn[n, i]
            body, doubt = with_sensors(body, doubt, blocks.sensed[n, i], blocks.sensed_std[n, i], LEAST_DOUBT * k.span)
            x[BODY], x[DOUBT] = body, doubt
            state.carried[i, LAGGED_DRIVE] = lagged(work.seen[i], k, x, z[i], state.carried[i, LAGGED_DRIVE])
            block = WheelInput(
                y=blocks.y[n, i],
                samples=blocks.samples[n, i],
                jitter=blocks.jitter[n, i],
                white=blocks.white[n, i],
                slack=blocks.slack[n, i],
                habit=blocks.habit[n, i],
                drive=x[DRIVE],
                drive_half=x[DRIVE_HALF],
                drive_none=x[DRIVE_NONE],
                share_none=x[SHARE_NONE],
                share_some=x[SHARE_SOME],
                chatter=blocks.chatter[n, i],
                wander=blocks.wander[n, i],
                body=body,
                doubt=doubt,
                unseen=blocks.unseen[n, i],
            )
            if status != SKIP:
                _enter_models(models, work.top[i], constants.cost, k, score[i], z[i], P[i], back[n, i])
            advance(models, block, status, blocks.quiet[n, i], k, z[i], P[i], work.gain)
            out.best[n, i], out.fault[n, i], x[GAIN] = _rank(models, score[i], work.gain)
