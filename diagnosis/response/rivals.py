"""Whose fault it is where wheels differ: the one that jumps, that is further off its command, or that alone is rough or still."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.channel import Samples
from diagnosis.response.forbidden import allowed, calm_enough, largest_roughness
from diagnosis.response.inputs import cells
from diagnosis.response.lasting_noise import quiet_level
from diagnosis.response.machine import Judged, unlike_others
from diagnosis.response.models import Beside, Blocks, held_long
from diagnosis.response.pairs import anothers
from diagnosis.response.spells import Spell
from replay.faults import FaultMode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_HELD_BACK, _ALIKE = (
    1.0,
    0.25,
)  # usual misfits beside the command of each wheel, and by how much their shares of it may differ [1]
_NO_SHARE = 1e9
_DOUBT_S = 0.5  # around the beginning and the end of a spell
_ROUGHER = 2.0  # times what changes from sample to sample in other wheels, at most, is usual
_SPIKIER = 4.0  # times the wild readings of the other wheels (median): fewer are a habit of the machine, as coarse encoders have
_TURNS = 0.05  # of the usual speed
_LEAST_NOISY = 20  # blocks in which a channel changes: fewer tell nothing of its noise
_ALSO_HELD = 0.05  # of the driving in which another wheel stays at one value for long: then it is a habit
_WITHIN, _LONGER = 0.9, 2.0  # of a spell, and times its length: what lies so within another wheel's is its consequence
_STEADIER = 1.3  # times the misfit beside one gain: the wheel whose gain is the steadier one is at fault
_EXACT = 0.03  # by its size: a misfit beside one gain that is smaller says no more
_SAME_ASKED, _MOSTLY, _CLOSE = 0.05, 0.5, 0.5  # of what is asked; of a spell; of the misfit beside the command
_CLEARLY = 2.0  # times the misfit of another wheel beside its command: then it is clear whose fault it is


def by_each_other(found: Mapping[str, Judged], block_s: float, rest: Mapping[str, Samples]) -> dict[str, Judged]:
    """Wheels with what is usual in them, by the others: a fault of half the mission is no habit where no other wheel has it.

    `rest` are the readings of wheels that are not judged, whose habits count as well. `block_s` is the length of a block [s].
    """
    rough = {w: float(np.median(j.wheel.blocks.usual)) for w, j in found.items()}
    held = {w: held_long(j.wheel.blocks, j.driving, block_s) for w, j in found.items()}
    wild = {w: _wild_share(s) for w, s in {**rest, **{w: j.wheel.samples for w, j in found.items()}}.items()}
    calm = {
        w: calm_enough(j.wheel.blocks, j.driving, largest_roughness(j.wheel.blocks, j.wheel.samples, j.wheel.dt))
        for w, j in found.items()
    }
    out = {}
    for w, j in found.items():
        others = [o for o in found if o != w]
        turning = [o for o in others if _shows_noise(found[o])]
        blocks = j.wheel.blocks
        most = allowed(blocks, j.wheel.samples, j.driving, j.wheel.dt, [calm[o] for o in others])
        if turning:
            likely = _ROUGHER * float(np.median([rough[o] for o in turning]))
            share = min(1.0, likely / rough[w]) if rough[w] > 0.0 and likely > 0.0 else 1.0
            speed = np.abs(np.nan_to_num(blocks.mean))
            likewise = _ROUGHER * np.median([_usual_at(found[o].wheel.blocks, speed) for o in turning], axis=0)
            mine = _usual_at(blocks, speed)
            shares = np.divide(likewise, mine, out=np.ones(mine.size), where=(mine > 0.0) & (likewise > 0.0))
            quiet = quiet_level(blocks, j.driving, block_s, [found[o].wheel.blocks.rough for o in turning])
            blocks = blocks._replace(
                usual=np.minimum(np.clip(shares, 0.0, share) * blocks.usual, np.maximum(quiet, likewise / _ROUGHER)),
            )
        elif not rest and not others:  # beside one that shows nothing it may as well be the ground
            blocks = blocks._replace(usual=quiet_level(blocks, j.driving, block_s))
        if others:
            blocks = blocks._replace(habitual=max(held[o] for o in others) > _ALSO_HELD)
        blocks = blocks._replace(usual=np.minimum(blocks.usual, most), most=most)
        known = [x for o, x in wild.items() if o != w]
        usual = bool(known) and wild[w] <= _SPIKIER * float(np.median(known))
        out[w] = j._replace(wheel=j.wheel._replace(blocks=blocks, spiky=not usual))
    return out


def _shows_noise(one: Judged) -> bool:
    """Whether readings of a wheel change where it drives: one that is dead, held or at rest says nothing of how much others may."""
    b = one.wheel.blocks
    return int(np.count_nonzero((b.readings > 0) & ~b.held & ~b.dead & (b.zero < b.readings))) >= _LEAST_NOISY


def _usual_at(blocks: Blocks, speed: Array) -> Array:
    """What usually changes from sample to sample in a wheel at some speeds [m/s], shape of `speed`: more of it where it turns fast."""
    own = np.abs(np.nan_to_num(blocks.mean))
    turning = own[own > 0.0]
    if not turning.size:
        return np.full(speed.size, float(np.median(blocks.usual)))
    edges = np.quantile(turning, (1.0 / 3.0, 2.0 / 3.0))
    place, at = np.searchsorted(edges, own), np.searchsorted(edges, speed)
    whole = float(np.median(blocks.usual))
    levels = [
        float(np.median(blocks.usual[place == k])) if (place == k).any() else whole for k in range(edges.size + 1)
    ]
    return np.asarray(np.array(levels)[at])


def _wild_share(samples: Samples) -> float:
    """Share of wild readings while the wheel turns [1]: one that is held has none, whatever its habit."""
    known = np.abs(samples.value[np.isfinite(samples.value)])
    turns = np.abs(np.nan_to_num(samples.value)) > _TURNS * float(np.quantile(known, 0.9) if known.size else 0.0)
    number = int(np.count_nonzero(turns | samples.wild))
    return float(np.count_nonzero(samples.wild)) / number if number else 0.0


def shared(spell: Spell, beside: Beside | None) -> Spell:
    """A spell with how much of what other wheels say against it is its own."""
    if beside is None or spell.own or not np.isfinite(beside.speed[spell.start : spell.stop]).any():
        return spell
    return spell._replace(mine=float(np.mean(beside.blame[spell.start : spell.stop])))


def others_fault(spell: Spell, wheel: str, judged: Mapping[str, Judged]) -> bool:
    """Whether what looks like a scale is the fault of the wheel that this one was compared with, or of the whole machine."""
    one = judged[wheel]
    if spell.own or (not spell.mode.scaled and spell.mode is not FaultMode.OUTSIDE_TABLE):
        return False
    if not jumped(one, spell) and any(o != wheel for o in unlike_others(judged)):
        return True  # one that reads a share all the time makes others look off whenever the sides differ
    for other, j in judged.items():
        for s in j.spells if other != wheel else ():
            overlap = min(s.stop, spell.stop) - max(s.start, spell.start)
            if overlap > 0 and s.own:
                return True
            if overlap <= 0.3 * (spell.stop - spell.start):
                continue
            if one.speed is None:
                if s.mode is spell.mode:  # both at once: load, slope or a weak battery
                    return True
                continue
            if not s.mode.scaled and s.mode is not FaultMode.OUTSIDE_TABLE:
                return True
            jumps = jumped(one, spell), jumped(j, spell)
            if jumps[0] != jumps[1]:
                if jumps[1]:
                    return True
                continue
            theirs = anothers(spell, one, s, j)
            if theirs is not None:
                if theirs:
                    return True
                continue
            if overlap >= _WITHIN * (spell.stop - spell.start) and s.stop - s.start > _LONGER * (
                spell.stop - spell.start
            ):
                return True  # one cause that goes on beats one more that comes and goes with it
            mine, its = _misfit_of(one, spell), _misfit_of(j, spell)
            if max(mine, its) > _CLEARLY * min(mine, its):
                if its > mine:
                    return True
                continue
            own_share, its_share = _off_a_share(one, spell), _off_a_share(j, spell)
            if max(own_share, its_share) > _STEADIER * min(own_share, its_share):
                if its_share < own_share:
                    return True  # one gain at every speed explains the other wheel, none this one
            elif s.mode.scaled and (s.p > spell.p or spell.mode is FaultMode.OUTSIDE_TABLE):
                return True  # a sensor loses more often than it gains
    return False


def told_and_doing_alike(spell: Spell, wheel: str, judged: Mapping[str, Judged]) -> bool:
    """Whether another wheel that is told the same turns the same where this one is off its command alone: nothing is wrong with one of them.

    What a command makes of a wheel depends on the others, too: a limit, or a turn, that was seldom driven is no fault.
    """
    one, b = judged[wheel], judged[wheel].wheel.blocks
    if one.speed is not None or not one.response.answered or not spell.unspecific:
        return False
    part, width = slice(spell.start, spell.stop), int(b.start[1]) if b.start.size > 1 else 1
    asked = {w: cells(j.data.asked, width)[part] for w, j in judged.items()}
    off = np.abs(b.mean - np.clip(b.mean, b.low, b.high))[part]
    for other, j in judged.items():
        apart = np.abs(b.mean - j.wheel.blocks.mean)[part]
        same = np.abs(asked[wheel] - asked[other]) < _SAME_ASKED * np.abs(asked[wheel])
        same &= np.isfinite(apart) & np.isfinite(off)
        if other != wheel and np.mean(same) > _MOSTLY and np.median(apart[same]) < _CLOSE * np.median(off[same]):
            return True
    return False


def held_back_together(judged: Mapping[str, Judged]) -> Flags:
    """Blocks in which all wheels fall short of their commands, or exceed them, by like shares, shape (b,): a slope or load, no sensor's fault.

    Sensors do not fail together, nor alike.
    """
    gains, off = [], []
    for j in judged.values():
        if not j.response.answered:
            return np.zeros(j.driving.size, np.bool_)
        b = j.wheel.blocks
        middle = 0.5 * (b.low + b.high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            gains.append(np.nan_to_num(b.mean / middle, nan=_NO_SHARE, posinf=_NO_SHARE, neginf=-_NO_SHARE))
        off.append(np.abs(b.mean - np.clip(b.mean, b.low, b.high)) > _HELD_BACK * b.noise)
    spread = np.max(gains, axis=0) - np.min(gains, axis=0) if len(gains) > 1 else np.full(off[0].size, np.inf)
    one_way = np.logical_or(np.max(gains, axis=0) < 1.0, np.min(gains, axis=0) > 1.0)
    return np.asarray(np.logical_and.reduce(off) & one_way & (np.min(gains, axis=0) > 0.0) & (spread < _ALIKE))


def jumped(one: Judged, spell: Spell) -> bool:
    """Whether the channel jumps where a spell begins or ends."""
    step, width = one.wheel.samples.step[one.wheel.jumps.place], int(one.wheel.blocks.start[1])
    reach = round(_DOUBT_S / one.wheel.dt)
    return any(bool((np.abs(step - at * width) <= reach).any()) for at in (spell.start, spell.stop))


def _off_a_share(one: Judged, spell: Spell) -> float:
    """Misfit of a wheel's readings beside one gain of its speed by other channels, by their size [1]; 1 where nothing is known."""
    if one.speed is None:
        return 1.0
    part = slice(spell.start, spell.stop)
    y, x = one.wheel.blocks.mean[part], one.speed[part]
    known = np.isfinite(y) & np.isfinite(x)
    if not np.any(x[known] != 0.0):
        return 1.0
    made = x[known] * float(x[known] @ y[known]) / float(x[known] @ x[known])
    size = float(np.sqrt(np.mean(y[known] ** 2)))
    return float(np.clip(np.sqrt(np.mean((y[known] - made) ** 2)) / size, _EXACT, 1.0)) if size > 0.0 else 1.0


def _misfit_of(one: Judged, spell: Spell) -> float:
    """Median misfit of a wheel beside its command in the blocks of a spell, in usual ones; 1 where nothing is known."""
    part, b = slice(spell.start, spell.stop), one.wheel.blocks
    off = (np.abs(b.mean - np.clip(b.mean, b.low, b.high)) / b.noise)[part]
    return max(float(np.median(off[np.isfinite(off)])), 1.0) if np.isfinite(off).any() else 1.0
