"""`njit` for this project's kernels: numba's, with caches that know the kernels of a wheel (`shipped_cache`).

A kernel that others call is compiled for them alone with `no_cpython_wrapper=True`: the code that takes Python's objects apart, tuples of
forty constants among them, was a tenth of all compiling. `forceinline=True` puts it into its callers as machine code; numba's
`inline="always"` does so as Python, so that each caller compiles it anew.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

import numba
from numba.core import config

_cache_of: Callable[[Any], Any] | None
try:
    from replay.arrays.shipped_cache import cache_of as _cache_of
except ImportError:  # a release of numba whose caches are built otherwise: it compiles, and keeps that, as always
    _cache_of = None


def njit(function: Any = None, *, cache: bool = False, **options: Any) -> Any:
    """`numba.njit`; a cached kernel may come out of the wheel.

    Raises
    ------
    TypeError
        By a kernel with `no_cpython_wrapper=True` that is called from Python, where numba would call the address 0.
    """
    if function is None:
        return lambda inner: njit(inner, cache=cache, **options)
    # No kernel is called through a pointer; a part that is put into its callers hands that on to no kernel that it calls.
    options = {"no_cfunc_wrapper": True, "forceinline": False} | options
    kernel = numba.njit(cache=cache and _cache_of is None, **options)(function)
    if config.DISABLE_JIT:
        return kernel
    if cache and _cache_of is not None:
        kernel._cache = _cache_of(kernel.py_func)
    if options.get("no_cpython_wrapper"):
        _for_kernels_alone(kernel)
    return kernel


def _for_kernels_alone(kernel: Any) -> None:
    """Keep what is compiled from Python's calls, which have no way into it."""

    def keep(compiled: Any) -> None:
        kernel.overloads[tuple(compiled.signature.args)] = compiled

    def refuse(*_: Any, **__: Any) -> NoReturn:
        raise TypeError(f"{kernel.py_func.__qualname__} is called by kernels alone")

    kernel.add_overload, kernel._compile_for_args = keep, refuse
