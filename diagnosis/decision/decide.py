"""The verdict: whether the machine may go out, why not, and what to do about each part."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.decision.behind import behind_drives
from diagnosis.decision.behind_events import with_faults_behind
from diagnosis.decision.caveats import (
    Reservations,
    by_model,
    caveats_of,
    doubt_of,
    limits_of,
    smallest_loads,
)
from diagnosis.decision.decided import Decision
from diagnosis.decision.endings import endings_of
from diagnosis.decision.open_checks import open_words, stands_out
from diagnosis.decision.sensors_alone import TITLES, sensors_alone
from diagnosis.decision.severity import advised
from diagnosis.decision.short import SAID_S, beside_nothing, exempt_axles
from diagnosis.decision.to_clear import to_clear
from diagnosis.decision.unexplained_axles import unexplained_sentences
from diagnosis.decision.wording import actions_of, count_faults, join_words, misplaced_words, sentence_of
from diagnosis.results.assessed import Cut, is_judged
from diagnosis.results.assessment import STATES, Assessment
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.detectability import Detectable
from diagnosis.results.durations import seconds_words
from diagnosis.results.ending import Ending
from diagnosis.results.left_out import only_left_out
from diagnosis.results.machine_event import MachineEvent
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.result import FaultInterval
from diagnosis.results.vocabulary import Kind, Severity, Tier, Verdict
from diagnosis.results.wheel_model import WheelModelFit
from replay.faults import Side, State
from replay.machine.config import Limits

#: A component and its side.
Part = tuple[str, str]

_WHAT_TO_DO = re.compile(r": (?:log|let) ")
_COMPARED_WHEELS = 3
_UNEXPLAINED_S = 0.5
_AXLE_UNEXPLAINED_S = 8.0  # healthy missions that are ready have 6 s at most (tuning, 16 of three machines), a valve off by 0.1 for 12 s has 12.6
_MOSTLY = 0.5
_NO_YAW = (
    "An offset of a steering sensor, or a scale of all of them, that is there from start to end, or grows slowly, does not show in this log; a yaw rate "
    "(imu.yaw_rate) would show it."
)
_ALL_AXLES = (
    "What all steering {valve}s lose from start to end does not show in this log; [steering] in the machine file, which `mfhca fit` writes from healthy "
    "missions, would show it."
)

_BESIDE_NOTHING = "No second speed to compare with"


def decide(
    intervals: Sequence[FaultInterval],
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    axles: Sequence[str],
    limits: Limits,
    damage: Sequence[str],
    words: MachineWords,
    *,
    driving_s: Mapping[Part, float] | None = None,
    model: WheelModelFit | None = None,
    checks: Sequence[Checked] = (),
    scope: Sequence[Cut] = (),
    events: Sequence[MachineEvent] = (),
    hints: Sequence[str] = (),
    misplaced: Sequence[str] = (),
    open_state: Mapping[Part, State] | None = None,
    shown: Sequence[Detectable] = (),
    end_s: float | None = None,
    commanded: bool = True,
    rarely_sent: tuple[str, str] = ("", ""),
) -> Decision:
    """Give the verdict.

    ``stop`` with a fault of high severity, ``watch`` with one of low or medium; without faults ``ready`` only where
    every wheel and side was decided for `min_assessed` seconds and for four fifths of its driving, and the log lost
    nothing, else ``not_assessed``. A wheel model found in the mission itself is compared across wheels; with fewer
    than three of them a loss that lasts the whole mission would not show, so that it gives no ``ready`` either. What
    stands against ``ready`` beside the faults keeps ``watch`` from being cleared.

    Parameters
    ----------
    intervals : Sequence[FaultInterval]
        Faults.
    assessments : Mapping
        By (component, side).
    decided_s : Mapping
        Seconds of driving in which the component and side was healthy or faulty rather than undecided.
    axles : Sequence[str]
        Steering axles.
    limits : Limits
        What ``ready`` needs.
    damage : Sequence[str]
        What the log lost.
    words : MachineWords
        How to speak of the machine.
    driving_s : Mapping or None
        Seconds of driving of the component; None: only `min_assessed` counts.
    model : WheelModelFit or None
        Wheel models behind the judgement, where any.
    checks : Sequence[Checked]
        What is asked once more before a machine is cleared.
    scope : Sequence[Cut]
        Why what was judged is not the whole mission.
    events : Sequence[MachineEvent]
        What happened to the machine as a whole and is no part's fault.
    hints : Sequence[str]
        Signals that fit another sign, unit or place better over the whole mission.
    misplaced : Sequence[str]
        Wheels and axles that are elsewhere than the machine file says, or have the wrong sign.
    open_state : Mapping or None
        The commonest state of each part that is no judgement, while driving.
    shown : Sequence[Detectable]
        What the mission would have shown.
    end_s : float or None
        End of the log [s]; None: not known.
    commanded : bool
        Whether any command of the wheels is in the log.
    rarely_sent : tuple[str, str]
        Commands that may be published on change alone, and what to do then.
    """
    driven = driving_s or {}
    against = _reservations(assessments, decided_s, driven, axles, limits, damage, model)
    twice = {(c.component, c.side.value) for c in checks if c.check is Check.SECOND_MEASUREMENT}
    against = replace(
        against,
        words=words,
        unexplained=tuple(p for p in against.unexplained if p[0] not in axles or p not in twice),
        open=tuple(c for c in checks if not c.passed),
        scope=tuple(scope),
        events=with_faults_behind(events, intervals, words),
        hints=(*(misplaced_words(m) for m in misplaced), *hints),
        misplaced=tuple(misplaced),
        open_state=open_state or {},
        uncommanded=not commanded,
        twice=frozenset(twice),
        rarely_sent=rarely_sent,
    )
    open_points = to_clear(against, assessments, decided_s, driven, axles, limits, intervals)
    found = _with_faults(intervals, against, endings_of(intervals, assessments, end_s)) or _without_faults(
        assessments, decided_s, axles, against, intervals
    )
    said = found.title in TITLES  # which parts are not judged, and why
    unseen = tuple(dict.fromkeys(a.hidden for a in assessments.values() if a.hidden))
    told = said or found.status is Verdict.READY  # which call sensors healthy
    short = tuple(_WHAT_TO_DO.split(x)[0] for x in unseen) if said else unseen  # what to log for it is a caveat
    found = replace(found, text=_with_limits(found.text, short)) if told else found
    if found.status is Verdict.NOT_ASSESSED and open_points and not against.misplaced:  # which says it itself
        found = replace(found, text=f"{found.text} To clear it: {open_points[0].act}.")
    caveats = caveats_of(against, assessments, decided_s, driven, axles, limits, short_named=said)
    if _modelled(assessments) and model is not None and model.identified:
        caveats += (by_model(assessments, shown, words),)
    loads = smallest_loads(assessments, words)
    caveats += () if found.status is Verdict.READY else loads
    caveats += limits_of(limits)
    hidden: tuple[str, ...] = (_NO_YAW,) if any(_offset_hidden(checks, axle) for axle in axles) else ()
    hidden += (words.fill(_ALL_AXLES),) if _common_loss_hidden(checks) else ()
    if not told or short != unseen:
        caveats += unseen
    if found.status is Verdict.READY:
        exempt = exempt_axles(assessments, decided_s, driven, axles, limits, words, open_state=against.open_state)
        behind = behind_drives(assessments, axles, checks, model, words)
        off = unexplained_sentences(assessments, axles, words)
        found = replace(found, text=" ".join((found.text, *exempt, *off, *behind, *loads, *hidden)))
    else:
        caveats += hidden
    caveats = tuple(c for c in caveats if c != found.text)
    actions = actions_of(advised(intervals, found.status, cleared=found.cleared), words)
    return replace(
        found,
        scope=tuple(scope),
        caveats=caveats,
        actions=actions,
        to_clear=() if found.status is Verdict.READY else open_points,
    )


def _with_limits(text: str, limits: Sequence[str]) -> str:
    """A verdict's sentence that goes on with what it does not say."""
    return "; ".join((text.removesuffix("."), *(f"{x[:1].lower()}{x[1:]}".removesuffix(".") for x in limits))) + "."


