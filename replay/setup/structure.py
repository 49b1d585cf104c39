"""Which wheels a machine has, what steers them, and where they are: from a preset, a description, or the names in a log."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from replay.log.raw_log import Channel
from replay.machine.config import Machine, haulotte
from replay.machine.geometry import Geometry, WheelGeometry, own_axle
from replay.setup.preset import Preset
from replay.setup.robot_description import RobotDescription, WheelJoint
from replay.signals.name_parts import axle_number, end_of, index_of, is_steering, position, row_of, rows_of, wheel_said
from replay.signals.name_words import tokens
from replay.signals.named_units import bare_name
from replay.signals.rules import candidates
from replay.signals.unsure_body import steering_letters
from replay.signals.unsure_names import unsure

FOUR, SIX = ("FR", "FL", "RR", "RL"), ("FR", "FL", "MR", "ML", "RR", "RL")
GERMAN, FRENCH = ("VR", "VL", "HR", "HL"), ("AVD", "AVG", "ARD", "ARG")
TWO, ONE, MOTOR = ("R", "L"), ("D",), ("M",)
IN_ROWS = "axle by axle"  # how wheels are told by the number of their axle and a side
_LANGUAGES = (
    (GERMAN, {"vl", "vr", "hl", "hr", "vorne", "vorn", "hinten", "vorder", "hinter", "va", "ha"}),
    (FRENCH, {"avg", "avd", "arg", "ard", "avant", "arriere", "gauche", "droite"}),
)
_PAIRS = ("RR", "RL"), ("FR", "FL")  # the driven wheels of a car
_NUMBERED = (8, 6, 4, 3, 2)
_TRACK, _BASE, _RADIUS = 0.5, 0.5, 0.1  # m; where nothing tells them


@dataclass(frozen=True)
class Structure:
    """The wheels of a machine.

    Attributes
    ----------
    wheels : tuple[str, ...]
        Names in order.
    places : Mapping[str, WheelGeometry] or None
        Where they are, and their steering axle; None for a drive without geometry.
    radius : float or None
        Of a wheel [m], where it is known.
    measured : tuple[str, ...]
        Which of ``track``, ``wheelbase`` are known rather than supposed.
    joints : Mapping[str, WheelJoint]
        Joints of a description, by wheel.
    max_steer : float or None
        Largest steering angle [rad], where it is known.
    how : str
        Where the structure comes from, in words.
    """

    wheels: tuple[str, ...]
    places: Mapping[str, WheelGeometry] | None
    radius: float | None = None
    measured: tuple[str, ...] = ()
    joints: Mapping[str, WheelJoint] = field(default_factory=dict)
    max_steer: float | None = None
    how: str = ""

    def machine(self, radius: float | None = None) -> Machine:
        """A machine to find signals with; wheels without places stand in the middle; `radius` [m] instead of the known one."""
        size = radius or self.radius or _RADIUS
        places = self.places or {w: WheelGeometry(0.0, 0.0, 0.0, "fixed") for w in self.wheels}
        geometry = Geometry(dict(places), 2 * size)
        return Machine("unnamed machine", "", self.wheels, geometry, max_speed=1e6)


def supposed(wheels: Sequence[str], steered: Mapping[str, str] | None = None) -> Mapping[str, WheelGeometry] | None:
    """Places of wheels by their names, half a metre apart; None where the names say no side."""
    rows = {"front": 1.0, "middle": 0.0, "rear": -1.0, None: 0.0}
    out = {}
    if numbered := rows_of(wheels):  # the first axle in front
        middle = (min(n for n, _ in numbered) + max(n for n, _ in numbered)) / 2
        for (number, side), wheel in numbered.items():
            y = _TRACK / 2 if side == "left" else -_TRACK / 2
            out[wheel] = WheelGeometry((middle - number) * _BASE, y, 0.0, (steered or {}).get(wheel, "fixed"))
        return out
    for wheel in wheels:
        along, across = position(wheel)
        across = across or ("right" if wheel == "R" else None)
        if across is None:
            return None
        y = _TRACK / 2 if across == "left" else -_TRACK / 2
        out[wheel] = WheelGeometry(rows[along] * _BASE / 2, y, 0.0, (steered or {}).get(wheel, "fixed"))
    return out


def preset_structure(preset: Preset) -> Structure:
    """Structure of a usual kind of machine, with lengths to be filled in but for the paper's."""
    how = f"preset {preset.value}"
    if preset is Preset.HAULOTTE:
        machine = haulotte()
        assert machine.geometry is not None
        measured = ("track", "wheelbase")
        return Structure(machine.wheels, machine.geometry.wheels, machine.wheel_radius, measured, how=how)
    if preset is Preset.DIFF_DRIVE:
        return Structure(TWO, supposed(TWO), how=how)
    steered = {"FR": "front", "FL": "front"} if preset is Preset.ACKERMANN else None
    return Structure(FOUR, supposed(FOUR, steered), how=how)


