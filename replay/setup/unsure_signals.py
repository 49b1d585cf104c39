"""Signals of a draft whose names leave open what they hold: taken as what they seem, with one question for each kind."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

from replay.log.raw_log import Channel
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.setup.draft_notes import Draft
from replay.setup.unstated_units import USUAL_UNITS
from replay.signals.signal import Signals
from replay.signals.to_si import peak_of
from replay.signals.unsure_kinds import Open, Unsure
from replay.signals.unsure_names import unsure

_QUESTIONS = {
    Open.SPEED: "are {names} speeds of the wheels? Their names tell the wheel, but not what; they are taken so.",
    Open.POSITION: "are {names} positions of the wheels{unit}? They are taken so, and the speeds are their slopes.",
    Open.SECOND: "are {names} second sensors of what {beside} and the like measure? They are taken so: what both say is believed.",
    Open.YAW_RATE: "is {names} the yaw rate of the machine, in {turns}? It is taken so.",
    Open.PLACE: "are {names} places by a satellite receiver, in degrees? They are taken so.",
    Open.GROUND: "is {names} the speed over ground by a satellite receiver, in {speeds}? It is taken so.",
    Open.ANGLE: "are these steering angles, in {angles}: {names}? They are taken so.",
    Open.DRIVERS: "is {names} the angle of the wheel that the driver turns, as its name says? Then it is geared to the axle's, and it is not taken.",
    Open.OPENING: "are {names} what valves or pumps are told, or where they stand (1 is fully open)? They are taken so.",
}

_SHOWN = 8  # labels in a question


def unsure_signals(
    draft: Draft, channels: Mapping[str, Channel], machine: Machine, found: Signals
) -> Mapping[str, SignalSource]:
    """Sources of such signals, by canonical name; steps of encoders get their scale, and their question, with the lengths.

    Parameters
    ----------
    draft : Draft
        Takes the questions.
    channels : Mapping[str, Channel]
        All of the log.
    machine : Machine
        Its wheels and axles.
    found : Signals
        As found by their names.
    """
    kinds: dict[Open, list[Unsure]] = defaultdict(list)
    for one in unsure(channels, machine):
        if one.signal not in found.items and one.kind not in (
            Open.CURRENT,
            Open.MOTION,
        ):  # which have their own questions
            kinds[one.kind].append(one)
    kinds[Open.YAW_RATE] = [_turning(one, channels) for one in kinds.get(Open.YAW_RATE, [])]
    for kind, ones in kinds.items():
        if kind in _QUESTIONS and ones:
            bare = any(one.origin.unit == "rad" for one in ones)
            names, beside = _few([_label(one) for one in ones]), ones[0].beside
            unit = ones[0].origin.unit
            draft.ask(
                "signals",
                _QUESTIONS[kind].format(
                    names=names,
                    beside=beside,
                    unit=" in rad" if bare else "",
                    turns=unit or "rad/s",
                    angles=unit,
                    speeds=unit or "m/s",
                ),
            )
    return {one.signal: one.origin for kind, ones in kinds.items() if kind is not Open.DRIVERS for one in ones}


def _turning(one: Unsure, channels: Mapping[str, Channel]) -> Unsure:
    """A yaw rate with the unit that its values have, where its name states none: one question, and no second one of its unit."""
    channel = next((c for n, c in channels.items() if one.origin.label in (n, c.name)), None)
    unit, least, most, _ = USUAL_UNITS["rotation"]
    fast = channel is not None and not one.origin.unit and not channel.unit and least < peak_of(channel.values) <= most
    return replace(one, origin=replace(one.origin, unit=unit)) if fast else one


def _label(one: Unsure) -> str:
    """Label of a channel, of an angle with whether it is taken for a commanded one."""
    return one.origin.label + (" (commanded)" if one.signal.endswith(".phi_ref") else "")


def _few(labels: Sequence[str]) -> str:
    """Labels, the first of many: their lines are in the draft."""
    more = f" and {len(labels) - _SHOWN} more" if len(labels) > _SHOWN else ""
    return ", ".join(labels[:_SHOWN] if more else labels) + more
