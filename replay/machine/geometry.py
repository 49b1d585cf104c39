"""Where the wheels are, and which steering axle they belong to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from replay.errors import check_range
from replay.machine.quantities import LENGTHS


@dataclass(frozen=True)
class WheelGeometry:
    """One drive wheel on its steering joint (frame REP-103 at the machine's centre).

    Attributes
    ----------
    x, y : float
        Steering joint [m]; x forward, y left.
    offset : float
        Distance from joint to wheel centre along the wheel's axle [m], positive to the left (d_i of L1 (1)).
    axle : str
        Steering axle: ``front``, ``rear``, the wheel's own (`own_axle`), or ``fixed``.
    """

    x: float
    y: float
    offset: float
    axle: str


def own_axle(wheel: str) -> str:
    """Name of the axle of a wheel that is steered by itself, which is another part than the wheel: ``FR_steer``."""
    return f"{wheel}_steer"


@dataclass(frozen=True)
class Geometry:
    """Where the wheels are. `wheels` is keyed by wheel name."""

    wheels: Mapping[str, WheelGeometry]
    wheel_diameter: float

    def __post_init__(self) -> None:
        """Check lengths."""
        check_range("geometry.wheel_diameter", self.wheel_diameter, 0.02, 5.0, "m", mistaken=LENGTHS)
        for name, w in self.wheels.items():
            for key, value in (("x", w.x), ("y", w.y)):
                check_range(f"geometry.{name}.{key}", value, -20.0, 20.0, "m", mistaken=LENGTHS)
            check_range(f"geometry.{name}.offset", w.offset, -2.0, 2.0, "m", mistaken=LENGTHS)

    @property
    def axles(self) -> tuple[str, ...]:
        """Steered axles in order of first use."""
        return tuple(dict.fromkeys(w.axle for w in self.wheels.values() if w.axle != "fixed"))

    @property
    def still_x(self) -> float:
        """Where the body does not move sideways in a turn [m]: mean x of its unsteered wheels; 0 where all are steered."""
        xs = [w.x for w in self.wheels.values() if w.axle == "fixed"]
        return sum(xs) / len(xs) if xs else 0.0

    @property
    def steering_base(self) -> float | None:
        """From the unsteered wheels forward to the steered ones [m]; None where it is not one end of the machine that steers."""
        still, xs = self.still_x, [w.x for w in self.wheels.values() if w.axle != "fixed"]
        if not xs or len(xs) == len(self.wheels) or min(xs) <= still <= max(xs):
            return None
        return sum(xs) / len(xs) - still

    def axle_x(self, axle: str) -> float:
        """Position of an axle along the machine [m]: mean x of its joints."""
        xs = [w.x for w in self.wheels.values() if w.axle == axle]
        return sum(xs) / len(xs)


def four_wheel_geometry(wheelbase: float, joint_spacing: float, wheel_diameter: float, wheel_offset: float) -> Geometry:
    """Four steered wheels FR, FL, RR, RL on a front and a rear axle; all lengths in m. Lengths [m]."""
    check_range("geometry.wheelbase", wheelbase, 0.05, 40.0, "m", mistaken=LENGTHS)
    check_range("geometry.joint_spacing", joint_spacing, 0.05, 20.0, "m", mistaken=LENGTHS)
    half, side = wheelbase / 2, joint_spacing / 2
    return Geometry(
        wheels={
            "FR": WheelGeometry(half, -side, -wheel_offset, "front"),
            "FL": WheelGeometry(half, side, wheel_offset, "front"),
            "RR": WheelGeometry(-half, -side, -wheel_offset, "rear"),
            "RL": WheelGeometry(-half, side, wheel_offset, "rear"),
        },
        wheel_diameter=wheel_diameter,
    )
