"""Machine constants from healthy missions: noise, wheels, wheel offset, control law; unit errors by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.drives.inputs import drive_data
from diagnosis.fitting.control import ControlFit, fit_control, lambda_doubt
from diagnosis.fitting.drives import fit_drives
from diagnosis.fitting.efforts import fit_efforts, with_efforts
from diagnosis.fitting.geometry import fit_offset
from diagnosis.fitting.machine import Constant, with_control, with_drives, with_noise, with_offset, with_plants
from diagnosis.fitting.noise import fit_noise
from diagnosis.fitting.plants import fit_plants
from diagnosis.fitting.steering import fit_steering, with_steering
from diagnosis.fitting.units import UnitError, find_unit_errors, speed_mistakes
from diagnosis.fitting.valve_maps import fit_maps
from diagnosis.fitting.wheels import WheelFit
from diagnosis.fitting.windows import WheelRecord
from replay.control.loop import Replay, replay_loop
from replay.errors import NotJudged
from replay.machine.config import Machine
from replay.mission import Mission
from replay.progress import Progress, Stage, Subscriber, silent
from replay.signals.timeline import Timeline

_LEAST_SECONDS = 10.0


@dataclass(frozen=True)
class FitResult:
    """What the missions say of the machine.

    Attributes
    ----------
    machine : Machine
        The given machine with the constants that were found.
    constants : tuple[Constant, ...]
        All constants that were looked for, in the order of the machine file.
    unit_errors : tuple[UnitError, ...]
        Wrong units and signs; constants that rest on these signals are not written.
    left_out : tuple[str, ...]
        Missions, wheels and windows that disagree with the others, one sentence each.
    notes : tuple[str, ...]
        What else is to be known.
    missions : tuple[str, ...]
        Names of the missions.
    seconds, driving : float
        Their length together, and the part in which a wheel is commanded to move [s].
    """

    machine: Machine
    constants: tuple[Constant, ...]
    unit_errors: tuple[UnitError, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    missions: tuple[str, ...]
    seconds: float
    driving: float


def fit_missions(missions: Sequence[Mission], machine: Machine, *, progress: Subscriber = silent) -> FitResult:
    """Estimate a machine's constants from its healthy missions.

    Parameters
    ----------
    missions : Sequence[Mission]
        Missions of one machine, read with `machine`.
    machine : Machine
        Where its signals are, its geometry, limits and law; what is found replaces its constants.
    progress : Subscriber
        Called at the beginning of each stage.

    Returns
    -------
    FitResult
        The constants with their standard deviations; the machine with those that hold.

    Raises
    ------
    NotJudged
        Where no mission is given, or together they hold too little driving.
    """
    names = tuple(m.files[0].path.name if m.files else f"mission {k}" for k, m in enumerate(missions, 1))
    timelines = [m.timeline for m in missions]
    replays: list[Replay] = []
    for name, timeline in zip(names, timelines, strict=True):
        progress(Progress(Stage.REPLAYING_MISSION, name))
        replays.append(_slim(replay_loop(timeline, machine)))
    seconds = sum(t.size * t.dt for t in timelines)
    records = [_records(t, r, machine) for t, r in zip(timelines, replays, strict=True)]
    driving = sum(_driving(wheels) for wheels in records)
    progress(Progress(Stage.CHECKING_UNITS))
    errors = list(find_unit_errors(timelines, replays, machine))
    progress(Progress(Stage.FITTING_LAW))
    control, doubt = _law(timelines, replays, machine, errors)
    bad = {s for e in errors for s in e.signals}
    efforts = fit_efforts(timelines, machine, replays)
    if not errors and not efforts and not any(f"wheel.{w}.u" in t.signals for t in timelines for w in machine.wheels):
        raise NotJudged(
            f"{', '.join(names) or 'no mission'}: no command of a valve or drive (wheel.*.u: opening, duty, torque) is logged beside "
            "the speeds, and what `mfhca fit` finds is how speeds answer it; machines that follow commanded speeds are diagnosed without it"
        )
    if driving < _LEAST_SECONDS and not errors and not efforts:
        raise NotJudged(
            f"{', '.join(names) or 'no mission'}: {driving:.1f} s in which a wheel is commanded to move, {_LEAST_SECONDS:g} s "
            "are needed; give missions that drive"
        )
    progress(Progress(Stage.FITTING_WHEELS))
    spoiled = [_spoiled(w, timelines, bad) for w in machine.wheels]
    usable = [[None if s else r for r, s in zip(wheels, spoiled, strict=True)] for wheels in records]
    plants = fit_plants(usable, machine.plant.flow) if usable else []
    maps = fit_maps(timelines, replays, machine, spoiled)
    progress(Progress(Stage.FITTING_GEOMETRY))
    offset, blocks, turned = fit_offset(timelines, machine, bad)
    constants: list[Constant] = []
    out = with_offset(machine, offset, blocks, len(turned), constants)
    out = with_control(out, machine, control, bool(doubt), constants)
    out = with_plants(out, machine, plants, maps, spoiled, constants)
    if len(machine.wheels) == 1 or machine.geometry is None:
        progress(Progress(Stage.FITTING_DRIVES))
        out = _with_drives(out, machine, list(zip(timelines, replays, strict=True)), spoiled, constants)
    out = with_efforts(out, machine, efforts, constants)
    out = with_steering(out, machine, fit_steering(timelines, machine, bad), len(timelines), constants)
    out = with_noise(out, fit_noise(timelines, machine), bad, constants)
    return FitResult(
        machine=out,
        constants=tuple(constants),
        unit_errors=tuple(errors),
        left_out=(*_left_plants(plants, machine, names), *_left_laws(control, names)),
        notes=_law_notes(control),
        missions=names,
        seconds=seconds,
        driving=driving,
    )


def _law(
    timelines: Sequence[Timeline], replays: Sequence[Replay], machine: Machine, errors: list[UnitError]
) -> tuple[ControlFit, str]:
    """The control law and why its λ̂ is in doubt (empty where not); a doubted one adds the unit error behind it."""
    control = fit_control(timelines, replays, machine, {s for e in errors for s in e.signals})
    doubt, leaves = lambda_doubt(control, machine, speed_mistakes(machine))
    if doubt:
        suspects = tuple(f"wheel.{w}.{leaf}" for leaf in leaves for w in machine.wheels)
        errors.append(UnitError(suspects, control.lambda_.value / machine.control.lambda_, doubt))
    return control, doubt


def _with_drives(
    out: Machine,
    machine: Machine,
    missions: Sequence[tuple[Timeline, Replay]],
    spoiled: Sequence[str],
    constants: list[Constant],
) -> Machine:
    """The machine with the models of its single drives."""
    logged = {
        w: sum(drive_data(t, r.v_ref[:, i], machine, w) is not None for t, r in missions)
        for i, w in enumerate(machine.wheels)
    }
    spoiled_by = dict(zip(machine.wheels, spoiled, strict=True))
    return with_drives(out, fit_drives(missions, machine), spoiled_by, logged, constants)


def _left_laws(control: ControlFit, names: tuple[str, ...]) -> list[str]:
    return [f"{names[m]}: the control law fits it badly or unlike the others" for m in control.left_missions]


def _law_notes(control: ControlFit) -> tuple[str, ...]:
    """What the control law explains, where one was found."""
    n = len(control.missions)
    if control.pi is not None:
        pi, (ff, kp, ki) = control.pi, control.pi.spread
        return (
            f"The controller is none of MFHCA's: proportional and integral with feed-forward, {pi.text} (± {ff:.2g}, {kp:.2g}, "
            f"{ki:.2g}), explains at least {100 * pi.explained:.1f} % of the command within a second of {n} "
            f'mission{"" if n == 1 else "s"}. control.law = "none" is written: there is no Ψ̂ to replay.',
        )
    if not control.law:
        return ()
    return (
        f"Control law {control.law}, Ψ̂ {control.psi}, explains at least {100 * control.explained:.1f} % of the command "
        f"of {n} mission{'' if n == 1 else 's'}; λ̂ from increments {control.increments.value:.4g} ± "
        f"{control.increments.std:.2g} s/m ({control.increments.why}).",
    )


def _slim(replay: Replay) -> Replay:
    """Keep commands, angles and fits; the rest of a replay is large."""
    none = np.empty((0, replay.v_ref.shape[1]))
    return replace(
        replay,
        rho=none,
        psi_printed=none,
        psi_implied=none,
        implied_squared=none,
        forcing=none,
        psi=none,
        u=none,
        u_difference=none,
        steer_u=none,
        steer_difference=none,
    )


def _channels(wheel: str, timeline: Timeline) -> tuple[str | None, str | None]:
    """Best measured speed and opening of a wheel that a mission logs."""
    found = []
    for leaves in (("v_true", "v"), ("u_applied", "u")):
        logged = (f"wheel.{wheel}.{leaf}" for leaf in leaves)
        found.append(next((n for n in logged if (x := timeline.get(n)) is not None and np.isfinite(x).any()), None))
    return found[0], found[1]


def _records(timeline: Timeline, replay: Replay, machine: Machine) -> list[WheelRecord | None]:
    out: list[WheelRecord | None] = []
    for i, w in enumerate(machine.wheels):
        speed, opening = _channels(w, timeline)
        if speed is None or opening is None:
            out.append(None)
            continue
        y, command = timeline.signals[speed], replay.v_ref[:, i]
        if not np.isfinite(command).any():
            command = y  # a loop holds the speed: it is the better regressor
        use = np.ones(y.size, dtype=np.bool_)
        out.append(
            WheelRecord(y, timeline.signals[opening][:, None], command, use, timeline.dt, machine.limits.driving_speed)
        )
    return out


def _driving(wheels: list[WheelRecord | None]) -> float:
    return max((np.count_nonzero(np.abs(r.command) > r.driving) * r.dt for r in wheels if r is not None), default=0.0)


def _spoiled(wheel: str, timelines: Sequence[Timeline], bad: set[str]) -> str:
    """Signal with a unit error that the wheel's constants would rest on; empty where there is none."""
    used = {f"wheel.{wheel}.v_ref", "cmd.v"}
    for t in timelines:
        used |= {n for n in _channels(wheel, t) if n is not None}
    return next(iter(sorted(used & bad)), "")


def _left_plants(fits: list[WheelFit | None], machine: Machine, names: tuple[str, ...]) -> list[str]:
    out = []
    for w, fit in zip(machine.wheels, fits, strict=True):
        if fit is None:
            continue
        if fit.refused:
            out.append(f"wheel {w}: {fit.refused}")
        out += [f"{names[m]}: wheel {w} disagrees with the other missions" for m in fit.left_missions]
        gone = fit.considered - fit.used
        if not fit.refused and gone > 0:
            out.append(f"wheel {w}: {gone} of {fit.considered} windows disagree with the majority")
    return out
