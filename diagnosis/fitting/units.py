"""Unit errors in logged signals, by name: what was read against what it should be, and which line of [signals] mends it.

A closed loop holds measured speed near its command, a steering cylinder its angle; the command of a wheel follows from
that of the body by L1 (1), L2 (2). A ratio far from 1 that a known mistake explains is that mistake; nothing is
scaled away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, pi

import numpy as np

from diagnosis.fitting.ratios import Ratios, measure
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

_NEAR = (0.7, 1.35)
_TRACKING = 0.93  # a healthy loop stays a little behind its command
_SPREAD = log(1.35)
_MOST_GAIN = 60.0


@dataclass(frozen=True)
class UnitError:
    """A wrong unit or sign.

    Attributes
    ----------
    signals : tuple[str, ...]
        Signals that are off; constants that rest on them are not written.
    factor : float
        What was read over what it should be.
    text : str
        What is off and what to change.
    """

    signals: tuple[str, ...]
    factor: float
    text: str


def speed_mistakes(machine: Machine) -> dict[str, tuple[float, str]]:
    """Known mistakes with a wheel's speed: name → factor on the speed read, and what to write."""
    gear = machine.gear_ratio
    out = {
        "rpm read as rad/s": (60 / (2 * pi), 'unit = "rpm"'),
        "rad/s read as rpm": (2 * pi / 60, 'unit = "rad/s"'),
        "deg/s read as rad/s": (180 / pi, 'unit = "deg/s"'),
        "rad/s read as deg/s": (pi / 180, 'unit = "rad/s"'),
        "km/h read as m/s": (3.6, 'unit = "km/h"'),
        "m/s read as km/h": (1 / 3.6, 'unit = "m/s"'),
        "mm/s read as m/s": (1e3, 'unit = "mm/s"'),
        "m/s read as mm/s": (1e-3, 'unit = "m/s"'),
    }
    if abs(log(gear)) > _SPREAD:
        out[f"the motor's speed read as the wheel's (gear ratio {gear:g})"] = (gear, 'at = "motor"')
        out[f"the wheel's speed read as the motor's (gear ratio {gear:g})"] = (1 / gear, 'at = "wheel"')
    r = machine.wheel_radius
    if r is not None and abs(log(r)) > _SPREAD:
        out[f"rad/s of the wheel read as m/s (wheel radius {r:g} m)"] = (1 / r, 'unit = "rad/s"')
        out[f"m/s read as rad/s of the wheel (wheel radius {r:g} m)"] = (r, 'unit = "m/s"')
        out["rpm of the wheel read as m/s"] = (60 / (2 * pi * r), 'unit = "rpm"')
        if abs(log(gear)) > _SPREAD:
            out["rad/s of the motor read as m/s"] = (gear / r, 'unit = "rad/s", at = "motor"')
            out["m/s read as rad/s of the motor"] = (r / gear, 'unit = "m/s"')
            out["rpm of the motor read as m/s"] = (60 * gear / (2 * pi * r), 'unit = "rpm", at = "motor"')
    return out


_ANGLES = {"degrees read as rad": (180 / pi, 'unit = "deg"'), "rad read as degrees": (pi / 180, 'unit = "rad"')}


def _named(factor: float, known: dict[str, tuple[float, str]], usual: float) -> tuple[str, str] | None:
    """Nearest known mistake and its remedy; None where none is near."""
    size = log(abs(factor) / usual)
    near = sorted(known, key=lambda name: abs(size - log(known[name][0])))
    best = near[0]
    if abs(size - log(known[best][0])) > _SPREAD:
        return None
    also = [n for n in near[1:3] if abs(size - log(known[n][0])) < abs(size - log(known[best][0])) + 0.1]
    more = f", or {also[0]} ({known[also[0]][1]})" if also else ""
    return best, f"{known[best][1]}{more}"


