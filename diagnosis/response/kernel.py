"""Compiled recursions: a drive that follows its target, and the probability of each state of a wheel in each block."""

from __future__ import annotations

import numpy as np

from replay.arrays.compiling import njit


@njit(cache=True)
def follow(target, start, gain, most):  # type: ignore[no-untyped-def]
    """Speed that follows a target by a first-order lag and a largest change of a step; shape of `target`."""
    out = np.empty(target.size)
    v = start
    for k in range(target.size):
        change = gain * (target[k] - v)
        if change > most:
            change = most
        elif change < -most:
            change = -most
        v += change
        out[k] = v
    return out


@njit(cache=True)
def target(commands, weights, bounds, limit, delay):  # type: ignore[no-untyped-def]
    """Weighted commands within the bounds of each column and a limit, `delay` cells late; shape (cells,)."""
    cells, columns = commands.shape
    asked = np.empty(cells)
    for i in range(cells):
        total = 0.0
        for k in range(columns):
            total += min(max(commands[i, k] * weights[k], -bounds[k]), bounds[k])
        asked[i] = min(max(total, -limit), limit)
    out = np.empty(cells)
    for i in range(cells):
        x = i - delay
        j = int(np.floor(x))
        if j < 0:
            out[i] = asked[0]
        elif j >= cells - 1:
            out[i] = asked[cells - 1]
        else:
            out[i] = asked[j] + (x - j) * (asked[j + 1] - asked[j])
    return out


@njit(cache=True, no_cpython_wrapper=True)
def _top(score, k):  # type: ignore[no-untyped-def]
    """Largest score of block k; NaN where one is."""
    top = score[k, 0]
    for m in range(score.shape[1]):
        if np.isnan(score[k, m]):
            return score[k, m]
        if score[k, m] > top:
            top = score[k, m]
    return top


@njit(cache=True)
def posterior(score, enters, leaves):  # type: ignore[no-untyped-def]
    """Forward and backward probabilities of states, of which the first is the healthy one that all others are entered from.

    Parameters
    ----------
    score : array, shape (blocks, states)
        Log-likelihood of each block in each state.
    enters, leaves : array, shape (blocks,)
        Probability to enter any of the others from the first at a block; to go back to it.
    """
    blocks, states = score.shape
    forward = np.empty((blocks, states))
    backward = np.ones((blocks, states))
    for k in range(blocks):
        top = _top(score, k)
        total = 0.0
        stay, enter, leave = 1.0 - enters[k], enters[k] / (states - 1), leaves[k]
        for m in range(states):
            if k == 0:
                before = stay if m == 0 else enter
            elif m == 0:
                before = stay * forward[k - 1, 0] + leave * (1.0 - forward[k - 1, 0])
            else:
                before = (1.0 - leave) * forward[k - 1, m] + enter * forward[k - 1, 0]
            forward[k, m] = before * np.exp(max(score[k, m] - top, -300.0))
            total += forward[k, m]
        for m in range(states):
            forward[k, m] /= total
    for k in range(blocks - 2, -1, -1):
        top = _top(score, k + 1)
        total = 0.0
        stay, enter, leave = 1.0 - enters[k + 1], enters[k + 1] / (states - 1), leaves[k + 1]
        first = backward[k + 1, 0] * np.exp(max(score[k + 1, 0] - top, -300.0))
        into = 0.0
        for m in range(1, states):
            after = backward[k + 1, m] * np.exp(max(score[k + 1, m] - top, -300.0))
            into += enter * after
            backward[k, m] = (1.0 - leave) * after + leave * first
            total += backward[k, m]
        backward[k, 0] = stay * first + into
        total += backward[k, 0]
        for m in range(states):
            backward[k, m] /= total
    for k in range(blocks):
        total = 0.0
        for m in range(states):
            forward[k, m] *= backward[k, m]
            total += forward[k, m]
        for m in range(states):
            forward[k, m] = forward[k, m] / total if total != 0.0 else np.nan
    return forward
