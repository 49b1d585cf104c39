"""Checks of wheels: second measurements, speed per opening and tracking beside the other wheels, quick changes, delay."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.echo import repeats_its_command
from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.efforts import effort_checks
from diagnosis.clearing.limits import PAIR, Limits, long_limit, measured_twice, response_limits
from diagnosis.clearing.longer import around, longer
from diagnosis.clearing.measure import alone, compared, lasts, late, times, worst
from diagnosis.clearing.opening_offsets import opening_offsets
from diagnosis.clearing.openings import openings_tell
from diagnosis.clearing.pairs import FALLS, pairs_fall
from diagnosis.clearing.plant_response import LIMIT, beside_plant
from diagnosis.clearing.responses import OTHERS, USUAL_TOP, largest, others_at, responses_of, wheel_responses
from diagnosis.clearing.same_side import beside_its_side
from diagnosis.clearing.seconds import alone_apart, less_at_starts, off_second
from diagnosis.clearing.valves import valve_checks
from diagnosis.clearing.wild import wild_readings
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.arrays.blocks import release
from replay.faults import Side

FLOOR = 0.16  # of the top speed: a deviation is a share of at least this
CREEPING, _CREEPS_ALIKE = (
    0.06,
    1.5,
)  # the same beside a second speed; there it counts beyond so many times the median of the others
#: Where a wheel hardly drives, its speed per opening counts beyond so much of the loss that counts, where it does not from less on
#: elsewhere [ln]: dead bands differ. Healthy wheels of seven machines with valves, a tuning mission each, had 0.14 at most.
_CREEPING_RESPONSE = 0.75
#: The least of that [ln], and times the others': what one wheel alone shows. Of 50 healthy missions of 17 machines (tuning) none that is cleared had
#: .12 and 2.2 times the next.
_LEAST_CREEPING, _CREEPING_ALONE = 0.15, 2.2
_ANSWER_S = 0.5  # within which a drive jumps as its command did
ROUGH, _ROUGHER = 0.15, 5.0  # quick changes: share of the speed, times those of the other wheels
_LEAST_ROUGH, _ROUGH_ALONE = (
    0.04,
    2.5,
)  # beside others that are smoother: of 194 healthy logs (14 machines, tuning) none had 2 times the next above it
LATE_S = 0.17  # 0.2 s are told as 0.18 to 0.22
#: How much more of a partial loss the speed per opening shows than a carried wheel's speed alone, because its controller asks for more, and the
#: least that is told from what healthy ones do [ln]. A loss of 0.3 showed 1.4 times as much on a machine whose controller asked for little.
_ASKED_MORE, _LEAST_TOLD = 1.3, 0.06
_TRACKING, _TRACKING_ALONE = 0.5, 0.12  # at most, and at least where the other wheels follow much better
_SLOWER = 3.0  # times the deviation of the others' speeds
#: Of full opening, by which a wheel may differ from the others at one speed, and times what the next one does. Healthy wheels of 14 machines
#: (28 tuning missions) had 0.07 where no other had 0.032, and else 1.6 times the next.
LEAST_OFFSET, _OFF_ALONE = 0.08, 2.2
#: The same of one of two driven wheels, in windows alone: over the mission each is as far off as the other. Two healthy ones of such a truck had 0.033
#: at most, and 1.5 times each other's (five missions).
_OFF_OF_PAIR = 2.0
_STANDS_BEHIND, _FOLLOWS = 0.5, (0.7, 1.3)  # of its command: a wheel that hardly answers beside one that does


def wheel_checks(cells: Cells, clear_at: float) -> Iterator[Checked]:
    """Checks of all wheels; `clear_at` is the loss that counts [1]."""
    speed, command, opening, second = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied", "v_true"))
    reference = cells.reference
    twice = measured_twice(cells)
    used = np.where(np.isfinite(opening), opening, command)
    apart = np.column_stack([cells.apart(wheel) for wheel in cells.machine.wheels])
    speed, second, opening = (np.where(apart, x, np.nan) for x in (speed, second, opening))
    responses = wheel_responses(cells)
    tells = openings_tell(cells, responses)
    windows, lasting = responses.windows, responses.usual
    slow = responses_of(cells, speed, used, reference, CREEPING * USUAL_TOP, over_time=False, beyond_dead=True).windows
    slow[np.isfinite(windows)] = np.nan
    slowest = [float(x) for x in largest(-slow)]
    limits = response_limits(responses, twice, clear_at, cells.carried_shares, cells.ahead, driven=len(cells.driven))
    long = longer(cells, -windows, cells.machine.wheels)
    long_most = [float(x) for x in largest(long)]
    tracking, rough = _tracking(cells, speed, reference), _rough_beside_others(roughness_of(cells, speed, reference))
    rough = np.fmax(rough, wild_readings(cells, speed, FLOOR * cells.machine.max_speed))
    worst_tracking, roughest = ([float(x) for x in largest(z)] for z in (tracking, rough))
    beside, together = beside_its_side(cells, responses), pairs_fall(responses, cells)
    offsets = opening_offsets(cells, speed, used)
    by_file, for_a_part = beside_plant(cells, used, responses)
    most_off = [float(x) for x in largest(offsets[0])], [float(x) for x in offsets[1]]
    delays, made = late(speed, reference, cells.dt), made_of_commands(cells, speed, reference)
    powered = len(cells.driven)
    by_effort = effort_checks(cells)
    top = cells.machine.max_speed
    slow_off = [compared(cells, y, x, CREEPING * top).off for y, x in zip(speed.T, second.T, strict=True)]
    creeping = less_at_starts(np.column_stack(slow_off))
    slowly = [float(x) for x in largest(creeping)]
    apart_from_second = off_second(cells, speed, second, FLOOR * top)
    most_apart = [float(x) for x in largest(apart_from_second)]
    yield from valve_checks(cells, Kind.WHEEL, clear_at)
    for i, wheel in enumerate(cells.machine.wheels):
        about = (Kind.WHEEL, wheel)
        either = Side.SENSOR if wheel in cells.machine.unpowered else Side.SENSOR_OR_ACTUATOR
        if not _known(speed[:, i]):
            continue
        if twice[i][1]:
            about_sensor = (*about, Side.SENSOR, Check.SECOND_MEASUREMENT)
            most = alone_apart(most_apart, i, clear_at)
            driven = worst(cells, about_sensor, apart_from_second[:, i], most, apart=True)
            creeps = worst(cells, about_sensor, creeping[:, i], most_creeping(slowly, i, clear_at), apart=True)
            yield max(driven, creeps, key=times)
        if wheel in cells.carried and not twice[i][0] and _known(command[:, i]):
            most = max(cells.carried[wheel], cells.may_carry)
            limits[i] = beside_ground(limits[i], most, clear_at)
            yield Checked(*about, Side.ACTUATOR, Check.CARRIED, most, most_carried(clear_at))
        if by_file[i] is not None:
            about_plant = (*about, either, Check.PLANT_RESPONSE)
            share = -float(np.log1p(-clear_at))
            whole = lasts(cells, about_plant, abs(by_file[i] or 0.0), LIMIT * share)
            part = whole if for_a_part is None else lasts(cells, about_plant, for_a_part.off, for_a_part.limit * share)
            yield max(whole, part, key=times)
        # where an opening is no speed, what it gives says nothing of a wheel whose sides are both measured twice
        enough = powered >= OTHERS  # of two wheels, each is the other's measure: one of both is off, or nobody is
        if _known(used[:, i]) and enough and (tells or not all(twice[i])):
            own = limits[i]
            response = (*about, either, Check.RESPONSE)
            driven = worst(cells, response, -windows[:, i], own.below, apart=True)
            most_slow = max(own.below, -_CREEPING_RESPONSE * float(np.log1p(-clear_at)))
            if not any(twice[i]):
                most_slow = alone(slowest, i, most_slow, _LEAST_CREEPING, _CREEPING_ALONE)
            found = [driven, worst(cells, response, -slow[:, i], most_slow, apart=True)]
            if any(twice[i]):
                most_long = long_limit(long_most, i, own.below)
                found.append(around(worst(cells, response, long[:, i], most_long, apart=True)))
            yield max(found, key=times)
            yield lasts(cells, (*about, either, Check.LASTING_RESPONSE), lasting[i].below, own.lasting_below)
            changed = lasts(cells, (*about, either, Check.CHANGE), responses.changes[i], own.changed)
            grown = lasts(cells, (*about, either, Check.CHANGE), responses.grown[i], own.grown)
            both = float(together[i]) if np.isfinite(together[i]) else None
            falls = lasts(cells, (*about, either, Check.CHANGE), both, -FALLS * float(np.log1p(-clear_at)))
            yield max(changed, grown, falls, key=times)
            if not all(twice[i]):  # of a wheel that is measured twice on both sides, it is the ground's doing
                yield worst(cells, (*about, either, Check.EXCESS), windows[:, i], own.above, apart=True)
                yield lasts(cells, (*about, either, Check.LASTING_EXCESS), lasting[i].above, own.lasting_above)
            if tells and not twice[i][1] and i in beside:
                yield worst(cells, (*about, either, Check.SAME_SIDE), *beside[i], apart=True)
            if tells and (not any(twice[i]) or powered == PAIR) and np.isfinite(offsets[1][i]):
                about_opening = (*about, either, Check.OPENING_OFFSET)
                once, usual = (alone(x, i, 1.0, LEAST_OFFSET, _OFF_ALONE) for x in most_off)
                if powered == PAIR:
                    once = alone(most_off[0], i, 1.0, LEAST_OFFSET, _OFF_OF_PAIR, others=1)
                yield max(
                    worst(cells, about_opening, offsets[0][:, i], once, apart=True),
                    lasts(cells, about_opening, float(offsets[1][i]), usual),
                    key=times,
                )
        if _known(used[:, i]) and wheel in by_effort:
            yield by_effort[wheel]
        # nothing tells what lies behind such a drive, and less where its own opening is all that is measured of it
        if _known(used[:, i]) and enough and not tells and twice[i][0]:
            yield Checked(*about, either, Check.BEHIND, None, limits[i].below)
        if _known(reference[:, i]):
            if (
                _known(used[:, i]) or twice[i][1] or wheel in cells.machine.unpowered
            ):  # a drive with a command alone is judged by how it answers it, not by its lag
                limit = alone(worst_tracking, i, _TRACKING, _TRACKING_ALONE, _SLOWER)
                yield worst(cells, (*about, either, Check.TRACKING), tracking[:, i], limit, apart=True)
            elif (stands := behind_all_through(made, i)) >= _STANDS_BEHIND:
                yield lasts(cells, (*about, either, Check.TRACKING), stands, _STANDS_BEHIND)
            if delays[i] is not None:
                yield lasts(cells, (*about, Side.SENSOR, Check.DELAY), delays[i], LATE_S)
        if _echoes(cells, wheel):  # it measures nothing, and jumps as it is told
            continue
        most_rough = alone(roughest, i, ROUGH, _LEAST_ROUGH, _ROUGH_ALONE)
        yield worst(cells, (*about, Side.SENSOR, Check.ROUGHNESS), rough[:, i], most_rough, apart=True)


def most_creeping(slowly: Sequence[float], i: int, clear_at: float) -> float:
    """By how much a wheel's speed may be off its second measurement where it hardly drives [1].

    Stiction, backlash and pulses that are few make more of small speeds than a fault does, of all wheels alike.

    Parameters
    ----------
    slowly : Sequence[float]
        By how much each wheel's is, at most [1]; NaN where nothing is known.
    i : int
        The wheel.
    clear_at : float
        The loss that counts [1].
    """
    others = [x for j, x in enumerate(slowly) if j != i and np.isfinite(x)]
    return max(clear_at, _CREEPS_ALIKE * float(np.median(others))) if others else clear_at


def beside_ground(limits: Limits, carried: float, clear_at: float) -> Limits:
    """Limits of a wheel that the ground carries: below the others by no more than a loss of its valve would leave to be seen.

    Parameters
    ----------
    limits : Limits
        Those without the ground.
    carried : float
        Share of its speed that the ground gives it [1].
    clear_at : float
        The loss that counts [1].
    """
    seen = -_ASKED_MORE * (1.0 - carried) * float(np.log1p(-clear_at))
    return limits._replace(below=min(limits.below, max(seen, _LEAST_TOLD)))


def most_carried(clear_at: float) -> float:
    """Share of its speed that the ground may give a wheel, so that a loss of its valve still shows in the speed per opening [1].

    `clear_at` is the loss that counts [1].
    """
    return 1.0 + _LEAST_TOLD / (_ASKED_MORE * float(np.log1p(-clear_at)))


def _echoes(cells: Cells, wheel: str) -> bool:
    """Whether a wheel's reading repeats its command."""
    return cells.once(f"echo of {wheel}", lambda: _echo(cells, wheel))


