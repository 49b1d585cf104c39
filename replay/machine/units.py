"""Units of recorded signals and their conversion to SI.

A unit belongs to one quantity; a signal accepts the quantities that can describe it (a wheel speed may be
recorded in m/s at the rim, or in rad/s or rpm of the wheel or of its motor).
"""

from __future__ import annotations

import math
from typing import Literal

from replay.errors import ConfigError

Quantity = Literal["speed", "rotation", "angle", "length", "fraction", "pressure", "acceleration", "position_deg"]

_UNITS: dict[str, tuple[Quantity, float]] = {
    "m/s": ("speed", 1.0),
    "mm/s": ("speed", 1e-3),
    "cm/s": ("speed", 1e-2),
    "km/h": ("speed", 1 / 3.6),
    "rad/s": ("rotation", 1.0),
    "deg/s": ("rotation", math.pi / 180),
    "rpm": ("rotation", 2 * math.pi / 60),
    "rev/s": ("rotation", 2 * math.pi),
    "rad": ("angle", 1.0),
    "deg": ("angle", math.pi / 180),
    "m": ("length", 1.0),
    "mm": ("length", 1e-3),
    "1": ("fraction", 1.0),
    "fraction": ("fraction", 1.0),
    "%": ("fraction", 1e-2),
    "Pa": ("pressure", 1.0),
    "bar": ("pressure", 1e5),
    "MPa": ("pressure", 1e6),
    "m/s^2": ("acceleration", 1.0),
}
_ALIASES = {"°": "deg", "°/s": "deg/s", "percent": "%", "1/min": "rpm", "u/min": "rpm", "kph": "km/h"}
_DEGREES = {"gnss.lat", "gnss.lon"}


def known_units() -> tuple[str, ...]:
    """Every unit that a machine file may name."""
    return tuple(_UNITS)


def quantity_of(signal: str) -> Quantity:
    """Quantity of a canonical signal after conversion to SI.

    Raises
    ------
    ConfigError
        Where the name is not canonical.
    """
    group, _, rest = signal.partition(".")
    leaf = rest.rpartition(".")[2]
    if group == "cmd" and leaf == "v":
        return "speed"
    if group == "cmd" and leaf == "omega":
        return "rotation"
    if group == "wheel" and leaf in {"v_ref", "v", "v_true"}:
        return "speed"
    if group in {"wheel", "steer"} and leaf in {"u", "u_applied", "psi"}:
        return "fraction"
    if group == "wheel" and leaf in {"pressure_a", "pressure_b"}:
        return "pressure"
    if group == "steer" and leaf in {"phi_ref", "phi", "phi_true"}:
        return "angle"
    if group == "imu" and leaf == "yaw_rate":
        return "rotation"
    if group == "gnss" and leaf in {"lat", "lon"}:
        return "position_deg"
    if group == "gnss" and leaf == "speed":
        return "speed"
    if group == "odom" and leaf in {"x", "y"}:
        return "length"
    if group == "odom" and leaf == "yaw":
        return "angle"
    raise ConfigError(
        f"[signals] {signal!r} is not a known signal; expected cmd.v, cmd.omega, wheel.<W>.v_ref|v|v_true|u|u_applied|"
        "psi|pressure_a|pressure_b, steer.<A>.phi_ref|phi|phi_true|u|u_applied, gnss.lat|lon|speed, imu.yaw_rate or "
        "odom.x|y|yaw"
    )


def si_factor(
    signal: str,
    unit: str,
    *,
    wheel_radius: float | None,
    gear_ratio: float,
    at: Literal["motor", "wheel"],
    derivative: bool = False,
) -> float:
    """Factor from a recorded unit to the signal's SI unit.

    Parameters
    ----------
    signal : str
        Canonical name.
    unit : str
        Recorded unit.
    wheel_radius : float or None
        Rolling radius [m]; needed for a wheel speed recorded as a rotation.
    gear_ratio : float
        Motor turns per wheel turn [1].
    at : str
        Where a rotation was measured.
    derivative : bool
        Whether the recorded value is a position whose time derivative is the signal.

    Raises
    ------
    ConfigError
        Where the unit is unknown or does not describe the signal's quantity.
    """
    wanted = quantity_of(signal)
    name = _ALIASES.get(unit.strip(), unit.strip())
    if wanted == "position_deg":
        if name != "deg":
            raise ConfigError(f"[signals] {signal!r}: unit {unit!r} does not fit; expected deg")
        return 1.0
    if name not in _UNITS:
        raise ConfigError(f"[signals] {signal!r}: unit {unit!r} is not known; expected one of {', '.join(_UNITS)}")
    quantity, factor = _UNITS[name]
    if derivative:
        integral: dict[Quantity, Quantity] = {"length": "speed", "angle": "rotation"}
        quantity = integral.get(quantity, quantity)
    if quantity == wanted:
        return factor
    if wanted == "speed" and quantity == "rotation" and signal.startswith("wheel."):
        if wheel_radius is None:
            raise ConfigError(
                f"[signals] {signal!r}: unit {unit!r} needs the wheel's size; set geometry.wheel_diameter [m]"
            )
        return factor * wheel_radius / (gear_ratio if at == "motor" else 1.0)
    fitting = ", ".join(u for u, (q, _) in _UNITS.items() if q == wanted)
    raise ConfigError(f"[signals] {signal!r}: unit {unit!r} is a {quantity}; expected a {wanted} ({fitting})")