def _offset_hidden(checks: Sequence[Checked], axle: str) -> bool:
    """Whether an axle's angle is checked, but by nothing that would show its offset."""
    asked = {(c.check, c.side) for c in checks if c.component == axle}
    kinds = {check for check, _ in asked}
    return bool(asked) and Check.LASTING_YAW not in kinds and (Check.SECOND_MEASUREMENT, Side.SENSOR) not in asked


def _common_loss_hidden(checks: Sequence[Checked]) -> bool:
    """Whether axles are held against each other alone: neither against a second measurement of their valves nor against a plant."""
    beside = {c.component for c in checks if c.check is Check.LASTING_RATE}
    twice = {c.component for c in checks if c.check is Check.SECOND_MEASUREMENT and c.side is Side.ACTUATOR}
    return bool(beside - twice - {c.component for c in checks if c.check is Check.PLANT_RATE})


def _reservations(
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    driven: Mapping[Part, float],
    axles: Sequence[str],
    limits: Limits,
    damage: Sequence[str],
    model: WheelModelFit | None,
) -> Reservations:
    """What stands against ``ready`` beside the faults."""
    wheels = [part for part in assessments if part[0] not in axles]
    own_model = _modelled(assessments) and model is not None and model.identified
    short = tuple(p for p in wheels if not is_judged(decided_s.get(p, 0.0), driven.get(p, 0.0), limits.min_assessed))
    sensors = [p for p in short if p[1] == Side.SENSOR]
    return Reservations(
        short=short,
        silent=tuple(p for p in short if decided_s.get(p, 0.0) < SAID_S),
        beside_nothing=bool(sensors)
        and all(driven.get(p, 0.0) >= limits.min_assessed and beside_nothing(assessments[p]) for p in sensors),
        unexplained=tuple(
            p
            for p, a in assessments.items()
            if (a.unexplained_s >= _UNEXPLAINED_S if p in wheels else _axle_unexplained(a))
        ),
        not_compared=own_model and model is not None and _compared(model, assessments) < _COMPARED_WHEELS,
        damage=tuple(damage),
    )


