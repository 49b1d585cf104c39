"""The machine as a whole: what its wheels have in common beside its commands, and beside what measures the body, as it changes in a mission.

Wheels that are compared with each other alone show nothing of what they share: a supply that gives less to all motors, speeds that all read less,
tyres that all slip, and a receiver or a gyro that fails, on which other judgements rest. Each of these is no part's fault that could be named.
What is so from start to end beside the body's sensors is a scale's, which `diagnosis.decision.scale` judges.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.yaw import turn_by_angles
from diagnosis.decision.common_response import common_change
from diagnosis.decision.common_spell import common_spell
from diagnosis.decision.course import FEW, FLOOR, Course
from diagnosis.decision.scale import bodies
from diagnosis.results.machine_event import (
    MachineEvent,
    beyond_the_top,
    body_otherwise,
    gyro_otherwise,
    less_than_told,
    not_at_rest,
    other_response,
)
from diagnosis.results.plain_numbers import plain
from diagnosis.results.said import Said, Stated
from replay.arrays.quantiles import median_known, median_of, quantile_of
from replay.arrays.runs import runs_of

Flags = NDArray[np.bool_]

_MOVES = 0.3  # of the usual speed: less of it says nothing
_USUAL = 0.95  # quantile
_ALIKE = 0.15  # of the usual speed, by which half of the wheels are no further from their median: in tight turns none is the body's
_SETTLED_S, _SETTLED = 0.6, 0.3  # a command that has changed by less than this share of the usual one over this time
_KNOWN = 0.5  # of a window
_SPELL_S = (
    6.0  # for which the body is off without a break; healthy machines slip for up to four, of 34 + 20 tuning missions
)
_SAME, _VARIES = 1e-6, 0.5  # of the usual speed: a reading that is held; by which the wheels' speeds vary meanwhile
_MANY = 20  # windows before and after a change, at least: ten seconds
_FEW_CHANGE = 1.5  # times the change that counts, where there are few windows in turns
_TURNS = 0.3  # of the usual yaw rate, root mean square over a window
_DEAF, _WILD, _DEAF_S = (
    0.35,
    2.2,
    2.5,
)  # slope of the measured yaw rate by that of the angles: healthy ones 0.6 to 1.2 in any window
#: Of the change that counts; s without a break, and in all: of 17 + 20 healthy missions (tuning, a user's) none was so far behind for more than 2 s, a loader
#: that drives into its heap for 4.
_NEARLY, _BEHIND_S, _AGAIN_S = 0.85, 5.0, 15.0
_AS_FAST = "as fast as steering angles and {wheel} speeds make it"
_GEAR = 0.62  # ln: what changes by more is another gear
_BEYOND_TOP = 1.6  # times the top speed of the machine file, which no machine reaches
_STANDS, _CLOSED, _CREEPS = 0.01, 0.03, 0.035  # of the top speed; of full opening; of the top speed
_SETTLES_S, _CREEPS_S = 1.5, 1.0  # after a stop, in which a machine rolls out, and for which it moves on


def as_a_whole(cells: Cells) -> list[MachineEvent]:
    """What the machine does as a whole that no part explains, worded without its machine's words.

    None of a machine whose drives have no openings: what it has in common is judged by its own models.
    """
    if not np.isfinite(cells.wheels("u")).any():
        return []
    beyond = list(_beyond_the_top(cells))
    if beyond:  # of another unit, nothing else is worth asking
        return beyond
    beside_body = list(_beside_body(cells))
    # speeds that are in doubt make the turns by them doubtful as well
    beside_commands = list(_beside_commands(cells)) or list(_beside_openings(cells))
    return [*beside_commands, *_at_rest(cells), *(beside_body or _beside_gyro(cells))]


def _counts(cells: Cells) -> float:
    """The loss that counts [ln]."""
    return -float(np.log1p(-cells.machine.limits.clear_at))


def _common(cells: Cells) -> tuple[Array, Array, float]:
    """Speeds of wheels of which nothing is stated (cells, wheels), the size of their median (cells,), and what it usually is [m/s]."""
    sound = np.column_stack([~cells.told(wheel) for wheel in cells.machine.wheels])
    speeds = np.where(sound, cells.wheels("v"), np.nan)
    v = _median(speeds)
    return speeds, v, _usual(v)


def _stated(cells: Cells) -> Flags:
    """Cells in which a fault of any wheel is stated, shape (cells,)."""
    return np.asarray(np.column_stack([cells.told(wheel) for wheel in cells.machine.wheels]).any(axis=1), np.bool_)


def _median(x: Array) -> Array:
    """Size of the median of the wheels, NaN where hardly half of them are known; from shape (cells, wheels) to (cells,)."""
    known = np.isfinite(x).sum(axis=1) > x.shape[1] / 2
    out = np.full(len(x), np.nan)
    out[known] = np.abs(median_known(x[known], axis=1))
    return out


def _largest(x: Array) -> Array:
    """Largest size among the wheels, NaN where none is known; from shape (cells, wheels) to (cells,)."""
    known = np.isfinite(x).any(axis=1)
    return np.where(known, np.abs(np.nan_to_num(x)).max(axis=1, initial=0.0), np.nan)


def _usual(size: Array) -> float:
    """What a size of shape (cells,) usually is while it is anything; infinite where it never is."""
    some = size[np.nan_to_num(size) > 0.0]
    return float(quantile_of(some, _USUAL)) if some.size else np.inf


def _course(cells: Cells, of: Array, by: Array, use: Flags) -> Course:
    """What one size is of another where both are used, each of shape (cells,)."""
    use = use & np.isfinite(of) & np.isfinite(by)
    frame = cells.frame
    enough = frame.sums(use.astype(np.float64)) >= _KNOWN * min(frame.length, frame.cells)
    part, whole = (frame.sums(np.where(use, x, 0.0)) for x in (of, by))
    enough &= whole > 0.0
    return Course(np.where(enough, part / np.where(enough, whole, 1.0), np.nan), cells)


def _beside_commands(cells: Cells) -> Iterator[MachineEvent]:
    """All wheels make another share of what they are told from some moment on, or do not make it throughout."""
    _, v, _ = _common(cells)
    asked = _median(cells.reference)
    usual, back = _usual(asked), max(1, round(_SETTLED_S / cells.dt))
    before = np.r_[np.full(min(back, asked.size), np.nan), asked[:-back]]
    with np.errstate(invalid="ignore"):
        use = (asked > _MOVES * usual) & (np.abs(asked - before) < _SETTLED * usual)
    use &= ~_stated(cells)  # a wheel that has failed is dragged along by the others, or drags them
    course, counts = _course(cells, v, asked, use), _counts(cells)
    found = course.changes("what they are told", _NEARLY * counts, _MANY)
    if found is None and course.mostly(counts, counts):
        found = Said(f"{course.usual:.2f} times what they are told throughout")
    found = found or _falls_behind(course, counts)
    if found is not None:
        yield found._replace(text=f"All {{wheels}} together make {found.text}").event(less_than_told)


def _beside_openings(cells: Cells) -> Iterator[MachineEvent]:
    """All wheels make another speed of the same openings from some moment on, or for a while."""
    found, spell, least = common_change(cells, _GEAR), common_spell(cells), _NEARLY * _counts(cells)
    if found is not None and abs(found[0]) >= _counts(cells):
        since = Stated.of(found[1], digits=0)
        text = (
            f"From about {since.start} s on all {{wheels}} together make {np.exp(found[0]):.2f} times the speed of the same {{valve}} openings that they "
            "made before, where they are driven alike"
        )
        yield Said(text, (since.span,)).event(other_response)
    elif spell is not None and least <= abs(spell[0]) <= _GEAR:
        when = Stated.of(*spell[1:], digits=0)
        text = (
            f"At about {when} all {{wheels}} together make {np.exp(spell[0]):.2f} times the speed of the same {{valve}} openings "
            "that they make else at such speeds"
        )
        yield Said(text, (when.span,)).event(other_response)


def _falls_behind(course: Course, counts: float) -> Said | None:
    """How much of their commands all wheels make for a while or again and again, and when; None where that is what they usually make."""
    if not np.isfinite(course.usual):
        return None
    at = np.flatnonzero(np.isfinite(course.share))
    behind = course.log[at] - np.log(max(course.usual, FLOOR)) <= -_NEARLY * counts
    spell = course.longest(behind, _BEHIND_S)
    hop = course.cells.frame.hop * course.cells.dt
    if spell is not None:
        first, last = int(at[spell[0]]), int(at[spell[1] - 1]) + 1
        inside, when = float(median_of(course.share[at[slice(*spell)]])), Stated.of(*course.span(first, last), digits=0)
        return Said(f"{inside:.2f} times what they are told at {when}, and {course.usual:.2f} times else", (when.span,))
    if np.count_nonzero(behind) * hop < _AGAIN_S:
        return None
    inside = float(median_of(course.share[at[behind]]))
    text = f"{inside:.2f} times what they are told again and again, for {np.count_nonzero(behind) * hop:.0f} s in all, and {course.usual:.2f} times else"
    return Said(text, tuple(course.span(int(at[a]), int(at[b - 1]) + 1) for a, b in runs_of(behind)))


def _beyond_the_top(cells: Cells) -> Iterator[MachineEvent]:
    """All wheels are much faster for long than the machine file's top speed, as of another unit."""
    _, v, usual = _common(cells)
    if (
        np.isfinite(usual)
        and usual > _BEYOND_TOP * cells.machine.max_speed
        and np.isfinite(v).sum() * cells.dt >= _SPELL_S
    ):
        yield beyond_the_top(
            f"The {{wheels}} reach {plain(usual)} {{speed_unit}}, {usual / cells.machine.max_speed:.1f} times [geometry] max_speed"
        )


