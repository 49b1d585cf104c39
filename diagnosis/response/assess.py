"""The walk: response of every drive → blocks → views of each wheel → states → findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.answering import BODY_COMMANDS, MOVES, wheels_of
from diagnosis.response.asked import asked_of
from diagnosis.response.beside import Bodies, same_side, turns_by_wheels, views
from diagnosis.response.body import BodySpeed
from diagnosis.response.calm_holds import calm_hold, either
from diagnosis.response.channel import holds_of, samples_of
from diagnosis.response.common_cause import (
    consequence,
    less_sure,
    standing,
    stands_with_all,
    unwinds,
    without_consequences,
)
from diagnosis.response.company import after_a_dispute, in_company
from diagnosis.response.disputed import DISPUTED, HIDES, disputed_steps, doubted, unproved
from diagnosis.response.drive import by_peers, unanswered
from diagnosis.response.effort import idle_drives, idle_spans, own_pull, powered, shares_of
from diagnosis.response.encoder_scale import scaled_sides
from diagnosis.response.encoder_scale_words import by_the_gyro, told
from diagnosis.response.ground import by_drag, by_slip
from diagnosis.response.gyro import wrong_gyro
from diagnosis.response.holds import with_habits
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.joint import rolling
from diagnosis.response.joint_gain import scaled_channels, told_gain, without_gains
from diagnosis.response.late import late_neighbour, late_wheels, left_open, smallest_delay
from diagnosis.response.machine import (
    Judged,
    lasting_losses,
    otherwise,
    paused,
    pauses,
    standstills,
    unexplained,
    unlike,
)
from diagnosis.response.models import BLOCK_S, Beside, Blocks
from diagnosis.response.motionless import motionless, not_moving
from diagnosis.response.nearer import nearer_to_its_command
from diagnosis.response.pairs import by_leaps
from diagnosis.response.power import powers_of, unshown
from diagnosis.response.ramps import only_a_ramp
from diagnosis.response.reversed_sign import reversed_spans, told_reversed
from diagnosis.response.rivals import (
    by_each_other,
    held_back_together,
    others_fault,
    told_and_doing_alike,
)
from diagnosis.response.runaway import runaways
from diagnosis.response.runs_on import running_on
from diagnosis.response.share_findings import told_share
from diagnosis.response.sides import sides_of
from diagnosis.response.sideways import crossed, goes_sideways
from diagnosis.response.spells import spans_of, until_back, where_asked
from diagnosis.response.states import judge
from diagnosis.response.turning import track_of, turning_of, turns_other_way, turns_with, unasked_turn, wrong_yaw_rate
from diagnosis.response.unlike import contradicting, unlike_in_motion
from diagnosis.response.uphill import lower_by_a_load
from diagnosis.response.usual_times import as_usual, shares_by_commands, shares_by_positions
from diagnosis.response.witness import witness_of, witnessed
from diagnosis.response.wound_up import after_a_fault
from diagnosis.results.assessment import Assessment, Finding, Reason
from replay.machine.config import Limits
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_S = 1.0
_UNDIRECTED = (
    "{name} is never below 0, also where it is told to go backwards: it tells no direction and is read with that of its command, so that a "
    "{{wheel}} that turns the wrong way would not show."
)
_PAIR = 2  # wheels, of which each moves one side of the machine
_TURNED = (
    "The sides of the machine go apart as where it turns, of which the log has neither a command nor a measurement: log the commanded yaw "
    "rate (cmd.omega) or a measured one (imu.yaw_rate)."
)
_EXCHANGED = (
    "the sides, or those of one axle, go apart the other way than the machine turns: left and right may be exchanged, or the sign of one "
    "side, or of the yaw rate, is wrong"
)


@dataclass(frozen=True)
class Judgement:
    """Both sides of each wheel that could be judged, and what happened to the machine as a whole, to its gyro, to all speeds and to those of one side, a sentence each.

    `when` has the times of what happened to the machine, by its sentence [s]; `apart` says which wheels read another share of the motion than the others, or nothing, all through; `unrelated` says that speeds and commands are of sizes that nothing relates.
    """

    parts: Mapping[str, tuple[Assessment, Assessment]]
    events: tuple[str, ...]
    gyro: tuple[str, ...] = ()
    unshown: tuple[str, ...] = ()
    unrelated: tuple[str, ...] = ()
    scaled: tuple[str, ...] = ()
    apart: tuple[str, ...] = ()
    when: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)


def assess_response(
    data: Mapping[str, FollowerData],
    geometry: Geometry | None,
    yaw: Array | None,
    limits: Limits,
    dt: float,
    speeds: tuple[BodySpeed, ...] = (),
    heading: Array | None = None,
) -> Judgement:
    """Judge drives by their response.

    Parameters
    ----------
    data : Mapping[str, FollowerData]
        All drives that are judged so, by wheel.
    geometry : Geometry or None
        Says which wheels are on one side.
    yaw : Array or None, shape (n,)
        Measured yaw rate [rad/s].
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    speeds : tuple[BodySpeed, ...]
        The body's speed by its own sensors, in blocks of `BLOCK_S`.
    heading : Array or None, shape (b,)
        Yaw rate by the heading of odometry in such blocks [rad/s].
    """
    if not data:
        return Judgement({}, ())
    width, cell = max(1, round(BLOCK_S / dt)), cell_of(dt)
    data = without_gains(data, scales := scaled_channels(data, dt))
    by_position = shares_by_positions(data, dt)
    data = {w: replace(d, joint_share=by_position.get(w)) for w, d in data.items()}
    drives = list(data.values())
    left_out = standing(data, limits.driving_speed, dt)
    idle = spans_of(np.logical_or.reduce(list(left_out.values())))
    found = wheels_of(data, left_out, geometry, (cell, width), limits, dt)
    if changed := shares_by_commands(found, width):
        data = {
            w: replace(d, share=changed.get(w, found[w].data.share if w in found else None)) for w, d in data.items()
        }
        found = wheels_of(data, left_out, geometry, (cell, width), limits, dt)
    witness = witness_of(speeds, drives, width, limits, dt)
    seen = [span for span in idle if witness.saw(*span, width)]
    idle = [span for span in idle if span not in seen]
    if not found:
        stood = standstills(idle, dt)
        ignored = () if stood or seen else unexplained(drives, limits, dt)
        ignored, said = witnessed(ignored, witness, seen, drives, speeds, (width, limits, dt))
        still = {text: [(a * dt, b * dt) for a, b in idle] for text in stood}
        return Judgement({}, stood, (), said, () if stood else ignored, when=still)
    rest = {w: samples_of(d.y, d.fresh) for w, d in data.items() if w not in found}
    found = by_each_other(found, width * dt, rest)
    holds = {w: holds_of(j.wheel.samples, MOVES * limits.driving_speed, dt) for w, j in found.items()}
    lone = (
        len(data) == _PAIR and len(found) == _PAIR and turns_by_wheels(*(j.wheel.blocks.mean for j in found.values()))
    )
    found = {w: j._replace(wheel=j.wheel._replace(lone=lone)) for w, j in with_habits(found, holds).items()}
    means, turned_by = {w: j.wheel.blocks.mean for w, j in found.items()}, None if yaw is None else cells(yaw, width)
    rollers = any(d.commands.shape[1] > BODY_COMMANDS for d in drives)
    sideways = rollers or goes_sideways(means, geometry, width * dt)
    exchanged = sideways and not rollers and crossed(means, geometry, turned_by)
    stretch = drives[0].stretch if len(drives) == 1 else None
    bodies = Bodies(speeds, turned_by, width * dt, sideways, None if stretch is None else cells(stretch, width))
    efforts = {  # what stands with the machine pulls nothing, and one noise is by chance less than another
        w: cells(np.where(left_out[w], np.nan, j.data.effort), width)
        for w, j in found.items()
        if j.data.effort is not None and not sideways
    }
    mates = {w: tuple(o for o in found if o != w and same_side(w, o, geometry)) for w in found}
    efforts, none = powered(efforts)
    beside_it = {w: tuple(o for o in mates[w] if o in efforts) or tuple(o for o in found if o != w) for w in found}
    pulls, spans = shares_of(found, efforts, beside_it), idle_spans(efforts, found, beside_it, width * dt)
    found = {
        w: j._replace(yaw=yaw, rolls=w in none, wheel=j.wheel._replace(pull=own_pull(j, efforts.get(w), pulls.get(w))))
        for w, j in found.items()
    }
    names = {w: j.data.name for w, j in found.items()}
    usual = {w: as_usual(j.wheel.blocks.mean, j.data.share, width) for w, j in found.items()}
    beside, by_motion, left_notes = views(names, {w: j.wheel.blocks for w, j in found.items()}, geometry, bodies, usual)
    judged = by_leaps({w: judge(j, beside.get(w), dt, width) for w, j in found.items()}, mates)
    turned = {w: [s for s in j.spells if unasked_turn(w, s, judged, geometry, yaw)] for w, j in judged.items()}
    slips = {w: [s for s in j.spells if by_slip(s, w, judged, bodies.yaw)] for w, j in judged.items()}
    kept = {
        w: [
            less_sure(s, w, judged, width * dt)
            for s in j.spells
            if not others_fault(s, w, judged)
            and not told_and_doing_alike(s, w, judged)
            and not consequence(s, w, judged)
            and not unwinds(s, w, judged, width * dt)
            and not wrong_yaw_rate(s, j)
            and s not in slips[w]
            and s not in turned[w]
            and not by_drag(s, w, judged)
        ]
        for w, j in judged.items()
    }
    least = max(1, round(_LEAST_S / BLOCK_S))
    asked = {w: asked_of(j, limits) for w, j in judged.items()}
    bare = {w: j.posterior if j.speed is None else None for w, j in judged.items()}
    moves = {w: (x, rolling(x, judged[w].joint, MOVES * limits.driving_speed)) for w, x in asked.items()}
    kept = {w: where_asked(spells, moves[w], least, bare[w]) for w, spells in kept.items()}
    kept = {w: until_back(spells, judged[w].wheel.blocks.dead, asked[w]) for w, spells in kept.items()}
    kept = {w: [s for s in spells if not stands_with_all(s, w, judged, asked)] for w, spells in kept.items()}
    turning = turning_of(judged, geometry, bodies.yaw if not sideways else None)
    kept = {w: [s._replace(turns=turns_with(w, s, judged, turning)) for s in spells] for w, spells in kept.items()}
    other_way = exchanged or turns_other_way(judged, geometry, turning)
    by_motion = {} if other_way else by_motion  # then a yaw rate confirms no wheel
    together = held_back_together(judged)
    like = {w: by_peers(w, judged, geometry, cell) for w in judged}
    away = runaways(judged, efforts, width * dt)
    weak = {
        w: _drives(
            w,
            judged,
            (like[w], by_motion.get(w)),
            (spans.get(w, []), bool(mates[w]) or not _turned_by(w, found)),
            (efforts.get(w), away.get(w, [])),
            width * dt,
        )
        for w in judged
        if not judged[w].data.unpowered
    }
    weak = {w: without_consequences(found, w, judged, width) for w, found in weak.items()}
    late = late_wheels(judged, width * dt)
    unclear = left_open(late, judged)
    kept = {w: [x for x in spells if not only_a_ramp(x, unclear[w], judged[w], width)] for w, spells in kept.items()}
    late = {w: [f for f in found if f not in unclear[w]] for w, found in late.items()}
    nobodys = {
        w: [
            x
            for x in spells
            if lower_by_a_load(x, judged[w])
            or calm_hold(x, w, judged, MOVES * limits.driving_speed)
            or nearer_to_its_command(x, w, judged, mates[w], width * dt)
            or in_company(x, w, judged)
            or after_a_dispute(x, w, judged, width * dt)
        ]
        for w, spells in kept.items()
    }
    kept = {w: [x for x in spells if x not in nobodys[w]] for w, spells in kept.items()}
    kept = {w: [x for x in spells if not late_neighbour(x, w, late, width)] for w, spells in kept.items()}
    parts = {
        w: sides_of(j, kept[w], (weak.get(w, []), late[w]), (left_out[w], together), limits, dt)
        for w, j in judged.items()
    }
    parts = {
        w: (
            doubted(
                sensor,
                [slice(f.start, f.stop) for f in unclear[w]]
                + [slice(x.start * width, x.stop * width) for x in nobodys[w]],
            ),
            drive,
        )
        for w, (sensor, drive) in parts.items()
    }
    if len(data) == 1:
        parts = {w: (either(a, judged[w], MOVES * limits.driving_speed), b) for w, (a, b) in parts.items()}
    astray, lasts, elsewhere = otherwise(judged, width * dt, witness.there)
    remarks = (*astray, *left_notes, *((_TURNED,) if any(turned.values()) else ()))
    doubts = {w: Reason(j.odd) for w, j in judged.items() if j.odd and not any(side.findings for side in parts[w])}
    doubts |= {w: j.joint.unlike for w, j in judged.items() if j.joint is not None and j.joint.unlike}
    apart, none_read = (
        unlike_in_motion(judged, mates, sideways=sideways),
        motionless(judged, limits.driving_speed, width * dt),
    )
    doubts |= apart | unlike(judged) | none_read
    if other_way:
        doubts = dict.fromkeys(judged, Reason(_EXCHANGED)) | doubts
    for w, why in doubts.items():
        parts[w] = doubted(parts[w][0], [slice(None)], why), parts[w][1]
    parts |= {w: not_moving(*parts[w], why) for w, why in none_read.items()}
    disputed = disputed_steps(judged, width * dt)
    parts |= {w: (unproved(parts[w][0], one, DISPUTED), parts[w][1]) for w, one in disputed.items()}
    lasting = lasting_losses(judged)
    for w, (sensor, drive) in parts.items():
        j, about = judged[w], asked[w]
        powers = powers_of(j.wheel.blocks, j.driving, about, width * dt, beside.get(w), limits.clear_at, lasting[w])
        hides = np.repeat(unshown(powers, j.driving.size, width * dt), width)[: j.data.y.size]
        sensor = unproved(sensor, hides, HIDES)
        delay, lateness = smallest_delay(j, width * dt)
        powers = powers._replace(rows=(*powers.rows, delay))
        signless = (_UNDIRECTED.format(name=names[w]),) if j.data.undirected else ()
        parts[w] = replace(sensor, powers=powers, notes=(*sensor.notes, lateness, *signless, *remarks)), drive
    unsettled = {w: [*kept[w], *(s for s in slips[w] if not wrong_yaw_rate(s, j))] for w, j in judged.items()}
    sought = scaled_sides(judged, unsettled, turning, width * dt)
    aside, across = [(x.start, x.stop) for x in sought.found], None if other_way else track_of(judged, geometry)
    gyro = wrong_gyro(judged, unsettled, turning, width * dt, heading, aside, across)
    open_to = [slice(x.start * width, x.stop * width) for x in gyro if not x.sure]
    parts = {
        w: (by_the_gyro(w, sensor, judged, sought, turning, open_to), drive) for w, (sensor, drive) in parts.items()
    }
    ignored = () if any(j.response.answered for j in judged.values()) else unexplained(drives, limits, dt)
    of_one = [f for side in parts.values() for f in side[0].findings] if len(data) == 1 else []
    stood = standstills(idle, dt) or paused(of_one, dt)
    rests = idle or [(f.start, f.stop) for f in pauses(of_one)]
    times = [(a * dt, b * dt) for a, b in rests]
    when = dict.fromkeys(stood, times) | dict.fromkeys(astray, elsewhere)
    ignored, said = witnessed(ignored, witness, seen, drives, speeds, (width, limits, dt))
    scaled = told(sought, turning, width * dt)
    parts = {w: told_share(sides, judged[w]) for w, sides in parts.items()}
    other_sign = reversed_spans(judged, width * dt)
    parts = {w: told_reversed(sides, judged[w], other_sign.get(w, [])) for w, sides in parts.items()}
    parts |= {w: told_gain(parts[w], data[w].name, gain) for w, gain in scales.items() if w in parts}
    told_of_it = tuple(x.text for x in gyro)
    events = (*stood, *(astray if lasts else ()))
    return Judgement(parts, events, told_of_it, said, ignored, scaled, contradicting(apart, none_read), when)


def _turned_by(wheel: str, found: Mapping[str, Judged]) -> bool:
    """Whether a wheel and one of the others turn the machine by what they differ."""
    means = {w: j.wheel.blocks.mean for w, j in found.items()}
    return any(turns_by_wheels(means[wheel], means[o]) for o in means if o != wheel)


def _drives(
    wheel: str,
    judged: Mapping[str, Judged],
    known: tuple[Blocks | None, Beside | None],
    pull: tuple[list[tuple[int, int]], bool],
    effort: tuple[Array | None, list[Finding]],
    block_s: float,
) -> list[Finding]:
    """What is known to be a drive's fault, each time once.

    `known`: its blocks with what is expected of it, and how the ground moves; `pull`: blocks in which it pulls nothing, and whether it is dragged along then;
    `effort` in blocks, and times in which it pulls away.
    """
    idle = after_a_fault(idle_drives(judged[wheel], *pull, block_s), judged[wheel], effort[0], block_s)  # without power
    told, blocks, share = idle + effort[1], known[0], judged[wheel].data.share
    if blocks is not None and share is not None:  # at a share of its speed it keeps none that it is not told
        blocks = blocks._replace(mean=as_usual(blocks.mean, share, round(block_s / judged[wheel].wheel.dt)))
    for more in (unanswered(wheel, judged, known, block_s), running_on(wheel, judged, blocks, block_s)):
        told = told + [f for f in more if not any(f.start < g.stop and g.start < f.stop for g in told)]
    return told