def _compared(model: WheelModelFit, assessments: Mapping[Part, Assessment]) -> int:
    """How many wheels a model compares: none of those without a drive."""
    free = {c for c, _ in assessments if (c, Side.ACTUATOR.value) not in assessments}
    return len(model.plants) - len(free)


def _axle_unexplained(a: Assessment) -> bool:
    """Whether a side of an axle is off without a fault for so long that the checks of the whole axle do not stand for it."""
    return a.unexplained_s >= _AXLE_UNEXPLAINED_S or (a.unexplained_s > 0.0 and _mostly_open(a))


def _mostly_open(assessment: Assessment) -> bool:
    """Whether a side was not assessed for most of the mission."""
    return bool(np.mean(assessment.states == STATES.index(State.NOT_ASSESSED)) > _MOSTLY)


def _modelled(assessments: Mapping[Part, Assessment]) -> bool:
    return any(a.tier is Tier.MODEL for a in assessments.values())


def _with_faults(
    intervals: Sequence[FaultInterval], against: Reservations, endings: Mapping[str, Ending]
) -> Decision | None:
    """The verdict where a fault is worth an action."""
    stop = [f for f in intervals if f.severity is Severity.HIGH]
    watch = [f for f in intervals if f.severity in (Severity.MEDIUM, Severity.LOW)]
    first = "".join(f"{misplaced_words(m)} " for m in against.misplaced[:1])
    if stop:
        return Decision(Verdict.STOP, count_faults(stop, watch), first + sentence_of(intervals, against.words, endings))
    if watch:
        doubt = doubt_of(watch, against)
        return Decision(
            Verdict.WATCH,
            count_faults((), watch, cleared=not doubt),
            first + sentence_of(intervals, against.words, endings),
            cleared=not doubt,
            not_cleared=doubt,
        )
    return None


