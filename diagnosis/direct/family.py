"""Second measurements of wheels as a family of evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from diagnosis.channels.habit import Habit, identify_habit, of_kind
from diagnosis.channels.relation import Relation, relations_of_kind, valves_of_kind
from diagnosis.direct.assess import assess_identified
from diagnosis.direct.at_once import without_shared_moments
from diagnosis.direct.gain_spread import usual_spread
from diagnosis.direct.identification import IdentifiedPair, identify
from diagnosis.direct.inputs import Pair, make_pair
from diagnosis.direct.low_speed import without_low_speed_habit
from diagnosis.direct.one_value import with_frozen_readings
from diagnosis.direct.second_is_off import without_second_speeds_own
from diagnosis.direct.second_scaled import without_second_speeds_scale
from diagnosis.direct.small_deviations import without_small_deviations
from diagnosis.direct.stays import without_stays
from diagnosis.direct.switching import without_switching
from diagnosis.direct.uncertainty import most_noise_of_kind, usual_of_kind
from diagnosis.estimation.lag import low_passed
from diagnosis.evidence import ACTUATOR, SENSOR, Array, Contribution, Flags, MissionView, Part
from diagnosis.results.assessment import Assessment, Lack, unassessed
from diagnosis.results.vocabulary import Tier
from replay.arrays.numeric import without_nan
from replay.arrays.processors import each
from replay.arrays.sliding import mean_within
from replay.faults import Side, State
from replay.machine.config import Limits
from replay.progress import Progress, Stage

_QUIET = 0.4  # of the driving speed
_EVEN_S = 0.05  # over which the speed is evened
_IDLE = 0.02  # of full opening
_LAGS_S = (0.1, 0.3)


class DirectEvidence:
    """A wheel's speed against a second sensor's, its valve's command against the measured position."""

    tier = Tier.DIRECT

    def assess(self, mission: MissionView) -> Contribution:
        """Judge what is measured twice."""
        parts: dict[Part, Assessment] = {}
        pairs: dict[Part, Pair] = {}
        habits = _habits(mission)
        for wheel in mission.wheels:
            one = _WheelPairs(mission, wheel)
            mission.timeline.store.release()
            if (wheel, SENSOR) not in mission.known and one.logged("v_true") and one.logged("v"):
                pairs[wheel, SENSOR] = one.speeds(habits[wheel])
            if (wheel, ACTUATOR) not in mission.known and one.logged("u_applied"):
                if one.logged("u"):
                    pairs[wheel, ACTUATOR] = one.openings()
                else:
                    why = "the {position} is logged but not its command"
                    parts[wheel, ACTUATOR] = unassessed(mission.timeline.size, State.NOT_ASSESSED, why, Lack.COMMAND)
        limits = mission.machine.limits
        identified = _identified(pairs, limits, mission)
        store = mission.timeline.store
        judged = each(
            lambda found: assess_identified(found, limits),
            identified.values(),
            mission.timeline.size,
            lambda _: store.release(),
        )
        store.release()
        parts |= dict(zip(identified, judged, strict=True))
        sensors = {wheel: found for (wheel, side), found in identified.items() if side == SENSOR}
        told = {wheel: parts[wheel, SENSOR] for wheel in sensors}
        for of_sensors in (
            without_low_speed_habit,
            without_shared_moments,
            partial(without_second_speeds_own, openings=_openings(mission)),
            partial(without_second_speeds_scale, openings=_openings(mission)),
            with_frozen_readings,
        ):
            told = of_sensors(sensors, told)
            store.release()
        valves = {wheel: found for (wheel, side), found in identified.items() if side == ACTUATOR}
        own = {wheel: parts[wheel, ACTUATOR] for wheel in valves}
        for of_valves in (without_small_deviations, without_stays, without_switching, with_frozen_readings):
            own = of_valves(valves, own)
            store.release()
        parts |= {(wheel, SENSOR): a for wheel, a in told.items()} | {(wheel, ACTUATOR): a for wheel, a in own.items()}
        return Contribution(parts)


def _identified(pairs: dict[Part, Pair], limits: Limits, mission: MissionView) -> dict[Part, IdentifiedPair]:
    """Pairs with what is identified of them; noise that those of one kind do not have is none of a healthy channel."""

    def begun(part: Part) -> None:
        mission.progress(Progress(Stage.JUDGING_WHEEL, part[0]))

    found = dict(
        zip(pairs, each(lambda part: identify(pairs[part], limits), pairs, mission.timeline.size, begun), strict=True)
    )
    for side in (SENSOR, ACTUATOR):
        kind = [part for part in found if part[1] == side]
        own = [found[part].relation for part in kind]
        alike = (
            relations_of_kind(own, mission.timeline.dt) if side == SENSOR else valves_of_kind(own, mission.timeline.dt)
        )
        found |= _of_kind({part: found[part] for part in kind}, alike, limits, mission)
        if side == ACTUATOR and any(found[part].relation != r for part, r in zip(kind, own, strict=True)):
            # what the others seemed to be off by was their lags' doing, not noise that this one may have
            found |= _of_kind({part: found[part] for part in kind}, alike, limits, mission)
        spread = usual_spread([found[part].own_spread for part in kind])
        found |= {part: found[part].with_kind_spread(spread) for part in kind}
    return found


