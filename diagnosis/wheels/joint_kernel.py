"""Compiled forward recursion of all wheels together: Viterbi over each one's models, coupled by pump and body.

The pump's share of a demand depends on what the other valves take, and the load on a wheel on the speed of the body:
both are read off the other wheels' most probable models of the block before, so that no fault is explained by another
wheel's healthy valve, nor the reverse.
"""

from __future__ import annotations

# ruff: noqa: SIM109 (compiled: a tuple of constants costs a search)
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from diagnosis.channels.sample_status import SKIP
from diagnosis.estimation.back_pointers import STAY
from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    ODD,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_WHITE_3,
    WheelConstants,
)
from diagnosis.wheels.step_kernel import WheelInput, advance, enter, is_scaled
from replay.arrays.numeric import uncounted

Array = NDArray[np.float64]

_RECOVERY = 14.0  # minus the log-probability that a fault ends in one block
_LEARNING = 6.0  # by which a model with unknowns must beat the entry's cost
_OTHER_LOAD = 9.0  # minus the log-probability that an unusual load begins or ends in one block
_OTHER_NOISE = 4.0  # the same for noise of another strength

#: Columns of `JointOutput.inputs`: fields of `WheelInput`, and the log-likelihood of the block.
DRIVE, DRIVE_HALF, DRIVE_NONE, SHARE_NONE, SHARE_SOME, BODY, DOUBT, GAIN = range(8)
#: The last column of `JointState.carried`, behind the first three of `JointOutput.inputs`.
LAGGED_DRIVE = 3


class JointConstants(NamedTuple):
    """What stays the same during a mission."""

    wheels: tuple[WheelConstants, ...]
    K: Array  # (wheels,) speed per full opening [m/s]
    known: NDArray[np.bool_]  # (wheels,) whether a wheel has a model
    models: NDArray[np.int64]  # (wheels,) how many models are considered
    flow: float  # what the pump feeds, as a sum of speeds [m/s]
    cost: float  # minus the log-probability of entering a model in one block


class JointInput(NamedTuple):
    """Blocks of all wheels, shape (n, wheels), and their openings, shape (n·width, wheels)."""

    u: Array  # openings beyond the dead zone [fraction]
    y: Array
    samples: Array
    jitter: Array
    white: Array
    slack: Array
    habit: NDArray[np.int8]
    chatter: Array
    wander: Array
    unseen: Array  # by how much faster a valve may drive its wheel than anyone has seen [m/s]
    ratio: Array  # speed of the wheel per speed of the body [1]
    turn: Array  # what it rolls less because it steers [m/s]
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    given: NDArray[np.uint8]  # model in which the others take a wheel to be; `STAY`: its own most probable one


class JointState(NamedTuple):
    """What the recursion carries from blocks to blocks."""

    score: Array  # (wheels, models) log-probability of each model, less that of the best
    mean: Array  # (wheels, models, 4)
    cov: Array  # (wheels, models, 4, 4)
    carried: Array  # (wheels, 4) drive that the last samples' openings leave to the next block; lagged drive [m/s]


class JointOutput(NamedTuple):
    """What is written for each of n blocks."""

    back: NDArray[np.uint8]  # (n, wheels, models) model from which each was entered, `STAY` where it was not
    best: NDArray[np.uint8]  # (n, wheels) most probable model by what came before
    fault: Array  # (n, wheels) probability by the same that the wheel is not healthy
    inputs: Array  # (n, wheels, 8) see `DRIVE` and following


class JointWork(NamedTuple):
    """Arrays to work in, of the block at hand."""

    gain: Array  # (models,) log-likelihoods
    top: NDArray[np.int64]  # (wheels,) most probable model
    seen: NDArray[np.int64]  # (wheels,) model in which the others take the wheel to be
    speed: Array  # (wheels,) speed of the body by the wheel [m/s]
    trust: Array  # (wheels,) weight of that
    taken: Array  # (wheels,) flow that its valve takes, as a speed [m/s]
    here: Array  # (wheels, width) see `weights`
    after: Array  # (wheels, width)

    @classmethod
    def of(cls, wheels: int, width: int) -> JointWork:
        """Make them for blocks of `width` samples."""
        gain, here, after = np.zeros(MODELS), np.zeros((wheels, width)), np.zeros((wheels, width))
        top, seen = np.zeros(wheels, dtype=np.int64), np.zeros(wheels, dtype=np.int64)
        return cls(gain, top, seen, np.zeros(wheels), np.zeros(wheels), np.zeros(wheels), here, after)


@njit(cache=True, error_model="numpy")
def taken(m: int, gain: float, bias: float, K: float, x: float) -> float:
    """Speed for which a valve in model m takes flow, at commanded opening x [m/s]."""
    if m == A_STUCK:
        return abs(bias)
    if m == A_NONE:
        return 0.0
    if m == A_BIAS:
        return abs(gain * K * x + bias)
    if m == A_GAIN:
        return abs(gain * K * x)
    return abs(K * x)


@njit(cache=True, error_model="numpy")
def weights(width: int, lag: float) -> tuple[Array, Array]:
    """Weights with which an opening at place q of a block drives the mean speed of its own and of the next block."""
    here, after = np.zeros(width), np.zeros(width)
    a = np.exp(-lag / width)
    c = (1.0 - a) / (1.0 - np.exp(-lag)) / width
    for q in range(width):
        for n in range(q + 1, width):
            here[q] += c * a ** (n - 1 - q)
        for n in range(width, q + width + 1):
            after[q] += c * a ** (n - 1 - q)
    return here, after


