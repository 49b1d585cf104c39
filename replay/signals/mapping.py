"""From recorded channels to canonical signals in SI: as the machine file says, or by rules with every guess named."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from replay.arrays.column_store import ColumnStore
from replay.errors import ConfigError
from replay.log.empty_log import NO_NUMBER
from replay.log.raw_log import Channel, LogSummary, RawLog, TopicInfo
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.units import known_unit
from replay.machine.unpowered import drive_in_log, is_of_no_drive
from replay.signals.candidate import Candidate
from replay.signals.channel_data import channel_data, find_channel, is_source, slashed
from replay.signals.file_names import in_its_file, named_channels
from replay.signals.name_parts import wheel_said
from replay.signals.publishing import on_change_hint
from replay.signals.rules import candidates, wanted_type
from replay.signals.scale_doubt import scale_doubt
from replay.signals.second_ones import number_of
from replay.signals.signal import FILE_NAMES, Signal, Signals
from replay.signals.steering_command import turn_by_steering
from replay.signals.to_si import Converted, choose_motor_or_wheel, convert, usable_unit
from replay.signals.unfilled import unfilled, unfilled_note
from replay.signals.unit_doubts import Doubt, agreed, doubt, questions
from replay.signals.unsure_kinds import Unsure
from replay.signals.unsure_names import NOT_USED, unsure

#: Why a signal is missing for which nothing was found.
NO_CHANNEL = "no channel fits by its name or message type"
_NAMED = 4  # channels in a note


def plan_topics(
    summaries: Sequence[LogSummary], machine: Machine, also: Callable[[TopicInfo], bool] | None = None
) -> dict[str, tuple[str, ...] | None]:
    """Topics worth decoding in each source.

    Parameters
    ----------
    summaries : Sequence[LogSummary]
        What each source holds.
    machine : Machine
        Its given signals, and the rules for those not given.
    also : Callable[[TopicInfo], bool] or None
        What else is wanted.

    Returns
    -------
    dict[str, tuple[str, ...] or None]
        By `LogSummary.source`: topics, or None where all is to be read (tables).
    """
    given = {slashed(s.topic) for s in machine.signals.values() if s.topic is not None}
    plan: dict[str, tuple[str, ...] | None] = {}
    for summary in summaries:
        if all(t.encoding == "table" for t in summary.topics):
            plan[summary.source] = None
            continue
        plan[summary.source] = tuple(
            t.name
            for t in summary.topics
            if slashed(t.name) in given
            or (also is not None and also(t))
            or (not t.note and (t.encoding == "json" or wanted_type(t.type_name)))
        )
    return plan


@dataclass
class _Draft:
    """Signals while they are being found."""

    machine: Machine
    items: dict[str, Signal] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    doubts: list[Doubt] = field(default_factory=list)
    named: list[str] = field(default_factory=list)
    given: dict[tuple[str, str], str] = field(default_factory=dict)  # by source and channel: signal that it is given as

    def take(
        self, name: str, log: RawLog, channel: Channel, converted: Converted, origin: SignalSource, guessed: bool
    ) -> None:
        beside = "" if channel.topic else next(n for n, c in log.channels.items() if c.stamps is channel.stamps)
        self.items[name] = Signal(name, converted.stamps, converted.values, origin, log.source, guessed, beside)
        self.notes += [f"{name}: {note}" for note in converted.notes]
        unsure = doubt(name, converted.values, origin, self.machine)
        if unsure is not None:
            self.doubts.append(unsure)
            self.notes.append(unsure.text)


def map_signals(logs: Sequence[RawLog], machine: Machine) -> Signals:
    """Find every signal of the machine in the logs of one mission.

    Parameters
    ----------
    logs : Sequence[RawLog]
        Decoded sources.
    machine : Machine
        Given signals are taken exactly as they say; the others are searched for by rules.

    Returns
    -------
    Signals
        In SI at their own stamps, with every guess and doubt in `notes` and the reason for each missing one.

    Raises
    ------
    ConfigError
        Where a given unit does not fit its signal.
    """
    draft = _Draft(machine)
    for name, source in machine.signals.items():
        _take_given(draft, name, source, logs)
    by_signal: dict[str, list[tuple[Candidate, RawLog]]] = {}
    driven: dict[str, str] = {}  # what would be the drives of wheels without one
    for log, channels in zip(logs, named_channels(logs), strict=True):
        empty = unfilled(channels)
        draft.notes += [unfilled_note(array) for array in dict.fromkeys(empty.values())]
        for found in candidates({n: c for n, c in channels.items() if n not in empty}, machine):
            candidate = replace(found, origin=in_its_file(found.origin, log))
            by_signal.setdefault(candidate.signal, []).append((candidate, log))
            if is_of_no_drive(found.signal, machine.unpowered) and _changes(channels.get(found.origin.label)):
                driven.setdefault(found.signal, found.origin.label)
    draft.notes += drive_in_log(driven, machine.unpowered)
    for name in machine.canonical_signals():
        if name not in machine.signals:
            _take_guess(draft, name, by_signal.get(name, []))
    _name_the_unsure(draft, logs)
    turn_by_steering(draft.items, draft.missing, machine)
    if draft.named:
        draft.notes.append(
            f"{len(draft.named)} signals were recorded under their own names, in SI unless a unit is given"
        )
    order = {name: i for i, name in enumerate((*machine.canonical_signals(), *machine.signals))}
    items = dict(sorted(draft.items.items(), key=lambda item: order[item[0]]))
    store = logs[0].store if logs else ColumnStore()
    asked = questions(agreed(draft.doubts, items, machine), items)
    numbered = by_number(items, machine)
    if numbered:
        draft.notes.append(
            f"wheels are told by numbers alone: {', '.join(numbered)}; another order blames the wrong wheel, and [signals] of a "
            "machine file sets it"
        )
    draft.notes += filter(None, [scale_doubt(items, machine), on_change_hint(items)])
    return Signals(items, draft.missing, tuple(dict.fromkeys(draft.notes)), asked, store=store)


def _changes(channel: Channel | None) -> bool:
    """Whether a channel has more than one value."""
    if channel is None or channel.values.dtype.kind not in "fiu":
        return False
    known = channel.values[np.isfinite(channel.values)]
    return bool(known.size and np.ptp(known.astype(np.float64)) > 0.0)


def _name_the_unsure(draft: _Draft, logs: Sequence[RawLog]) -> None:
    """Give missing signals the channel that may hold them as their reason, with what its name leaves open."""
    named: list[str] = []
    for log, channels in zip(logs, named_channels(logs), strict=True):
        for found in unsure(channels, draft.machine):
            if draft.missing.get(found.signal) == NO_CHANNEL and not _is_given(draft, log, found):
                there = replace(found, origin=in_its_file(found.origin, log))
                draft.missing[found.signal] = there.reason
                named.append(f"{there.origin.label} ({found.signal})")
    if named:
        more = f" and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
        draft.notes.append(
            f"{NOT_USED}: {', '.join(named[:_NAMED])}{more}; `mfhca channels LOG` has the line to write for each"
        )


def by_number(items: Mapping[str, Signal], machine: Machine) -> list[str]:
    """Labels with the wheel that they were taken for by nothing but a number: ``/speeds.data[0] as FR``, one for each wheel."""
    out: dict[str, str] = {}
    for name, signal in items.items():
        group, wheel, _ = (*name.split("."), "", "")[:3]
        numbered = re.search(r"\d", signal.origin.label) is not None
        if group == "wheel" and signal.guessed and numbered and len(machine.wheels) > 1:
            said = wheel_said(signal.origin.label, machine)
            if said != wheel and signal.origin.label != name:
                out.setdefault(wheel, f"{signal.origin.label} as {wheel}")
    return [*out.values()]


def _take_given(draft: _Draft, name: str, source: SignalSource, logs: Sequence[RawLog]) -> None:
    """Take a signal exactly from where the machine file says."""
    chosen = [log for log in logs if is_source(log.source, source.source)]
    if not chosen:
        draft.missing[name] = f"no source matches {source.source!r}"
        return
    for log in chosen:
        channel = find_channel(log, source)
        if channel is None:
            continue
        unit = source.unit or usable_unit(name, channel.unit) or ""
        if not unit and channel.unit:
            draft.notes.append(f"{name}: the recorded unit {channel.unit!r} is not known; SI is assumed")
        origin = replace(source, unit=unit)
        converted = convert(name, channel_data(log, channel, origin), origin, draft.machine, log.store)
        draft.take(name, log, channel, converted, origin, False)
        draft.given.setdefault((log.source, channel.name), name)
        return
    used = {s.label for s in draft.machine.signals.values()}  # of what the file says of another signal, it is none
    near = difflib.get_close_matches(source.label, [k for c in chosen for k in c.channels if k not in used], 3, 0.6)
    hint = f"; similar: {', '.join(near)}" if near else ""
    draft.missing[name] = f"{FILE_NAMES} {source.label!r}, which no source holds{hint}"


def _take_guess(draft: _Draft, name: str, found: list[tuple[Candidate, RawLog]]) -> None:
    """Take the surest candidate that holds a number."""
    reason = NO_CHANNEL
    ranked = sorted(found, key=lambda f: (f[0].rank, number_of(f[0].origin.label), -_size(f[1], f[0])))
    for i, (candidate, log) in enumerate(ranked):
        channel = find_channel(log, candidate.origin)
        if channel is None:
            continue
        other = draft.given.get((log.source, channel.name))
        if other is not None:  # the machine file says what it is
            reason = f"{candidate.origin.label}, which would fit, is given as {other}"
            continue
        data = channel_data(log, channel, candidate.origin)
        if not np.isfinite(data[1]).any():
            reason = f"{candidate.origin.label} {NO_NUMBER}"
            continue
        unit = candidate.origin.unit or usable_unit(name, channel.unit) or ""
        origin = choose_motor_or_wheel(name, replace(candidate.origin, unit=unit), data[1], draft.machine)
        try:
            converted = convert(name, data, origin, draft.machine, log.store)
        except ConfigError as error:
            reason = str(error)
            continue
        draft.take(name, log, channel, converted, origin, True)
        if candidate.rank == 0:
            draft.named.append(name)
            return
        text = f"{name} is taken from {origin.label} ({candidate.why}"
        text += f", in {origin.unit.replace('1', 'fractions')}" if origin.unit else ", unit not stated, SI assumed"
        text += (
            f" at the {origin.at})"
            if known_unit(origin.unit) in ("rpm", "rad/s") and name.startswith("wheel.")
            else ")"
        )
        rivals = [
            c.origin.label for c, rival in ranked[i + 1 :] if _as_sure(c, candidate) and not _is_given(draft, rival, c)
        ]
        text += f"; {rivals[0]} would fit as well" if rivals else ""
        draft.notes.append(text)
        return
    draft.missing[name] = reason


def _as_sure(one: Candidate, other: Candidate) -> bool:
    """Whether neither the rule nor a number in their names prefers one of two channels."""
    return one.rank == other.rank and number_of(one.origin.label) == number_of(other.origin.label)


def _is_given(draft: _Draft, log: RawLog, candidate: Candidate | Unsure) -> bool:
    channel = find_channel(log, candidate.origin)
    return channel is not None and (log.source, channel.name) in draft.given


def _size(log: RawLog, candidate: Candidate) -> int:
    channel = find_channel(log, candidate.origin)
    return 0 if channel is None else len(channel.stamps)