def _of_kind(
    kind: dict[Part, IdentifiedPair], alike: Sequence[Relation], limits: Limits, mission: MissionView
) -> dict[Part, IdentifiedPair]:
    """Pairs of one kind that have another relation, or more noise, than such have, identified with what is usual."""
    usual = usual_of_kind([one.own for one in kind.values()])
    most = most_noise_of_kind([one.model.noise for one in kind.values()])
    found = {}
    for (part, one), relation in zip(kind.items(), alike, strict=True):
        exceeds = usual is not None and one.own.exceeds(usual)
        louder = most is not None and one.model.noise > most
        mission.timeline.store.release()
        if exceeds or louder or relation != one.relation:
            found[part] = identify(one.pair, limits, usual if exceeds else None, relation, most)
    return found


def _openings(mission: MissionView) -> dict[str, Array]:
    """What is measured of the drives' openings, or commanded, by wheel."""
    best = {
        w: next((n for leaf in ("u_applied", "u") if mission.logged(n := f"wheel.{w}.{leaf}")), None)
        for w in mission.wheels
    }
    return {w: mission.values(name) for w, name in best.items() if name is not None}


def _habits(mission: MissionView) -> dict[str, Habit]:
    """How the speed sensors are updated, for wheels with a second one."""
    twice = [w for w in mission.wheels if mission.logged(f"wheel.{w}.v") and mission.logged(f"wheel.{w}.v_true")]
    names = [f"wheel.{w}.v" for w in twice]
    timeline = mission.timeline
    found = of_kind([identify_habit(timeline.signals[n], timeline.fresh[n], timeline.dt) for n in names])
    return dict(zip(twice, found, strict=True))


@dataclass(frozen=True)
class _WheelPairs:
    """Channels of one wheel beside their references."""

    mission: MissionView
    wheel: str

    def name(self, leaf: str) -> str:
        return f"wheel.{self.wheel}.{leaf}"

    def logged(self, leaf: str) -> bool:
        return self.mission.logged(self.name(leaf))

    def speeds(self, habit: Habit) -> Pair:
        """The speed sensor against the second one."""
        pair = self._pair(Side.SENSOR, "v", "v_true", self._quiet(), "m/s", 2.2 * self.mission.machine.max_speed)
        return replace(pair, instruments=lambda: self._instruments, habit=habit)

    def openings(self) -> Pair:
        """The valve's position against its command."""
        span = max(self.mission.machine.control.u_max, 1e-6)
        u = self.mission.values(self.name("u"))
        idle = self.mission.timeline.map(lambda u: np.abs(without_nan(u)) < _IDLE * span, u)
        pair = self._pair(Side.ACTUATOR, "u_applied", "u", idle, "of full opening", span)
        return replace(pair, instruments=lambda: self._instruments)

    def _pair(self, side: Side, y: str, x: str, quiet: Flags, unit: str, span: float) -> Pair:
        mission = self.mission
        return make_pair(
            mission.timeline, mission.alive, side, self.name(y), self.name(x), quiet, unit, span, mission.machine
        )

    def _quiet(self) -> Flags:
        """Neither commanded nor moving by the second sensor, whose noise moves nothing."""
        limit = _QUIET * self.mission.machine.limits.driving_speed
        width = max(1, round(_EVEN_S / self.mission.timeline.dt))

        def low(command: Array, speed: Array) -> Flags:
            return np.asarray((np.abs(without_nan(command)) < limit) & (np.abs(without_nan(speed)) < limit))

        true = self.mission.values(self.name("v_true"))
        even = self.mission.timeline.store.keep(mean_within(without_nan(true), width))
        return self.mission.timeline.map(low, self.mission.command(self.wheel), even)

    @cached_property
    def _instruments(self) -> Array | None:
        """The commanded speed and two lags of it: what drives the loop and knows nothing of a fault in it."""
        command = self.mission.command(self.wheel)
        if not np.isfinite(command).any():
            return None
        store, dt = self.mission.timeline.store, self.mission.timeline.dt
        return store.beside([command, *(store.keep(low_passed(command, lag, dt)) for lag in _LAGS_S)])