def _echo(cells: Cells, wheel: str) -> bool:
    timeline, name, at = cells.timeline, f"wheel.{wheel}.v", cells.machine.wheels.index(wheel)
    asked = cells.replay.v_ref[:, at]
    y = timeline.signals[name]
    found = repeats_its_command(y, timeline.fresh[name], asked, cells.machine.limits, timeline.dt)
    release(y, asked)
    return found


def _known(x: Array) -> bool:
    return bool(np.isfinite(x).any())


def made_of_commands(cells: Cells, speed: Array, reference: Array) -> Array:
    """Share of its commanded speed that each wheel usually makes while it is commanded [1], shape (wheels,); NaN where it never is.

    `speed` and `reference` of shape (cells, wheels) in m/s.
    """
    frame, floor = cells.frame, FLOOR * cells.machine.max_speed
    asked = frame.mean(np.abs(reference))
    share = np.where(asked > floor, frame.mean(np.abs(speed)) / np.maximum(asked, floor), np.nan)
    known = np.isfinite(share).any(axis=0)
    return np.where(known, np.nanmedian(np.where(known, share, 0.0), axis=0), np.nan)


def behind_all_through(made: Array, i: int) -> float:
    """How much less of its command a wheel makes all through than the one that makes most [1], where that one follows; else 0.

    `made` of shape (wheels,) as of `made_of_commands`.
    """
    most = float(np.nanmax(np.delete(made, i), initial=0.0)) if made.size > 1 else 0.0
    return max(0.0, most - float(made[i])) if _FOLLOWS[0] < most < _FOLLOWS[1] and np.isfinite(made[i]) else 0.0


