"""How the parts of compiled kernels are compiled."""

from __future__ import annotations

from numba import njit

# A part of a kernel: compiled into its caller and kept with it, never called from Python. The caller holds all arrays
# for longer than the part does, so the counting of references, which can cost more than a walk over bytes, is left
# out; hence a part makes no arrays.
part = njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)
