"""filterpy's Kalman filter, without the second of CPU time that its import otherwise takes.

`import filterpy` loads all of `scipy.stats`, `scipy.ndimage`, `scipy.linalg` and `scipy.sparse`, for densities, convolutions and matrices that
the filter is not asked for here. While filterpy is loaded, stand-ins have the places of those that are not there yet; whatever is
asked of them later, the real ones answer.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from filterpy.kalman import KalmanFilter

_LEFT_OUT = ("scipy.stats", "scipy.ndimage", "scipy.linalg", "scipy.sparse", "scipy.sparse.linalg")


class _Later:
    """What a module holds under a name; the module is loaded when something is asked of it."""

    def __init__(self, module: str, name: str) -> None:
        self._module, self._name = module, name

    def __getattr__(self, asked: str) -> Any:
        if isinstance(sys.modules.get(self._module), _StandIn):
            return _nothing  # filterpy tries once whether a density takes its options
        return getattr(self._real(), asked)

    def __call__(self, *words: Any, **named: Any) -> Any:
        return self._real()(*words, **named)

    def _real(self) -> Any:
        return getattr(import_module(self._module), self._name)


def _nothing(*_: object, **__: object) -> None:
    return


class _StandIn(ModuleType):
    def __getattr__(self, name: str) -> _Later:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Later(self.__name__, name)


def kalman_filter() -> type[KalmanFilter]:
    """The class `filterpy.kalman.KalmanFilter`."""
    if "filterpy" not in sys.modules:
        standing_in = [name for name in _LEFT_OUT if name not in sys.modules]
        sys.modules.update({name: _StandIn(name) for name in standing_in})
        try:
            import_module("filterpy.kalman")
        finally:
            for name in standing_in:
                del sys.modules[name]
    found: type[KalmanFilter] = import_module("filterpy.kalman").KalmanFilter
    return found
