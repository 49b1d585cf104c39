"""Read machine files (TOML)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from replay.border import UnforeseenValue, bordered
from replay.errors import ConfigError, check_range
from replay.faults import FaultMode, Side
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.axle_plant import AxlePlant
from replay.machine.config import ASSUMABLE, Control, Limits, Machine, Noise, Plant, WheelPlant, haulotte
from replay.machine.drive_model import drive_from_table
from replay.machine.effort_model import effort_from_table
from replay.machine.geometry import Geometry, WheelGeometry, four_wheel_geometry, own_axle
from replay.machine.quantities import UNITS
from replay.machine.questions import questions_of
from replay.machine.signal_table import check_asked
from replay.machine.units import known_unit, si_factor
from replay.machine.unpowered import unpowered_of
from replay.toml_text import MAX_BYTES, TomlError, parse_toml

_T = TypeVar("_T")
_SECTIONS = {
    "machine", "geometry", "control", "plant", "drive", "effort", "steering", "noise", "limits", "sources", "signals", "advice",
}  # fmt: skip
_HEAD = {"name", "id", "wheels", "unpowered", "drive", "part", "speed_unit"}
_STANDARD = ("wheelbase", "joint_spacing", "wheel_offset")
_LONGEST = 1000
_FASTEST_DRIVING = 2.0  # m/s: the least driving speed is a share of max_speed, but no more than that
_SIDES = tuple(side.value for side in Side)
_MODES = tuple(mode.value for mode in FaultMode)
#: Keys of [geometry] that are the machine's own.
MACHINE_LEVEL = ("gear_ratio", "max_speed", "max_steer")


def load_machine(path: Path) -> Machine:
    """Read a machine file; what it leaves out takes the default of the paper's machine.

    A file that names its own wheels, other than FR, FL, RR, RL, and gives no geometry has none.

    Raises
    ------
    ConfigError
        Where the file cannot be read, is not TOML, or names an unknown key, signal, unit or a value out of range.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
        text = raw.decode()
        data = parse_toml(text)
    except OSError as error:
        raise ConfigError(f"{path}: cannot read the machine file: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start} is not UTF-8; a machine file is TOML text in UTF-8") from error
    except TomlError as error:
        raise ConfigError(f"{path}: {error}") from error
    try:
        with bordered(path, "machine file", UnforeseenValue, "look at the values of that kind in it"):
            return replace(_machine(data), questions=questions_of(text))
    except UnforeseenValue:
        raise
    except ConfigError as error:
        said = str(error)
        raise ConfigError(f"{path}: {said if len(said) <= _LONGEST else said[:_LONGEST] + ' …'}") from error


