"""Values that are missing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.core import cgutils
from numba.core.types.containers import BaseTuple
from numba.core.types.npytypes import Array
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray


def without_nan(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """NaN as 0, for reading: where there is none it is the same array, if compiled code takes it as it is. Both of one shape (n,)."""
    missing = np.isnan(x)
    return np.asarray(np.where(missing, 0.0, x)) if missing.any() or not x.flags.carray else x


@intrinsic
def uncounted(_: Any, value: Any) -> Any:
    """Return the same array, whose slices are not counted, or the same tuple of such arrays and of numbers.

    An argument of the function that calls this keeps the arrays alive. Each count is an atomic operation; in the
    recursions of the filters they took a third of the time.
    """

    def bare(context: Any, builder: Any, kind: Any, given: Any) -> Any:
        if isinstance(kind, BaseTuple):
            for i, part in enumerate(kind):
                if isinstance(part, Array):
                    inner = bare(context, builder, part, builder.extract_value(given, i))
                    given = builder.insert_value(given, inner, i)
            return given
        view = make_array(kind)(context, builder, given)
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return bare(context, builder, signature.return_type, arguments[0])

    return value(value), generate


def bridged(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """x with what is not known put between its neighbours, and as the nearest one at both ends; 0 where nothing is known.

    Both of shape (n,), in one unit.
    """
    known = np.isfinite(x)
    if known.all():
        return x
    at = np.flatnonzero(known)
    return np.interp(np.arange(x.size), at, x[at]) if at.size else np.zeros(x.size)


def carried(x: NDArray[np.float64], last: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x with the value before in the place of what is not known, and what its last row holds for the next part.

    Parameters
    ----------
    x : NDArray[np.float64], shape (n, k)
        One part; NaN where unknown.
    last : NDArray[np.float64], shape (k,)
        What the part before held.
    """
    known = np.isfinite(x)
    if not known.all():
        x = np.vstack([last, x])
        at = np.maximum.accumulate(np.where(np.vstack([np.ones_like(known[:1]), known]), np.arange(len(x))[:, None], 0))
        x = np.take_along_axis(x, at, axis=0)[1:]
    return x, np.asarray(x[-1] if len(x) else last)
