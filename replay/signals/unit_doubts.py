"""Values that a machine cannot have: doubts about their units in figures, and the line of the machine file that mends them.

A unit that is wrong shows in most samples of every signal that was recorded with it; a faulty sensor shows in one channel,
for a time. Only the former is a question that must be answered before a mission is judged.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.errors import ConfigError
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.quantities import SI_UNITS
from replay.machine.signal_table import quantity_of
from replay.machine.toml_text import signal_line
from replay.machine.units import known_unit
from replay.signals.signal import Signal, quantity_kind
from replay.signals.to_si import factor_of, magnitudes, peak_of

_TOO_FAST = 3.0
_WIDE = 1.5
_ABSURD = 1e4  # times max_speed, which no wrong unit that is known makes
_WILD = 3.0  # times the usual one of the signals recorded alike
_MOST_VOLTS = 10.5  # what an analogue signal of 10 V may reach
_CURRENT = (3.5, 21.0)  # mA; what a signal of 4 to 20 mA keeps between
_MOST_OF_IT = 0.2  # of the samples other than zero lie beyond the limit: no spikes
_ANY_MACHINE = 30.0  # m/s; faster than any machine whose top speed was not given
_SOUND = 2  # other signals of the kind, recorded in the same unit, that are plausible: then it is a fault of this one
_ONE_VALUE = 0.95  # of the samples: a dead reading
_TURN = 3.1  # rad; a machine file can give no larger limit of steering
_ROTATIONS, _TURNING = ("rad/s", "rpm", "deg/s"), ("rad/s", "rpm", "deg/s", "rev/s")
_ANGLES, _LENGTHS = ("rad", "deg"), ("m", "mm")  # of positions, whose slopes are speeds
_LINEAR = re.compile(r"(^|\.)linear\.[xyz]$")  # of a Twist, which is in m/s by definition
_JOINT = re.compile(r"(^|\.)velocit\w*\[")  # of a JointState, which is no speed over ground
_PER_MINUTE = re.compile(
    r"drehzahl|rpm|umdr|u_?min|tr_?min|(?<![a-z])n_?(soll|ist|set|act|ref|cmd)(?![a-z])", re.IGNORECASE
)  # of a name: turns per minute
_SPEED_UNITS = ("m/s", "km/h", "mm/s", "cm/s")


@dataclass(frozen=True)
class Doubt:
    """One signal whose values do not fit the machine.

    Attributes
    ----------
    signal : str
        Canonical name.
    text : str
        What it reaches, with its unit, and what that is compared with.
    line : str
        Line of [signals], or key of [geometry], that would make it fit; empty where none is known.
    impossible : bool
        Whether most of its values cannot be.
    """

    signal: str
    text: str
    line: str = ""
    impossible: bool = False

    @property
    def question(self) -> str:
        """The sentence that asks for the answer."""
        answer = f". If so, write: {self.line}" if self.line else "; give its unit, gain or source in [signals]"
        return f"{self.text}{answer}"


def per_minute(name: str) -> bool:
    """Whether the name of a speed speaks of turns per minute."""
    return _PER_MINUTE.search(name) is not None


def _mostly_beyond(values: NDArray[Any], limit: float) -> bool:
    """Whether many of the samples other than zero lie beyond a limit."""
    moving = magnitudes(values)
    moving = moving[moving > 0]
    return bool(len(moving) and np.count_nonzero(moving > limit) >= _MOST_OF_IT * len(moving))


def doubt(
    signal: str, values: NDArray[np.float64], origin: SignalSource, machine: Machine, fastest: float = 0.0
) -> Doubt | None:
    """Return what is wrong with a signal that is too large for the machine; None where nothing is.

    Parameters
    ----------
    signal : str
        Canonical name.
    values : NDArray[np.float64], shape (n,)
        SI values.
    origin : SignalSource
        How it was recorded, with the unit that was used.
    machine : Machine
        Its limits.
    fastest : float
        What the fastest of the speeds reaches that were recorded as this one [m/s]: they have one unit. 0: this one's.
    """
    quantity, peak = quantity_of(signal), peak_of(values)
    if quantity == "speed" and not signal.startswith("gnss") and peak > _TOO_FAST * machine.max_speed:
        return _too_fast(signal, values, fastest or peak, origin, machine)
    if quantity == "fraction" and not signal.endswith(".psi") and peak > _WIDE * machine.control.u_max:
        return _too_open(signal, values, peak, origin, machine)
    if quantity == "angle" and signal.startswith("steer.") and peak > 2 * max(machine.max_steer, 0.1):
        return _too_far(signal, values, peak, origin, machine)
    return None


def agreed(doubts: Sequence[Doubt], items: Mapping[str, Signal], machine: Machine) -> list[Doubt]:
    """The doubts, those of speeds that were recorded alike with one answer for all of them: that of the fastest, which has to fit.

    A reading that is several times as large as those of most others is wild, and is no measure of their unit.

    Parameters
    ----------
    doubts : Sequence[Doubt]
        Of all signals of a mission, each by itself.
    items : Mapping[str, Signal]
        The signals by name.
    machine : Machine
        Its limits.
    """
    alike: dict[tuple[str, bool, str, float], list[str]] = {}
    for d in doubts:
        if quantity_of(d.signal) == "speed":
            alike.setdefault(_recorded(items[d.signal]), []).append(d.signal)
    fastest: dict[str, float] = {}
    for names in alike.values():
        peaks = sorted(peak_of(items[n].values) for n in names)
        usual = peaks[(len(peaks) - 1) // 2]
        fastest |= dict.fromkeys(names, max(p for p in peaks if p <= _WILD * usual))
    out = []
    for d in doubts:
        s = items[d.signal]
        same = doubt(d.signal, s.values, s.origin, machine, fastest[d.signal]) if d.signal in fastest else None
        out.append(d if same is None else replace(d, line=same.line))
    return out


def _recorded(signal: Signal) -> tuple[str, bool, str, float]:
    """What speeds have in common that have one unit; a Twist is in m/s by definition."""
    origin = signal.origin
    unit = known_unit(origin.unit) or ("twist" if _LINEAR.search(origin.field or "") else "")
    return unit, origin.derivative, origin.at, abs(origin.gain)


def _too_fast(signal: str, values: NDArray[np.float64], peak: float, origin: SignalSource, machine: Machine) -> Doubt:
    top, times = machine.max_speed, peak / machine.max_speed
    shown = machine.speed_unit if signal.startswith("wheel.") else SI_UNITS["speed"]
    unit = origin.unit or shown
    text = f"{signal} reaches {peak:.3g} {shown} with unit {unit!r}, {times:.1f} times max_speed {top:g} {shown}"
    limit = _ANY_MACHINE if "max_speed" in machine.assumed else 0.0
    impossible = peak > limit and _mostly_beyond(values, max(top, limit))
    gear = machine.gear_ratio
    turns = known_unit(origin.unit) in _ROTATIONS
    if turns and signal.startswith("wheel.") and origin.at == "wheel" and gear > 1 and times / gear <= _WIDE:
        motor = signal_line(signal, replace(origin, at="motor"))
        text += f'; it is probably measured at the motor (gear ratio {gear:g}): set at = "motor"'
        return Doubt(signal, text, motor, impossible)
    if turns and origin.at == "motor" and gear == 1.0:
        text += "; it is measured at the motor, and gear_ratio is 1: give turns of the motor per turn of the wheel"
        return Doubt(signal, text, f"[geometry] gear_ratio = {times:.2g} or so", impossible)
    fitting = _fitting_speed(signal, peak, origin, machine) if impossible else ""
    if times > _ABSURD and not fitting:
        many = f"{peak:.0e}".replace("e+0", "e").replace("e+", "e")
        return Doubt(
            signal,
            f"{signal} reaches {many} {shown}, which nothing does: it is damaged, no speed, or has another unit or gain",
            "",
            impossible,
        )
    other = f", or [geometry] max_speed = {_rounded_up(peak)} if the machine is that fast"
    line = f"{fitting}{other}" if fitting else f"[geometry] max_speed = {_rounded_up(peak)}"
    other_file = _LINEAR.search(origin.field or "") is not None
    check = "a Twist is in m/s: is this the machine file of another machine?" if other_file else "check its unit"
    return Doubt(signal, f"{text}; {check}", line, impossible)


def _fitting_speed(signal: str, peak: float, origin: SignalSource, machine: Machine) -> str:
    """Line of the signal with the unit with which it just fits the machine's top speed; empty where none does."""
    if _LINEAR.search(origin.field or ""):
        return ""
    recorded = peak / abs(factor_of(signal, origin, machine))
    rotations, lengths = (_ANGLES, _LENGTHS) if origin.derivative else (_ROTATIONS, _SPEED_UNITS)
    turns = [replace(origin, unit=unit, at="wheel") for unit in rotations]
    if machine.gear_ratio > 1:
        turns += [replace(origin, unit=unit, at="motor") for unit in rotations]
    speeds = [replace(origin, unit=unit, at="wheel") for unit in lengths]
    rotation = known_unit(origin.unit) in (*_TURNING, *_ANGLES)
    joint = _JOINT.search(origin.field or "") is not None
    ways_to_try = (turns,) if joint else (turns, speeds) if rotation else (speeds + turns,)
    named = per_minute(origin.label)
    if named and machine.wheel_radius is None:
        return f"{signal_line(signal, replace(origin, unit='rpm'))} with [geometry] wheel_diameter"
    if named:
        ways_to_try = ([tried for tried in turns if tried.unit == "rpm"], *ways_to_try)
    for k, ways in enumerate(ways_to_try):
        # what its name says may be slow: neither top speed nor wheel size need be known yet
        least = 0.0 if named and k == 0 else 0.1 * machine.max_speed
        reached: list[tuple[float, str]] = []
        for tried in ways:
            try:
                speed = recorded * abs(factor_of(signal, tried, machine))
            except ConfigError:
                continue
            if least < speed <= _WIDE * machine.max_speed:
                reached.append((speed, signal_line(signal, tried)))
        if reached:  # the one that is nearest to the top speed, by its factor
            return min(reached, key=lambda r: abs(np.log(r[0] / machine.max_speed)))[1]
    return ""


