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
    """NaN as 0; four times as fast as `numpy.nan_to_num`, which looks for infinities too. Both of one shape (n,)."""
    return np.asarray(np.where(np.isnan(x), 0.0, x))


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
