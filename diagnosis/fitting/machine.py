"""Fitted constants put into a machine, each with where it comes from or why it is not known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite

from diagnosis.fitting.control import ControlFit
from diagnosis.fitting.geometry import offset_pattern
from diagnosis.fitting.noise import NoiseFit
from diagnosis.fitting.robust import Estimate
from diagnosis.fitting.wheels import WheelFit
from diagnosis.wheels.plant_constants import PlantFit
from replay.machine.config import Law, Machine, Noise, PsiMode, WheelPlant
from replay.machine.drive_model import DriveModel


@dataclass(frozen=True)
class Constant:
    """One constant of the machine file.

    Attributes
    ----------
    key : str
        Its place in the machine file, ``plant.FR.K``.
    value, std : float or None
        What the missions say, and its standard deviation; None where they do not.
    unit : str
        Unit.
    before : float or None
        Value of the given machine.
    windows, missions : int
        What stands behind it; 0 windows where it does not come from windows.
    written : bool
        Whether it is in the new machine.
    why : str
        Why it is not written or how it is to be read.
    """

    key: str
    value: float | None
    std: float | None
    unit: str
    before: float | None
    windows: int
    missions: int
    written: bool
    why: str = ""


def _constant(
    key: str, e: Estimate, unit: str, before: float | None, windows: int, missions: int, *, written: bool, why: str = ""
) -> Constant:
    value = e.value if isfinite(e.value) else None
    std = e.std if isfinite(e.std) else None
    return Constant(key, value, std, unit, before, windows, missions, written and value is not None, why or e.why)


def with_offset(machine: Machine, d: Estimate, blocks: int, missions: int, constants: list[Constant]) -> Machine:
    """Put the wheel offset into the geometry."""
    geometry = machine.geometry
    before = None if geometry is None else max(abs(w.offset) for w in geometry.wheels.values())
    constants.append(_constant("geometry.offset", d, "m", before, blocks, missions, written=True))
    if geometry is None or not isfinite(d.value):
        return machine
    places = {
        n: replace(w, offset=float(s * d.value))
        for (n, w), s in zip(geometry.wheels.items(), offset_pattern(machine), strict=True)
    }
    return replace(machine, geometry=replace(geometry, wheels=places))


_UNSURE_LAMBDA = 0.5  # standard deviation of λ̂, as a share, from which it is not written

_LAWS: dict[str, Law] = {"signed": "signed", "opposed": "opposed", "printed": "printed", "sign_abs": "sign_abs"}
_PSI: dict[str, PsiMode] = {"printed": "printed", "forced": "forced"}


def with_control(out: Machine, machine: Machine, fit: ControlFit, doubt: bool, constants: list[Constant]) -> Machine:
    """Put law, λ, ζ into the control section; a law that is none of MFHCA's as ``none``."""
    before, count = machine.control, len(fit.missions)
    if fit.pi is not None:
        out = replace(out, control=replace(before, law="none"))
    sure = not fit.law or not fit.lambda_.std > _UNSURE_LAMBDA * abs(fit.lambda_.value)
    held = not doubt and sure and bool(fit.law)
    why = "far from the machine file's, see the unit errors" if doubt else "" if sure else "too uncertain"
    steady = isfinite(fit.psi0.value) and fit.psi0.std < 0.1 * fit.psi0.value
    psi0_why = (
        "" if steady or not isfinite(fit.psi0.value) else "differs between wheels and missions: left to be fitted"
    )
    constants += [
        _constant("control.lambda", fit.lambda_, "s/m", before.lambda_, 0, count, written=held, why=why),
        _constant("control.zeta", fit.zeta, "s/m²", before.zeta, 0, count, written=held),
        _constant("control.psi0", fit.psi0, "", before.psi0, 0, count, written=held and steady, why=psi0_why),
    ]
    if not held:
        return out
    control = replace(before, law=_LAWS[fit.law], psi=_PSI[fit.psi], lambda_=fit.lambda_.value)
    if isfinite(fit.zeta.value):
        control = replace(control, zeta=fit.zeta.value)
    if steady:
        control = replace(control, psi0=fit.psi0.value)
    return replace(out, control=control)


_LEFT_OUT = "the wheel is left out"  # which says why, once

_PLANT = (("K", "m/s per full opening"), ("tau", "s"), ("dead", "of full opening"), ("offset", "m/s"), ("load", "m/s"))


_MAP = (("hysteresis", "of full opening"), ("grip", ""), ("wander", "m/s/√s"))
_NO_MAP = "the wheels' speeds and openings do not show the map of the valve"