def described_structure(description: RobotDescription, joints: Sequence[str]) -> Structure | None:
    """Structure of a described robot; None where it describes no wheels.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    joints : Sequence[str]
        Joints whose states were recorded: of the wheels only these count, where there are any.
    """
    recorded = [w for w in description.wheels if w.joint in joints]
    wheels = recorded or list(description.wheels)
    if not wheels:
        return None
    names = _names(wheels)
    places, rows = {}, len({n[0] for n in names})
    middle = (max(w.x for w in wheels) + min(w.x for w in wheels)) / 2
    for name, w in zip(names, wheels, strict=True):
        axle = "fixed" if not w.steering else own_axle(name)
        places[name] = WheelGeometry(round(w.x - middle, 4), round(w.y, 4), round(w.offset, 4), axle)
    radii = [w.radius for w in wheels if w.radius is not None]
    measured = ("track", "wheelbase") if rows > 1 else ("track",)
    order = sorted(names, key=lambda n: (-places[n].x, places[n].y))
    return Structure(
        tuple(order), {n: places[n] for n in order}, max(radii) if radii else None, measured,
        dict(zip(names, wheels, strict=True)), description.max_steer, "/robot_description",
    )  # fmt: skip


def _names(wheels: Sequence[WheelJoint]) -> list[str]:
    """FR, FL, MR … by their places; W1, W2 … where two would be called the same."""
    rows: list[float] = []
    for x in sorted((w.x for w in wheels), reverse=True):
        if not rows or rows[-1] - x > 0.05:
            rows.append(x)
    letters = {1: [""], 2: ["F", "R"], 3: ["F", "M", "R"]}.get(len(rows), [str(i + 1) for i in range(len(rows))])
    if any({"vl", "vr", "hl", "hr"} & set(tokens(w.joint)) for w in wheels):
        letters = ["V" if x == "F" else "H" if x == "R" else x for x in letters]
    out = []
    for w in wheels:
        row = min(range(len(rows)), key=lambda i: abs(rows[i] - w.x))
        side = "L" if w.y > 0.01 else "R" if w.y < -0.01 else "C"
        out.append(f"{letters[row]}{side}" if letters[row].isalpha() or not letters[row] else f"{side}{letters[row]}")
    return out if len(set(out)) == len(out) else [f"W{i + 1}" for i in range(len(out))]


def named_structure(channels: Mapping[str, Channel]) -> Structure | None:
    """Structure by what the wheels are called in a log; None where no name speaks of wheels."""
    in_rows = _in_rows(channels)
    if in_rows and _covers(channels, in_rows, by_name=True):
        return Structure(
            in_rows, supposed(in_rows, _steered(channels, in_rows)), how=f"the names in the log, {IN_ROWS}"
        )
    named: tuple[tuple[str, ...], ...] = (SIX, FOUR, TWO)
    for names in named:
        if _covers(channels, names, by_name=True):
            wheels = _called(channels) if names == FOUR else names
            return Structure(wheels, supposed(wheels, _steered(channels, wheels)), how="the names in the log")
    for pair in _PAIRS:
        if _covered(channels, FOUR, by_name=True) == set(pair):
            return Structure(pair, supposed(pair, _steered(channels, pair)), how="the names in the log")
    for count in _NUMBERED:
        wheels = FOUR if count == 4 else TWO if count == 2 else tuple(f"W{i + 1}" for i in range(count))
        if _covers(channels, wheels):
            return Structure(wheels, supposed(wheels, _steered(channels, wheels)), how="numbers in the log")
    places = _unsure_structure(channels)
    if places is None and _covers(channels, ONE):
        return Structure(ONE, _at_the_steering(channels), how="the only drive in the log")
    return places


def _in_rows(channels: Mapping[str, Channel]) -> tuple[str, ...]:
    """Wheels by names of an axle's number and a side (``A1L``, ``left_1``); empty where fewer than two axles have two sides each."""
    said = {row: name for name in channels if (row := row_of(bare_name(name)[0])) is not None}
    numbers = sorted(n for n, side in said if side == "left" and (n, "right") in said)
    if len(numbers) < 2 or numbers != [*range(numbers[0], numbers[-1] + 1)]:
        return ()
    number_first = re.search(r"\d[ _-]?(?i:l|g)", said[numbers[0], "left"])
    form = "A{n}{side}" if number_first else "{side}{n}"
    return tuple(form.format(n=n, side=side) for n in numbers for side in "RL")


def _at_the_steering(channels: Mapping[str, Channel]) -> Mapping[str, WheelGeometry] | None:
    """Place of the only drive beside a steering angle, whose axle needs one; None where nothing is steered."""
    ends = {along for along, across in _steering_ends(channels) if across is None}
    if not ends:
        return None
    axle = "rear" if ends == {"rear"} else "front"
    return {ONE[0]: WheelGeometry(-_BASE if axle == "rear" else _BASE, 0.0, 0.0, axle)}


