"""Wheels that read another share of what they are told, or of what their side does, than the others do, from the start of a log to its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.body import BodySpeed
from diagnosis.response.machine import Judged
from diagnosis.response.majority import agreed
from diagnosis.results.assessment import Reason

Array = NDArray[np.float64]

_ALIKE = 0.08  # by how much two wheels of one side differ where nothing is wrong: tyres, load
_ROLLERS = 0.12  # the same of wheels with rollers, which slip more
_LEAST = 80  # blocks in motion
_MOVES = 0.1  # of the usual largest speed
_FITS = 0.15  # median misfit of two wheels of a side, of their speed: else the ground makes more of it
_TOGETHER, _APART = 4, 0.25  # wheels that one sum relates; the size of what it leaves beside the least motion
_KEPT, _ROUNDS = 0.8, 4
_WITNESSES, _MOSTLY = 3, 0.5  # wheels that agree, and in how much of the motion


def unlike_in_motion(
    judged: Mapping[str, Judged],
    mates: Mapping[str, Sequence[str]],
    *,
    sideways: bool,
    speeds: Sequence[BodySpeed] = (),
) -> dict[str, Reason]:
    """Wheels without a command that answers for them, which read another share of the motion than others, with a sentence.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    mates : Mapping[str, Sequence[str]]
        Others of the same side, by wheel.
    sideways : bool
        Whether the machine also moves sideways, so that wheels of one side are not alike.
    speeds : Sequence[BodySpeed]
        Sensors of the body's speed.
    """
    bare = [w for w, j in judged.items() if not j.response.answered]
    means = {w: j.wheel.blocks.mean for w, j in judged.items()}
    if not bare:
        return {}
    known = _by_one_sum(means) if sideways else {}
    out = {}
    for w in bare:
        beside = [o for o in means if o != w] if sideways else mates[w]
        told = {o: x for o in beside if (x := _share(means[w], means[o])) is not None}
        if known:
            if abs(np.log(known[w])) > _ROLLERS:
                out[w] = _said(known[w], "all others make")
        elif told and all(abs(np.log(x)) > _ALIKE for x in told.values()):
            out[w] = _said(float(np.median(list(told.values()))), " and ".join(told) + " make")
        elif not told and (share := _beside_all(means, w)) is not None:
            out[w] = _said(share, "all others make")
    return out | {w: why for w, why in _beside_body(means, speeds).items() if w in bare and w not in out}


def _beside_all(means: Mapping[str, Array], wheel: str) -> float | None:
    """What a wheel reads of three or more others that agree [1]; None where it is as they are, or they do not agree in most of its motion."""
    others = [x for w, x in means.items() if w != wheel]
    if len(others) < _WITNESSES:
        return None
    speed, _ = agreed(others)
    share = _share(means[wheel], speed)
    moves = np.abs(np.median(np.array(others), axis=0)) > 0.0
    agree = np.count_nonzero(np.isfinite(speed)) >= _MOSTLY * np.count_nonzero(moves)
    return share if share is not None and agree and abs(np.log(share)) > _ALIKE else None


def _beside_body(means: Mapping[str, Array], speeds: Sequence[BodySpeed]) -> dict[str, Reason]:
    """Wheels that read another share of the body's measured speed than 1 while as many others, at least, read what it says, with a sentence."""
    out: dict[str, Reason] = {}
    for body in speeds:
        if body.name == "odometry":  # made of the wheels
            continue
        size = np.abs(body.speed)
        shares = {w: x for w, y in means.items() if (x := _share(np.abs(y), size)) is not None}
        off = {w: x for w, x in shares.items() if abs(np.log(x)) > _ALIKE}
        if off and 2 * len(off) <= len(shares):
            out |= {w: _said(x, f"{body.name} show") for w, x in off.items()}
    return out


def contradicting(apart: Mapping[str, Reason], still: Mapping[str, Reason]) -> tuple[str, ...]:
    """Sentences on wheels that read another share of the motion than others, or nothing at all, one for each; what is said of them by wheel."""
    return tuple(f"{w} speed sensor: {why.text}." for found in (apart, still) for w, why in found.items())


def _said(share: float, others: str) -> Reason:
    return Reason(
        f"over the whole mission it reads {share:.2f} × what {others} of the same motion, and no command tells which of them is right: a scaled or "
        "wrongly mapped sensor, or another {wheel} diameter"
    )


def _share(y: Array, x: Array) -> float | None:
    """What a wheel reads of another one's speed, all through [1]; None where the two do not go together."""
    if not np.isfinite(x).any():
        return None
    least = _MOVES * float(np.nanquantile(np.abs(x), 0.9))
    use = np.isfinite(y) & np.isfinite(x) & (np.abs(x) > least) & (y != 0.0)
    if np.count_nonzero(use) < _LEAST:
        return None
    share = float(np.median(y[use] / x[use]))
    off = float(np.median(np.abs(y[use] - share * x[use])))
    return share if share > 0.0 and off < _FITS * float(np.median(np.abs(y[use]))) else None


def _by_one_sum(means: Mapping[str, Array]) -> dict[str, float]:
    """Share that each wheel with rollers reads, by the one sum of all four that is always zero; empty where there is none."""
    if len(means) != _TOGETHER:
        return {}
    table = np.column_stack(list(means.values()))
    table = table[np.isfinite(table).all(axis=1) & (table != 0.0).any(axis=1)]
    if len(table) < _LEAST:
        return {}
    weights, sizes = _null(table)
    if sizes[-1] > _APART * sizes[-2] or not np.all(weights > 0.0):  # it did not move in all ways that it can
        return {}
    return {w: float(np.median(np.delete(weights, i)) / weights[i]) for i, w in enumerate(means)}


def _null(table: Array) -> tuple[Array, Array]:
    """Weights [1] of the sum of columns that is nearest to zero in most rows, and the sizes of all sums, largest first, each of shape (columns,)."""
    kept = np.ones(len(table), np.bool_)
    weights, sizes = np.zeros(table.shape[1]), np.zeros(table.shape[1])
    for _ in range(_ROUNDS):
        _, sizes, rows = np.linalg.svd(table[kept], full_matrices=False)
        weights = rows[-1]
        off = np.abs(table @ weights)
        kept = off <= np.quantile(off, _KEPT)
    return np.abs(weights), sizes
