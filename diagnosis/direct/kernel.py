"""Recursions over the samples of one pair (compiled): consistency of blocks, and likelihoods outwards from an onset."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.sample_status import CLEAR, PAIR, SKIP
from replay.arrays.compiling import njit

_SIGMAS = 3.0
_SAME = 0.6


@njit(cache=True, nogil=True)
def consistent_blocks(samples, noise, block, out):  # type: ignore[no-untyped-def]
    """Whether each block's residual is as white noise is: mean, share of x, power, and values that change."""
    y, x, status, _, white, _, _ = samples
    for i in range(out.size):
        n, same = 0, 0
        sd = sdd = sdx = sxx = 0.0
        last = np.nan
        good = True
        for k in range(i * block, min(y.size, (i + 1) * block)):
            if status[k] == PAIR:
                scale = 1.0 / np.sqrt(white[k])
                d, ref = (y[k] - x[k]) * scale, x[k] * scale
                n += 1
                sd += d
                sdd += d * d
                sdx += d * ref
                sxx += ref * ref
                if y[k] == last:
                    same += 1
                last = y[k]
            elif status[k] != SKIP:
                good = False
        out[i] = (
            good
            and sd * sd <= _SIGMAS**2 * noise**2 * n
            and sdx * sdx <= _SIGMAS**2 * noise**2 * sxx
            and sdd <= noise**2 * (n + _SIGMAS * np.sqrt(2.0 * n))
            and same <= _SAME * n
        )


@njit(cache=True, nogil=True)
def healthy_likelihoods(samples, bank, decay, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of each sample under y = x + b + n, b an AR(1) of the tolerance's power; none where decay is 0."""
    b, c = 0.0, bank.mismatch_r if decay > 0.0 else 0.0
    y, x, status, _, white, passing, _ = samples
    for k in range(y.size):
        out[k] = 0.0
        if status[k] != PAIR and status[k] != CLEAR:
            continue
        c = decay * decay * c + (1 - decay * decay) * bank.mismatch_r * passing[k] if decay > 0.0 else 0.0
        b *= decay
        s = c + bank.r * white[k]
        e = y[k] - x[k] - b
        b += c / s * e
        c -= c * c / s
        out[k] = max(-0.5 * (e * e / s + np.log(2 * np.pi * s)), bank.floor)


@njit(cache=True, nogil=True)
def drifting_likelihoods(samples, bank, delta, walk, power, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of each sample under y = δ·x + δ̄ + n with δ known and δ̄ a random walk."""
    b, c = 0.0, (0.3 * bank.span) ** 2
    y, x, status, _, white, _, _ = samples
    for k in range(y.size):
        out[k] = 0.0
        if status[k] != PAIR and status[k] != CLEAR:
            continue
        c += (walk * bank.span) ** 2 * bank.dt
        s = c + bank.r * white[k] * power * power
        e = y[k] - delta * x[k] - b
        b += c / s * e
        c -= c * c / s
        out[k] = max(-0.5 * (e * e / s + np.log(2 * np.pi * s)), bank.floor) - bank.drift_cost