def _without_faults(
    assessments: Mapping[Part, Assessment],
    decided_s: Mapping[Part, float],
    axles: Sequence[str],
    against: Reservations,
    intervals: Sequence[FaultInterval],
) -> Decision:
    """The verdict where no fault is worth an action: the first reservation that there is, else ``ready``."""
    if against.events:
        return Decision(Verdict.NOT_ASSESSED, against.events[0].title, against.events[0].text)
    if against.hints:
        return Decision(Verdict.NOT_ASSESSED, "The machine's settings do not fit the log", against.hints[0])
    if (seen := sensors_alone(assessments, decided_s, axles, against, intervals)) is not None:
        return Decision(Verdict.NOT_ASSESSED, *seen)
    if against.short:
        who = against.words.listed(Kind.WHEEL, against.short)
        if against.beside_nothing:
            text = f"No fault was found, but the log has nothing that shows what {who} should do."
            return Decision(Verdict.NOT_ASSESSED, _BESIDE_NOTHING, text)
        was = "was" if len(against.short) == 1 else "were"
        text = f"No fault was found, but {who} {was} not judged long enough to be called healthy{stands_out(against.open)}."
        return Decision(Verdict.NOT_ASSESSED, "Not judged long enough", text)
    if against.unexplained:
        named = sorted({c for c, _ in against.unexplained})
        who = join_words(
            [
                against.words.listed(kind, parts)
                for kind in (Kind.WHEEL, Kind.STEER)
                if (parts := [(c, Side.SENSOR_OR_ACTUATOR) for c in named if (c in axles) is (kind is Kind.STEER)])
            ]
        )
        most = max(assessments[part].unexplained_s for part in against.unexplained)
        text = f"No fault was identified, but no single fault explains the residual of the {who} for up to {seconds_words(most)}."
        return Decision(Verdict.NOT_ASSESSED, "Unexplained residuals", text)
    if against.not_compared:
        text = (
            f"No fault was found, but the {against.words.part} model was identified from this mission alone, so a loss that lasts the "
            "whole mission would not show."
        )
        return Decision(Verdict.NOT_ASSESSED, "No fault found, not fully assessed", text)
    if against.damage:
        apart = only_left_out(against.damage)
        text = ("" if apart else "Parts of the log are lost: ") + against.damage[0].removesuffix(".") + "."
        title = "No fault found, but a file was left out" if apart else "No fault found in a damaged log"
        return Decision(Verdict.NOT_ASSESSED, title, text)
    if against.scope:
        text = f"No fault was found, but {join_words([cut.text for cut in against.scope])}."
        at_times = all(cut.kind.of_time for cut in against.scope)
        title = f"No fault found, not {'the whole mission' if at_times else 'all parts'} judged"
        return Decision(Verdict.NOT_ASSESSED, title, text)
    if against.open:
        text = f"No fault was identified, but this mission does not exclude one: {open_words(against.open)}."
        return Decision(Verdict.NOT_ASSESSED, "No fault found, not cleared", text)
    least = min((decided_s[part] for part in assessments if part[0] not in axles), default=0.0)
    return Decision(
        Verdict.READY, "No fault found", against.words.fill(_healthy(assessments, axles, least)), cleared=True
    )


def _healthy(assessments: Mapping[Part, Assessment], axles: Sequence[str], least_s: float) -> str:
    """What was judged healthy, a sentence with words of the machine in braces: wheels without a drive have a sensor alone."""
    wheels = list(dict.fromkeys(c for c, _ in assessments if c not in axles))
    free = [w for w in wheels if (w, Side.ACTUATOR.value) not in assessments]
    if len(wheels) == 1:
        both = "The {wheel.sensor}" if free else "The {wheel.sensor} and the {wheel.actuator}"
        return f"{both} {'was' if free else 'were'} judged healthy over at least {least_s:.0f} s of {{moving}}."
    both = "The {wheel.sensor} and the {wheel.actuator} of every {wheel}"
    if free:
        has = "has" if len(free) == 1 else "have"
        both += f" with a drive, and the {{wheel.sensor}}{'' if len(free) == 1 else 's'} of {join_words(free)}, which {has} none,"
    return f"{both} were judged healthy over at least {least_s:.0f} s of {{moving}}."
