"""A single drive's channels: speed, command and effort."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.liveness import alive, alive_sources
from replay.arrays.runs import runs_of
from replay.machine.config import Machine, Noise
from replay.machine.drive_model import DriveModel
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_NOTHING = 1e-9
_SPAN = 2.2  # largest plausible speed [top speed]


@dataclass(frozen=True)
class DriveRecord:
    """Speed, command and effort of one mission on a uniform axis, shapes (n,); NaN where not valid."""

    y: Array
    command: Array
    u: Array
    dt: float


@dataclass(frozen=True)
class DriveData:
    """One drive's channels; shapes (n,), NaN where not valid.

    Attributes
    ----------
    y : Array
        Measured speed [m/s].
    y_fresh : NDArray[np.bool_]
        Steps with a new sample of it.
    alive : NDArray[np.bool_]
        Whether another channel of its source delivers.
    command : Array
        Commanded speed [m/s].
    u : Array
        Effort [unit of effort].
    dt : float
        Step [s].
    model : DriveModel or None
        From healthy missions; None: the controller is identified in this mission, and there is no effort map.
    span : float
        Largest plausible speed [m/s].
    u_max : float
        Effort at which the controller saturates [unit of effort].
    lsb : float or None
        Rounding step of the speed [m/s]; None: found from the mission.
    names : tuple[str, str, str]
        Channels of speed, command and effort, for the text.
    open_loop : bool
        Whether faults were written into the log afterwards, so that the controller cannot have met them.
    """

    y: Array
    y_fresh: NDArray[np.bool_]
    alive: NDArray[np.bool_]
    command: Array
    u: Array
    dt: float
    model: DriveModel | None
    span: float
    u_max: float
    lsb: float | None
    names: tuple[str, str, str]
    open_loop: bool = False

    @property
    def record(self) -> DriveRecord:
        """The channels without their circumstances.

        An effort at its limit answers to no speed, nor does a controller that is switched off: no effort where nothing is
        commanded.
        """
        idle = (np.abs(self.u) <= _NOTHING * self.u_max) & (np.abs(self.command) <= _NOTHING * self.span)
        free = (np.abs(np.nan_to_num(self.u)) < 0.99 * self.u_max) & ~idle
        return DriveRecord(self.y, self.command, np.where(free, self.u, np.nan), self.dt)


def drive_data(
    timeline: Timeline, command: Array, machine: Machine, wheel: str, counts: dict[str, NDArray[np.int16]] | None = None
) -> DriveData | None:
    """Channels of a drive, or None where its speed, command or effort is not in the log.

    Parameters
    ----------
    timeline : Timeline
        The aligned mission.
    command : Array, shape (n,)
        Commanded speed [m/s].
    machine : Machine
        The machine.
    wheel : str
        Which of its drives.
    counts : dict[str, NDArray[np.int16]] or None
        From `diagnosis.channels.liveness.alive_sources`; None: counted here.
    """
    names = (f"wheel.{wheel}.v", f"wheel.{wheel}.v_ref", f"wheel.{wheel}.u")
    y, u = timeline.get(names[0]), timeline.get(names[2])
    if y is None or u is None or not all(np.isfinite(x).any() for x in (y, u, command)):
        return None
    return DriveData(
        y=y,
        y_fresh=timeline.fresh[names[0]],
        alive=alive(timeline, alive_sources(timeline) if counts is None else counts, names[0]),
        command=command,
        u=u,
        dt=timeline.dt,
        model=machine.drives.get(wheel),
        span=_SPAN * machine.max_speed,
        u_max=max(machine.control.u_max, 1e-6),
        lsb=machine.noise.get(names[0], Noise()).lsb,
        names=names,
        open_loop=timeline.open_loop,
    )


def stretches(valid: NDArray[np.bool_], least: int) -> list[slice]:
    """Stretches of valid samples that are at least `least` long. `valid` of shape (n,)."""
    return [slice(a, b) for a, b in runs_of(valid) if b - a >= least]
