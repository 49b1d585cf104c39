"""A single drive with command, speed and effort, judged by what its controller answered to and what effort it took.

Two kinds of evidence: the speed that the effort implies (`diagnosis.drives.inverse_controller`) shows every fault of the
speed's channel that the controller did not meet, and a channel that is constant; the effort beyond a map from healthy
missions (`diagnosis.drives.load`) shows extra load or loss of effectiveness. A loss of gain that the controller met too
leaves the first without a trace and looks like extra load in the second, so the sensor is called healthy only where both
agree or where the log's faults were written into it afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR, SILENT
from diagnosis.drives.findings import find_rows
from diagnosis.drives.identification import identify_controller
from diagnosis.drives.inputs import DriveData
from diagnosis.drives.inverse_controller import implied_speed
from diagnosis.drives.load import LoadTrack, track_load
from diagnosis.drives.load_findings import load_findings
from diagnosis.drives.power import load_powers, sensor_powers
from diagnosis.drives.speed_pair import SpeedPair, speed_pair
from diagnosis.results.assessment import CODE, Assessment, Finding, Reason, unassessed
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.results.plain_numbers import plain
from diagnosis.results.sizes import not_reported
from diagnosis.results.vocabulary import Tier
from replay.faults import Side, State
from replay.machine.config import Limits
from replay.machine.drive_model import EffortMap, InverseController

Array = NDArray[np.float64]

_STEP_RANGE = 0.1
_MOST, _PIECES = 0.5, 6  # of the driving; separate faults of one sensor, of which more are how the drive is controlled
_NO_MODEL = (
    "the controller that command and effort show in this mission does not explain its driving, from one part of it to the next; `mfhca fit` with "
    "healthy missions finds it more surely"
)


@dataclass(frozen=True)
class _Evidence:
    """Both kinds of evidence on a drive.

    Attributes
    ----------
    pair : SpeedPair
        Measured speed beside the implied one.
    lead : Array, shape (n,)
        Causal log-odds of a fault of the speed's channel.
    speed : list[Finding]
        Faults of the speed's channel.
    load : LoadTrack or None
        Extra effort; None without healthy missions.
    effort : list[Finding]
        Faults by extra effort.
    """

    pair: SpeedPair
    lead: Array
    speed: list[Finding]
    load: LoadTrack | None
    effort: list[Finding]

    @property
    def sensor(self) -> list[Finding]:
        """Findings of the sensor, in order of time."""
        return sorted([*self.speed, *(f for f in self.effort if f.side is not Side.ACTUATOR)], key=lambda f: f.start)

    @property
    def actuator(self) -> list[Finding]:
        """Findings of the actuator, in order of time."""
        return [f for f in self.effort if f.side is not Side.SENSOR]


def assess_drive(data: DriveData, limits: Limits) -> tuple[Assessment, Assessment]:
    """Judge sensor and actuator of a drive by the speed that its effort implies and by its effort.

    Parameters
    ----------
    data : DriveData
        Channels and model.
    limits : Limits
        What counts.

    Returns
    -------
    tuple[Assessment, Assessment]
        Sensor and actuator; not assessed where command and effort do not show which speed the controller received.
    """
    controller = _controller(data)
    if controller is None:
        why = "command and effort do not show which speed the controller received"
        missing = unassessed(data.y.size, State.NOT_ASSESSED, why)
        return missing, unassessed(data.y.size, State.NOT_ASSESSED, why)
    pair = speed_pair(data, controller, implied_speed(controller, data.record), limits)
    findings, lead, below = find_rows(pair, limits)
    known = data.model is not None and controller is data.model.echo
    if not known and _mostly_faulty(data, findings, limits):
        missing = unassessed(data.y.size, State.NOT_ASSESSED, _NO_MODEL)
        return missing, unassessed(data.y.size, State.NOT_ASSESSED, _NO_MODEL)
    load, more = _extra_effort(data, pair, findings, limits)
    evidence = _Evidence(pair, lead, findings, load, more)
    sensor, actuator = _assessments(data, evidence, _notes(data, pair, controller, below))
    sensor = replace(sensor, powers=sensor_powers(pair, limits))
    if load is not None and data.model is not None and data.model.effort is not None:
        actuator = _as_far_as_seen(replace(actuator, powers=load_powers(load, data.model.effort, limits)), limits)
    return sensor, actuator


def _mostly_faulty(data: DriveData, findings: list[Finding], limits: Limits) -> bool:
    """Whether a controller that was found in this mission alone calls most of its driving, or many pieces of it, faulty: then it is not the drive's.

    It is identified by what holds in more than half of the time, and a sensor fails in one way.
    """
    if len(findings) > _PIECES:
        return True
    driving = np.isfinite(data.y) & (np.abs(np.nan_to_num(data.command)) > limits.driving_speed)
    there = np.zeros(data.y.size, np.bool_)
    for f in findings:
        there[f.start : f.stop] = True
    return bool(np.count_nonzero(there & driving) > _MOST * max(int(np.count_nonzero(driving)), 1))


def _as_far_as_seen(drive: Assessment, limits: Limits) -> Assessment:
    """A drive that is not called healthy where a load that counts could last all through the mission without a trace."""
    assert drive.powers is not None
    (least,) = (r.size for r in drive.powers.rows if r.for_s is None)
    healthy = drive.states == CODE[State.HEALTHY]
    if not healthy.any() or (least is not None and least <= limits.clear_at):
        return drive
    shows = "in no size" if least is None else f"from {100 * least:.0f} % of the effort on"
    why = (
        f"a load that lasts all through the mission would show {shows} only, and {100 * limits.clear_at:.0f} % count (limits.clear_at); "
        "more effort, as faster driving takes, shows smaller ones"
    )
    states = np.where(healthy, CODE[State.NOT_ASSESSED], drive.states).astype(np.int8)
    return replace(drive, states=states).reasoned(State.NOT_ASSESSED, Reason(why))


def _controller(data: DriveData) -> InverseController | None:
    """Inverse model of the controller: the known one where it holds for this log's step, else this mission's own."""
    known = None if data.model is None else data.model.echo
    if known is not None and abs(known.step_s - data.dt) <= _STEP_RANGE * data.dt:
        return known
    return identify_controller([data.record])


def _extra_effort(
    data: DriveData, pair: SpeedPair, findings: list[Finding], limits: Limits
) -> tuple[LoadTrack | None, list[Finding]]:
    """Extra effort over the mission and the faults that it shows; None without a map from healthy missions."""
    effort: EffortMap | None = None if data.model is None else data.model.effort
    if effort is None:
        return None, []
    bad = np.zeros(data.y.size, dtype=np.bool_)
    for f in findings:
        bad[f.start : f.stop] = True
    # behind a faulty sensor the implied speed is the drive's, unless the controller met the fault too
    clean = replace(data.record, y=np.where(bad, pair.samples.x if data.open_loop else np.nan, data.y))
    load = track_load(clean, effort, limits.driving_speed)
    return load, load_findings(data, load, effort.between, limits)


def _states(data: DriveData, evidence: _Evidence) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """State of every sample of sensor and actuator."""
    samples, load = evidence.pair.samples, evidence.load
    known = np.isfinite(data.y) & np.isfinite(samples.x)
    free = np.zeros(data.y.size, np.bool_)  # of extra load
    if load is not None:
        free = (load.sampled(load.probability, data.y.size) < 0.5) & (load.sampled(load.covered, data.y.size) > 0.5)
    sensor = np.where(samples.quiet, CODE[State.NOT_EXCITED], CODE[State.HEALTHY]).astype(np.int8)
    sensor[~known & ~samples.quiet & np.isfinite(data.y)] = CODE[State.NOT_ASSESSED]  # the effort is at its limit
    sensor[~np.isfinite(data.y) & (samples.status != SILENT)] = CODE[State.NO_DATA]
    actuator = sensor.copy()
    for states in (actuator,) if data.open_loop else (sensor, actuator):
        states[(states == CODE[State.HEALTHY]) & ~free] = CODE[State.NOT_ASSESSED]
    for f in (*(f for f in evidence.effort if f.side is not Side.ACTUATOR), *evidence.speed):
        sensor[f.start : f.stop] = CODE[State(f.mode.value)]
    for f in evidence.actuator:
        actuator[f.start : f.stop] = CODE[State(f.mode.value)]
    for f in evidence.speed:
        if f.mode.total and not data.open_loop:
            actuator[f.start : f.stop] = CODE[State.MASKED]
    return sensor, actuator


def _assessments(data: DriveData, evidence: _Evidence, notes: tuple[str, ...]) -> tuple[Assessment, Assessment]:
    """Findings, states and columns of sensor and actuator."""
    pair, load, size = evidence.pair, evidence.load, data.y.size
    x = pair.samples.x
    columns = {
        "residual": np.where(pair.samples.status == PAIR, data.y - x, np.nan),
        "threshold": np.full(x.size, 3 * pair.noise),
        "expected": x,
        "log_odds": evidence.lead,
    }
    effort_columns: dict[str, Array] = {}
    if load is not None:
        effort_columns = {
            "load_probability": load.sampled(load.probability, size),
            "load": load.sampled(load.level, size),
            "expected": load.sampled(load.expected, size),
        }
    step = steps_of([*evidence.sensor, *evidence.actuator], x.size, data.dt)
    reasons = _reasons(data, load)
    sensor, actuator = (
        Assessment(states, reasons, tuple(findings), shown.columns, Tier.DRIVE, notes, closeups=shown.closeups)
        for states, findings, shown in zip(
            _states(data, evidence),
            (evidence.sensor, evidence.actuator),
            (Pictured.of(step, c.items()) for c in (columns, effort_columns)),
            strict=True,
        )
    )
    return sensor, actuator


def _reasons(data: DriveData, load: LoadTrack | None) -> dict[State, str]:
    """Why a state that is no judgement was given."""
    return {
        State.NOT_EXCITED: "the drive is neither commanded nor moving",
        State.MASKED: "the {wheel.sensor}, which is needed for it, delivers nothing usable",
        State.NO_DATA: "no samples",
        State.NOT_ASSESSED: _why_not_assessed(data, load),
    }


def _why_not_assessed(data: DriveData, load: LoadTrack | None) -> str:
    effort = None if data.model is None else data.model.effort
    if load is None or effort is None:
        return "no effort of healthy missions to compare with"
    beyond, loaded = np.count_nonzero(load.covered == 0.0), np.count_nonzero(load.probability >= 0.5)
    if beyond > loaded:
        return (
            f"healthy missions drove at {plain(effort.slowest)} to {plain(effort.fastest)} {{speed_unit}}; what effort a healthy drive takes at "
            "other speeds is not known (`mfhca fit` with healthy missions at these speeds finds it)"
        )
    return "the drive takes more effort than in healthy missions; a sensor that reads low has the same effect"


def _notes(data: DriveData, pair: SpeedPair, controller: InverseController, below: int) -> tuple[str, ...]:
    """Figures that the judgement used."""
    figures = (
        f"{data.names[0]} against the speed to which {data.names[2]} answered: noise {plain(pair.noise)} {{speed_unit}} "
        f"({100 * pair.exact:.0f} % of the samples within {plain(pair.core, 2)} {{speed_unit}}), integral time {plain(controller.memory_s)} s."
    )
    if not below:
        return (figures,)
    return (
        figures,
        not_reported(below, data.names[0]),
    )
