"""A single drive with command, speed and effort, judged by what its controller answered to and what effort it took.

Two kinds of evidence: the speed that the effort echoes (`diagnosis.drives.echo`) shows every fault of the speed's channel
that the controller did not meet, and a channel that is constant; the effort beyond a map from healthy missions
(`diagnosis.drives.load`) shows extra load or loss of effectiveness. A loss of gain that the controller met too leaves
the first without a trace and looks like extra load in the second, so the sensor is called healthy only where both agree
or where the log's faults were written into it afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum, rounding_step
from diagnosis.channels.sample_status import sample_status
from diagnosis.drives.echo import DriveRecord, echoed_speed, identify_echo, window_size
from diagnosis.drives.findings import EchoPair, find_rows
from diagnosis.drives.load import LoadTrack, track_load
from diagnosis.drives.load_findings import load_findings
from diagnosis.estimation.fault_models import BLIND, PAIR, SILENT
from diagnosis.results.assessment import CODE, Assessment, Finding, unassessed
from diagnosis.results.evidence_columns import Pictured, steps_of
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from replay.machine.drive_model import DriveModel, EchoModel

Array = NDArray[np.float64]

_NOISE_RANGE = (0.7, 1.5)
_STEP_RANGE = 0.1
_QUIET = 0.4
_NOTHING = 1e-9
_SLOW_S, _SLACK = 0.5, 0.03
_LEAST_NOISE = 2e-3  # of the span: no echo is believed beyond that


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
        From healthy missions; None: the echo is found in this mission, and there is no effort map.
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

        An effort at its limit echoes nothing, nor does a controller that is off: no effort where nothing is commanded.
        """
        off = (np.abs(self.u) <= _NOTHING * self.u_max) & (np.abs(self.command) <= _NOTHING * self.span)
        free = (np.abs(np.nan_to_num(self.u)) < 0.99 * self.u_max) & ~off
        return DriveRecord(self.y, self.command, np.where(free, self.u, np.nan), self.dt)