def with_plants(
    out: Machine,
    machine: Machine,
    fits: list[WheelFit | None],
    maps: PlantFit | None,
    spoiled: list[str],
    constants: list[Constant],
) -> Machine:
    """Put the wheels' constants into the plant section; the map of a valve stands beside its linear model."""
    wheels = dict(machine.plant.wheels)
    mapped = maps.plants if maps is not None else (None,) * len(machine.wheels)
    for w, fit, mapped_fit, error in zip(machine.wheels, fits, mapped, spoiled, strict=True):
        if w in machine.unpowered:
            continue
        before = wheels.get(w)
        found = None if fit is not None and fit.refused else mapped_fit  # its windows contradict each other
        for name, unit in _PLANT:
            e = Estimate(float("nan"), float("nan"), f"{error} has a wrong unit or sign" if error else "not logged")
            if fit is not None:
                e = Estimate(float("nan"), float("nan"), _LEFT_OUT) if fit.refused else getattr(fit, name)
            old = None if before is None else getattr(before, name)
            if name == "tau" and isfinite(e.value) and not isfinite(e.std):
                e = Estimate(float("nan"), e.std, f"{e.why}; {e.value if old is None else old:g} s is assumed")
            used, count = (0, 0) if fit is None else (fit.used, len(fit.missions))
            constants.append(_constant(f"plant.{w}.{name}", e, unit, old, used, count, written=True))
        if fit is not None and not fit.refused:
            tau, tau_std = fit.tau.value, _known(fit.tau.std)
            if tau_std is None and before is not None:
                tau, tau_std = before.tau, before.tau_std
            wheels[w] = WheelPlant(
                K=fit.K.value,
                tau=tau,
                load=_known(fit.load.value),
                K_std=_known(fit.K.std),
                tau_std=tau_std,
                load_std=_known(fit.load.std),
                dead=fit.dead.value,
                dead_std=_known(fit.dead.std),
                offset=fit.offset.value,
                offset_std=_known(fit.offset.std),
            )
        if found is not None:
            wheels[w] = _mapped(wheels.get(w), found)
        for name, unit in _MAP:
            e = Estimate(float("nan"), float("nan"), _NO_MAP)
            if found is not None:
                e = Estimate(float(getattr(found, name)), float("nan"))
            old = None if before is None else getattr(before, name)
            windows = 0 if maps is None else maps.windows
            constants.append(_constant(f"plant.{w}.{name}", e, unit, old, windows, 0, written=True))
    return replace(out, plant=replace(machine.plant, wheels=wheels))


def _mapped(linear: WheelPlant | None, found: WheelPlant) -> WheelPlant:
    """A wheel with the map of its valve; lag and load go with the map, gain and dead zone stay those of the linear fit."""
    if linear is None:
        return found
    return replace(
        found, K=linear.K, K_std=linear.K_std, tau_std=linear.tau_std, dead=linear.dead, dead_std=linear.dead_std
    )


def _known(x: float) -> float | None:
    return float(x) if isfinite(x) else None


_ECHO = (
    ("gains", "m/s per unit of effort"),
    ("memory_s", "s"),
    ("setpoint", "of the command"),
    ("noise", "m/s"),
)
_EFFORT = (
    ("offset", "unit of effort"),
    ("slope", "unit of effort per m/s"),
    ("between", "unit of effort"),
    ("drift", "unit of effort per √s"),
    ("noise", "unit of effort"),
)
_NO_ECHO = "command and effort do not show which speed the controller received"
_NO_EFFORT = "three missions are needed in which the drive is driven for five seconds"


def with_drives(
    machine: Machine,
    drives: Mapping[str, DriveModel],
    spoiled: Mapping[str, str],
    missions: Mapping[str, int],
    constants: list[Constant],
) -> Machine:
    """Put the models of single drives into the drive section; what was not found stays as it was.

    Parameters
    ----------
    machine : Machine
        What they are put into.
    drives : Mapping[str, DriveModel]
        By wheel, as found.
    spoiled : Mapping[str, str]
        By wheel: a signal with a wrong unit that its model would rest on, else empty.
    missions : Mapping[str, int]
        By wheel: missions that log its speed, command and effort.
    constants : list[Constant]
        Takes the constants.
    """
    out = dict(machine.drives)
    for wheel, count in missions.items():
        found = DriveModel() if spoiled[wheel] else drives.get(wheel, DriveModel())
        before = out.get(wheel, DriveModel())
        wrong = f"{spoiled[wheel]} has a wrong unit or sign" if spoiled[wheel] else "" if count else "not logged"
        for part, fields, why in (("echo", _ECHO, _NO_ECHO), ("effort", _EFFORT, _NO_EFFORT)):
            new, old = getattr(found, part), getattr(before, part)
            for name, unit in fields:
                remark = ("the largest of them" if name == "gains" else "") if new is not None else wrong or why
                e = Estimate(_first(new, name), _std(new, name), remark)
                was = _known(_first(old, name))
                key = f"drive.{wheel}.{part}.{name}"
                constants.append(_constant(key, e, unit, was, 0, count, written=True))
        kept = DriveModel(echo=found.echo or before.echo, effort=found.effort or before.effort)
        if kept != DriveModel():
            out[wheel] = kept
    return replace(machine, drives=out)


def _first(part: object, name: str) -> float:
    """A field of a drive's model, of gains the largest; NaN where there is no model."""
    value = getattr(part, name, float("nan"))
    return float(max(value, key=abs) if isinstance(value, tuple) else value)


def _std(part: object, name: str) -> float:
    return float(getattr(part, "memory_std_s", float("nan"))) if name == "memory_s" else float("nan")


def with_noise(out: Machine, fits: dict[str, NoiseFit], bad: set[str], constants: list[Constant]) -> Machine:
    """Put the channels' noise into the noise section."""
    noise = dict(out.noise)
    for name, fit in fits.items():
        before = noise.get(name, Noise())
        why = "its unit or sign is wrong" if name in bad else ""
        held = name not in bad
        constants.append(
            _constant(f"noise.{name}.std", fit.std, "SI", before.std, 0, fit.missions, written=held, why=why)
        )
        constants.append(
            _constant(f"noise.{name}.lsb", fit.lsb, "SI", before.lsb, 0, fit.missions, written=held, why=why)
        )
        if held:
            lsb = _known(fit.lsb.value)
            noise[name] = Noise(std=_known(fit.std.value) or before.std, lsb=before.lsb if lsb is None else lsb)
    return replace(out, noise=noise)
