"""From the states of a wheel's blocks to findings, with onset, size and what tells sensor from drive."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.at_once import back_at_once, how_hard, sensor_by_jumps, times_harder, too_hard
from diagnosis.response.jumps import onset_of
from diagnosis.response.spells import Spell
from diagnosis.response.wheel import EITHER, SENSOR_SHARE, Wheel, sensor_finding
from diagnosis.results.assessment import Finding
from diagnosis.results.limited import limited
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Sat
from diagnosis.results.sentence import About, Sentence, lasting
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_ONE_JUMP, _TWO_JUMPS = 0.92, 0.97
_BY_BODY = 0.08  # that it is the sensor's although the body turns as the reading says
_LEAST_PULLS, _AS_USUAL = 8, (0.6, 1.5)  # blocks with an effort, and its size by the usual one
_CHANGES = 0.1  # of the readings, as a dead sensor's do not
_MOVING = 0.2  # of the usual speed
_CREEPS = 0.03  # of the top speed
_WHOLE = 0.75  # of the speed: what rises, or falls, by less from one reading to the next is no whole jump
_IN_SHARE, _VARIES = 0.06, 0.2  # misfit of a share of another speed, by its own size, and how much that speed varies
_LOUD = 2.0  # times the usual change from reading to reading, the other wheels' at that time included
_BEYOND_HABIT = 2.5  # times as long as healthy channels stay at a value
# a scaled speed that only its command contradicts: loads and slip last less, or are less sure
_BARE_P, _BARE_S = 0.92, 5.0
# a wheel that reads more than both others of its side, by which factor at least: they may share a loss, of which there are more than gains
_TWO, _TOO_QUICK, _OUTVOTED_P = 2, 1.1, 0.6


def finding_of(spell: Spell, wheel: Wheel, speed: Array | None) -> Finding | None:
    """What a spell is; None where nothing tells that it is the sensor's or the drive's fault.

    Parameters
    ----------
    spell : Spell
        The spell.
    wheel : Wheel
        The wheel.
    speed : Array or None, shape (b,)
        Its speed by other channels [m/s].
    """
    step = wheel.samples.step
    width = int(wheel.blocks.start[1]) if wheel.blocks.start.size > 1 else 1
    first, last = spell.start * width, min(spell.stop * width, int(step[-1]) + 1)
    if spell.mode is FaultMode.STUCK:
        return _stuck(spell, wheel, first, last)
    if spell.mode is FaultMode.NO_SIGNAL:
        return _silent(spell, wheel, first, last, speed)
    if spell.mode is FaultMode.NOISY:
        return _noisy(spell, wheel, first, last)
    return _scaled(spell, wheel, (first, last), speed)


def _stuck(spell: Spell, wheel: Wheel, first: int, last: int) -> Finding | None:
    inside = np.flatnonzero((wheel.samples.step >= first) & (wheel.samples.step < last))
    value = float(wheel.samples.value[inside[inside.size // 2]])
    same = wheel.samples.value == value
    start, stop = int(inside[inside.size // 2]), int(inside[inside.size // 2])
    while start > 0 and same[start - 1]:
        start -= 1
    while stop + 1 < same.size and same[stop + 1]:
        stop += 1
    begin, end = int(wheel.samples.step[start]), int(wheel.samples.step[stop]) + 1
    if (end - begin) * wheel.dt < _BEYOND_HABIT * wheel.habit:
        return None
    text = (
        f"{wheel.name} read {plain(value, 4)} {{speed_unit}} in {stop - start + 1} readings one after another, for {lasting((end - begin) * wheel.dt, 2)}; "
        "while it drives it otherwise changes all the time."
    )
    sat = Sat(value, abs(value), value, value, "m/s")
    return sensor_finding(begin, end, FaultMode.STUCK, spell.p * SENSOR_SHARE, Epsilon(1.0, 1.0, 1.0), sat, (text,))


def _silent(spell: Spell, wheel: Wheel, first: int, last: int, speed: Array | None) -> Finding | None:
    part = slice(spell.start, spell.stop)
    middle = 0.5 * (wheel.blocks.low + wheel.blocks.high) if speed is None else speed
    fell = _whole_jump(wheel, middle, first, 0.0)
    rose = _whole_jump(wheel, middle, last, np.inf)
    begin = first if fell is None else int(wheel.samples.step[fell])
    end = last if rose is None else int(wheel.samples.step[rose])
    if fell is None and rose is None and _asked_little(wheel, part) and _lives(wheel, begin, end):
        return None
    asked = "its command asked for motion" if np.isfinite(wheel.blocks.low[part]).any() else "other {wheels} turned"
    texts = [f"{wheel.name} read 0 for {lasting((end - begin) * wheel.dt, 2)} while {asked}."]
    # a wheel that comes free leaps ahead, for its loop has wound up
    sensor = _by_jumps(wheel, 0 if fell is None else 1 + (rose is not None))
    if fell is not None or rose is not None:
        texts.append(
            "It fell to 0, or rose from it, from one reading to the next"
            + (
                ": no drive stops or starts like that."
                if wheel.sharp and fell is not None
                else ", and readings are too far apart to tell a jam from that."
            )
        )
    freed = back_at_once(wheel.samples, last, wheel.dt) if wheel.lone and not spell.turns else None
    if freed is not None and sensor <= EITHER and times_harder(wheel.samples, freed[1:]) > 1.0:
        sensor = sensor_by_jumps(wheel.samples, freed[1:], wheel.dt)
        begin, end = (int(wheel.samples.step[k]) for k in freed)
        hard = how_hard(wheel.samples, freed[1:])
        texts.append(
            f"It was back at its speed from one reading to the next{hard}: a {{wheel}} that comes free has the machine to set going."
        )
    seen = speed is not None and np.nanmedian(np.abs(speed[part])) > _MOVING * np.nanquantile(np.abs(speed), 0.9)
    if speed is not None and wheel.own and not spell.own and not seen:
        sensor = 0.5  # another view of this wheel has it at rest, too
    if seen or spell.own:
        texts.append(f"{wheel.compared} went on moving.")
        sensor = max(sensor, SENSOR_SHARE) if wheel.own or spell.own else sensor
    sensor = _by_body(spell, sensor, texts)
    if _BY_BODY < sensor < SENSOR_SHARE and _pulls_as_usual(wheel, part):
        sensor = SENSOR_SHARE
        texts.append("Its drive pulls as usual, as it does not where a {wheel} is held, or the drive has no power.")
    if sensor > _BY_BODY and _lives(wheel, begin, end):
        sensor = min(sensor, 0.5)
        texts.append("Its readings, small as they are, still change: a dead sensor's do not.")
    if 1.0 - EITHER <= sensor <= EITHER:
        without = "a sharp jump" if wheel.compared else "a sharp jump or another view of this {wheel}"
        texts.append(
            f"Without {without}, a {{wheel}} that stands still and a dead sensor cannot be distinguished; readings 100 times a second, the "
            f"position of its joint, or {'' if wheel.compared else '{or_view}'}the drive's effort would tell them apart."
        )
    sat = Sat(0.0, 0.0, 0.0, 0.0, "m/s")
    return sensor_finding(
        begin, max(end, begin + 1), FaultMode.NO_SIGNAL, spell.p, Epsilon(1.0, 1.0, 1.0), sat, tuple(texts), sensor
    )


def _asked_little(wheel: Wheel, part: slice) -> bool:
    """Whether the command asks for less than this drive usually misses it by, or for hardly anything: friction holds such a wheel."""
    b = wheel.blocks
    low, high = b.low[part], b.high[part]
    known = np.isfinite(low) & np.isfinite(high)
    least = np.maximum(b.noise[part], _CREEPS * float(np.nanquantile(np.abs(b.mean), 0.95)))
    return bool(known.any() and np.mean((np.abs(low + high) < 2.0 * least)[known]) > EITHER)


def _lives(wheel: Wheel, begin: int, end: int) -> bool:
    """Whether readings in steps [begin, end) change now and then, as those of a dead sensor do not."""
    inside = (wheel.samples.step > begin) & (wheel.samples.step < end) & np.isfinite(wheel.samples.change)
    return bool(inside.any() and np.mean(~wheel.samples.same[inside]) > _CHANGES)


def _by_body(spell: Spell, sensor: float, texts: list[str]) -> float:
    """Probability that a spell is the sensor's [1], beside how the body turns; says so in `texts`."""
    if not spell.turns:
        return sensor
    if sensor > EITHER:  # two that contradict each other
        return 0.5
    texts.append(
        "The measured yaw rate follows this reading, not what the {wheel} should do: the {wheel} really turns so, and its {valve} does not do "
        "what it is told."
    )
    return _BY_BODY


