"""Speeds of wheels that state no unit, and steps of encoders: the unit or scale that fits the command, with a question."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from replay.log.source_options import SignalSource
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit
from replay.setup.draft_notes import Draft
from replay.setup.motion import WheelMotion, held, wheel_motion
from replay.setup.structure import Structure
from replay.signals.signal import Signals
from replay.signals.to_si import peak_of
from replay.signals.unit_doubts import per_minute

DIFFERS = 0.15  # share, from which a length is another one
_AGREE = 1.33
WHEEL_SIZES = (0.04, 1.0)  # m; of a radius that explains a speed without a unit
_MILLIMETRE = 1e-3
_TURNS, _LEAST = 0.3, 50  # of the fastest turn, and samples, in which a wheel turns


def agreed(values: Sequence[float]) -> float | None:
    """Median of values that agree within a third, in their unit; None where they do not."""
    if not values or max(values) > _AGREE * min(values):
        return None
    return float(np.median(values))


def unit_of_speeds(
    draft: Draft, structure: Structure, found: Signals, names: Sequence[str], motions: Mapping[str, WheelMotion],
    origins: dict[str, SignalSource],
) -> float | None:  # fmt: skip
    """Give speeds without a unit the one that makes the wheels a usual size, else a scale; return the radius [m], if one fits.

    Parameters
    ----------
    draft : Draft
        Takes the question.
    structure : Structure
        Its wheels.
    found : Signals
        Of the log.
    names : Sequence[str]
        Speeds of wheels that state no unit.
    motions : Mapping[str, WheelMotion]
        How each signal of a wheel follows the command.
    origins : dict[str, SignalSource]
        Of all signals; units and gains are written into it.
    """
    how = "it makes them follow the command"
    gain = agreed([abs(motions[n].gain) for n in names if n in motions]) if set(names) <= set(motions) else None
    asked = found.items.get("cmd.v")
    gain = abs(mean) if gain is None and (mean := by_their_mean(found, names, origins)) is not None else gain
    if gain is None and asked is not None and peak_of(asked.values) > 0:
        gain = float(np.median([peak_of(found.items[n].values) for n in names])) / peak_of(asked.values)
        how = "by the largest commanded and measured speeds"
    labels = ", ".join(origins[n].label for n in names)
    if any(origins[n].derivative for n in names):
        _scale_of_steps(draft, names, labels, origins, gain)
        return None
    if gain is None or gain <= 0:
        draft.ask("signals", f"in which unit are {labels}? None is stated, and m/s is taken.")
        return None
    if abs(gain - 1) <= DIFFERS:
        return None
    if abs(gain * UNITS["mm/s"][1] - 1) <= DIFFERS:
        bodies = _bodies_alike(found, names, origins)
        for n in (*names, *_alike(found, names, origins), *bodies):
            origins[n] = replace(origins[n], unit="mm/s")
        labels = ", ".join((labels, *(origins[n].label for n in bodies)))
        draft.ask("signals", f"are {labels} in mm/s? None is stated; {how}.")
        return None
    turns = all(per_minute(origins[n].label) for n in names)  # n_ist, Drehzahl: hardly anybody counts these in rad/s
    for unit, turn in (("rad/s", 1.0), ("rpm", 2 * math.pi / 60))[1 if turns else 0 :]:
        radius = 1 / (gain * turn)
        if structure.places is not None and WHEEL_SIZES[0] <= radius <= WHEEL_SIZES[1]:
            for n in (*names, *_alike(found, names, origins)):
                origins[n] = replace(origins[n], unit=unit)
            draft.ask("signals", f"are {labels} in {unit}? None is stated; {how} with wheels of {radius:.3g} m radius.")
            return radius
    for n in (*names, *_alike(found, names, origins)):
        scale = float(f"{origins[n].gain / gain:.6g}")
        origins[n] = replace(origins[n], unit="m/s", gain=scale)
    draft.ask("signals", f"what is the scale of {labels}? No unit is stated; {1 / gain:.6g} makes it m/s: {how}.")
    return None


def _scale_of_steps(
    draft: Draft, names: Sequence[str], labels: str, origins: dict[str, SignalSource], gain: float | None
) -> None:
    """Write steps of encoders as metres, by the scale [steps per metre] that makes them follow the command, and ask for it."""
    told = "Nothing in the log tells it, and a millimetre for each stands in"
    if gain is not None and gain > 0:
        told = f"{gain:.6g} to the metre make them follow the command"
    for n in names:
        scale = origins[n].gain / gain if gain else _MILLIMETRE
        origins[n] = replace(origins[n], unit="m", gain=float(f"{scale:.6g}"))
    draft.ask(
        "signals",
        f"how far does the machine go in a step of its encoders ({labels})? {told}: gain = 3.1416 × wheel_diameter / the steps of a turn.",
    )


def _alike(found: Signals, names: Sequence[str], origins: Mapping[str, SignalSource]) -> list[str]:
    """Commanded and second speeds of wheels without a unit, which are as large as the measured ones: they have the same one."""
    out: list[str] = []
    for kind in ("ref", "true"):
        others = [(name, n) for name in names if (n := f"{name}_{kind}") in origins and not origins[n].unit]
        sizes = [peak_of(found.items[n].values) / max(peak_of(found.items[v].values), 1e-9) for v, n in others]
        out += [n for _, n in others] if all(0.4 < size < 2.5 for size in sizes) else []
    return out


def _bodies_alike(found: Signals, names: Sequence[str], origins: Mapping[str, SignalSource]) -> list[str]:
    """Measured speeds of the body without a unit, which are as large as those of the wheels: they have the same one."""
    usual = max(float(np.median([peak_of(found.items[n].values) for n in names])), 1e-9)
    bare = [n for n in ("odom.v", "gnss.speed") if n in found.items and n in origins and not origins[n].unit]
    return [n for n in bare if 0.4 < peak_of(found.items[n].values) / usual < 2.5]


def by_their_mean(found: Signals, names: Sequence[str], origins: Mapping[str, SignalSource]) -> float | None:
    """Recorded unit of the mean of some wheels per commanded m/s, for commands without turns; None where it does not follow them.

    Parameters
    ----------
    found : Signals
        Of the log.
    names : Sequence[str]
        Speeds of the wheels.
    origins : Mapping[str, SignalSource]
        Of all signals; a negative gain is of a wheel that counts backwards.
    """
    asked, first = found.items.get("cmd.v"), found.items[names[0]]
    if asked is None or len(names) < 2:
        return None
    mean = np.mean([np.sign(origins[n].gain) * held(found.items[n], first.stamps) for n in names], axis=0)
    motion = wheel_motion(replace(first, values=mean), asked, None)
    return None if motion is None else motion.gain


def unit_of_commanded_turns(
    draft: Draft, wheels: Sequence[str], found: Signals, origins: dict[str, SignalSource]
) -> None:
    """Give commanded speeds of wheels that state no unit that of the measured turns, where they are as large as these, with a question.

    Parameters
    ----------
    draft : Draft
        Takes the question.
    wheels : Sequence[str]
        The machine's.
    found : Signals
        Of the log, rotations in rad/s, and as recorded what states no unit.
    origins : dict[str, SignalSource]
        Of all signals; units are written into it.
    """
    bare = {n: v for w in wheels if (n := f"wheel.{w}.v_ref") in origins and (v := f"wheel.{w}.v") in origins}
    bare = {
        n: v
        for n, v in bare.items()
        if not origins[n].unit and UNITS.get(known_unit(origins[v].unit) or "", ("",))[0] == "rotation"
    }
    sizes = {n: size for n, v in bare.items() if (size := _size(found, n, v)) is not None}
    if not bare or len(sizes) < len(bare):
        return
    for unit in ("rad/s", "rpm", "deg/s"):
        if all(abs(size * UNITS[unit][1] - 1.0) <= DIFFERS for size in sizes.values()):
            labels = ", ".join(origins[n].label for n in bare)
            draft.ask(
                "signals",
                f"are {labels} in {unit}? None is stated; so they are as large as the measured turns of the wheels.",
            )
            for n in bare:
                origins[n] = replace(origins[n], unit=unit)
            return


def _size(found: Signals, asked: str, measured: str) -> float | None:
    """Commanded speed by the measured one [1], by how they go together while the wheel turns; None where it hardly does."""
    if asked not in found.items or measured not in found.items:
        return None
    y = found.items[measured]
    x, v = held(found.items[asked], y.stamps), np.asarray(y.values, np.float64)
    use = np.isfinite(x) & np.isfinite(v)
    use &= np.abs(v) > _TURNS * float(np.max(np.abs(v[use]), initial=0.0))
    return float(np.median(x[use] / v[use])) if np.count_nonzero(use) >= _LEAST else None


def turns_commanded(origins: Mapping[str, SignalSource], turning: Sequence[str], measured: float) -> str:
    """Unit of the wheels' turns, where the commanded speed states none and is as large as these; else empty.

    Parameters
    ----------
    origins : Mapping[str, SignalSource]
        Of all signals.
    turning : Sequence[str]
        Speeds of wheels that are rotations.
    measured : float
        Radius [m] that would make the command agree with them as a speed.
    """
    units = {known_unit(origins[n].unit) or "" for n in turning}
    if "cmd.v" not in origins or origins["cmd.v"].unit or len(units) != 1:
        return ""
    (unit,) = units
    return unit if unit in UNITS and abs(measured * UNITS[unit][1] - 1) <= DIFFERS else ""
