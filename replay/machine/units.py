"""Conversion of recorded units to SI.

A unit belongs to one quantity; a signal accepts the quantities that can describe it (a wheel speed may be
recorded in m/s at the rim, or in rad/s or rpm of the wheel or of its motor).
"""

from __future__ import annotations

from typing import Literal

from replay.errors import ConfigError
from replay.machine.quantities import DOUBTED_UNITS, SI_UNITS, UNITS, Quantity
from replay.machine.signal_table import quantity_of

#: Other spellings, as logs and people write them in English, German and French; compared without case and spaces.
_SPELLINGS = {
    "rpm": "r.p.m. r/min rev/min 1/min /min min-1 min^-1 min⁻¹ u/min umdr/min umdr./min umdrehungen/min upm tr/min tour/min tours/min t/min trs/min",
    "rev/s": "rps u/s tr/s",
    "deg": "° degs degree degrees grad grd winkelgrad degré degrés",
    "deg/s": "°/s deg/sec degree/s degrees/s grad/s degré/s degrés/s dps",
    "rad": "radian radians radiant radiants",
    "rad/s": "rad/sec rads/s radian/s radians/s rad.s-1 rad*s^-1",
    "m/s": "m/sec mps m.s-1 m*s^-1 meter/s meters/s mètre/s",
    "km/h": "kph kmh kmph km/std",
    "kn": "kt kts knot knots knoten nœud nœuds",
    "m": "meter meters metre metres mètre mètres",
    "%": "percent prozent proz proz. pct pourcent",
    "1": "- ratio",
    "m/s^2": "m/s² m/s2 m/s/s m/sec^2 m/sec2 m.s-2 m*s^-2 mps2",
    "g": "g0 g₀ gn gₙ g-force",
    "N·m": "n.m n*m n-m newtonmeter",
    "A": "amp amps ampere ampère",
    "V": "volt volts",
}
_ALIASES = {word: name for name, words in _SPELLINGS.items() for word in words.split()}
_NO_CASE = {name.casefold(): name for name in UNITS if name not in ("MPa", "mA")}


def known_unit(text: str) -> str | None:
    """Name in the table of units of a unit as logs and people write it (``U/min``, ``tr/min``: rpm); None where not known."""
    bare = text.strip()
    if (bare[:1], bare[-1:]) in (("[", "]"), ("(", ")")):  # as in a row of units: [%]
        bare = bare[1:-1].strip()
    if bare in UNITS:
        return bare
    word = "".join(bare.split()).casefold()
    return _ALIASES.get(word) or _NO_CASE.get(word)


def is_angle(unit: str) -> bool:
    """Whether a recorded unit is one of angles."""
    name = known_unit(unit)
    return name is not None and UNITS[name][0] == "angle"


def kept_unit(signal: str, recorded: str) -> str:
    """Unit in which a signal is kept: SI, of an effort the one of its kind: ``A`` of one in mA, ``1`` of a share.

    Parameters
    ----------
    signal : str
        Canonical name.
    recorded : str
        Unit of its source; may be empty.
    """
    unit = SI_UNITS[quantity_of(signal)]
    name = known_unit(recorded) or unit
    if quantity_of(signal) != "effort" or UNITS[name][0] not in ("effort", "fraction"):
        return unit
    return {"mA": "A", "Nm": "N·m", "%": "1", "fraction": "1"}.get(name, name)


def _no_opening(signal: str, unit: str) -> str:
    """Why volts or amperes are no opening, and the line to write instead."""
    usual = {"V": "gain = 0.1 where 10 V open it fully", "mA": "gain = 0.0625, offset = -0.25 of 4 to 20 mA"}
    how = usual.get(unit, "gain = 1 / the value that opens it fully")
    motor = f"; if it is the effort of a motor, name it {signal[:-1]}effort" if signal.endswith(".u") else ""
    return f'unit {unit!r} is no opening; write unit = "1" and the scale: {how}{motor}'


def si_factor(
    signal: str,
    unit: str,
    *,
    wheel_radius: float | None,
    gear_ratio: float,
    at: Literal["motor", "wheel"],
    derivative: bool = False,
    speed_unit: str = "m/s",
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
    speed_unit : str
        Unit in which the machine's wheel or joint speeds are kept: m/s, or rad/s or deg/s of a joint.

    Raises
    ------
    ConfigError
        Where the unit is unknown or does not describe the signal's quantity.
    """
    wanted = quantity_of(signal)
    name = known_unit(unit) or ""
    if wanted == "position_deg":
        if name != "deg":
            raise ConfigError(f"[signals] {signal!r}: unit {unit!r} does not fit; expected deg")
        return 1.0
    if not name:
        raise ConfigError(
            f"[signals] {signal!r}: unit {unit!r} is not known; expected one of {', '.join(u for u in UNITS if u not in DOUBTED_UNITS)}"
        )
    quantity, factor = UNITS[name]
    if derivative:
        integral: dict[Quantity, Quantity] = {"length": "speed", "angle": "rotation"}
        quantity = integral.get(quantity, quantity)
    if wanted == "speed" and speed_unit != SI_UNITS["speed"] and signal.startswith("wheel."):
        if quantity != "rotation":
            raise ConfigError(
                f"[signals] {signal!r}: unit {unit!r} is a {quantity}, and the machine's speeds are in {speed_unit} "
                "(machine.part, machine.speed_unit); expected rad/s, deg/s, rpm or rev/s, or rad or deg with derivative = true"
            )
        return factor / UNITS[speed_unit][1] / (gear_ratio if at == "motor" else 1.0)
    if quantity == wanted or (wanted == "effort" and quantity == "fraction"):
        return factor
    if (
        signal == "cmd.omega" and quantity == "angle"
    ):  # of a car's steering; `turned_by_steering` makes a yaw rate of it
        return factor
    if quantity == "effort" and wanted == "fraction":
        raise ConfigError(f"[signals] {signal!r}: {_no_opening(signal, name)}")
    if wanted == "speed" and quantity == "rotation" and signal.startswith("wheel."):
        if wheel_radius is None:
            raise ConfigError(
                f"[signals] {signal!r}: unit {unit!r} needs the wheel's size; set geometry.wheel_diameter [m], or "
                'machine.part = "joint" where it is the speed of a joint'
            )
        return factor * wheel_radius / (gear_ratio if at == "motor" else 1.0)
    fitting = ", ".join(u for u, (q, _) in UNITS.items() if q == wanted and u not in DOUBTED_UNITS)
    raise ConfigError(f"[signals] {signal!r}: unit {unit!r} is a {quantity}; expected a {wanted} ({fitting})")