def _machine(data: Mapping[str, Any]) -> Machine:
    for section, content in data.items():
        if section not in _SECTIONS:
            raise ConfigError(f"[{section}] is not a section; expected {', '.join(sorted(_SECTIONS))}")
        if not isinstance(content, dict):
            raise ConfigError(f"{section} = {content!r} must be a section: write [{section}]")
    base = haulotte()
    head = _known("machine", data.get("machine", {}), _HEAD)
    wheels = head.get("wheels", list(base.wheels))
    if not isinstance(wheels, list) or not all(isinstance(w, str) and w and "." not in w for w in wheels):
        raise ConfigError(f"machine.wheels = {wheels!r} must be a list of names without dots")
    if not wheels:
        raise ConfigError("machine.wheels = [] must name each wheel once, and at least one")
    geo = dict(data.get("geometry", {}))
    top = {key: _number(f"geometry.{key}", geo.pop(key)) for key in MACHINE_LEVEL if key in geo}
    geometry = _geometry(geo, tuple(wheels), base)
    speed = top.get("max_speed", base.max_speed)
    check_range(
        "geometry.max_speed", speed, 1e-6, 1e6, str(head.get("speed_unit", base.speed_unit))
    )  # before limits are made of it
    limits = dict(data.get("limits", {}))
    driving = base.limits.driving_speed * speed / base.max_speed
    if head.get("speed_unit", base.speed_unit) == "m/s":
        driving = min(driving, _FASTEST_DRIVING)  # a car on a yard drives as well
    limits.setdefault("driving_speed", round(driving, 9))
    limits.setdefault("min_sat", round(base.limits.min_sat * speed / base.max_speed, 9))
    axles = () if geometry is None else geometry.axles
    signals = {_of_own_axle(k, axles): _signal(k, v) for k, v in data.get("signals", {}).items()}
    machine = Machine(
        name=str(head.get("name", base.name if set(wheels) == set(base.wheels) else "unnamed machine")),
        id=str(head.get("id", "")),
        wheels=tuple(wheels),
        geometry=geometry,
        gear_ratio=top.get("gear_ratio", base.gear_ratio if "geometry" not in data else 1.0),
        max_speed=speed,
        max_steer=top.get("max_steer", base.max_steer),
        control=_build(Control, "control", data.get("control", {}), {"lambda": "lambda_"}),
        plant=_plant(data.get("plant", {}), tuple(wheels), base.plant.flow if geometry == base.geometry else None),
        noise={k: _build(Noise, f"noise.{k}", v) for k, v in data.get("noise", {}).items()},
        limits=_build(Limits, "limits", limits),
        sources={k: _build(SourceOptions, f"sources.{k}", v) for k, v in data.get("sources", {}).items()},
        signals=signals,
        efforts={k: effort_from_table(f"effort.{k}", v) for k, v in data.get("effort", {}).items()},
        drives={k: drive_from_table(f"drive.{k}", v) for k, v in data.get("drive", {}).items()},
        steering={k: _build(AxlePlant, f"steering.{k}", v) for k, v in data.get("steering", {}).items()},
        drive=head.get("drive", "auto"),
        part=head.get("part", "wheel"),
        speed_unit=_speed_unit(head, signals),
        advice=_advice(data.get("advice", {}), (*wheels, *axles)),
        unpowered=unpowered_of(head.get("unpowered", [])),
    )
    machine = dataclasses.replace(machine, assumed=_assumed(machine, data))
    _check_units(machine)
    return machine


def _check_units(machine: Machine) -> None:
    """Raise where a unit of a signal does not fit it."""
    for name, source in machine.signals.items():
        if source.unit:
            si_factor(
                name,
                source.unit,
                wheel_radius=machine.wheel_radius,
                gear_ratio=machine.gear_ratio,
                at=source.at,
                derivative=source.derivative,
                speed_unit=machine.speed_unit,
            )


def _speed_unit(head: Mapping[str, Any], signals: Mapping[str, SignalSource]) -> Any:
    """Unit of the machine's speeds: as given, of joints by the unit of their signals, else m/s."""
    if "speed_unit" in head or head.get("part", "wheel") != "joint":
        return head.get("speed_unit", "m/s")
    units = [known_unit(s.unit) for name, s in signals.items() if name.startswith("wheel.") and s.unit]
    of_speed = next((u for u in units if u is not None and UNITS[u][0] in ("rotation", "angle", "speed", "length")), "")
    if of_speed in ("deg", "deg/s"):
        return "deg/s"
    return "m/s" if UNITS.get(of_speed, ("rotation", 1.0))[0] in ("speed", "length") else "rad/s"


def _assumed(machine: Machine, data: Mapping[str, Any]) -> tuple[str, ...]:
    """What the file leaves to the paper's machine, of `ASSUMABLE`."""
    places = data.get("geometry", {})
    lengths = {*_STANDARD, "wheel_diameter"} <= set(places) or any(isinstance(v, dict) for v in places.values())
    own_law = machine.control.law == "none"
    left = {
        "geometry": machine.geometry is not None and not lengths,
        "gear_ratio": machine.geometry is not None and "geometry" not in data,
        "max_speed": "max_speed" not in places,
        "max_steer": bool(machine.axles) and "max_steer" not in places,
        "flow": machine.plant.flow is not None and "flow" not in data.get("plant", {}),
        "control": not lengths and not own_law and not {"lambda", "xi", "beta", "k_ps"} & set(data.get("control", {})),
    }
    return tuple(key for key in ASSUMABLE if left[key])


