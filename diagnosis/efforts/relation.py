"""Effort that a wheel's motion takes, and by how much it is off that, alone and beside the other wheels.

The balance of a driven wheel at its rim (Rajamani, Vehicle Dynamics and Control, 2nd ed., 2012, eq. 4.7; Armstrong-Hélouvry et al., Automatica 30
(1994) 1083–1138 for the friction; Maclaurin, Proc. IMechE D 222 (2008) 2039–2051 for what a skid-steered turn takes):

    k·e = J·v̇ + F_c·sgn v + b·v + F_x,

with e the effort (current, torque or duty), k what a unit of it pulls, and F_x the tyre's force: the wheel's part of the body's inertia, of its
rolling and turning resistance, and of a slope and a payload, which the other wheels carry as well. Divided by k that is linear in the terms of
`diagnosis.efforts.windows.TERMS`. A torque that is lost behind the effort is another k: the same motion takes 1/δ of the effort. A brake that
drags is another F_c. Both are the effort's own: those of the other wheels do not change, or change against it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.efforts.windows import EffortSteps

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ROUNDS, _WIDE, _RIDGE = 15, 2.0, 1e-3
_FLOOR = 0.25  # of the usual square of an effort, which counts in every step: hardly any effort tells no share
_LEAST_STEPS = 20  # of driving from which on a relation is found or used


def fitted(terms: Array, effort: Array, use: Flags) -> Array | None:
    """Coefficients of an effort over its motion, by Cauchy's loss with a little ridge; None where too little is driven.

    Parameters
    ----------
    terms : Array, shape (steps, k)
        From `EffortSteps.terms`.
    effort : Array, shape (steps,)
        In its unit.
    use : Flags, shape (steps,)
        Where it counts.

    Returns
    -------
    Array or None, shape (k,)
    """
    if np.count_nonzero(use) < _LEAST_STEPS:
        return None
    x, y = terms[use], effort[use]
    scale = np.sqrt(np.mean(x**2, axis=0)) + 1e-12
    x = x / scale
    weight, theta = np.ones(y.size), np.zeros(x.shape[1])
    ridge = _RIDGE * y.size * np.eye(x.shape[1])
    for _ in range(_ROUNDS):
        theta = np.linalg.solve(x.T @ (x * weight[:, np.newaxis]) + ridge, x.T @ (weight * y))
        rest = y - x @ theta
        wide = _WIDE * (1.4826 * float(np.median(np.abs(rest))) + 1e-12)
        weight = 1.0 / (1.0 + (rest / wide) ** 2)
    return np.asarray(theta / scale)


def usual_of(effort: Array, use: Flags) -> float:
    """Root mean square of an effort where it counts [its unit]. Both of shape (steps,)."""
    return float(np.sqrt(np.mean(effort[use] ** 2))) if use.any() else 0.0


def held_share(effort: Array, command: Array, speed: Array, use: Flags) -> float:
    """What is left of an effort at steady commands beside what command and error make of it, as a share of the usual one [1].

    Without a loop the effort is a function of the command, with a proportional one of command and error; what is left is what an integral part holds
    (Åström and Hägglund, Advanced PID Control, 2006, section 3.2): only such a loop asks for more of a drive that gives less, until the speed is right.

    Parameters
    ----------
    effort, command, speed : Array, shape (steps,)
        [unit of effort], [m/s], [m/s].
    use : Flags, shape (steps,)
        Where the drive is driven one way.
    """
    before = np.r_[np.nan, np.nan, command[:-2]]
    size = float(np.nanmax(np.abs(command), initial=0.0))
    last = np.r_[np.nan, command[:-1]]
    steady = (
        use & np.isfinite(command) & (np.abs(command - last) < 0.01 * size) & (np.abs(command - before) < 0.01 * size)
    )
    if np.count_nonzero(steady) < _LEAST_STEPS:
        return 0.0
    terms = np.column_stack([np.ones(command.size), np.sign(command), command, command - speed])
    theta = fitted(np.nan_to_num(terms), np.nan_to_num(effort), steady)
    if theta is None:
        return 0.0
    rest = effort[steady] - terms[steady] @ theta
    return float(np.sqrt(np.mean(rest**2))) / max(usual_of(effort, use), 1e-12)


class Shares:
    """By which share efforts are off their motion, over runs of driven steps.

    Parameters
    ----------
    rest, expected : Array, shape (steps, wheels)
        Effort less what its motion takes, and that [unit of effort].
    use : Flags, shape (steps, wheels)
        Where they count.
    usual : Sequence[float]
        Usual size of each effort [unit of effort].
    """

    def __init__(self, rest: Array, expected: Array, use: Flags, usual: Sequence[float]) -> None:
        """Sum what is asked for."""
        self.rest, self.expected, self.use, self.usual = rest, expected, use, np.asarray(usual)
        self.wheels = rest.shape[1]

    def over(
        self, wheel: int, length: int | None, added: Array | None = None
    ) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
        """Shares of a wheel over runs of `length` driven steps, with their first step and the one behind their last.

        What any of the other wheels shows as well, for its usual size, is no wheel's own, and what the wheel's motion alone explains is nothing:
        of all of these shares the smallest counts, and none where they differ in sign.

        Parameters
        ----------
        wheel : int
            Which one.
        length : int or None
            Driven steps; None: all.
        added : Array or None, shape (steps,)
            What a fault would add to the effort [unit of effort].

        Returns
        -------
        shares : Array, shape (runs,)
        first, last : NDArray[np.intp], shape (runs,)
        """
        places = np.flatnonzero(self.use[:, wheel])
        n = places.size if length is None else length
        if not n or places.size < n:
            none = np.zeros(0, np.intp)
            return np.zeros(0), none, none
        own = self.rest[places, wheel] + (0.0 if added is None else added[places])
        m = self.expected[places, wheel]
        tried = [own]
        for j in range(self.wheels):
            if j != wheel:
                beside = np.where(self.use[places, j], self.rest[places, j], 0.0) * self.usual[wheel] / self.usual[j]
                tried.append(own - beside)
        base = _runs(m**2 + _FLOOR * self.usual[wheel] ** 2, n)
        shares = np.vstack([_runs(x * m, n) / base for x in tried])
        smallest = shares[np.abs(shares).argmin(axis=0), np.arange(base.size)]
        one_sign = (shares > 0).all(axis=0) | (shares < 0).all(axis=0)
        first = places[: base.size]
        return np.where(one_sign, smallest, 0.0), first, places[n - 1 :] + 1


def _runs(x: Array, n: int) -> Array:
    """Sums of n neighbours."""
    total = np.cumsum(np.r_[0.0, x])
    return np.asarray(total[n:] - total[:-n])


def largest_off(shares: Shares, lengths: Sequence[int]) -> Array:
    """Largest share by which each wheel is off over each length, the last of them over the whole mission, shape (wheels, lengths) [1]."""
    out = np.zeros((shares.wheels, len(lengths)))
    for i in range(shares.wheels):
        for k, n in enumerate(lengths):
            found = shares.over(i, None if k == len(lengths) - 1 else n)[0]
            out[i, k] = np.max(np.abs(found), initial=0.0)
    return out


def shares_of(steps: EffortSteps, theta: Sequence[Array], usual: Sequence[float], least: float) -> Shares:
    """By which shares the efforts of a mission are off coefficients.

    Parameters
    ----------
    steps : EffortSteps
        The mission.
    theta : Sequence[Array], each of shape (len(TERMS),)
        Of each wheel [unit of effort and that by m/s and m/s²].
    usual : Sequence[float]
        Usual size of each effort [unit of effort].
    least : float
        The driving speed [m/s].
    """
    expected = np.column_stack([steps.terms(i, least) @ t for i, t in enumerate(theta)])
    return Shares(np.where(steps.use, steps.effort - expected, 0.0), expected, steps.use, usual)
