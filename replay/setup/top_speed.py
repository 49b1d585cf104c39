"""Top speed of a machine, as far as a log shows it, and the limits that go with it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from replay.log.raw_log import RawLog
from replay.machine.config import Limits, Machine, haulotte
from replay.machine.quantities import UNITS
from replay.setup.draft_notes import Draft
from replay.setup.motion import held
from replay.signals.mapping import map_signals
from replay.signals.signal import Signal
from replay.signals.to_si import peak_of
from replay.signals.unit_doubts import per_minute

_HEADROOM = 1.2
_LEAST_SPEED = 0.05  # m/s
_ANY_MACHINE, _STANDS_IN = 30.0, 10.0  # m/s; faster than any wheeled machine, and what is written then
_SLOW = 0.2  # m/s; from which top speed on a number too large may be one in mm/s
_WILD = 2.0  # times the usual top speed of a wheel: a sensor that reads so much is no measure


def with_speeds(draft: Draft, machine: Machine, logs: Sequence[RawLog]) -> Machine:
    """The machine with the top speed that the log shows, and the limits that go with it."""
    found = map_signals(logs, machine).items
    measured, commanded = (
        [s for n, s in found.items() if re.fullmatch(rf"wheel\.\w+\.{x}", n)] for x in ("v", "v_ref")
    )
    wheels = [*measured, *commanded]
    reached = max(_fastest(measured), _fastest(commanded), _asked(found, machine))
    top = float(f"{max(_HEADROOM * reached, _LEAST_SPEED):.3g}")
    if reached > _ANY_MACHINE:
        fast = [
            s for s in (*filter(None, [found.get("cmd.v"), found.get("cmd.omega")]), *wheels) if _top(s) > _ANY_MACHINE
        ]
        slow = top * UNITS["mm/s"][1]
        turns = bool(fast) and all(per_minute(s.origin.label) for s in fast)
        by_mm = _SLOW <= slow <= _STANDS_IN and not turns and not any(s.origin.unit for s in fast)
        stands_in = slow if by_mm else _STANDS_IN
        hint = f" (in mm/s it would be {reached * UNITS['mm/s'][1]:.3g} m/s)" if by_mm else ""
        if turns:  # and what they are multiplied by is a guess
            hint += '; their names speak of turns per minute: unit = "rpm", with the size of the wheels in wheel_diameter and gear_ratio'
        named = ", ".join(s.origin.label for s in fast) or "the speeds"
        draft.ask(
            "geometry",
            f"in which unit {'is' if len(fast) == 1 else 'are'} {named}? As they are taken the machine reaches "
            f"{reached:.3g} m/s, as none does{hint}; give it under [signals]. max_speed = {stands_in:g} m/s stands in.",
        )
        return replace(machine, max_speed=stands_in, limits=limits_for(stands_in), assumed=())
    who = "its wheels reach, or are" if len(machine.wheels) > 1 else "it reaches, or is"
    how = (
        f"is a fifth more than the {reached:.3g} m/s that {who} asked for, in this log"
        if _HEADROOM * reached >= _LEAST_SPEED
        else "stands in, for this log shows hardly any motion"
    )
    draft.ask("geometry", f"how fast can it go? max_speed = {top:g} m/s {how}; limits grow and shrink with it.")
    return replace(machine, max_speed=top, limits=limits_for(top), assumed=())


def limits_for(top: float) -> Limits:
    """Limits that grow and shrink with the top speed [m/s], as those of a machine file do that leaves them out."""
    usual, share = Limits(), top / haulotte().max_speed
    return replace(usual, driving_speed=round(usual.driving_speed * share, 9), min_sat=round(usual.min_sat * share, 9))


def _asked(found: Mapping[str, Signal], machine: Machine) -> float:
    """Largest speed that commands of the body ask of one of its wheels [m/s]."""
    v, omega = found.get("cmd.v"), found.get("cmd.omega")
    if v is None:
        return 0.0
    turned = None if omega is None else held(omega, v.stamps)
    places = machine.geometry.wheels.values() if machine.geometry is not None else ()
    sides = {p.y for p in places} if turned is not None else set()
    return max([_top(v), *(peak_of(v.values - y * turned) for y in sides if turned is not None)])


def _fastest(wheels: Sequence[Signal]) -> float:
    """Top speed [m/s] of the fastest one that is not far beyond the middle one: a sensor alone is no measure, it may have been wild."""
    tops = sorted(_top(s) for s in wheels)
    usual = tops[(len(tops) - 1) // 2] if tops else 0.0
    return max((t for t in tops if t <= _WILD * usual), default=usual)


def _top(signal: Signal) -> float:
    return peak_of(signal.values)