def _too_open(signal: str, values: NDArray[np.float64], peak: float, origin: SignalSource, machine: Machine) -> Doubt:
    unit = origin.unit or SI_UNITS["fraction"]
    if _is_current(values / factor_of(signal, origin, machine)):
        ways = (("12 mA close it", 0.125, -1.5), ("4 mA close it", 0.0625, -0.25))
        lines = (
            f"where {what} {signal_line(signal, replace(origin, unit='1', gain=g, offset=b))}" for what, g, b in ways
        )
        said = f"{signal} reaches {peak:.3g} of full opening with unit {unit!r}; it is probably a current of 4 to 20 mA; check its unit"
        return Doubt(signal, said, ", or ".join(lines), _mostly_beyond(values, machine.control.u_max))
    percent = _WIDE < peak <= 150
    volts = percent and peak <= _MOST_VOLTS  # nothing tells them from %
    probably = "; it is in % or in volts" if volts else "; it is probably %" if percent else ""
    text = f"{signal} reaches {peak:.3g} of full opening with unit {unit!r}{probably}"
    tried = replace(origin, unit="%") if percent else replace(origin, gain=float(f"{origin.gain / peak:.3g}"))
    other = f", or where 10 V open it fully {signal_line(signal, replace(origin, unit='1', gain=0.1))}" if volts else ""
    line = f"{signal_line(signal, tried)}{other}"
    return Doubt(signal, f"{text}; check its unit", line, _mostly_beyond(values, machine.control.u_max))


