"""Words that fit the machine: what moves it, what moves, and in which unit.

The tool judges hydraulic machines on wheels as well as electric robots and arms. Whatever speaks of a valve, a wheel or a
unit of speed to a reader asks this table, which is made from the machine file and the log's signals and stands in
``machine.words`` of `report.json`, so that pages made from a saved result say the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from diagnosis.results.plain_numbers import plain
from diagnosis.results.vocabulary import Kind, Tier
from diagnosis.results.words_row import Worded, WordsRow
from replay.faults import Side
from replay.machine.config import Machine
from replay.machine.quantities import OPENING
from replay.machine.signal_table import find_signal

#: What moves a part: a valve, a motor, or a drive of which nothing says which of the two.
Mover = Literal["valve", "motor", "drive"]

# What a percentage of a command is a percentage of, by what moves the part.
_PERCENT = {"valve": " % of opening", "motor": " % of full command", "drive": " % of full command"}
_SHARE = {"valve": OPENING, "motor": "of full command", "drive": "of full command"}
_COMMAND = re.compile(r"wheel\.[^.]+\.(u|u_applied|pressure_a|pressure_b)|steer\.[^.]+\.(u|u_applied)")
_MOTORS = re.compile(r"duty|pwm|torque|drehmoment|couple|inverter|umrichter|(?<!hydro)(?<!hydro_)motor|servo|vesc")
_VALVES = re.compile(r"valve|ventil|vanne|spool|schieber|tiroir|pump|swash|hydr|oil|(^|_)press")
_EFFORT = re.compile(r"wheel\.[^.]+\.effort")


@dataclass(frozen=True)
class MachineWords:
    """How to speak of a machine's parts and speeds.

    Attributes
    ----------
    drive : str
        What moves a part: ``valve``, ``motor``, or ``drive`` where that is not known.
    part : str
        What is moved: ``wheel`` or ``joint``.
    speed_unit : str
        Unit of the parts' speeds: ``m/s``, ``rad/s`` or ``deg/s``.
    """

    drive: Mover = "valve"
    part: Literal["wheel", "joint"] = "wheel"
    speed_unit: str = "m/s"

    def part_name(self, kind: str, side: str) -> str:
        """Words for the part of a component on one side: ``drive valve``; words of other tools' documents stay."""
        names = self._steering if kind == Kind.STEER else self._driven if kind == Kind.WHEEL else {}
        return names.get(side, side.replace("_", " "))

    def part_words(self, kind: str, component: str, side: str) -> str:
        """A component and its part in words: ``FR speed sensor``, ``front steering valve``, ``m5 joint motor``."""
        return f"{component.removesuffix('_steer')} {self.part_name(kind, side)}"

    @property
    def _driven(self) -> Mapping[str, str]:
        if self.part == "joint":
            sensor, actuator = "joint sensor", f"joint {self.drive}"
        else:
            sensor, actuator = "speed sensor", "drive" if self.drive == "drive" else f"drive {self.drive}"
        either = self.drive if self.part == "joint" else actuator
        return {Side.SENSOR: sensor, Side.ACTUATOR: actuator, Side.SENSOR_OR_ACTUATOR: f"{sensor} or {either}"}

    @property
    def _steering(self) -> Mapping[str, str]:
        return {
            Side.SENSOR: "steering sensor",
            Side.ACTUATOR: f"steering {self.drive}",
            Side.SENSOR_OR_ACTUATOR: f"steering sensor or {self.drive}",
        }

    @property
    def parts(self) -> str:
        """What is moved, of several: ``wheels``."""
        return f"{self.part}s"

    @property
    def moving(self) -> str:
        """What a machine does while it can be judged: wheels drive, joints move."""
        return "driving" if self.part == "wheel" else "motion"

    @property
    def parts_moved(self) -> str:
        """What somebody moves to have parts judged, to follow *move*: ``the machine``, or ``the joints``."""
        return "the machine" if self.part == "wheel" else "the joints"

    @property
    def while_moving(self) -> str:
        """The same, to follow *while*."""
        return "driving" if self.part == "wheel" else "moving"

    def listed(self, kind: str, parts: Sequence[tuple[str, str]]) -> str:
        """Several parts of one kind, components with the same sides together: ``FR and FL speed sensor; RL drive valve``."""
        sides: dict[str, list[str]] = {}
        for component, side in parts:
            sides.setdefault(component, []).append(side)
        alike: dict[tuple[str, ...], list[str]] = {}
        for component, own in sides.items():
            alike.setdefault(tuple(own), []).append(component)
        out = []
        for own_sides, components in alike.items():
            who = ", ".join(components[:-1]) + (" and " if len(components) > 1 else "") + components[-1]
            out.append(f"{who} {' and '.join(self.part_name(kind, side) for side in own_sides)}")
        return "; ".join(out)

    @property
    def percent(self) -> str:
        """Unit of a command in percent, to follow a number: `` % of opening``."""
        return _PERCENT[self.drive]

    @property
    def position(self) -> str:
        """What the drive does, measured a second time: a valve's position, what else carries out its command."""
        return "valve position" if self.drive == "valve" else f"{self.drive}'s output"

    def unit(self, unit: str) -> str:
        """A unit of a signal or limit as the machine has it: wheel speeds in its own unit, commands as a share."""
        return {"m/s": self.speed_unit, "m/s²": f"{self.speed_unit}²", OPENING: _SHARE[self.drive]}.get(unit, unit)

    def unit_of(self, signal: str) -> str:
        """Unit of a canonical signal, to follow a number; empty for what is not one."""
        entry = find_signal(signal)
        if entry is None:
            return ""
        return entry.shown_unit if entry.group in ("cmd", "gnss") else self.unit(entry.shown_unit)

    def amount(self, value: float, unit: str = "m/s", digits: int = 3) -> str:
        """A value with its unit, to follow a verb: ``0.31 m/s``, ``2.1 % of opening``.

        The value is in `unit`, openings as fractions [1].
        """
        if unit == OPENING:
            return f"{plain(100 * value, digits)}{self.percent}"
        if unit in ("rad", "rad/s") and unit != self.speed_unit:
            return f"{plain(math.degrees(value), digits)}°{unit.removeprefix('rad')}"
        return f"{plain(value, digits)} {self.unit(unit)}".rstrip()

    def fill(self, text: str) -> str:
        """A sentence of the tool's own with words in braces, such as ``{wheel}`` and ``{valve}``, filled in."""
        for key, word in (
            ("{wheel}", self.part),
            ("{wheels}", self.parts),
            ("{valve}", self.drive),
            ("{or_size}", "another wheel diameter, or " if self.part == "wheel" else "or "),
            ("{or_view}", "another wheel of its side, a gyro or " if self.part == "wheel" else ""),
            ("{moving}", self.moving),
            ("{position}", self.position),
            ("{percent}", self.percent),
            ("{unit_command}", "opening" if self.drive == "valve" else "command"),
            ("{speed_unit}", self.speed_unit),
        ):
            text = text.replace(key, word)
        for kind in Kind:
            for side in Side:
                text = text.replace(part_token(kind, side), self.part_name(kind, side))
        return text

    def evidence(self, tier: Tier, kind: Kind, second_of: Side | None = None) -> str:
        """Name of a tier's evidence: ``wheel model``; empty where there is none.

        `second_of`: the side of which its model took in a second measurement.
        """
        return self.fill(tier.name_of(kind) if second_of is None else tier.with_second(kind, second_of))

    def decided(self, tier: Tier, kind: Kind, side: Side, *, twice: bool = False) -> str:
        """How a fault was decided; empty where nothing says so; `twice`: by a model that took in a second measurement."""
        return self.fill(tier.decided(kind, side, twice=twice))

    def row(self) -> WordsRow:
        """The same for ``report.json``."""
        return {"drive": self.drive, "part": self.part, "speed_unit": self.speed_unit}