def _pulls_as_usual(wheel: Wheel, part: slice) -> bool:
    """Whether a drive has its usual share of the load in most of some blocks: also beside all others, for what lasts is the usual itself."""
    if wheel.pull is None:
        return False
    apart = np.ones(wheel.pull.size, np.bool_)
    apart[part] = False
    known = np.isfinite(wheel.pull)
    share, rest = wheel.pull[known & ~apart], wheel.pull[known & apart]
    if min(share.size, rest.size) < _LEAST_PULLS:
        return False
    whole, other = float(np.median(share)), float(np.median(rest))
    return _AS_USUAL[0] < whole < _AS_USUAL[1] and _AS_USUAL[0] * other < whole < _AS_USUAL[1] * other


def _by_jumps(wheel: Wheel, jumps: int) -> float:
    """Probability that what begins, or ends, within one reading is the sensor's [1]."""
    return (0.5, _ONE_JUMP, _TWO_JUMPS)[jumps] if wheel.sharp else 0.5


def _changes(wheel: Wheel, at: int, ratio: float) -> int | None:
    """Sample behind the jump by a ratio near a step: in a calm moment, or at any time one that is too hard for the drive."""
    found = onset_of(wheel.jumps, wheel.samples, at, ratio, wheel.dt)
    return too_hard(wheel.samples, at, ratio, wheel.dt) if found is None else found


