"""filterpy's Kalman filter, without the second of CPU time that its import otherwise takes.

`import filterpy` loads all of `scipy.stats`, for densities that the filter is not asked for here. While filterpy is loaded, a
stand-in has that module's place; whatever is asked of it later, the real one answers.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from filterpy.kalman import KalmanFilter

_STATS = "scipy.stats"


class _Later:
    """A distribution of `scipy.stats` that is loaded when something is asked of it."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, asked: str) -> object:
        if isinstance(sys.modules.get(_STATS), _StandIn):
            return _nothing  # filterpy tries once whether a density takes its options
        return getattr(getattr(import_module(_STATS), self._name), asked)


def _nothing(*_: object, **__: object) -> None:
    return


class _StandIn(ModuleType):
    def __getattr__(self, name: str) -> _Later:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Later(name)


def kalman_filter() -> type[KalmanFilter]:
    """The class `filterpy.kalman.KalmanFilter`."""
    if "filterpy" not in sys.modules and _STATS not in sys.modules:
        sys.modules[_STATS] = _StandIn(_STATS)
        try:
            import_module("filterpy.kalman")
        finally:
            del sys.modules[_STATS]
    found: type[KalmanFilter] = import_module("filterpy.kalman").KalmanFilter
    return found
