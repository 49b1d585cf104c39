"""Caches of kernels: an installation brings them compiled.

numba keeps what it compiled for one processor, beside the sources, in the user's folder of caches or where `NUMBA_CACHE_DIR`
says, and looks into one of them alone: a first diagnosis with an empty one takes nine times the processor time of the
next, nearly all of it compiling. What an installation in place compiled for this processor stands beside the sources, and is
used from there. A wheel that was built with numba at hand has the kernels of a diagnosis in `replay/compiled`, made for a
common kind of processor (`shipped_kernels`). They are used where this machine's processor can run them, Python and
numba are those that made them, and the sources are the same; else they are not there, and numba compiles as always, as it
does with `MFHCA_KERNELS=0` in the environment.
"""

from __future__ import annotations

import os
import platform
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from numba.core import config
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    InTreeCacheLocator,
    UserProvidedCacheLocator,
)
from numba.core.runtime import rtsys

from replay.arrays.kernel_cache import drop_own_stale_kernels
from replay.arrays.lazy_linking import link_lazily
from replay.progress import compiling_begins

INSTALLED = Path(__file__).parents[2]
SHIPPED = INSTALLED / "replay" / "compiled"


class Kind(NamedTuple):
    """A common kind of processor: its name to the compiler, and what one must have to run what was made for it."""

    name: str
    needs: frozenset[str]


KINDS = {
    "x86_64": Kind(
        "x86-64-v3",
        frozenset(
            ["avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sahf", "sse4.2", "xsave"]
        ),
    ),
    "aarch64": Kind("generic", frozenset()),
}

PACKAGES = ("replay", "diagnosis")  # have kernels

_OTHERWISE = ("BOUNDSCHECK", "DEBUG", "DEBUGINFO_DEFAULT", "CPU_NAME", "CPU_FEATURES", "DISABLE_JIT")  # asked of numba


def told_otherwise() -> bool:
    """Whether numba is to compile by other rules than an installation's kernels were compiled by, or to compile in any case."""
    return os.environ.get("MFHCA_KERNELS") == "0" or any(getattr(config, option, None) for option in _OTHERWISE)


@cache
def kind_of_this_machine() -> Kind | None:
    """The common kind of processor whose kernels this machine runs; None where there is none, or numba is told otherwise."""
    from llvmlite import binding  # type: ignore[import-untyped]

    kind = KINDS.get(platform.machine())
    if kind is None or told_otherwise():
        return None
    return kind if all(binding.get_host_cpu_features().get(need) for need in kind.needs) else None


class ShippedCache(FunctionCache):  # type: ignore[misc]
    """numba's cache of one kernel, which looks beside the sources and into the wheel's kernels too where it has nothing."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The kernel, or None, without the tables of all that numba can compile.

        numba fills them before it looks into a cache: 200 modules and half a unit of CPU time, for a compiler that a warm run does not
        call; where it is called, it fills them itself. Machine code needs the addresses of the runtime and of the hash's key alone.
        """
        rtsys.initialize(target_context)
        from numba.cpython import hashing  # noqa: F401 - which makes them known

        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        link_lazily(target_context.codegen())
        found = super()._load_overload(sig, target_context)
        if found is None and self._enabled and not told_otherwise():
            found = self._installed(sig, target_context) or self._shipped(sig, target_context)
        if found is None:
            compiling_begins()
        return found

    def _installed(self, sig: Any, target_context: Any) -> Any:
        """The kernel that was compiled beside the sources for this processor, or None; others than this project's are not looked for."""
        package, *inner = self._py_func.__module__.split(".")[:-1] or [""]
        folder = INSTALLED.joinpath(package, *inner, "__pycache__")
        if package not in PACKAGES or folder == Path(self.cache_path) or not folder.is_dir():
            return None  # numba has looked there itself
        drop_own_stale_kernels()
        return self._out_of(folder, self._index_key(sig, target_context.codegen()), target_context)

    def _shipped(self, sig: Any, target_context: Any) -> Any:
        """The kernel out of the wheel, or None."""
        folder = shipped_folder(self._py_func.__module__)
        kind = kind_of_this_machine() if folder.is_dir() else None
        if kind is None:
            return None
        name, (triple, *_), code = self._index_key(sig, target_context.codegen())
        return self._out_of(folder, (name, (triple, kind.name, ""), code), target_context)

    def _out_of(self, folder: Path, key: Any, target_context: Any) -> Any:
        """The kernel of a key in a folder of compiled ones, or None."""
        file = IndexDataCacheFile(str(folder), self._impl.filename_base, self._impl.locator.get_source_stamp())
        data = file.load(key)
        return None if data is None else self._impl.rebuild(target_context, data)


class _AnyLocator(InTreeCacheLocator):  # type: ignore[misc]
    """The folder that `NUMBA_CACHE_DIR` names, else the one beside the sources, though nothing can be written there."""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """Look there; nothing is tried."""
        return (UserProvidedCacheLocator if config.CACHE_DIR else InTreeCacheLocator)(py_func, py_file)


class _ReadImpl(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_AnyLocator,)


class ReadOnlyCache(ShippedCache):
    """The same where no folder of caches can be written, as in a container with a read-only file system: what is compiled is not kept."""

    _impl_class = _ReadImpl

    def save_overload(self, sig: Any, data: Any) -> None:
        """Nothing can be kept."""


def shipped_folder(module: str, top: Path | None = None) -> Path:
    """Where a wheel has the compiled kernels of a module: one folder for each package."""
    return (top or SHIPPED) / module.rpartition(".")[0]


def cache_of(function: Any) -> ShippedCache:
    """The cache of a kernel's function, by what numba may write."""
    try:
        return ShippedCache(function)
    except RuntimeError:  # numba found no folder that it can write
        return ReadOnlyCache(function)