def _tracking(cells: Cells, speed: Array, reference: Array) -> Array:
    """Mean |v − v_c| by mean |v_c|, less that of the other wheels, shape (windows, wheels)."""
    frame, floor = cells.frame, FLOOR * cells.machine.max_speed
    share = frame.mean(np.abs(speed - reference)) / np.maximum(frame.mean(np.abs(reference)), floor)
    others = others_at(share)
    return np.asarray(share - np.where(np.isfinite(others), others, 0.0))


class Roughness(NamedTuple):
    """Quick changes [m/s], what they are a share of [m/s], and the limit of the share, each of shape (windows, wheels)."""

    quick: Array
    size: Array
    limit: Array


def roughness_of(cells: Cells, speed: Array, reference: Array | None = None) -> Roughness:
    """Quick changes of speeds (cells, wheels); a lone drive, beside which no other shows it, may jump as its command did just before.

    Where that is not recorded, what only rises or falls may be what it was told: noise goes back and forth.
    """
    frame, floor = cells.frame, FLOOR * cells.machine.max_speed
    quick = _quick(speed)
    if speed.shape[1] == 1 and not np.isfinite(cells.reference).any():
        quick = np.where(_turns(speed), quick, 0.0)
    if reference is not None and speed.shape[1] == 1:
        asked, late = np.abs(np.nan_to_num(_quick(reference))), round(_ANSWER_S / cells.dt)
        jumps = np.where(asked > ROUGH * cells.machine.max_speed, asked, 0.0)
        near = np.lib.stride_tricks.sliding_window_view(np.pad(jumps, ((late, 0), (0, 0))), late + 1, axis=0)
        quick = np.maximum(np.abs(quick) - near.max(axis=-1), 0.0)
    much, size = frame.rms(quick), np.maximum(frame.rms(speed), floor)
    others = others_at(much / size)
    return Roughness(much, size, np.maximum(ROUGH, np.where(np.isfinite(others), _ROUGHER * others, 0.0)))


def _quick(x: Array) -> Array:
    """What a cell has beside the mean of it and its neighbours, shape of `x` (cells, wheels)."""
    quick = np.full(x.shape, np.nan)
    quick[1:-1] = x[1:-1] - (x[:-2] + x[1:-1] + x[2:]) / 3.0
    return quick


def _turns(x: Array) -> NDArray[np.bool_]:
    """Whether a cell is above both of its neighbours, or below both, shape of `x` (cells, wheels)."""
    out: NDArray[np.bool_] = np.zeros(x.shape, np.bool_)
    with np.errstate(invalid="ignore"):
        out[1:-1] = (x[1:-1] - x[:-2]) * (x[1:-1] - x[2:]) > 0.0
    return out


def _rough_beside_others(r: Roughness) -> Array:
    """Quick changes as a share of the speed, 0 unless they are much more than other wheels', shape (windows, wheels)."""
    share = r.quick / r.size
    return np.asarray(np.where((share < r.limit) & (r.limit > ROUGH), 0.0, share))
