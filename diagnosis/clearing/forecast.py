"""What a log's signals can tell of each part, before anything is judged, and which signal would tell more."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import Side
from replay.machine.config import Machine

_OTHERS = 2
_DOUBTED = "not judged before the unit of the {valve} openings is certain"
_ASKED = "steer.*.phi_ref or steer.*.u"


@dataclass(frozen=True)
class Forecast:
    """What can be told of one side of parts whose signals are the same.

    Attributes
    ----------
    components : tuple[str, ...]
        Wheels or axles.
    kind : Kind
        What they are.
    side : Side
        Which side.
    told : bool
        Whether a fault of it is told from one of the other side.
    words : str
        What shows, and what does not.
    log : tuple[str, ...]
        Signals that would tell more, ``*`` for a wheel or an axle.
    """

    components: tuple[str, ...]
    kind: Kind
    side: Side
    told: bool
    words: str
    log: tuple[str, ...]


def forecast(
    logged: Collection[str], machine: Machine, words: MachineWords, *, doubted: bool = False
) -> tuple[Forecast, ...]:
    """What the signals `logged` can tell of the machine's parts, parts with the same signals together.

    Parameters
    ----------
    logged : Collection[str]
        Names of the signals that were found.
    machine : Machine
        The machine.
    words : MachineWords
        How to speak of it.
    doubted : bool
        Whether the unit of all valves' openings is in doubt, so that none of them is looked at.
    """
    opened = {n for n in logged if n.rpartition(".")[2] in ("u", "u_applied")} if doubted else set[str]()
    logged = [n for n in logged if n not in opened]
    every = sum(f"wheel.{w}.v" in logged for w in machine.wheels)
    driven = sum(f"wheel.{w}.v" in logged for w in machine.driven)
    commanded = "cmd.v" in logged or any(f"wheel.{w}.v_ref" in logged for w in machine.wheels)
    groups: dict[tuple[Kind, Side, bool, str, tuple[str, ...]], list[str]] = {}
    for kind, prefix, names in ((Kind.WHEEL, "wheel", machine.wheels), (Kind.STEER, "steer", machine.axles)):
        for name in names:
            has = {signal.rpartition(".")[2] for signal in logged if signal.startswith(f"{prefix}.{name}.")}
            if kind is Kind.WHEEL and name in machine.unpowered:
                free = _free_sensor(has, every, commanded)
                groups.setdefault((kind, Side.SENSOR, *free), []).append(name)
                continue
            if kind is Kind.WHEEL:
                sides = _wheel_sensor(has, driven, words, commanded), _wheel_drive(has, driven, words, commanded)
            else:
                told_where = "phi_ref" in has or {"cmd.v", "cmd.omega"} <= set(logged)
                bare = machine.control.law == "none" and not has & {"u", "u_applied"}
                sides = (
                    _angle_sensor(has, "imu.yaw_rate" in logged, words, told_where),
                    _steering_drive(has, words, told_where),
                )
                if (
                    bare and told_where and {"phi"} <= has and "phi_true" not in has
                ):  # nothing says what opens the {valve}
                    sides = _bare(has, "imu.yaw_rate" in logged)
            if any(n.startswith(f"{prefix}.{name}.") for n in opened):
                sides = sides[0], (False, _DOUBTED, ())
            for side, (told, text, more) in zip((Side.SENSOR, Side.ACTUATOR), sides, strict=True):
                lacking = tuple(signal for signal in more if "*" not in signal or signal.rpartition(".")[2] not in has)
                groups.setdefault((kind, side, told, text, lacking), []).append(name)
    return tuple(
        Forecast(tuple(who), kind, side, told, words.fill(text), more)
        for (kind, side, told, text, more), who in groups.items()
    )


#: Whether a side is told from the other one, what shows, and what to log.
_Told = tuple[bool, str, tuple[str, ...]]


def _wheel_sensor(has: set[str], speeds: int, words: MachineWords, commanded: bool) -> _Told:
    more: tuple[str, ...] = ("wheel.*.v_true",)
    if "v" not in has:
        return False, "not judged: no speed is logged", ("wheel.*.v",)
    if "v_true" in has:
        return True, "told while the machine moves, against its second measurement", ()
    if not has & {"u", "u_applied"}:
        if speeds == 1 and not commanded:
            return False, "only a speed that is frozen, wild or noisy shows: no command is logged", ("cmd.v", *more)
        if words.drive == "valve":
            more = ("wheel.*.u", *more)
        if not commanded:
            return False, "what departs from the other {wheels} shows: no command is logged", ("cmd.v", *more)
        return (
            False,
            "what departs from the commanded speed or from the other {wheels} shows, a standstill as a fault of either side",
            more,
        )
    if speeds <= _OTHERS:
        return False, "too few {wheels} to compare with: a loss that lasts the whole mission does not show", more
    return (
        False,
        "a loss shows beside the other {wheels}, mostly as one of sensor or {valve}, and not where it is all {wheels}'",
        more,
    )


def _free_sensor(has: set[str], speeds: int, commanded: bool) -> _Told:
    """The only side of a wheel without a drive."""
    if "v" not in has:
        return False, "not judged: no speed is logged", ("wheel.*.v",)
    if "v_true" in has:
        return True, "told while the machine moves, against its second measurement; it has no drive", ()
    more = ("wheel.*.v_true",)
    if not commanded:
        shown = (
            "what departs from the other {wheels} shows"
            if speeds > 1
            else "only one that is frozen, wild or noisy shows"
        )
        return False, f"{shown}: no command is logged; it has no drive", ("cmd.v", *more)
    return True, "told where it departs from the commanded speed or from the other {wheels}; it has no drive", more


def _wheel_drive(has: set[str], speeds: int, words: MachineWords, commanded: bool) -> _Told:
    more = ("wheel.*.u_applied",)
    if "u" not in has and words.drive != "valve":
        if "effort" in has:
            return False, "whether it is weak is not judged: what effort is healthy is not known", ()
        if not commanded:
            return False, "not judged: no command is logged", ("cmd.v", "wheel.*.effort")
        return False, "only a standstill under command shows; whether it is weak is not judged", ("wheel.*.effort",)
    if "u" not in has:
        return False, "not judged: no {valve} command is logged", ("wheel.*.u", *more)
    if "u_applied" in has:
        return True, "told while it is opened, by its measured opening", ()
    if "v" not in has:
        return False, "not judged: no speed and no opening is logged", ("wheel.*.v", *more)
    if speeds <= _OTHERS:
        return False, "too few {wheels} to compare with: a loss that lasts the whole mission does not show", more
    return (
        False,
        "a loss shows beside the other {wheels}, mostly as one of sensor or {valve}, and not where it is all {wheels}'",
        more,
    )


def _angle_sensor(has: set[str], yaw: bool, words: MachineWords, commanded: bool) -> _Told:
    if "phi" not in has:
        return False, "not judged: no angle is logged", ("steer.*.phi",)
    if "phi_true" in has:
        return True, "told while the axle is steered, against its second measurement; an offset at any time", ()
    more: tuple[str, ...] = ("steer.*.phi_true",) if yaw else ("steer.*.phi_true or imu.yaw_rate",)
    if not has & {"u", "u_applied"}:
        if not commanded:
            return False, "not judged: neither a commanded angle nor a {valve} command is logged", (_ASKED, *more)
        more = ("steer.*.u", *more)
    offset = "an offset shows by the yaw rate" if yaw else "an offset does not show"
    return False, f"shows while the axle is steered, mostly as one of sensor or {words.drive}; {offset}", more


def _bare(has: set[str], yaw: bool) -> tuple[_Told, _Told]:
    """Sensor and drive of an axle whose loop is another controller's, with an angle and a command alone."""
    if "phi_ref" not in has:
        both = "not judged: neither a commanded angle nor a {valve} command of it is logged"
        return (False, both, (_ASKED,)), (False, both, (_ASKED,))
    offset = "an offset shows by the yaw rate" if yaw else "an offset does not show"
    more: tuple[str, ...] = ("steer.*.u",) if yaw else ("steer.*.u", "imu.yaw_rate")
    stays = "only one that stays while its commanded angle goes elsewhere shows"
    return (False, f"{stays}; {offset}", more), (False, stays, ("steer.*.u",))


def _steering_drive(has: set[str], words: MachineWords, commanded: bool) -> _Told:
    more = ("steer.*.u_applied",)
    if "u" not in has and (not commanded or "phi" not in has or "u_applied" in has):
        asked = _ASKED if "phi" in has and "u_applied" not in has else "steer.*.u"
        return False, "not judged: no {valve} command is logged", (asked, *more)
    if "u" not in has:
        return False, "shows while the axle is steered, mostly as one of sensor or {valve}", ("steer.*.u", *more)
    if "u_applied" in has:
        return True, "told while the axle is steered, by its measured opening", ()
    if "phi" not in has:
        return False, "not judged: no angle and no opening is logged", ("steer.*.phi", *more)
    return False, "shows while the axle is steered, mostly as one of sensor or {valve}", more
