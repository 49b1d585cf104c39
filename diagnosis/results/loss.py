"""Loss of effectiveness over a whole mission, for trends: ε of y = (1 − ε)·x where the part is healthy or inefficient.

A fault's own ε̂ says how bad a fault is; a part that wears loses a little in every mission, long before that is a fault.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.document import LossRow
from diagnosis.results.result import Epsilon
from replay.arrays.blocks import blocks

Array = NDArray[np.float64]

_WINDOW_S = 1.0  # errors of samples this far apart count as independent
_LEAST_WINDOWS = 10


@dataclass(frozen=True)
class Loss:
    """Loss of effectiveness and the driving time behind it [s].

    `relative` where it is one against the other wheels, which holds how unlike they are made: its change over missions counts.
    """

    epsilon: Epsilon
    seconds: float
    relative: bool = False


def loss_of(y: Array, x: Array, use: NDArray[np.bool_], dt: float) -> Loss | None:
    """Fit y = (1 − ε)·x by least squares.

    The bounds come from the scatter of windows of a second (sandwich estimator over windows), so that errors which last
    for many samples do not make them too narrow.

    Parameters
    ----------
    y, x : Array, shape (n,)
        What the part gives, and what it should give.
    use : NDArray[np.bool_], shape (n,)
        Samples that count.
    dt : float
        Step [s].

    Returns
    -------
    Loss or None
        None for fewer than ten windows in which x moves.
    """
    length = max(1, round(_WINDOW_S / dt))
    parts = []
    for part in blocks(y.size, length):
        known = use[part] & np.isfinite(y[part]) & np.isfinite(x[part])
        b, a = np.where(known, x[part], 0.0), np.where(known, y[part], 0.0)
        first = np.arange(0, b.size, length)
        parts.append([np.add.reduceat(q, first) for q in (b * b, b * a, known.astype(np.float64))])
    power, product, count = (np.concatenate(q) for q in zip(*parts, strict=True))
    kept = (count > 0.2 * length) & (power > 0)
    windows = int(np.count_nonzero(kept))
    if windows < _LEAST_WINDOWS:
        return None
    total = float(power[kept].sum())
    gain = float(product[kept].sum()) / total
    rest = product[kept] - gain * power[kept]
    spread = 1.96 * float(np.sqrt(np.square(rest).sum() * windows / (windows - 1))) / total
    return Loss(Epsilon(1.0 - gain, 1.0 - gain - spread, 1.0 - gain + spread), float(count[kept].sum()) * dt)


def loss_rows(losses: Mapping[tuple[str, str], Loss | None]) -> list[LossRow]:
    """Rows of ``loss`` in ``report.json``: one for each component and side that has one."""
    return [
        {
            "component": component,
            "side": side,
            "epsilon": loss.epsilon.row(),
            "seconds": loss.seconds,
            "relative": loss.relative,
        }
        for (component, side), loss in losses.items()
        if loss is not None
    ]