def _geometry(geo: dict[str, Any], wheels: tuple[str, ...], base: Machine) -> Geometry | None:
    assert base.geometry is not None
    usual = set(wheels) == set(base.wheels)  # a machine puts them in its own order
    if not geo:
        return base.geometry if usual else None
    diameter = geo.pop("wheel_diameter", None)
    per_wheel = {k: v for k, v in geo.items() if isinstance(v, dict)}
    if per_wheel:
        unknown = set(geo) - set(per_wheel)
        _known("geometry", dict.fromkeys(sorted(unknown)), {*_STANDARD, *MACHINE_LEVEL, "wheel_diameter"})
        if unknown:
            raise ConfigError(
                f"geometry.{sorted(unknown)[0]} does not go with places per wheel ([geometry.{wheels[0]}])"
            )
        if diameter is None:
            raise ConfigError("geometry.wheel_diameter [m] is missing")
        return Geometry(
            {w: _place(w, v, wheels) for w, v in per_wheel.items()}, _number("geometry.wheel_diameter", diameter)
        )
    _known("geometry", geo, set(_STANDARD))
    if set(geo) - {"wheel_offset"} == set() and diameter is not None and not usual:
        raise ConfigError(
            "geometry gives a wheel_diameter but no places; add x, y, offset and steer per wheel, e.g. "
            f"[geometry.{wheels[0]}]"
        )
    if not usual:
        raise ConfigError(
            f"geometry.wheelbase and joint_spacing fit the wheels {list(base.wheels)}; this machine has "
            f"{list(wheels)}: give x, y, offset and steer per wheel, e.g. [geometry.{wheels[0]}]"
        )
    values = {"wheelbase": 2.1, "joint_spacing": 1.46, "wheel_offset": 0.20, "wheel_diameter": 0.854}
    given = geo if diameter is None else {**geo, "wheel_diameter": diameter}
    values.update({k: _number(f"geometry.{k}", v) for k, v in given.items()})
    return four_wheel_geometry(
        values["wheelbase"], values["joint_spacing"], values["wheel_diameter"], values["wheel_offset"]
    )


def _place(wheel: str, value: Mapping[str, Any], wheels: tuple[str, ...]) -> WheelGeometry:
    section = f"geometry.{wheel}"
    if wheel not in wheels:
        raise ConfigError(f"[{section}]: no wheel {wheel!r}; machine.wheels has {list(wheels)}")
    _known(section, value, {"x", "y", "offset", "steer"})
    missing = {"x", "y"} - set(value)
    if missing:
        raise ConfigError(f"[{section}]: {sorted(missing)[0]} [m] is missing")
    steer = value.get("steer", "fixed")
    if steer not in ("front", "rear", "own", "fixed"):
        raise ConfigError(f"{section}.steer = {steer!r} is not known; expected front, rear, own or fixed")
    return WheelGeometry(
        x=_number(f"{section}.x", value["x"]),
        y=_number(f"{section}.y", value["y"]),
        offset=_number(f"{section}.offset", value.get("offset", 0.0)),
        axle=own_axle(wheel) if steer == "own" else steer,
    )


