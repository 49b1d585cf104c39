"""The table of canonical signals: what the machine can have recorded, once.

A new signal is one entry here, and what its absence costs in `diagnosis.decision.missing`; names, units, the reading order,
what a log's symbols are called and which signals clocks are compared by are looked up in this table.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import StrEnum

from replay.errors import ConfigError
from replay.machine.quantities import OPENING, SI_UNITS, Quantity


class Scope(StrEnum):
    """What a signal belongs to; wheels and axles have one of each kind."""

    WHEEL = "<W>"
    AXLE = "<A>"
    MACHINE = ""


@dataclass(frozen=True)
class Named:
    """How symbols of a PLC and columns of a table name a signal.

    Attributes
    ----------
    order : int
        Patterns of one scope are tried in this order; the first that fits counts.
    pattern : str
        Regular expression, searched in the last word of the symbol of a wheel or axle, in the whole symbol of a signal of
        the machine.
    """

    order: int
    pattern: str


@dataclass(frozen=True)
class CanonicalSignal:
    """One entry of the table.

    Attributes
    ----------
    group, leaf : str
        First and last word of the name: ``wheel`` and ``v`` of ``wheel.FR.v``.
    quantity : Quantity
        What it is, which decides its SI unit.
    words : str
        What it is, in words.
    clock_rank : int or None
        Place among the signals by whose copies in two files their clocks are compared, the surest first; None where copies do
        not show the same moment.
    named : Named or None
        How symbols name it; None where only its canonical name, a message type or the machine file leads to it.
    """

    group: str
    leaf: str
    quantity: Quantity
    words: str
    clock_rank: int | None = None
    named: Named | None = None

    @property
    def scope(self) -> Scope:
        """What it belongs to."""
        return {"wheel": Scope.WHEEL, "steer": Scope.AXLE}.get(self.group, Scope.MACHINE)

    @property
    def kind(self) -> str:
        """Name without wheel or axle: ``wheel.v``."""
        return f"{self.group}.{self.leaf}"

    @property
    def of_drive(self) -> bool:
        """Whether it is of what moves a wheel, so that one that only rolls along has none."""
        return self.group == "wheel" and self.leaf in _OF_DRIVES

    @property
    def unit(self) -> str:
        """SI unit."""
        return SI_UNITS[self.quantity]

    @property
    def shown_unit(self) -> str:
        """The same to follow a number in a report."""
        return OPENING if self.quantity == "fraction" else self.unit


_OF_DRIVES = frozenset({"u", "u_applied", "effort", "psi", "pressure_a", "pressure_b"})
_VALVE_POSITION = Named(
    0,
    r"(valve|spool)_?(\d+_)?(act|actual|fb|feedback|meas|measured|pos|position|ist)|(act|actual|fb|feedback|meas|measured|ist)_?valve|spool|^u_?applied|^u_?(act|actual|ist|meas|fb)$",
)
_VALVE = Named(
    1,
    r"valve_?(\d+_)?(cmd|command|out|set|ref|soll)|(cmd|command|set|ref|soll)_?valve|valve$|^u_?cmd|^u_?(set|ref|soll|des|target)$|control_?(out|cmd)|^u$",
)
_SPEED_COMMAND = (
    r"(velo(city)?|speed|vel|rpm|drehzahl|geschw\w*)_?(ref|cmd|command|set|des|target|soll)|"
    r"(ref|cmd|set|des(ired)?|target|soll)_?(velo(city)?|speed|vel|rpm|drehzahl|geschw)"
)
_ANGLE_COMMAND = (
    r"(angle|phi|steer\w*|winkel)_?(ref|cmd|command|set|des|target|soll)|"
    r"(ref|cmd|set|des(ired)?|target|soll)_?(angle|phi|steer|winkel)"
)
_ASKED = r"(joystick|cmd|command|driver|desired|ref)"
_SECOND_SPEED = r"(velo(city)?|speed|vel)_?(redundant|true|second)"
_SPEED = r"velo(city)?|speed|(^|_)vel(_|$)|rpm|drehzahl|geschw|^omega"
_EFFORT = r"effort|torque|current|duty|pwm|moment$"
_YAW_RATE = (
    r"(imu|gyro).*(yaw_?rate|gyro_?z|omega_?z|angular_velocity_z)|^gyro_(z|yaw)(_(rad|deg)_s)?$|^angular_velocity_z$"
)
_ACCELERATION = r"(^|_)(imu|body)_(acc|accel|acceleration)_?x(_|$)|^(lin(ear)?_)?(acc|accel|acceleration)_x$"
_Entry = CanonicalSignal

#: In reading order: group, leaf, quantity, words, rank for clocks, name in symbols.
CANONICAL: tuple[CanonicalSignal, ...] = (
    _Entry(
        "cmd", "v", "speed", "commanded speed v_c", 0, Named(5, _ASKED + r".*(velocity|speed|_v$|vel(_x|_lin\w*)?$)")
    ),
    _Entry(
        "cmd",
        "omega",
        "rotation",
        "commanded yaw rate ω_c",
        1,
        Named(4, _ASKED + r".*(yaw_?rate|omega|turn|vel_(z|w|yaw|theta|ang\w*)$)|^" + _ASKED + r"_(w|yaw)$"),
    ),
    _Entry("cmd", "lateral", "speed", "commanded speed to the left, of wheels with rollers"),
    _Entry("wheel", "v_ref", "speed", "commanded speed v_c,i", 6, Named(6, _SPEED_COMMAND)),
    _Entry("wheel", "v", "speed", "measured speed", 2, Named(7, _SPEED)),
    _Entry("wheel", "v_true", "speed", "second measurement of the speed", 3, Named(5, _SECOND_SPEED)),
    _Entry("wheel", "v_position", "speed", "speed by the position of its joint"),
    _Entry("wheel", "u", "fraction", "valve command u_a", 8, _VALVE),
    _Entry("wheel", "u_applied", "fraction", "measured valve position", 10, _VALVE_POSITION),
    _Entry(
        "wheel", "effort", "effort", "effort of the drive: torque, current, voltage or duty", None, Named(8, _EFFORT)
    ),
    _Entry("wheel", "psi", "fraction", "recorded Ψ̂", 16, Named(4, r"^psi")),
    _Entry("wheel", "pressure_a", "pressure", "pressure of port A", 17, Named(2, r"press(ure)?_?a$")),
    _Entry("wheel", "pressure_b", "pressure", "pressure of port B", 18, Named(3, r"press(ure)?_?b$")),
    _Entry("steer", "phi_ref", "angle", "commanded angle φ_c", 7, Named(3, _ANGLE_COMMAND)),
    _Entry("steer", "phi", "angle", "measured angle φ", 4, Named(4, r"angle|phi|winkel|act_?pos")),
    _Entry(
        "steer", "phi_true", "angle", "second measurement of φ", 5, Named(2, r"(angle|phi)_?(redundant|true|second)")
    ),
    _Entry("steer", "u", "fraction", "valve command u_s", 9, _VALVE),
    _Entry("steer", "u_applied", "fraction", "measured valve position", 11, _VALVE_POSITION),
    _Entry("imu", "yaw_rate", "rotation", "measured yaw rate", 12, Named(0, _YAW_RATE)),
    _Entry(
        "imu",
        "acceleration",
        "acceleration",
        "measured forward acceleration, with gravity",
        None,
        Named(6, _ACCELERATION),
    ),
    _Entry(
        "gnss",
        "lat",
        "position_deg",
        "latitude",
        None,
        Named(1, r"(gnss|gps).*lat|(^|_)(latitude|breitengrad)(_(deg|grad))?$"),
    ),
    _Entry(
        "gnss",
        "lon",
        "position_deg",
        "longitude",
        None,
        Named(2, r"(gnss|gps).*lon|(^|_)(longitude|laengengrad)(_(deg|grad))?$"),
    ),
    _Entry(
        "gnss",
        "speed",
        "speed",
        "speed over ground",
        None,
        Named(3, r"(gnss|gps).*(speed|velocity)|speed_(ueber_grund|over_ground|sur_(le_)?fond)"),
    ),
    _Entry("odom", "x", "length", "forward position", 14),
    _Entry("odom", "y", "length", "position to the left", 15),
    _Entry("odom", "yaw", "angle", "heading", 13),
    _Entry("odom", "v", "speed", "forward speed by odometry"),
)
#: By name without wheel or axle: ``wheel.v``.
BY_KIND = {entry.kind: entry for entry in CANONICAL}


def names_of(wheels: Sequence[str], axles: Sequence[str], unpowered: Collection[str] = ()) -> tuple[str, ...]:
    """Every name that a machine with these wheels and axles can have, in reading order: one part after the other.

    `unpowered`: wheels without a drive, which have no signals of one.
    """
    parts = {Scope.WHEEL: wheels, Scope.AXLE: axles, Scope.MACHINE: ("",)}
    names = []
    for group in dict.fromkeys(entry.group for entry in CANONICAL):
        entries = [entry for entry in CANONICAL if entry.group == group]
        for part in parts[entries[0].scope]:
            own = [entry for entry in entries if part not in unpowered or not entry.of_drive]
            names += [f"{group}.{part}.{entry.leaf}" if part else entry.kind for entry in own]
    return tuple(names)


def find_signal(name: str) -> CanonicalSignal | None:
    """Entry of a name, None where it is not canonical."""
    words = name.split(".")
    entry = BY_KIND.get(f"{words[0]}.{words[-1]}")
    if entry is None or len(words) != (2 if entry.scope == Scope.MACHINE else 3) or not all(words):
        return None
    return entry


def is_asked(name: str) -> bool:
    """Whether a signal is a command or a reference: what is asked, which a sender may publish on change alone."""
    entry = find_signal(name)
    return entry is not None and (entry.group == "cmd" or entry.leaf in ("v_ref", "phi_ref", "u"))


def check_asked(name: str) -> None:
    """Raise `ConfigError` where a signal that is to be published on change is no command or reference."""
    if not is_asked(name):
        raise ConfigError(
            f"[signals] {name!r}: on_change is for what is asked (cmd.*, v_ref, phi_ref, u); a measurement that does not come is none"
        )


def signal_of(name: str) -> CanonicalSignal:
    """Entry of a name.

    Raises
    ------
    ConfigError
        Where the name is not canonical.
    """
    entry = find_signal(name)
    if entry is None:
        *known, last = known_names()
        raise ConfigError(f"[signals] {name!r} is not a known signal; expected {', '.join(known)} or {last}")
    return entry


def known_names() -> list[str]:
    """Patterns of all names, one for each group: ``gnss.lat|lon|speed``."""
    groups: dict[str, list[str]] = {}
    for entry in CANONICAL:
        first = f"{entry.group}.{entry.scope}." if entry.scope else f"{entry.group}."
        groups.setdefault(first, []).append(entry.leaf)
    return [first + "|".join(leaves) for first, leaves in groups.items()]


def quantity_of(name: str) -> Quantity:
    """Quantity of a canonical signal; raises `ConfigError` where the name is not canonical."""
    return signal_of(name).quantity
