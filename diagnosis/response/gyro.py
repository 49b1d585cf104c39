"""Whether the measured yaw rate is what fails: the wheels do what they are told and agree with each other, and it alone contradicts them.

The difference of the sides makes the yaw rate but for a gain and a constant, which most of the mission shows. Where a yaw rate that
deviates gives one value only, is another one by a constant, or a share, the gyro says something else than the wheels. A share may
also be ground that lets the wheels slip, and the sentence says so. No wheel is named for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.gyro_turns import against_the_wheels, usual_turns
from diagnosis.response.heading import agree
from diagnosis.response.machine import Judged
from diagnosis.response.spells import Spell, deviations_of
from diagnosis.response.turning import Turning, difference
from diagnosis.results.machine_event import GYRO_CONSTANT, GYRO_REST, GYRO_SLIP
from diagnosis.results.said import Said, Stated
from diagnosis.results.sizes import turn

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_OFF, _SHARE, _LEAST = 5.0, 0.25, 0.06  # usual misfits; of the yaw rate that the wheels make, and of the usual one
_TURNS = 0.35  # of the usual yaw rate: from there on a gyro that gives nothing, or a share, shows
_AROUND, _GAP = 4, 3  # blocks around a wheel's fault; sound blocks that a deviation may be interrupted by
_LEAST_S, _MOST_OF, _TURNING_S = 3.0, 0.8, 2.0  # of a deviation; of its blocks that deviate; of turning in it
_FITS = 0.3  # of a deviation: what a gain, or a constant, may leave of it
_STILL = 0.05  # of the usual yaw rate: a spread below that is one value
_NOTHING = 0.1  # of what the wheels make
_SAME, _ASIDE = 0.2, 0.15  # of one: a gain that is as before; of the usual yaw rate: a constant that matters
_ASIDE_AT_REST = 0.05  # of the usual yaw rate: a constant that rests of the machine show to come and go
_SOUND = 0.55  # of the mission, in which the gyro is sound
_STRAIGHT_S, _RESTS_S, _STANDS = (
    6.0,
    0.5,
    0.02,
)  # of a constant, nearly straight ahead; of rest in it; of the usual speed
_OR_SIDE = "; or one side goes otherwise than it reads, as with an encoder that is scaled inside the speed loop that it closes."
_HELD = ", unless something held it and the {wheels} slipped"
_APART = 0.05  # of the speed: sides that differ by less turn nothing worth a word
_NEVER, _TURNED_S = 0.2, 20.0  # of the wheels' yaw rate, over a mission that turns for so long


class Contradicted(NamedTuple):
    """Blocks [start, stop) in which the gyro alone contradicts the wheels, what is said of it, and whether nothing but the gyro does that."""

    said: Said
    start: int
    stop: int
    sure: bool


class _Spread(NamedTuple):
    """Yaw rate by the wheels, by the gyro, and what is usual [rad/s]."""

    made: Array
    measured: Array
    usual: float
    noise: float


def wrong_gyro(
    judged: Mapping[str, Judged],
    faults: Mapping[str, Sequence[Spell]],
    turning: Turning | None,
    block_s: float,
    heading: Array | None = None,
    aside: Sequence[tuple[int, int]] = (),
    across: float | None = None,
) -> tuple[Contradicted, ...]:
    """Times in which the gyro alone contradicts the wheels, and nothing else turns as it says.

    Parameters
    ----------
    judged : Mapping[str, Judged]
        All wheels.
    faults : Mapping[str, Sequence[Spell]]
        What is known of the wheels, or may be the ground: these times are left out.
    turning : Turning or None
        How the body is turned.
    block_s : float
        Length of a block [s].
    heading : Array or None, shape (b,)
        Yaw rate by the heading of odometry [rad/s]: where that has what the gyro shows, and the wheels have not, these slip.
    aside : Sequence[tuple[int, int]]
        Blocks [start, stop) that something else explains.
    across : float or None
        Between the sides [m], where the way in which they turn the machine is known; None else.
    """
    if turning is None or not all(j.response.answered for j in judged.values()):
        return ()
    apart = difference(judged, turning)
    sound = np.isfinite(apart) & np.isfinite(turning.yaw)
    for w, j in judged.items():
        b = j.wheel.blocks
        far = np.abs(b.mean - np.clip(b.mean, b.low, b.high)) > _OFF * b.noise
        sound &= ~far
        for s in faults[w]:
            sound[max(0, s.start - _AROUND) : s.stop + _AROUND] = False
    for start, stop in aside:
        sound[start:stop] = False
    found = usual_turns(apart, turning.yaw, sound, _SOUND)
    if found is None:
        speed = np.max([np.abs(j.wheel.blocks.mean) for j in judged.values()], axis=0)[sound]
        texts = _never(apart, turning.yaw, sound, block_s) if _turns(apart[sound], speed) else ()
        return tuple(Contradicted(Said(text), 0, apart.size, sure=True) for text in texts)
    gain, offset, noise = found
    usual = float(np.quantile(np.abs(gain * apart[sound]), 0.9))
    about = _Spread(gain * apart, turning.yaw - offset, usual, noise)
    off = sound & (np.abs(about.measured - about.made) > np.maximum(_OFF * noise, _SHARE * np.abs(about.made)))
    off &= np.abs(about.measured - about.made) > _LEAST * usual
    shows = sound & (off | (np.abs(about.made) > _TURNS * usual))
    fastest = float(np.quantile([np.abs(j.wheel.blocks.mean[sound]) for j in judged.values()], 0.9))
    stands = sound & (np.max([np.abs(j.wheel.blocks.mean) for j in judged.values()], axis=0) <= _STANDS * fastest)
    straight = sound & (np.abs(about.made) < _TURNS * usual)  # there a constant is no share of the turn
    found_in: dict[tuple[int, int], str] = {}
    for start, stop in deviations_of(off, shows, _GAP):
        long = (stop - start) * block_s >= _LEAST_S
        if long and np.mean(off[start:stop][shows[start:stop]]) >= _MOST_OF:
            found_in[start, stop] = _kind(about, slice(start, stop), sound[start:stop], block_s)
    for start, stop in deviations_of(off & straight, straight, _GAP):
        if not any(start < last and first < stop for (first, last), what in found_in.items() if what):
            found_in[start, stop] = _constant(about, slice(start, stop), (straight, sound, stands), block_s)
    against = against_the_wheels(gain, noise, apart[sound], turning, across)
    out = [Contradicted(Said(against), 0, apart.size, sure=True)] if against else []
    for (start, stop), what in sorted(found_in.items()):
        if heading is not None and agree(turning.yaw - offset, heading, about.made, slice(start, stop)):
            continue
        if what:
            constant = what.endswith(GYRO_CONSTANT)
            rests = bool(np.count_nonzero((stands & off)[start:stop]) * block_s >= _RESTS_S)
            when = Stated.of(start * block_s, stop * block_s)
            text = f"From {when.start} to {when.stop} s the gyro (imu.yaw_rate) {what}, by what the rest of the mission shows of the two"
            text += _OR_SIDE if constant and not rests else f"{GYRO_REST}." if constant else "."
            out.append(Contradicted(Said(text, (when.span,)), start, stop, sure=rests or not constant))
    return tuple(out)


def _constant(about: _Spread, part: slice, use_of: tuple[Flags, Flags, Flags], block_s: float) -> str:
    """The constant that the yaw rate has beside what the wheels make, by the times in which these hardly turn the machine; empty where none.

    `use_of`: blocks nearly straight ahead, sound ones, and those of a machine that stands. A constant that shows at rest as well, and at no other rest, may be
    smaller.
    """
    straight, sound, stands = use_of
    use, all_of = straight[part], sound[part]
    apart = about.measured[part] - about.made[part]
    if np.count_nonzero(use) * block_s < _STRAIGHT_S:
        return ""
    constant = float(np.median(apart[use]))
    left = float(np.std(apart[use] - constant))
    turns = all_of & ~use
    helps = not turns.any() or float(np.mean((apart[turns] - constant) ** 2)) < float(np.mean(apart[turns] ** 2))
    rest, other = stands[part], stands.copy()
    other[part] = False
    shows = bool(min(np.count_nonzero(rest), np.count_nonzero(other)) * block_s >= _RESTS_S)
    if shows:
        here, there = (float(np.median((about.measured - about.made)[x])) for x in (_only(stands, part), other))
        shows = bool(max(abs(here - constant), abs(there)) < _FITS * abs(constant))
    if (
        abs(constant) <= max((_ASIDE_AT_REST if shows else _ASIDE) * about.usual, _OFF * about.noise)
        or left > _FITS * abs(constant)
        or not helps
    ):
        return ""
    return f"reads {turn(constant, sign='+')} {GYRO_CONSTANT}"


def _only(where: Flags, part: slice) -> Flags:
    """Blocks of a part alone, shape (b,)."""
    out = np.zeros_like(where)
    out[part] = where[part]
    return out


def _kind(about: _Spread, part: slice, sound: Flags, block_s: float) -> str:
    """What the yaw rate does in a deviation; empty where no fault of a gyro does that."""
    made, measured = about.made[part][sound], about.measured[part][sound]
    turns = np.count_nonzero(np.abs(made) > _TURNS * about.usual) * block_s >= _TURNING_S
    if np.std(measured) < max(2.0 * about.noise, _STILL * about.usual) and turns and np.ptp(made) > about.usual:
        value = float(np.mean(measured))
        none = abs(value) < _ASIDE * about.usual
        said, held = ("gives next to nothing", _HELD) if none else (f"stays at {turn(value)}", "")
        return f"{said} while the {{wheels}} turn the machine at up to {turn(float(np.max(np.abs(made))))}{held}"
    size = float(np.sqrt(np.mean((measured - made) ** 2)))
    constant = float(np.mean(measured - made))
    gain = float(made @ measured) / max(float(made @ made), 1e-12)
    by_constant, by_gain = float(np.std(measured - made)), float(np.sqrt(np.mean((measured - gain * made) ** 2)))
    if min(by_constant, by_gain) > _FITS * size:
        return ""
    if by_constant < by_gain:
        aside = abs(constant) > _ASIDE * about.usual
        return f"reads {turn(constant, sign='+')} {GYRO_CONSTANT}" if aside else ""
    if not turns or abs(gain - 1.0) < _SAME:
        return ""
    if abs(gain) < _NOTHING:
        return f"gives next to nothing while the {{wheels}} turn the machine at up to {turn(float(np.max(np.abs(made))))}{_HELD}"
    ground = f", {GYRO_SLIP}" if 0.0 < gain < 1.0 else ""
    return f"reads {gain:.2f} × what the {{wheels}} make{ground}"


def _turns(apart: Array, speed: Array) -> bool:
    """Whether sides go apart by more than tyres and readings of a machine that goes straight ahead differ; of shape (k,) each [m/s]."""
    return bool(apart.size and np.quantile(np.abs(apart), 0.9) > _APART * np.nanquantile(speed, 0.9))


def _never(apart: Array, yaw: Array, sound: Flags, block_s: float) -> tuple[str, ...]:
    """A sentence where the yaw rate has hardly anything of what the wheels make, all through a mission that turns."""
    made, measured = apart[sound], yaw[sound]
    if not made.size:
        return ()
    usual = float(np.quantile(np.abs(made), 0.9))
    turned = np.abs(made) > _TURNS * usual
    if np.count_nonzero(turned) * block_s < _TURNED_S or not usual > 0.0:
        return ()
    alike = 0.0 if np.std(measured) == 0.0 else abs(float(np.corrcoef(made, measured)[0, 1]))
    if alike > _NEVER:
        return ()
    return (
        "All through the mission the gyro (imu.yaw_rate) has nothing of what the {wheels} make while they follow their commands: a dead "
        "gyro, or another axis of it.",
    )