def assess_drive(data: DriveData, limits: Limits) -> tuple[Assessment, Assessment]:
    """Judge sensor and actuator of a drive by its controller's echo and its effort.

    Parameters
    ----------
    data : DriveData
        Channels and model.
    limits : Limits
        What counts.

    Returns
    -------
    tuple[Assessment, Assessment]
        Sensor and actuator; not assessed where command and effort do not tell which speed the controller saw.
    """
    record = data.record
    model = data.model or DriveModel()
    echo = model.echo
    if echo is None or abs(echo.step_s - data.dt) > _STEP_RANGE * data.dt:
        echo = identify_echo([record])
    if echo is None:
        reason = "command and effort do not tell which speed the controller saw"
        size = data.y.size
        return unassessed(size, State.NOT_ASSESSED, reason), unassessed(size, State.NOT_ASSESSED, reason)
    x = echoed_speed(echo, record)
    pair = _pair(data, echo, x, limits)
    findings, lead, below = find_rows(pair, limits)
    quiet, known = pair.quiet, np.isfinite(data.y) & np.isfinite(x)
    bad = np.zeros(data.y.size, dtype=np.bool_)
    for f in findings:
        bad[f.start : f.stop] = True
    load: LoadTrack | None = None
    if model.effort is not None:
        # behind a faulty sensor the echo tells the speed, unless the controller met the fault too
        clean = replace(record, y=np.where(bad, x if data.open_loop else np.nan, data.y))
        load = track_load(clean, model.effort, limits.driving_speed)
    loaded = np.ones(data.y.size) if load is None else load.sampled(load.probability, data.y.size)
    states = np.where(quiet, CODE[State.NOT_EXCITED], CODE[State.HEALTHY]).astype(np.int8)
    states[~known & ~quiet & np.isfinite(data.y)] = CODE[State.NOT_ASSESSED]  # the effort is at its limit
    states[~np.isfinite(data.y) & (pair.status != SILENT)] = CODE[State.NO_DATA]
    actuator = states.copy()
    if not data.open_loop:
        states[(states == CODE[State.HEALTHY]) & ~(loaded < 0.5)] = CODE[State.NOT_ASSESSED]
    actuator[(actuator == CODE[State.HEALTHY]) & ~(loaded < 0.5)] = CODE[State.NOT_ASSESSED]
    more: list[Finding] = []
    if load is not None and model.effort is not None:
        more = load_findings(
            load, model.effort.between, data.y, data.dt, limits, data.names[2], open_loop=data.open_loop
        )
    on_sensor = sorted([*findings, *(f for f in more if f.side is not Side.ACTUATOR)], key=lambda f: f.start)
    on_actuator = [f for f in more if f.side is not Side.SENSOR]
    for f in (*(f for f in more if f.side is not Side.ACTUATOR), *findings):
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    for f in on_actuator:
        actuator[f.start : f.stop] = CODE[State(f.mode.value)]
    if not data.open_loop:
        for f in findings:
            if f.mode in (FaultMode.STUCK, FaultMode.NO_SIGNAL):
                actuator[f.start : f.stop] = CODE[State.MASKED]
    reasons = {
        State.NOT_EXCITED: "the drive is neither commanded nor moving",
        State.MASKED: "the speed sensor that would show it delivers nothing usable",
        State.NO_DATA: "no samples",
        State.NOT_ASSESSED: "no effort of healthy missions to compare with"
        if load is None
        else "the drive takes more effort than healthy missions did; a sensor that reads low would look the same",
    }
    columns = {
        "residual": np.where(pair.status == PAIR, data.y - x, np.nan),
        "threshold": np.full(x.size, 3 * pair.noise),
        "expected": x,
        "log_odds": lead,
    }
    notes = [
        f"{data.names[0]} against the speed to which {data.names[2]} answered: noise {pair.noise:.3g} m/s "
        f"({100 * pair.exact:.0f} % of the samples within {pair.core:.2g} m/s), integral time {echo.memory_s:.3g} s."
    ]
    if below:
        notes.append(f"{below} deviations of {data.names[0]} lie below the limits of the machine file.")
    drive_columns = {}
    if load is not None:
        size = data.y.size
        drive_columns = {
            "load_probability": load.sampled(load.probability, size),
            "load": load.sampled(load.level, size),
            "expected": load.sampled(load.expected, size),
        }
    step = steps_of([*on_sensor, *on_actuator], x.size, data.dt)
    sensor, valve = (Pictured.of(step, c.items()) for c in (columns, drive_columns))
    said = tuple(notes)
    return (
        Assessment(states, reasons, tuple(on_sensor), sensor.columns, "drive", said, closeups=sensor.closeups),
        Assessment(actuator, reasons, tuple(on_actuator), valve.columns, "drive", said, closeups=valve.closeups),
    )


def _pair(data: DriveData, echo: EchoModel, x: Array, limits: Limits) -> EchoPair:
    status = sample_status(data.y, x, data.y_fresh, data.alive, data.dt)
    commanded = np.isfinite(data.y) & np.isfinite(data.command) & np.isfinite(data.u)
    status[data.y_fresh & commanded & ~np.isfinite(x)] = BLIND  # the effort is at its limit
    still = _QUIET * limits.driving_speed
    quiet = (np.abs(np.nan_to_num(data.command)) < still) & (np.abs(np.nan_to_num(x)) < still)
    lsb = rounding_step(data.y[status == PAIR]) if data.lsb is None else data.lsb
    noise = _mission_noise(np.where(status == PAIR, data.y - x, np.nan), data.dt, echo.noise)
    noise = max(noise, lsb, _LEAST_NOISE * data.span)
    return EchoPair(
        y=data.y,
        x=x,
        slack=_slack(x - data.command, data.dt, echo.memory_std_s / echo.memory_s),
        status=status,
        quiet=np.asarray(quiet),
        lead=echo.first + len(echo.gains) - 1,
        noise=noise,
        core=echo.core,
        exact=echo.exact,
        lsb=lsb,
        span=data.span,
        dt=data.dt,
        name=data.names[0],
    )


def _slack(error: Array, dt: float, share: float) -> Array:
    """What the echo may be off where the drive is long off its command: a share of the slow tracking error."""
    width = max(1, round(_SLOW_S / dt))
    return np.asarray((_SLACK + share) * np.abs(moving_sum(np.nan_to_num(error), width)) / width, dtype=np.float64)


def _mission_noise(residual: Array, dt: float, known: float) -> float:
    """Noise of this mission's quieter windows, no further from the known one than healthy missions differ."""
    found = window_size(residual, dt)
    low, high = _NOISE_RANGE
    return known if np.isnan(found) else float(np.clip(found, low * known, high * known))
