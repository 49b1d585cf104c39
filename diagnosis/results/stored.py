"""How finely a result's columns are stored: on grids of powers of two, whose low bytes are zeros and take no room.

A recorded signal keeps a quarter of its resolution (LSB) or better, so that each of its levels stays a level. Where it
has none, and for what was replayed or found, the grid is a small part of the column's range; the range is that between
the quantiles of 0.1 % and 99.9 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.restored import differences_of
from replay.arrays.compiling import njit
from replay.arrays.quantiles import quantile_of

_BLOCK = 1 << 15
_PROBE = 20_000
_HUGE, _LEAST = 1e30, 1e-30
#: Steps of the grid within the range, and bits kept of each value; for recorded signals a float's own.
_BITS = {"evidence": (10, 10), "replay": (11, 11)}
_EXPECTED = (10, 0)  # a residual is made of it
_ESTIMATE = (8, 8)  # δ̂, δ̄ and their deviations: a hundredth part of how well they are known
_RECORDED, _WITH_LSB = 14, 16
_RECORDED_OF = {"e": "v", "u_difference": "u"}


def grid_of(name: str, values: NDArray[np.floating], lsb: float | None = None) -> float:
    """Step of the grid on which a column is stored: a power of two, in the column's unit; 0 where there is none.

    Parameters
    ----------
    name : str
        Column.
    values : NDArray[np.floating], shape (n,)
        Its samples; NaN where there is none.
    lsb : float or None
        Smallest increment of the recorded signal.
    """
    if name == "t":
        return 0.0
    if ".p_" in name:
        return 1 / 256
    probe = values[:: max(1, len(values) // _PROBE)].astype(np.float64)
    probe = probe[np.abs(probe) < _HUGE]
    if not len(probe):
        return 0.0
    low, high = quantile_of(probe, [0.001, 0.999])
    if lsb is not None and _LEAST < lsb < _HUGE:
        step = max(lsb / 4, float(high - low) / 2**_WITH_LSB)
    else:
        step = float(high - low) / 2 ** _bits_of(name, (_RECORDED, 0))[0]
    return 2.0 ** math.floor(math.log2(step)) if step > _LEAST else 0.0


def _bits_of(name: str, otherwise: tuple[int, int]) -> tuple[int, int]:
    """Steps within the range and bits kept, for columns that were replayed or found."""
    group, leaf = name.partition(".")[0], name.rpartition(".")[2]
    if group == "evidence" and leaf.startswith("delta"):
        return _ESTIMATE
    if group == "evidence" and leaf == "expected":
        return _EXPECTED
    return _BITS.get(group, otherwise)


def grids_of(columns: Mapping[str, NDArray[np.floating]], lsb: Mapping[str, float]) -> dict[str, float]:
    """Step of every column's grid, as `grid_of`; a difference from a recorded column is no finer than that one's.

    What a steering residual is expected from is as fine as the residual, which is then made of it. Columns of shape (n,); each step in
    its column's unit.
    """
    grids = {name: grid_of(name, values, lsb.get(name)) for name, values in columns.items()}
    for name in grids:
        group, _, rest = name.partition(".")
        part, _, leaf = rest.rpartition(".")
        if group == "replay" and leaf in _RECORDED_OF:
            recorded = (f"{kind}.{part}.{_RECORDED_OF[leaf]}" for kind in ("wheel", "steer"))
            grids[name] = max(grids[name], *(grids.get(r, 0.0) for r in recorded))
        elif leaf == "residual" and (pair := differences_of(name, columns)) and pair[0].startswith("steer."):
            grids[name] = max(grids[name], grids[pair[0]])
            if 0.0 < grids[name] < grids[pair[1]]:
                grids[pair[1]] = grids[name]
    return grids


@njit(cache=True, nogil=True, error_model="numpy")
def _put_on_grid(part, grid):  # type: ignore[no-untyped-def]
    """Round in place; a value of 2²³ steps or more is on the grid as it is."""
    beyond = grid * np.float32(2**23)
    for i in range(part.size):
        x = part[i]
        part[i] = x if abs(x) >= beyond else np.rint(x / grid) * grid + np.float32(0.0)


def stored(name: str, values: NDArray[np.floating], grid: float) -> NDArray[np.float32]:
    """Column as stored, wrong by half a step of its grid at most.

    Replayed columns are also rounded to 2.5·10⁻⁴, evidence but for what is expected to 5·10⁻⁴, its estimates (δ̂, δ̄, their
    deviations) to 2·10⁻³ of each value, where that is coarser.

    Parameters
    ----------
    name : str
        Column.
    values : NDArray[np.floating], shape (n,)
        Samples; what is not finite stays as it is.
    grid : float
        From `grid_of`; 0 rounds to 32-bit floats alone.
    """
    bits = 0 if ".p_" in name else _bits_of(name, (0, 0))[1]
    out = np.empty(len(values), np.float32)
    for i in range(0, len(out), _BLOCK):
        part = out[i : i + _BLOCK]
        part[:] = values[i : i + _BLOCK]
        if grid:
            _put_on_grid(part, np.float32(grid))
        if bits:
            half, kept = np.uint32(1 << (22 - bits)), np.uint32(0xFFFFFFFF << (23 - bits) & 0xFFFFFFFF)
            raw, finite = part.view(np.uint32), np.isfinite(part)
            if finite.all():
                raw += half
                raw &= kept
            else:
                np.copyto(raw, (raw + half) & kept, where=finite)
    return out