def _is_current(recorded: NDArray[np.float64]) -> bool:
    """Whether values as recorded keep between 4 and 20."""
    known = recorded[np.isfinite(recorded)]
    if not known.size:
        return False
    low, high = np.quantile(known, [0.01, 0.99])
    return bool(_CURRENT[0] <= low and high <= _CURRENT[1])


def _too_far(signal: str, values: NDArray[np.float64], peak: float, origin: SignalSource, machine: Machine) -> Doubt:
    unit = origin.unit or SI_UNITS["angle"]
    degrees = peak * np.pi / 180 <= _WIDE * machine.max_steer
    text = f"{signal} reaches {peak:.3g} rad with unit {unit!r}, max_steer is {machine.max_steer:.3g} rad"
    impossible = peak > _TURN and machine.max_steer < _TURN and _mostly_beyond(values, max(machine.max_steer, 0.1))
    line = (
        signal_line(signal, replace(origin, unit="deg")) if degrees else f"[geometry] max_steer = {min(peak, 3.2):.3g}"
    )
    return Doubt(signal, f"{text}{'; it is probably deg' if degrees else ''}", line, impossible)


def _rounded_up(value: float) -> str:
    """Two digits, not less than the value."""
    digits = 10.0 ** (np.floor(np.log10(value)) - 1)
    return f"{np.ceil(value / digits) * digits:g}"


def questions(doubts: Sequence[Doubt], items: Mapping[str, Signal]) -> tuple[str, ...]:
    """Sentences on values that cannot be and that no faulty sensor explains.

    Parameters
    ----------
    doubts : Sequence[Doubt]
        Of all signals of a mission.
    items : Mapping[str, Signal]
        The signals by name.
    """
    doubted = {d.signal for d in doubts}
    out = []
    for d in doubts:
        sound = [
            n
            for n, s in items.items()
            if n not in doubted and _alike(n, d.signal) and s.origin.unit == items[d.signal].origin.unit
        ]
        if d.impossible and len(sound) < _SOUND and not (sound and _runs_away(d.signal, items)):
            out.append(d.question)
    return tuple(out)


def _runs_away(signal: str, items: Mapping[str, Signal]) -> bool:
    """Whether a joint turns too fast while its speed reads one value all through: its loop drives it blindly, and its unit is that of the others."""
    kind, wheel, leaf = (*signal.split("."), "", "")[:3]
    speed = items.get(f"{kind}.{wheel}.v") if kind == "wheel" and leaf == "v_position" else None
    if speed is None:
        return False
    known = speed.values[np.isfinite(speed.values)]
    return bool(known.size and np.mean(known == np.median(known)) > _ONE_VALUE)


def _alike(a: str, b: str) -> bool:
    return quantity_kind(a) == quantity_kind(b)