def motor_state(channels: Mapping[str, Channel]) -> Channel | None:
    """Speed of the only motor that a controller of the kind VESC tells (electrical rotations a minute); None without one, or of several."""
    found = [
        c
        for c in channels.values()
        if c.type_name.rpartition("/")[2].startswith("VescState")
        and c.field.rpartition(".")[2] == "speed"
        and len(c.values) > 1
    ]
    return found[0] if len(found) == 1 else None


def one_motor(channels: Mapping[str, Channel]) -> Structure | None:
    """A car with one motor of which a VESC tells the speed, at the steered axle, which needs a wheel; None of another machine."""
    places = _at_the_steering(channels)
    if motor_state(channels) is None or places is None:
        return None
    return Structure(MOTOR, {MOTOR[0]: places[ONE[0]]}, how="the only motor in the log")


def _unsure_structure(channels: Mapping[str, Channel]) -> Structure | None:
    """Structure by columns that speak of a place each and may be speeds; None where these are not of every wheel."""
    in_rows = _in_rows(channels)
    for names in (*([in_rows] if in_rows else []), SIX, FOUR, TWO):
        trial = Structure(names, supposed(names)).machine(1.0)
        if {f"wheel.{w}.v" for w in names} <= {found.signal for found in unsure(channels, trial)}:
            wheels = _called(channels) if names == FOUR else names
            how = f"the names in the log{f', {IN_ROWS}' if names == in_rows else ''}"
            return Structure(wheels, supposed(wheels, _steered(channels, wheels)), how=how)
    return None


def _called(channels: Mapping[str, Channel]) -> tuple[str, ...]:
    """Names of four wheels in the language of the log: of two that it could be, the one with more words in it."""
    said = [w for c in channels for w in tokens(c)]
    known = [(sum(w in words for w in said), names) for names, words in _LANGUAGES]
    count, names = max(known, key=lambda one: one[0])
    return names if count else FOUR


def _covers(channels: Mapping[str, Channel], wheels: tuple[str, ...], by_name: bool = False) -> bool:
    """Whether every one of these wheels has a speed that is its own, found by its name alone or also by its number."""
    return _covered(channels, wheels, by_name) == set(wheels)


def _covered(channels: Mapping[str, Channel], wheels: tuple[str, ...], by_name: bool = False) -> set[str]:
    """Those of some wheels that have a speed."""
    trial = Structure(wheels, supposed(wheels)).machine(1.0)
    found: dict[str, set[str]] = {}
    for c in candidates(channels, trial):
        group, part, leaf = (*c.signal.split("."), "", "")[:3]
        if group != "wheel" or leaf not in ("v", "v_true", "u_applied"):
            continue
        if by_name and wheel_said(c.origin.label, trial) != part:
            continue
        found.setdefault(part, set()).add(bare_name(c.origin.label)[0])
    return set(found)


def steering_names(channels: Mapping[str, Channel]) -> set[str]:
    """Names of channels and joints of a log that speak of steering. `channels` by name."""
    names = {*steering_letters(channels)}
    for c in channels.values():
        inner = re.search(r"\[([^\[\]]+)\]$", c.field)
        name = inner[1] if inner and c.topic else c.name
        if is_steering(name):
            names.add(name)
    return names


def _steering_ends(channels: Mapping[str, Channel]) -> set[tuple[str | None, str | None]]:
    """Front or rear, and left or right, of the names that speak of steering."""
    return {(end_of(n), position(n)[1]) for n in steering_names(channels)}


def _steered(channels: Mapping[str, Channel], wheels: Sequence[str]) -> Mapping[str, str]:
    """Steering axle of each steered wheel: its own, where each has an angle, else that of its end of the machine."""
    names = steering_names(channels)
    if rows := rows_of(wheels):
        own = {wheel: own_axle(wheel) for row, wheel in rows.items() if row in {row_of(n) for n in names}}
        ends_of = {min(n for n, _ in rows): "front", max(n for n, _ in rows): "rear"}
        steers = {axle_number(n) for n in names}
        return own or {wheel: ends_of[n] for (n, _), wheel in rows.items() if n in ends_of and n in steers}
    ends = _steering_ends(channels)
    if any(c.type_name.rpartition("/")[2].startswith("AckermannDrive") for c in channels.values()):
        ends.add((None, None))
    own = {w: own_axle(w) for w in wheels if position(w) in ends}
    if own:
        return own
    numbers = {
        found[1] for n in names if (end_of(n), position(n)[1]) == (None, None) and (found := index_of(n)) is not None
    }
    along = {"front" if a is None else a for a, _ in ends} & {"front", "rear"} | (
        {"rear"} if len(numbers) > 1 else set()
    )
    return {w: end for w in wheels if (end := position(w)[0]) in along and end is not None}