def _advice(value: Mapping[str, Any], parts: Sequence[str]) -> dict[str, str]:
    """The operator's instructions, with keys such as ``wheel.sensor.stuck`` or ``FR.actuator``."""
    for key, words in value.items():
        who, *rest = key.split(".")
        side, mode = (*rest, "", "")[:2]
        if (
            who not in (*parts, "wheel", "steer")
            or side not in _SIDES
            or len(rest) > 2
            or (mode and mode not in _MODES)
        ):
            raise ConfigError(
                f'[advice] {key!r} is not known; expected "PART.SIDE" or "PART.SIDE.MODE" with PART wheel, steer or one of '
                f"{', '.join(parts)}, SIDE one of {', '.join(_SIDES)} and MODE one of {', '.join(_MODES)}"
            )
        if not isinstance(words, str) or not words.strip() or len(words) > _LONGEST:
            raise ConfigError(f"[advice] {key!r} must be text of 1 to {_LONGEST} characters")
    return dict(value)


def _plant(value: Mapping[str, Any], wheels: tuple[str, ...], default_flow: float | None) -> Plant:
    _known("plant", value, {"coupling", "flow", *wheels})
    flow = _number("plant.flow", value["flow"]) if "flow" in value else default_flow
    models = {w: _build(WheelPlant, f"plant.{w}", value[w]) for w in wheels if w in value}
    return Plant(coupling=value.get("coupling", "auto"), flow=flow, wheels=models)


def _of_own_axle(name: str, axles: Sequence[str]) -> str:
    """Name of a signal whose axle may be called by the wheel that it steers: ``steer.FR.phi`` is ``steer.FR_steer.phi``."""
    group, part, leaf = (*name.split("."), "", "")[:3]
    own = group == "steer" and part not in axles and own_axle(part) in axles
    return f"steer.{own_axle(part)}.{leaf}" if own else name


def _signal(name: str, value: Any) -> SignalSource:
    section = f'signals."{name}"'
    if not isinstance(value, dict):
        raise ConfigError(
            f'{section} must be a table such as {{ topic = "/cmd_vel", field = "linear.x", unit = "m/s" }}'
        )
    source: SignalSource = _build(SignalSource, section, value)
    ways = [source.topic is not None, source.symbol is not None, source.column is not None]
    if sum(ways) != 1 or (source.topic is None) != (source.field is None):
        raise ConfigError(f"{section} needs exactly one of topic with field, symbol, or column")
    if source.at not in ("motor", "wheel"):
        raise ConfigError(f"{section}: at = {source.at!r} is not known; expected motor or wheel")
    if source.on_change:
        check_asked(name)
    return source


def _known(section: str, value: Any, keys: set[str]) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ConfigError(f"{section} must be a section: write [{section}]")
    for key in value:
        if key not in keys:
            raise ConfigError(f"{section}.{key} is not a known key; expected {', '.join(sorted(keys))}")
    return value


def _number(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ConfigError(f"{key} = {value!r} must be a finite number")
    return float(value)


def _build(kind: type[_T], section: str, value: Any, rename: Mapping[str, str] | None = None) -> _T:
    """Make a dataclass from a TOML table, checking names and types of its fields."""
    rename = rename or {}
    fields = {f.name: f for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
    shown = {name: next((k for k, v in rename.items() if v == name), name) for name in fields}
    table = _known(section, value, set(shown.values()))
    out: dict[str, Any] = {}
    for name, item in ((rename.get(k, k), v) for k, v in table.items()):
        kind_text = str(fields[name].type)
        key = f"{section}.{shown[name]}"
        if kind_text.startswith("tuple[float"):
            if not isinstance(item, list):
                raise ConfigError(f"{key} = {item!r} must be a list of numbers")
            out[name] = tuple(_number(key, x) for x in item)
        elif "float" in kind_text:
            out[name] = _number(key, item)
        elif kind_text == "bool":
            if not isinstance(item, bool):
                raise ConfigError(f"{key} = {item!r} must be true or false")
            out[name] = item
        else:
            if not isinstance(item, str):
                raise ConfigError(f"{key} = {item!r} must be text")
            out[name] = item
    needed = (f.name for f in fields.values() if f.default is f.default_factory is dataclasses.MISSING)
    for name in needed:
        if name not in out:
            raise ConfigError(f"{section}.{shown[name]} is missing; give it, or leave [{section}] out")
    return kind(**out)