def _at_rest(cells: Cells) -> Iterator[MachineEvent]:
    """All wheels read a speed while they are told to stand, and their drives are closed."""
    speeds, v, _ = _common(cells)
    command, opening, top = cells.wheels("u"), cells.wheels("u_applied"), cells.machine.max_speed
    # of every wheel: in a turn on the spot their median is still
    asked, used = (_largest(x) for x in (cells.reference, np.where(np.isfinite(opening), opening, command)))
    with np.errstate(invalid="ignore"):
        stands = (asked <= _STANDS * top) & (used <= _CLOSED)
        # every wheel of which nothing is stated, of more than half
        moves = np.isfinite(v) & (np.where(np.isfinite(speeds), np.abs(speeds), np.inf).min(axis=1) > _CREEPS * top)
    before = round(_SETTLES_S / cells.dt)
    settled = np.lib.stride_tricks.sliding_window_view(np.pad(stands, (before, 0)), before + 1).all(axis=1)
    spells = [(a, b) for a, b in runs_of(settled & moves) if (b - a) * cells.dt >= _CREEPS_S]
    if spells:
        a, b = max(spells, key=lambda s: s[1] - s[0])
        when = Stated.of(a * cells.dt, b * cells.dt)
        text = (
            f"All {{wheels}} read about {plain(float(median_known(v[a:b])), 2)} {{speed_unit}} at {when}, while they are told to "
            "stand and no {valve} is open"
        )
        yield Said(text, (when.span,)).event(not_at_rest)