@njit(cache=True, error_model="numpy")
def _trust_in(m: int) -> float:
    """Weight of a wheel in model m when the speed of the body is estimated."""
    if m >= A_GAIN:
        return 0.7
    if m == S_GAIN:
        return 0.4
    if m == ODD:
        return 0.7
    return 1.0 if m == HEALTHY else 0.15


@njit(cache=True, error_model="numpy", inline="always")
def _see(
    n: int, i: int, k: WheelConstants, known: bool, models: int, blocks: JointInput, state: JointState, work: JointWork
) -> None:
    """Most probable model of wheel i, the one in which the others take it to be, and the body's speed by it."""
    z = state.mean
    m = int(np.argmax(state.score[i, :models]))
    work.top[i] = m
    if blocks.given[n, i] != STAY:
        m = int(blocks.given[n, i])
    work.seen[i] = m
    v = z[i, m, 0] / max(z[i, m, 1], 0.1) if is_scaled(m) else z[i, m, 0]
    if k.grip_most > 0.0:  # a driven wheel that the body holds back runs a little off it
        v += min(max((v - state.carried[i, LAGGED_DRIVE]) / k.grip, -0.5 * k.grip_most), 0.5 * k.grip_most)
    speed = (v + blocks.turn[n, i]) / blocks.ratio[n, i]
    if known and speed == speed:
        work.speed[i], work.trust[i] = speed, _trust_in(m)
    else:
        work.speed[i], work.trust[i] = 0.0, 0.0


@njit(cache=True, error_model="numpy", inline="always")
def _feed(
    n: int, blocks: JointInput, constants: JointConstants, state: JointState, work: JointWork, inputs: Array
) -> None:
    """Openings of every wheel as the pump feeds them in block n, written into `inputs`, (wheels, 8), and `carried`."""
    z, carried, K, flow = state.mean, state.carried, constants.K, constants.flow
    wheels, width = work.here.shape
    inputs[:, DRIVE : DRIVE_NONE + 1] = carried[:, DRIVE : DRIVE_NONE + 1]
    carried[:, DRIVE : DRIVE_NONE + 1] = 0.0
    for q in range(width):
        total = 0.0
        for j in range(wheels):
            m = work.seen[j]
            u = blocks.u[n * width + q, j]
            work.taken[j] = taken(m, z[j, m, 1], z[j, m, 3], K[j], u) if constants.known[j] else 0.0
            total += work.taken[j]
        for i in range(wheels):
            if not constants.known[i]:
                continue
            x, others = blocks.u[n * width + q, i], total - work.taken[i]
            own = K[i] * abs(x)
            full, half, idle, some = x, x, 1.0, 1.0
            if others + max(own, 0.15 * K[i]) > flow:  # the pump cannot feed all
                full *= min(1.0, flow / max(others + own, 1e-9))
                half *= min(1.0, flow / max(others + 0.5 * own, 1e-9))
                idle = min(1.0, flow / max(others, 1e-9))
                some = min(1.0, flow / max(others + 0.15 * K[i], 1e-9))
            here, after = work.here[i, q], work.after[i, q]
            inputs[i, DRIVE] += here * full
            inputs[i, DRIVE_HALF] += here * half
            inputs[i, DRIVE_NONE] += here * x * idle
            inputs[i, SHARE_NONE] += idle / width
            inputs[i, SHARE_SOME] += some / width
            carried[i, DRIVE] += after * full
            carried[i, DRIVE_HALF] += after * half
            carried[i, DRIVE_NONE] += after * x * idle


@njit(cache=True, error_model="numpy", inline="always")
def _body(i: int, speed: Array, trust: Array) -> tuple[float, float]:
    """Weighted median of the other wheels' speeds of the body, and their mean distance from it; NaN without any."""
    body, doubt = np.nan, 0.0
    total = trust.sum() - trust[i]
    if total > 0.0:
        least = 1e300
        for j in range(trust.size):
            if j == i or trust[j] == 0.0:
                continue
            far = 0.0
            for h in range(trust.size):
                if h != i:
                    far += trust[h] * abs(speed[h] - speed[j])
            if far < least:
                least, body = far, speed[j]
        doubt = least / total
    return body, doubt


@njit(cache=True, error_model="numpy", inline="always")
def _lagged(m: int, k: WheelConstants, x: Array, z: Array, before: float) -> float:
    """What valve and lag alone ask of a wheel in model m after a block with inputs x [m/s]."""
    takes = x[DRIVE]
    if m == A_GAIN or m == A_BIAS:
        takes *= z[m, 1]
    elif m == A_STUCK or m == A_NONE:
        takes = 0.0
    asked = k.K * takes + (z[m, 3] * x[SHARE_SOME] if m == A_STUCK or m == A_BIAS else 0.0)
    a = np.exp(-k.lag)
    return float(a * before + (1.0 - a) * asked)


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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
    width = work.here.shape[1]
    for i in range(work.top.size):
        work.here[i], work.after[i] = weights(width, constants.wheels[i].lag)
    for n in range(blocks.y.shape[0]):
        for i in range(work.top.size):
            _see(n, i, constants.wheels[i], constants.known[i], constants.models[i], blocks, state, work)
        _feed(n, blocks, constants, state, work, inputs[n])
        for i in range(work.top.size):
            if not constants.known[i]:
                continue
            k, x, models, status = constants.wheels[i], inputs[n, i], constants.models[i], blocks.status[n, i]
            body, doubt = _body(i, work.speed, work.trust)
            body = body * blocks.ratio[n, i] - blocks.turn[n, i]
            x[BODY], x[DOUBT] = body, doubt
            state.carried[i, LAGGED_DRIVE] = _lagged(work.seen[i], k, x, z[i], state.carried[i, LAGGED_DRIVE])
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
