"""Signals that rules for names would not find: joints of a description, a drive as a whole, tables called cmd_vel."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath

from replay.log.raw_log import Channel, LogSummary, RawLog
from replay.log.source_options import SignalSource, SourceOptions
from replay.log.time_zone import NO_ZONE
from replay.machine.geometry import own_axle
from replay.setup.draft_notes import Draft
from replay.setup.odometry_frame import along_the_ground
from replay.setup.one_clock import Lag
from replay.setup.structure import ONE, Structure
from replay.setup.topic_tables import odometry_column, signals_of_topics
from replay.setup.vesc import motor_signals
from replay.signals.candidate import message_field, source_of

_DATED = 10**18  # ns; stamps before are of a clock without a date
_TOGETHER = 5 * 10**9  # ns; tables of one recorder begin and end together
_ALIKE = 2 * 10**8  # ns; the same of tables that count from their own start, which begin alike in any case
_ANY = Structure(ONE, None).machine(1.0)
_JOINT_TYPES = ("JointState", "DynamicJointState")


def odometry(channels: Mapping[str, Channel]) -> Channel | None:
    """Speed of the body by odometry: of several topics not one whose speed is along an axis of the ground, nor one that is filtered."""
    found = [c for c in channels.values() if message_field(c) == "twist.twist.linear.x" and len(c.values) > 1]
    if not found:
        column = odometry_column(channels, _ANY)
        return None if column is None else column[0]
    return min(found, key=lambda c: (along_the_ground(c, channels), "filter" in c.topic, len(c.topic)))


def ask_about_odometry(structure: Structure, channels: Mapping[str, Channel], draft: Draft) -> None:
    """Ask for another speed of a drive as a whole, where the only one is along an axis of the ground."""
    whole = odometry(channels)
    if (
        structure.wheels == ONE
        and "odometry" in structure.how
        and whole is not None
        and along_the_ground(whole, channels)
    ):
        draft.ask(
            "signals",
            f"where is the speed along the machine? That of {whole.topic} is along an axis of the ground (x of its positions), whatever way the "
            "machine heads; it is not the drive's, and what is said of it is wrong wherever the machine turns.",
        )


def given_signals(
    structure: Structure, channels: Mapping[str, Channel], logs: Sequence[RawLog]
) -> dict[str, SignalSource]:
    """Signals by canonical name, with their units; the rules find the others."""
    given: dict[str, SignalSource] = {}
    speeds = {c.field for c in channels.values() if c.field.startswith("velocity[")}
    for wheel, joint in structure.joints.items():
        for c in channels.values():
            if c.type_name.rpartition("/")[2] not in _JOINT_TYPES or re.search(r"cmd|command|ref|target", c.topic):
                continue
            where = SignalSource(topic=c.topic, field=c.field)
            if c.field == f"velocity[{joint.joint}]":
                given.setdefault(f"wheel.{wheel}.v", replace(where, unit="rad/s"))
            elif c.field == f"effort[{joint.joint}]":
                given.setdefault(f"wheel.{wheel}.effort", replace(where, unit="N·m"))
            elif c.field == f"position[{joint.joint}]":
                leaf = "v_position" if f"velocity[{joint.joint}]" in speeds else "v"
                given.setdefault(f"wheel.{wheel}.{leaf}", replace(where, unit="rad", derivative=True))
            elif c.field == f"position[{joint.steering}]" and joint.steering:
                given.setdefault(f"steer.{own_axle(wheel)}.phi", replace(where, unit="rad"))
    given |= motor_signals(structure, channels)
    whole = odometry(channels)
    if structure.wheels == ONE and "odometry" in structure.how and whole is not None:
        column = odometry_column(channels, _ANY)
        given["wheel.D.v"] = column[1] if column is not None and column[0] is whole else source_of(whole, "m/s")
    given |= {n: o for n, o in signals_of_topics(logs).items() if n not in given}
    if structure.wheels == ONE and "wheel.D.v_ref" not in given:
        asked = given.pop("cmd.v", None) or _command(channels)
        if asked is not None:
            given["wheel.D.v_ref"] = asked
    return given


def _command(channels: Mapping[str, Channel]) -> SignalSource | None:
    """Commanded speed of the whole machine."""
    for c in channels.values():
        kind = c.type_name.rpartition("/")[2]
        asked = kind.startswith("Twist") and re.search(r"cmd|command", c.topic.lower())
        if (asked and c.field in ("linear.x", "twist.linear.x")) or (
            kind.startswith("AckermannDrive") and c.field in ("speed", "drive.speed")
        ):
            return SignalSource(topic=c.topic, field=c.field, unit="m/s")
    return None


def table_sources(
    logs: Sequence[RawLog], draft: Draft, lags: Mapping[str, Lag] | None = None
) -> dict[str, SourceOptions]:
    """Several tables are taken to come from one recorder, if they are of one format and begin and end together, or their signals fit.

    Tables without dates must do so to a fraction of a second. The zone of dates that state none is asked for.

    Parameters
    ----------
    logs : Sequence[RawLog]
        Files of one mission.
    draft : Draft
        Gets the questions.
    lags : Mapping[str, Lag] or None
        Of tables behind the first, where their signals tell.
    """
    lags = lags or {}
    tables = [log for log in logs if all(not c.topic for c in log.channels.values())]
    options = SourceOptions()
    if any(NO_ZONE in note for log in tables for note in log.summary.notes):
        options = replace(options, time_zone="UTC")
    pattern = f"*{PurePath(tables[0].source).suffix}" if tables else ""
    dated = [t.summary.start_ns >= _DATED for t in tables]
    if len(tables) > 1 and (all(dated) or not any(dated)):
        apart = _apart([t.summary for t in tables], lags)
        if apart:
            add = (
                'add clock = "as recorded" to'
                if options.time_zone
                else f'write "{pattern}" = {{ clock = "as recorded" }} into'
            )
            draft.ask(
                "sources",
                f"were all tables stamped by one computer? It is not taken so, for {apart}: clocks are estimated from what both "
                f"recorded, and a table that shares no moving signal with the first is left out. If it was one, {add} [sources].",
            )
        else:
            why = ", for their signals fit" if all(t.source in lags for t in tables[1:]) else ""
            draft.ask(
                "sources",
                f"were all tables stamped by one computer? It is taken so{why}; else remove clock, and it is estimated.",
            )
            options = replace(options, clock="as recorded")
    if options.time_zone:
        draft.ask(
            "sources", "in which time zone are the dates? They state none; UTC is written, Europe/Berlin is another."
        )
    return {} if options == SourceOptions() else {pattern: options}


def _apart(tables: Sequence[LogSummary], lags: Mapping[str, Lag]) -> str:
    """Why tables are not taken to be of one recorder; empty where they are."""
    formats = sorted({t.format for t in tables})
    if len(formats) > 1:
        return f"they are of different formats ({', '.join(formats)})"
    for source, lag in lags.items():
        if lag.apart:
            side = "later" if lag.seconds > 0 else "earlier"
            return f"{lag.by} in {PurePath(source).name} is about {abs(lag.seconds):.1f} s {side} than what it goes with in {PurePath(lag.other).name}"
    most = _TOGETHER if tables[0].start_ns >= _DATED else _ALIKE
    far = max(t.start_ns for t in tables) - min(t.start_ns for t in tables)
    late = max(t.stop_ns for t in tables) - min(t.stop_ns for t in tables)
    fit = all(t.source in lags and lags[t.source].fits for t in tables[1:])
    if max(far, late) > most and not fit:
        return f"they begin {far / 1e9:.1f} s and end {late / 1e9:.1f} s apart"
    return ""