#: Words of a hydraulic machine on wheels, for which the tool was made; also those of results that do not say theirs.
HYDRAULIC = MachineWords()
#: Words that fit any machine on wheels.
ANY_DRIVE = MachineWords(drive="drive")


def part_token(kind: Kind, side: str) -> str:
    """Stands for a part's name in a text for `MachineWords.fill`: ``{wheel.actuator}``."""
    return f"{{{kind}.{side}}}"


def machine_words(machine: Machine, logged: Collection[str] = ()) -> MachineWords:
    """Words for a machine: as its file says, else by the signals that its log holds.

    Parameters
    ----------
    machine : Machine
        The machine.
    logged : Collection[str]
        Names of the signals that were found. Openings, pressures and valve maps are those of valves; an effort (torque, current,
        duty) is that of a motor.
    """
    return MachineWords(_drive(machine, logged), machine.part, machine.speed_unit)


def _named_mover(machine: Machine, group: str) -> Mover:
    """What the names of a machine's commands say of what they move: of ``wheel`` or ``steer``."""
    said = " ".join(
        s.label.lower() for n, s in machine.signals.items() if n.startswith(f"{group}.") and _COMMAND.fullmatch(n)
    )
    motor, valve = _MOTORS.search(said) is not None, _VALVES.search(said) is not None
    return "drive" if motor is valve else "motor" if motor else "valve"


def _drive(machine: Machine, logged: Collection[str]) -> Mover:
    if machine.drive != "auto":
        return machine.drive
    if machine.drives or machine.efforts:  # what effort a speed takes
        return "motor"
    wheels, axles = (_named_mover(machine, group) for group in ("wheel", "steer"))
    if wheels == "motor":  # a steering of which nothing says what moves it has one word with them: neither
        steered = any(name.startswith("steer.") and _COMMAND.fullmatch(name) for name in logged) or bool(
            machine.steering
        )
        return "motor" if axles == "motor" or not steered else "drive"
    efforts = any(_EFFORT.fullmatch(name) for name in logged)
    opened = {name.partition(".")[0] for name in logged if _COMMAND.fullmatch(name)}
    if efforts and not machine.plant.wheels and "wheel" not in opened and ("steer" in opened or machine.steering):
        return "drive"  # motors at the wheels, valves at the axles: one word for both
    if opened or machine.plant.wheels or machine.steering:
        return "valve"
    return "motor" if efforts else "drive"


def words_of(machine: Worded) -> MachineWords:
    """Words of a saved result's machine; those of a hydraulic one on wheels where it has none, as older results were worded."""
    row = machine.get("words")
    if row is None:
        return HYDRAULIC
    return MachineWords(row["drive"], row["part"], row["speed_unit"])