def _whole_jump(wheel: Wheel, expected: Array, at: int, ratio: float) -> int | None:
    """Sample behind a jump to 0, or from it, that is as large as the speed itself was to be; None where there is none."""
    found = onset_of(wheel.jumps, wheel.samples, at, ratio, wheel.dt)
    if found is None:
        return None
    width = int(wheel.blocks.start[1]) if wheel.blocks.start.size > 1 else 1
    block = min(int(wheel.samples.step[found]) // width, expected.size - 1)
    size = abs(float(np.nan_to_num(expected[block])))
    return found if abs(float(np.nan_to_num(wheel.samples.change[found]))) > _WHOLE * size else None


def _noisy(spell: Spell, wheel: Wheel, first: int, last: int) -> Finding | None:
    part = slice(spell.start, spell.stop)
    came = wheel.blocks.readings[part] > 0  # a gap is neither loud nor quiet
    if np.median((wheel.blocks.rough[part] / wheel.blocks.usual[part])[came]) < _LOUD:
        return None  # what shakes other wheels too, or hardly more than usual, is no sensor's noise
    inside = (wheel.samples.step >= first) & (wheel.samples.step < last)
    rms = float(np.sqrt(np.mean(wheel.samples.white[inside] ** 2)))
    usual = float(np.sqrt(np.median(wheel.samples.white[~inside] ** 2))) if (~inside).any() else 0.0
    text = (
        f"{wheel.name} changes by {plain(rms, 2)} {{speed_unit}} from reading to reading (second differences), otherwise by {plain(usual, 2)} {{speed_unit}}; "
        "the inertia of a {wheel} forbids that."
    )
    sat = Sat(0.0, rms, -rms, rms, "m/s")
    return sensor_finding(first, last, FaultMode.NOISY, spell.p * SENSOR_SHARE, None, sat, (text,))


def _scaled(spell: Spell, wheel: Wheel, span: tuple[int, int], speed: Array | None) -> Finding | None:
    part = slice(spell.start, spell.stop)
    middle = 0.5 * (wheel.blocks.low + wheel.blocks.high) if speed is None else speed
    known = np.isfinite(wheel.blocks.mean[part]) & np.isfinite(middle[part])
    x, y = middle[part][known], wheel.blocks.mean[part][known]
    if not np.any(x * x > 0.0):
        return None
    gain = float(x @ y / (x @ x))
    if not 0.02 < gain < 20.0:
        return None
    fell, rose = (_changes(wheel, at, ratio) for at, ratio in zip(span, (gain, 1.0 / gain), strict=True))
    if fell is not None and rose is not None and fell >= rose:
        fell = rose = None
    places = [k for k in (fell, rose) if k is not None]
    sensor = _by_jumps(wheel, len(places))
    if not spell.turns:  # where the body turns so the wheel does, however fast it came
        sensor = max(sensor, sensor_by_jumps(wheel.samples, places, wheel.dt))
    bare = speed is None and _by_jumps(wheel, len(places)) <= EITHER
    if bare and (spell.p < _BARE_P or (span[1] - span[0]) * wheel.dt < _BARE_S):
        return None
    begin = span[0] if fell is None else int(wheel.samples.step[fell])
    end = span[1] if rose is None else int(wheel.samples.step[rose])
    texts = []
    if speed is not None:
        texts.append(
            f"{wheel.name} is {gain:.2f} × what {wheel.compared} show{'' if ' and ' in wheel.compared else 's'} of the same speed."
        )
    if fell is not None or rose is not None:
        texts.append(
            f"It changed by a factor of about {gain:.2f} from one reading to the next{', which no drive does' if wheel.sharp else how_hard(wheel.samples, places)}."
        )
    if bare:
        texts.insert(0, f"{wheel.name} is {gain:.2f} × what its command makes it do.")
    if bare and sensor <= EITHER:
        texts.append(
            "It came while the speed was changing, or not faster than this drive is, and nothing else shows the speed of this {wheel}: "
            "a weak drive and a wrong sensor cannot be distinguished; {or_view}the drive's effort would tell them apart."
        )
    misfit = float(np.sqrt(np.mean((y - gain * x) ** 2)) / np.sqrt(np.mean(x * x)))
    if spell.own:  # one encoder, two channels
        sensor = _TWO_JUMPS
    elif spell.kin or (speed is not None and wheel.own):
        sensor = max(sensor, _ONE_JUMP)
    elif (
        spell.turns is False and misfit < _IN_SHARE * min(gain, 1.0) and np.std(x) > _VARIES * np.sqrt(np.mean(x * x))
    ):  # a share that stays the same at every speed is no slip, and no weak drive where the body does not turn with it
        sensor = max(sensor, _ONE_JUMP)
        texts.append("The measured yaw rate does not follow this reading.")
    sensor = _by_body(spell, sensor, texts)
    if 1.0 - EITHER <= sensor <= EITHER and not bare:
        unseen = "It began and ended while the speed was changing, or too slowly for a jump: a {wheel} that is weak or skids and a wrong sensor cannot be distinguished."
        texts.append(Sentence(About.ONSET, unseen))
    wide = 2.0 * misfit / np.sqrt(max(1.0, x.size / 4.0))
    loss = 1.0 - gain
    p = spell.p * (0.5 + 0.5 * spell.mine) if speed is not None or bare else 1.0 - (1.0 - spell.p) * 0.5
    found = sensor_finding(
        begin, max(end, begin + 1), spell.mode, p, Epsilon(loss, loss - wide, loss + wide), None, tuple(texts), sensor
    )
    outvoted = speed is not None and spell.turns is None and not (places or wheel.own or spell.own or spell.kin)
    if not outvoted or gain < _TOO_QUICK or len(others := wheel.compared.split(" and ")) != _TWO:
        return found
    why = f"Two against one: {others[0]} and {others[1]} may both read too little instead, for nothing else shows how this side moves; a yaw rate would."
    return limited(found, _OUTVOTED_P, why)
