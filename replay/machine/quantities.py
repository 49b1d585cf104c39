"""Physical quantities and their units: the first unit of a quantity with factor 1 is its SI unit."""

from __future__ import annotations

import math
from typing import Literal

Quantity = Literal[
    "speed", "rotation", "angle", "length", "fraction", "pressure", "acceleration", "effort", "position_deg"
]

#: Every unit that a machine file may name: its quantity and the factor to SI.
UNITS: dict[str, tuple[Quantity, float]] = {
    "m/s": ("speed", 1.0),
    "mm/s": ("speed", 1e-3),
    "cm/s": ("speed", 1e-2),
    "km/h": ("speed", 1 / 3.6),
    "kn": ("speed", 1852 / 3600),
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
    "g": ("acceleration", 9.80665),
    "N·m": ("effort", 1.0),
    "Nm": ("effort", 1.0),
    "A": ("effort", 1.0),
    "mA": ("effort", 1e-3),
    "V": ("effort", 1.0),
}
#: Units of openings that `mfhca config init` writes where it cannot tell which one it is; taken as %, and no valve is judged by them.
DOUBTED_UNITS = ("% or V", "% or mA")
UNITS.update(dict.fromkeys(DOUBTED_UNITS, ("fraction", 0.01)))
#: Unit in which every signal of a quantity is kept; a position on the globe stays in degrees.
SI_UNITS: dict[Quantity, str] = {
    **{quantity: unit for unit, (quantity, factor) in reversed(UNITS.items()) if factor == 1.0},
    "position_deg": "deg",
}
#: What a fraction is a fraction of, to follow a number.
OPENING = "of full opening"
#: Units that lengths and angles of a machine file are given in by mistake, with the factor to SI.
DEGREES = ("degrees", math.pi / 180)
MILLIMETRES = ("millimetres", 1e-3)
CENTIMETRES = ("centimetres", 1e-2)
LENGTHS = (MILLIMETRES, CENTIMETRES)