def _beside_body(cells: Cells) -> Iterator[MachineEvent]:
    """A sensor of the body shows another share of the wheels' speed for a time."""
    speeds, v, usual = _common(cells)
    with np.errstate(invalid="ignore"):
        near = (np.abs(np.abs(speeds) - v[:, np.newaxis]) < _ALIKE * usual).sum(axis=1)
        known = np.isfinite(speeds).sum(axis=1)
        # of some of the wheels, in a turn, the median is one side's
        use = (v > _MOVES * usual) & np.where(known == speeds.shape[1], near >= known / 2, near == known)
    counts = _counts(cells)
    for body in bodies(cells):
        found = _held(cells, body.speed, speeds, usual) or _contradicts(
            _course(cells, np.abs(body.speed), v, use), counts
        )
        if found is not None:
            yield found._replace(text=f"By {body.name} the machine goes {found.text}").event(body_otherwise)
            return


def _contradicts(course: Course, counts: float) -> Said | None:
    """How fast the machine goes by a sensor of the body, and when, where that is another share of its wheels' speed by `counts` [ln]; else None."""
    found = course.changes("as fast as by its {wheels}", counts, _MANY)
    if found is not None:
        return found
    spell = course.longest(np.abs(np.nan_to_num(course.log - np.log(max(course.usual, FLOOR)))) >= counts, _SPELL_S)
    if spell is None:
        return None
    inside, when = float(median_known(course.share[slice(*spell)])), Stated.of(*course.span(*spell), digits=0)
    return Said(
        f"{inside:.2f} times as fast as by its {{wheels}} at {when}, and {course.usual:.2f} times else", (when.span,)
    )


