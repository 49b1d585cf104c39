"""SciPy's least squares without negative values, without the quarter of a second of CPU time that importing `scipy.optimize` takes.

The function stands in a module of its own, which needs one compiled module and nothing else of its package.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from threading import Lock
from typing import Any

_PACKAGE = "scipy.optimize"
_LOADING = Lock()


def non_negative_least_squares() -> Callable[..., tuple[Any, float]]:
    """The function `scipy.optimize.nnls`; from the whole package where that is loaded, or SciPy is another one than expected."""
    with _LOADING:  # parts of a mission are judged at once
        return _found()


@cache
def _found() -> Callable[..., tuple[Any, float]]:
    if _PACKAGE not in sys.modules:
        try:
            _load("_slsqplib", EXTENSION_SUFFIXES)
            _load("_nnls", [".py"])
            return sys.modules[f"{_PACKAGE}._nnls"].nnls  # type: ignore[no-any-return]
        except (ImportError, AttributeError, OSError):
            for name in ("_slsqplib", "_nnls"):
                sys.modules.pop(f"{_PACKAGE}.{name}", None)
    return import_module(_PACKAGE).nnls  # type: ignore[no-any-return]


def _load(name: str, suffixes: list[str]) -> None:
    """Load a module of the package from its file under its own name, so that the package takes it as it is later."""
    import scipy

    folder = Path(scipy.__path__[0]) / "optimize"
    path = next((p for s in suffixes if (p := folder / f"{name}{s}").exists()), None)
    spec = None if path is None else spec_from_file_location(f"{_PACKAGE}.{name}", path)
    if spec is None or spec.loader is None:
        raise ImportError(name)
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
