"""The table of controllers: names, classes, numbers of parameters, gains; and the one compiled step that runs any of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.controllers.adaptive import ADAPTIVE_STATES, AdaptiveGains, adaptive_step
from replay.controllers.finite_time import FINITE_TIME_STATES, FiniteTimeGains, finite_time_step
from replay.controllers.fuzzy import FUZZY_STATES, FuzzyGains, fuzzy_step
from replay.controllers.limits import F
from replay.controllers.mfhca import MFHCA_STATES, READINGS, MfhcaGains, mfhca_step
from replay.controllers.neural import NEURAL_STATES, NeuralGains, neural_step
from replay.controllers.reference import PI_STATES, PGains, PiGains, p_step, pi_step
from replay.errors import ConfigError

MFHCA, P, PI, ADAPTIVE, FINITE_TIME, NEURAL, FUZZY = range(7)
STATES = max(MFHCA_STATES, PI_STATES, ADAPTIVE_STATES, FINITE_TIME_STATES, NEURAL_STATES, FUZZY_STATES)


class ControllerGains(NamedTuple):
    """Gains of every class; a loop runs one of them, and what it takes of the others is never read."""

    mfhca: MfhcaGains
    p: PGains
    pi: PiGains
    adaptive: AdaptiveGains
    finite_time: FiniteTimeGains
    neural: NeuralGains
    fuzzy: FuzzyGains


@dataclass(frozen=True)
class ControllerClass:
    """One row of the table of controllers.

    Attributes
    ----------
    name : str
        As typed on the command line.
    code : int
        In compiled loops.
    title : str
        What it is.
    stands_for : str
        Row of the paper's table that it represents; empty for references.
    parameters : int
        How many have to be set, counted as in the paper.
    gains : type
        Its gains, with defaults tuned on one healthy mission of the simulator.
    bounds : Mapping[str, tuple[float, float]]
        Lowest and highest value of gains that cannot take any positive one.
    """

    name: str
    code: int
    title: str
    stands_for: str
    parameters: int
    gains: Callable[..., Any]
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)


_FRACTION = (0.0, 1.0)
CONTROLLERS: Mapping[str, ControllerClass] = {
    row.name: row
    for row in (
        ControllerClass("mfhca", MFHCA, "MFHCA, Ψ̂ forced", "MFHCA", 4, MfhcaGains),
        ControllerClass("p", P, "proportional", "", 1, PGains),
        ControllerClass("pi", PI, "proportional, integral, feed-forward", "", 3, PiGains),
        ControllerClass("adaptive", ADAPTIVE, "adaptive, backstepping-like", "Yang", 16, AdaptiveGains),
        ControllerClass(
            "finite-time", FINITE_TIME, "finite-time sliding", "Wang", 7, FiniteTimeGains,
            {"alpha": _FRACTION, "beta": _FRACTION},
        ),
        ControllerClass("neural", NEURAL, "neural, radial basis", "Yu", 6, NeuralGains),
        ControllerClass("fuzzy", FUZZY, "fuzzy adaptive", "Sun", 12, FuzzyGains),
    )
}  # fmt: skip
CONTROLLER_NAMES: tuple[str, ...] = tuple(CONTROLLERS)

#: Gains that divide, and so cannot be 0.
_DIVISORS = ("epsilon", "tau_f", "width", "w_v", "w_d")


@dataclass(frozen=True)
class Controller:
    """A controller with its gains.

    Attributes
    ----------
    name : str
        One of `CONTROLLER_NAMES`.
    values : Mapping[str, float]
        Gains that differ from the class's own, by name.
    reading : str
        Reading of L15 (14) that MFHCA runs; others have none.
    lead : float
        Share of its own step that Ψ̂ has taken when a command is given; see `replay.control.mfhca.forced_psi`.
    """

    name: str
    values: Mapping[str, float] = field(default_factory=dict)
    reading: str = "opposed"
    lead: float = 1.0

    def __post_init__(self) -> None:
        """Check names and values."""
        if self.name not in CONTROLLERS:
            raise ConfigError(f"controller {self.name!r} is not known; expected one of {', '.join(CONTROLLERS)}")
        if self.reading not in READINGS:
            raise ConfigError(f"law {self.reading!r} is not known; expected one of {', '.join(READINGS)}")
        known = self.settable
        for key, value in self.values.items():
            if key not in known:
                raise ConfigError(f"{self.name} has no parameter {key!r}; expected one of {', '.join(known)}")
            low, high = self.kind.bounds.get(key, (0.0, 1e6))
            if not (low <= value <= high) or (key in _DIVISORS and value <= 0.0):
                least = "more than 0" if key in _DIVISORS else f"{low:g}"
                raise ConfigError(f"{self.name}: {key} = {value:g} is out of range; expected {least} to {high:g}")

    @property
    def kind(self) -> ControllerClass:
        """Its row of the table."""
        return CONTROLLERS[self.name]

    @property
    def settable(self) -> tuple[str, ...]:
        """Names of its gains, as typed on the command line."""
        fields = self.kind.gains()._fields
        return tuple(_typed(f) for f in fields if f not in ("reading", "lead"))

    @property
    def own(self) -> dict[str, float]:
        """All its gains by name, as they are used."""
        gains = self._own()
        return {_typed(f): float(getattr(gains, f)) for f in gains._fields if f not in ("reading", "lead")}

    def gains(self) -> ControllerGains:
        """Gains for compiled loops."""
        return NEUTRAL._replace(**{self.name.replace("-", "_"): self._own()})

    def _own(self) -> Any:
        values = {("lambda_" if k == "lambda" else k): float(v) for k, v in self.values.items()}
        if self.name == "mfhca":
            values |= {"reading": READINGS.index(self.reading), "lead": self.lead}
        return self.kind.gains(**values)


def _typed(name: str) -> str:
    return "lambda" if name == "lambda_" else name


NEUTRAL = ControllerGains(
    MfhcaGains(), PGains(), PiGains(), AdaptiveGains(), FiniteTimeGains(), NeuralGains(), FuzzyGains()
)


def controller_state(wheels: int) -> F:
    """State of any controller at rest, shape (wheels, STATES)."""
    return np.zeros((wheels, STATES))


@njit(cache=True)
def command(code: int, v_ref: F, y: F, dt: float, u_max: float, gains: ControllerGains, s: F, u: F) -> None:
    """One step of a controller: valve command of every wheel into `u`; its state is advanced.

    Parameters
    ----------
    code : int
        Class, as in `CONTROLLERS`.
    v_ref, y : NDArray[np.float64], shape (wheels,)
        Commanded and measured speed [m/s].
    dt : float
        Control step [s].
    u_max : float
        Largest opening [fraction].
    gains : ControllerGains
        Of all classes; those of this one count.
    s : NDArray[np.float64], shape (wheels, STATES)
        The controller's state.
    u : NDArray[np.float64], shape (wheels,)
        Filled.
    """
    if code == MFHCA:
        mfhca_step(v_ref, y, dt, u_max, gains.mfhca, s, u)
    elif code == P:
        p_step(v_ref, y, u_max, gains.p, u)
    elif code == PI:
        pi_step(v_ref, y, dt, u_max, gains.pi, s, u)
    elif code == ADAPTIVE:
        adaptive_step(v_ref, y, dt, u_max, gains.adaptive, s, u)
    elif code == FINITE_TIME:
        finite_time_step(v_ref, y, dt, u_max, gains.finite_time, s, u)
    elif code == NEURAL:
        neural_step(v_ref, y, dt, u_max, gains.neural, s, u)
    else:
        fuzzy_step(v_ref, y, dt, u_max, gains.fuzzy, s, u)
