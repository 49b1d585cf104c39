"""A drive that is given what moves the others, and whose speed reads nothing from end to end: no model of it can be found, and none is needed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.standstill import STILL
from diagnosis.evidence import ACTUATOR, SENSOR, Contribution, MissionView, Part
from diagnosis.response.spells import spans_of
from diagnosis.response.wheel import sensor_finding
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, State

Array = NDArray[np.float64]

_LEAST_S, _SPELL_S, _JOIN_S = 5.0, 1.0, 2.0  # of being driven, in all and at once; of a pause that is bridged
_ENOUGH = 0.2  # quantile of the openings with which others move: as much moves this one
_MOSTLY = 0.7  # of that time in which another one moves
_P = 0.9


class UnmovedDrives:
    """Wheels whose drive command goes on while their speed reads nothing, beside others that move with as much."""

    tier = Tier.RESPONSE

    def assess(self, mission: MissionView) -> Contribution:
        """Judge wheels that no stronger evidence has judged."""
        machine = mission.machine
        known = [w for w in machine.wheels if mission.logged(f"wheel.{w}.v") and mission.logged(f"wheel.{w}.u")]
        speeds = {w: np.abs(mission.values(f"wheel.{w}.v")) for w in known}
        openings = {w: np.abs(mission.values(f"wheel.{w}.u")) for w in known}
        parts: dict[Part, Assessment] = {}
        for w in known:
            if w not in mission.wheels or w in machine.unpowered or mission.judged((w, SENSOR)):
                continue
            findings = unmoved(w, speeds, openings, machine.limits.driving_speed, mission.timeline.dt)
            if findings:
                parts[w, SENSOR], parts[w, ACTUATOR] = (_part(findings, speeds[w]) for _ in range(2))
        return Contribution(parts)


def unmoved(
    wheel: str, speeds: Mapping[str, Array], openings: Mapping[str, Array], driving_speed: float, dt: float
) -> list[Finding]:
    """Findings of a wheel that never moves although it is driven as much as moves the others.

    Parameters
    ----------
    wheel : str
        The wheel.
    speeds, openings : Mapping[str, Array], each of shape (n,)
        Sizes of measured speed [m/s] and of the drive command [1] of each wheel; NaN where not known.
    driving_speed : float
        Speed from which a wheel drives [m/s].
    dt : float
        Step [s].
    """
    own, given = np.nan_to_num(speeds[wheel]), np.nan_to_num(openings[wheel])
    others = [o for o in speeds if o != wheel]
    if np.max(own, initial=0.0) > STILL * driving_speed or not others:
        return []
    moves = {o: np.nan_to_num(speeds[o]) > driving_speed for o in others}
    with_ = np.concatenate([openings[o][moves[o] & np.isfinite(openings[o])] for o in others])
    if with_.size * dt < _LEAST_S:
        return []
    driven = given >= max(float(np.quantile(with_, _ENOUGH)), 1e-9)
    together = np.logical_or.reduce(list(moves.values()))
    if np.count_nonzero(driven) * dt < _LEAST_S or float(np.mean(together[driven])) < _MOSTLY:
        return []
    spans = [x for x in spans_of(driven, round(_JOIN_S / dt)) if (x[1] - x[0]) * dt >= _SPELL_S]
    text = (
        f"wheel.{wheel}.v reads 0 from start to end, for {np.count_nonzero(driven) * dt:.1f} s in all while wheel.{wheel}.u asks for as much as moves "
        "the other {wheels}: its sensor gives nothing, or its drive does not turn it, and its effort or another view of this {wheel} would tell which."
    )
    sat = Sat(0.0, 0.0, 0.0, 0.0, "m/s")
    return [sensor_finding(a, b, FaultMode.NO_SIGNAL, _P, Epsilon(1.0, 1.0, 1.0), sat, (text,), 0.5) for a, b in spans]


def _part(findings: list[Finding], speed: Array) -> Assessment:
    states = np.where(np.isfinite(speed), CODE[State.NOT_EXCITED], CODE[State.NO_DATA]).astype(np.int8)
    for f in findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    reasons = {State.NOT_EXCITED: "the {wheel} is not driven", State.NO_DATA: "no samples"}
    return Assessment(states, reasons, tuple(findings), {}, Tier.RESPONSE)
