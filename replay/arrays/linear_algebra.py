"""The linear algebra of compiled kernels, without the rest of `scipy.linalg`.

Before its first kernel numba imports two modules of `scipy.linalg`, which hold addresses of BLAS and LAPACK and need nothing else of it.
Their package loads a hundred others, of which a diagnosis uses none.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import ModuleType

_PACKAGE, _ADDRESSES = "scipy.linalg", ("cython_blas", "cython_lapack")


def load_addresses() -> None:
    """Load the two modules under their names; `scipy.linalg` itself is loaded whole by whoever imports it later.

    Where SciPy is another one than expected, nothing happens, and numba loads what it needs.
    """
    if _PACKAGE in sys.modules:
        return
    with suppress(ImportError):
        import scipy

        package = ModuleType(_PACKAGE)
        package.__path__ = [str(Path(folder) / "linalg") for folder in scipy.__path__]
        sys.modules[_PACKAGE] = package
        try:
            for name in _ADDRESSES:
                import_module(f"{_PACKAGE}.{name}")
        finally:
            del sys.modules[_PACKAGE]
