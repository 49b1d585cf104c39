"""Values that are missing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray


def without_nan(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """NaN as 0; four times as fast as `numpy.nan_to_num`, which looks for infinities too."""
    return np.asarray(np.where(np.isnan(x), 0.0, x))


@intrinsic
def uncounted(_: Any, array: Any) -> Any:
    """Return the same array, whose slices are not counted; an argument of the function that calls this keeps it alive.

    Each count is an atomic operation; in the recursions of the filters they took a third of the time.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        view = make_array(signature.return_type)(context, builder, arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), generate
