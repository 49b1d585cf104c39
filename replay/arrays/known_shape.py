"""Arrays of kernels whose sizes the compiler knows.

Of an array of three dimensions numba knows no more than that its rows stand behind each other: each index is multiplied by sizes
that are read from memory, and whether one element may be another one is not known, so that each is written and read again. Where
the sizes of all dimensions but the first are constants, both is known.
"""

from __future__ import annotations

from typing import Any

from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array


def trailing(*sizes: int) -> Any:
    """A function of kernels that gives the same C-ordered array, whose dimensions behind the first are known to have these sizes.

    Nothing is checked: an array of other sizes would be read beside its elements. The slices of what it gives are not counted (see
    `replay.arrays.numeric.uncounted`); an argument of the function that calls it keeps the array alive.
    """

    @intrinsic
    def known(_: Any, value: Any) -> Any:
        if not (isinstance(value, types.Array) and value.layout == "C" and value.ndim == len(sizes) + 1):
            return None

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            kind = signature.return_type
            view, intp = make_array(kind)(context, builder, arguments[0]), context.get_value_type(types.intp)
            first = builder.extract_value(view.shape, 0)
            steps = [context.get_abi_sizeof(context.get_data_type(kind.dtype))]
            for size in reversed(sizes):
                steps.insert(0, steps[0] * size)
            view.shape = cgutils.pack_array(builder, [first, *(intp(n) for n in sizes)])
            view.strides = cgutils.pack_array(builder, [intp(n) for n in steps])
            view.meminfo = cgutils.get_null_value(view.meminfo.type)
            view.parent = cgutils.get_null_value(view.parent.type)
            return view._getvalue()

        return value(value), generate

    return known