def _held(cells: Cells, speed: Array, wheels: Array, usual: float) -> Said | None:
    """That a body's speed (cells,) stays at one value, and for how long, while all wheels (cells, wheels) speed up or slow down by much; else None."""
    with np.errstate(invalid="ignore"):
        same = np.abs(np.diff(speed)) <= _SAME * usual
    for a, b in runs_of(same):
        part = np.abs(wheels[a : b + 1])
        known = np.isfinite(part).any(axis=0)
        if (b - a) * cells.dt < _SPELL_S or np.count_nonzero(known) <= wheels.shape[1] / 2:
            continue
        if float(np.min(np.nanmax(part[:, known], axis=0) - np.nanmin(part[:, known], axis=0))) > _VARIES * usual:
            when = Stated.of(a * cells.dt, (b + 1) * cells.dt, digits=0)
            text = f"at {abs(float(speed[a])):.2f} m/s at {when} to the last digit, while all its {{wheels}} speed up and slow down"
            return Said(text, (when.span,))
    return None


def _beside_gyro(cells: Cells) -> Iterator[MachineEvent]:
    """The measured yaw rate is another share of that by angles and speed, throughout, for a spell, or from some moment on."""
    turn = turn_by_angles(cells)
    if turn is None:
        return
    yaw, expected = turn
    known, frame = np.isfinite(yaw) & np.isfinite(expected), cells.frame
    y, x = (np.where(known, z, 0.0) for z in (yaw, expected))
    power = frame.sums(x * x)
    turns = power >= (_TURNS * _usual(np.abs(x))) ** 2 * min(frame.length, frame.cells)
    course = Course(np.where(turns, frame.sums(x * y) / np.where(turns, power, 1.0), np.nan), cells)
    found = _turns_otherwise(course, _counts(cells))
    if found is None:  # the speeds beside a stated fault may be one side's
        stated = np.column_stack([cells.explained(wheel) for wheel in cells.machine.wheels]).any(axis=1)
        found = _turns_briefly(course._replace(share=np.where(stated, np.nan, course.share)), _counts(cells))
    if found is not None:
        yield found._replace(text=f"By the gyro (imu.yaw_rate) the machine {found.text}").event(gyro_otherwise)


def _turns_otherwise(course: Course, counts: float) -> Said | None:
    """How the machine turns by the gyro, and when, where that is another share by `counts` [ln]; None where it is not."""
    what, share, usual = _AS_FAST, course.share, course.usual
    if course.mostly(_FEW_CHANGE * counts, counts):
        return Said(f"{_turning(usual)} {what} throughout")
    deaf, wild = (
        course.longest(flags, _DEAF_S)
        for flags in (np.nan_to_num(share, nan=1.0) < _DEAF, np.nan_to_num(share) > _WILD)
    )
    spell = deaf or wild
    if spell is not None:
        when = Stated.of(*course.span(*spell), digits=0)
        return Said(f"{_turning(float(median_of(share[slice(*spell)])))} {what} at {when}", (when.span,))
    found = course.changes(what, counts, _MANY) or course.changes(what, _FEW_CHANGE * counts, FEW)
    return None if found is None else found._replace(text=f"turns {found.text}")


def _turns_briefly(course: Course, counts: float) -> Said | None:
    """The same of a spell that stands out of turns that are else alike."""
    spell = course.spell(_NEARLY * counts, _SPELL_S)
    if spell is None:
        return None
    inside, when = float(median_known(course.share[slice(*spell)])), Stated.of(*course.span(*spell), digits=0)
    return Said(f"turns {inside:.2f} times {_AS_FAST} at {when}, and {course.usual:.2f} times else", (when.span,))


def _turning(share: float) -> str:
    """How a machine turns that turns so many times as fast as it should."""
    if share < -_DEAF:
        return f"turns the other way, {abs(share):.2f} times"
    return f"hardly turns, {max(share, 0.0):.2f} times" if share < _DEAF else f"turns {share:.2f} times"