def find_unit_errors(
    timelines: Sequence[Timeline], replays: Sequence[Replay], machine: Machine
) -> tuple[UnitError, ...]:
    """Name the unit and sign errors that the missions show.

    Parameters
    ----------
    timelines, replays : Sequence
        The aligned missions and their replayed loops.
    machine : Machine
        Geometry, gear, limits.
    """
    x = measure(timelines, replays, machine)
    commands = _command_errors(x, machine)
    bad = {s for e in commands for s in e.signals}
    out = list(commands)
    out += _speed_errors(x, machine, bad)
    out += _angle_errors(x, machine, bad)
    out += _effort_errors(x, machine, bad | {s for e in out for s in e.signals})
    return tuple(_joined(out))


def _off(ratio: float) -> bool:
    return not _NEAR[0] <= ratio <= _NEAR[1]


def _said(name: str, ratio: float, what: str, known: dict[str, tuple[float, str]], usual: float) -> UnitError:
    if ratio < 0 and not _off(-ratio):
        text = f"{name}, against {what}: sign flipped; set gain = -1 in [signals]"
        return UnitError((name,), -1.0, text)
    sign = ", with flipped sign (gain = -1)" if ratio < 0 else ""
    guess = _named(ratio, known, usual) if ratio else None
    if guess is None:
        text = (
            f"{name}, {ratio:.3g} times {what}: no known unit explains it; check its unit, gain and place in [signals]"
        )
    else:
        text = f"{name}, {ratio:.3g} times {what}: {guess[0]}{sign}; set {guess[1]} in [signals]"
    return UnitError((name,), ratio, text)


def _command_errors(x: Ratios, machine: Machine) -> list[UnitError]:
    """Logged commands of wheels and axles against those that the body's command gives."""
    out = []
    speeds = speed_mistakes(machine)
    wrong = [n for n, q in x.command.items() if n.startswith("wheel.") and _off(q)]
    body = x.top.get("cmd.v", 0.0) > 1.5 * machine.max_speed
    if wrong and body and len(wrong) > len(machine.wheels) / 2:
        q = 1.0 / float(np.median([x.command[n] for n in wrong]))
        return [_said("cmd.v", q, "the value from the wheels' commands", speeds, 1.0)]
    for name, q in x.command.items():
        if _off(q):
            known = speeds if name.startswith("wheel.") else _ANGLES
            out.append(_said(name, q, "the value from the body's command by L1, L2", known, 1.0))
    return out


def _speed_errors(x: Ratios, machine: Machine, bad: set[str]) -> list[UnitError]:
    """Measured speeds against the wheel's command."""
    out = []
    known = speed_mistakes(machine)
    checked = any(n.startswith("wheel.") for n in x.command)
    for name, ratio in x.speed.items():
        reference = name.rpartition(".")[0] + ".v_ref"
        q = x.command.get(reference, 1.0)
        seen = ratio * q if reference in bad else ratio  # against the command that the body's gives
        if _off(seen):
            above = x.top.get(name, 0.0) > 1.3 * machine.max_speed
            command_above = x.top.get(reference, 0.0) > 1.3 * machine.max_speed
            if not checked and command_above and not above:
                out.append(_said(reference, 1 / seen, "the measured speed", known, 1 / _TRACKING))
            else:
                out.append(_said(name, seen, "its command", known, _TRACKING))
        elif not checked and x.top.get(name, 0.0) > 1.5 * machine.max_speed:
            both = tuple(n for n in (name, reference) if n in x.top)
            out.append(_too_fast(both, x.top[name], x.gain, machine, known))
    return out


