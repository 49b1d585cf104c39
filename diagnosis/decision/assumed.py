"""Numbers of the paper's machine that were used because no machine file gave this machine's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from diagnosis.results.plain_numbers import plain
from diagnosis.results.sizes import amount
from replay.machine.config import Machine

_WORDS: Mapping[str, Callable[[Machine], str]] = {
    "geometry": lambda m: _geometry(m),
    "gear_ratio": lambda m: f"gear ratio {m.gear_ratio:g}",
    "max_speed": lambda m: (
        f"top speed {m.max_speed:g} {m.speed_unit}, and with it the limits: a {m.part} is driven above "
        f"{plain(m.limits.driving_speed)} {m.speed_unit}"
    ),
    "max_steer": lambda m: f"largest steering angle {amount(m.max_steer, 'rad')}",
    "flow": lambda m: f"pump flow for {m.plant.flow:g} m/s over all wheels",
    "control": lambda m: (
        f"control law MFHCA with ξ = {m.control.xi:g} s⁻¹, β = {m.control.beta:g} s⁻¹, steering gain {m.control.k_ps:g} rad⁻¹"
    ),
}


def assumed_words(machine: Machine) -> list[str]:
    """What of the machine is the paper's, with its figures; empty where the machine file gives all.

    Parameters
    ----------
    machine : Machine
        The machine, with the keys in `assumed` that no file gave.
    """
    absent = {"geometry": machine.geometry is None, "flow": machine.plant.flow is None}
    return [_WORDS[key](machine) for key in machine.assumed if not absent.get(key, False)]


def _geometry(machine: Machine) -> str:
    assert machine.geometry is not None
    wheels = machine.geometry.wheels.values()
    xs, ys = [w.x for w in wheels], [w.y for w in wheels]
    lengths = {
        "wheelbase": max(xs) - min(xs),
        "joint spacing": max(ys) - min(ys),
        "wheel offset": max(abs(w.offset) for w in wheels),
        "wheel diameter": machine.geometry.wheel_diameter,
    }
    return "geometry: " + ", ".join(f"{name} {length:g} m" for name, length in lengths.items())
