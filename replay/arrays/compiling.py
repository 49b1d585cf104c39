"""`njit` for this project's kernels: numba's, with caches that know the kernels of a wheel (`shipped_cache`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import config

_cache_of: Callable[[Any], Any] | None
try:
    from replay.arrays.shipped_cache import cache_of as _cache_of
except ImportError:  # a release of numba whose caches are built otherwise: it compiles, and keeps that, as always
    _cache_of = None


def njit(function: Any = None, *, cache: bool = False, **options: Any) -> Any:
    """`numba.njit`; a cached kernel may come out of the wheel."""
    if function is None:
        return lambda inner: njit(inner, cache=cache, **options)
    if _cache_of is None:
        return numba.njit(cache=cache, **options)(function)
    kernel = numba.njit(**options)(function)
    if cache and not config.DISABLE_JIT:
        kernel._cache = _cache_of(kernel.py_func)
    return kernel