def _too_fast(
    both: tuple[str, ...], top: float, gain: float, machine: Machine, known: dict[str, tuple[float, str]]
) -> UnitError:
    """Speed and command alike beyond what the machine can drive; λ̂, which falls as they grow, tells the unit."""
    factor = machine.control.lambda_ / gain
    guess = _named(factor, known, 1.0) if np.isfinite(factor) and _off(factor) else None
    told = "λ̂ differs by the same factor"
    if guess is None:
        fits = [n for n, (f, _) in known.items() if 0.5 * machine.max_speed < top / f < 1.1 * machine.max_speed]
        guess = (" or ".join(fits), " or ".join(known[n][1] for n in fits)) if fits else None
        told = "by the top speed alone"
    head = f"{' and '.join(both)}, up to {top:.3g} m/s or {top / machine.max_speed:.3g} times the machine's top speed"
    if guess is None:
        return UnitError(
            both, top / machine.max_speed, f"{head}: check unit and at in [signals], or geometry.max_speed"
        )
    return UnitError(both, top / machine.max_speed, f"{head}: {guess[0]} ({told}); set {guess[1]} in [signals]")


def _angle_errors(x: Ratios, machine: Machine, bad: set[str]) -> list[UnitError]:
    """Steering angles against their commands, and against what an axle can reach."""
    out = []
    for name, ratio in x.angle.items():
        reference = name.rpartition(".")[0] + ".phi_ref"
        seen = ratio * x.command.get(reference, 1.0) if reference in bad else ratio
        if _off(seen):
            out.append(_said(name, seen, "its command", _ANGLES, 1.0))
        elif x.top.get(name, 0.0) > max(1.7, 1.5 * machine.max_steer):
            text = f'{name}, up to {x.top[name]:.3g} rad: degrees read as rad; set unit = "deg" in [signals]'
            out.append(UnitError((name,), 180 / pi, text))
    for name in (n for n in x.top if n.startswith("steer.") and ".phi" in n and n not in x.angle):
        if not name.endswith("_ref") and x.top[name] > max(1.7, 1.5 * machine.max_steer):
            text = f'{name}, up to {x.top[name]:.3g} rad: degrees read as rad; set unit = "deg" in [signals]'
            out.append(UnitError((name,), 180 / pi, text))
    return out


def _effort_errors(x: Ratios, machine: Machine, bad: set[str]) -> list[UnitError]:
    """Openings against their limit, their sign, and the speed that full opening would give."""
    out = []
    limit = machine.control.u_max
    for name, ratio in x.effort.items():
        wheel = name.rpartition(".")[0]
        top = x.top.get(name, 0.0)
        spoiled = {f"{wheel}.v", f"{wheel}.v_ref"} & bad
        sensible = 1 / ratio if ratio else float("inf")  # m/s per opening
        if top > 1.5 * limit:
            percent = 'percent read as a fraction; set unit = "%"' if top <= 130 * limit else "raw counts; set a gain"
            text = f"{name}, up to {top:.3g} of full opening with control.u_max = {limit:g}: {percent} in [signals]"
            out.append(UnitError((name,), 100.0 if top <= 130 * limit else top, text))
        elif spoiled:
            continue
        elif ratio < 0:
            text = f"{name}, negative where its wheel drives forward: sign flipped; set gain = -1 in [signals]"
            out.append(UnitError((name,), -1.0, text))
        elif sensible * limit > _MOST_GAIN * machine.max_speed:
            text = (
                f"{name}, of which full opening would give {sensible * limit:.3g} m/s or "
                f"{sensible * limit / machine.max_speed:.3g} times the machine's top speed: a fraction read as percent; "
                'set unit = "fraction" in [signals]'
            )
            out.append(UnitError((name,), 0.01, text))
    return out


def _joined(errors: list[UnitError]) -> list[UnitError]:
    """One sentence for the same mistake in several signals."""
    groups: dict[str, list[UnitError]] = {}
    for e in errors:
        tail = e.text.rpartition(": ")[2]
        leaf = e.signals[0].rpartition(".")[2]
        groups.setdefault(f"{leaf} {tail}", []).append(e)
    out = []
    for same in groups.values():
        first = same[0]
        if len(same) == 1:
            out.append(first)
            continue
        names = tuple(dict.fromkeys(s for e in same for s in e.signals))
        factor = float(np.median([e.factor for e in same]))
        out.append(UnitError(names, factor, ", ".join(names) + first.text[len(" and ".join(first.signals)) :]))
    return out
