"""What the effort of each drive says beside that of the wheels on its side: a drive that pulls nothing, a wheel that cannot turn.

What effort a speed takes is not known where several drives move one body; but wheels of one side share their load, so that the ratio
of their efforts is a habit of the machine.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.effort_changes import answers, goes_with, is_noise, unanswered
from diagnosis.response.inputs import FollowerData
from diagnosis.response.machine import Judged
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, Sentence, lasting
from diagnosis.results.vocabulary import Tier
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]

_LEAST_BLOCKS = 80
_USUAL = 0.75  # quantile that is the usual size: a drive may pull nothing for half of the mission
_PULLS = 0.4  # of the usual effort of the others: from there on something is to be pulled
_NOTHING, _OWN = 0.06, 0.9  # of that quantile of its own effort: next to nothing
_NOISE, _MOST = 3.0, 0.12  # standard errors of the mean of a block; of its usual effort, however noisy it is
_BRIEFLY, _BRIEF_BLOCKS = 2.0, 3  # times that much, in so many blocks, ends no run of nothing
_NO_DRIVE = 1e-3  # of the largest usual effort on the machine: never more is no drive at all
_NOISE_ALONE = 0.1  # of the same: below that an effort may be its noise alone
_OWN_RUNS, _OTHER_RUNS = 4, 2  # runs of next to nothing that may be faults: of the drive in question, and of each other
_LONGER = 3  # times as long as what is left of such runs
_AROUND = 1  # block to each side of one, of which the median counts: a drive that is needed for a moment answers
_LEAST_S, _P = 3.0, 0.94
_CHANGES = 0.25  # of the top speed
_OFF, _PART = 2.0, 0.3  # usual misfits beside the command, and part of the time, of a wheel that leaves it


def shares_of(
    found: Mapping[str, Judged], efforts: Mapping[str, Array], sides: Mapping[str, tuple[str, ...]]
) -> dict[str, Array]:
    """Effort of each wheel by what those of its side make its part of the load [1], shape (b,); NaN where hardly anything is pulled.

    Parameters
    ----------
    found : Mapping[str, Judged]
        All wheels.
    efforts : Mapping[str, Array], each of shape (b,)
        Mean effort of each block, in any unit; wheels without one are left out.
    sides : Mapping[str, tuple[str, ...]]
        Wheels on the side of each wheel.
    """
    out = {}
    for w, e in efforts.items():
        others = [o for o in sides.get(w, ()) if o in efforts]
        if not others:
            continue
        by_each = [x for o in others if (x := _beside(e, efforts[o], found[w].driving)) is not None]
        if len(by_each) == len(
            others
        ):  # beside all of them: the one with the largest effort may be the one that is held
            out[w] = np.asarray(np.max(by_each, axis=0))
    return out


def own_pull(one: Judged, effort: Array | None, share: Array | None) -> Array | None:
    """Effort of a wheel by its part of the load, or by its own usual effort, whichever is larger [1], shape (b,).

    Where a wheel is held those beside it pull more, too, and its part of the load looks usual; its effort does not.

    Parameters
    ----------
    one : Judged
        The wheel.
    effort : Array or None, shape (b,)
        Mean effort of each block, in any unit.
    share : Array or None, shape (b,)
        From `shares_of`.
    """
    if effort is None or share is None:
        return None
    usual = np.abs(effort[one.driving & np.isfinite(effort)])
    return np.maximum(share, np.abs(effort) / max(float(np.median(usual)), 1e-12)) if usual.size else None


def _beside(e: Array, other: Array, driving: NDArray[np.bool_]) -> Array | None:
    """Effort by another one's, where that pulls [1]; 1 at most times, NaN elsewhere; None where that is hardly ever."""
    load = np.abs(other)
    use = driving & np.isfinite(e) & np.isfinite(load)
    if np.count_nonzero(use) < _LEAST_BLOCKS:
        return None
    pulled = use & (load > _PULLS * float(np.quantile(load[use], _USUAL)))
    ratio = float(np.quantile(np.abs(e[pulled]) / load[pulled], _USUAL)) if pulled.any() else 0.0
    return np.where(pulled, np.abs(e) / (ratio * np.maximum(load, 1e-12)), np.nan) if ratio > 0.0 else None


def powered(efforts: Mapping[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Efforts of the wheels that have a drive, and the wheels that have none: their effort is nothing from end to end, or its noise.

    Parameters
    ----------
    efforts : Mapping[str, Array], each of shape (b,)
        Mean effort of each block, in any unit.
    """
    usual = {w: float(np.nanquantile(np.abs(e), _USUAL)) if np.isfinite(e).any() else 0.0 for w, e in efforts.items()}
    least = _NO_DRIVE * max(usual.values(), default=0.0)
    most = _NOISE_ALONE * max(usual.values(), default=0.0)
    none = tuple(
        w
        for w, e in efforts.items()
        if not np.nanmax(np.abs(e), initial=0.0) > least
        or (usual[w] < most and is_noise(e, [x for o, x in efforts.items() if o != w]))
    )
    return {w: e for w, e in efforts.items() if w not in none}, none


def idle_spans(
    efforts: Mapping[str, Array], found: Mapping[str, Judged], sides: Mapping[str, tuple[str, ...]], block_s: float
) -> dict[str, list[tuple[int, int]]]:
    """Blocks [start, stop) in which the effort of a drive stays next to nothing while another one pulls, by wheel.

    The effort of a healthy drive passes through nothing, and may stay there for a while: a span counts that lasts several times as long
    as such times otherwise last on this machine. Drives that go to nothing together are switched off, by whatever switches them.

    Parameters
    ----------
    efforts : Mapping[str, Array], each of shape (b,)
        Of the wheels that have a drive.
    found : Mapping[str, Judged]
        All wheels.
    sides : Mapping[str, tuple[str, ...]]
        Wheels that share the load of each wheel.
    block_s : float
        Length of a block [s].
    """
    runs, silent = {}, {}
    for w, e in efforts.items():
        pulls = _any_pulls([efforts[o] for o in sides.get(w, ()) if o in efforts], found[w].driving)
        least = _next_to_nothing(e, found[w].data)
        size = np.abs(np.nan_to_num(_smooth(np.where(found[w].driving, e, np.nan)), nan=np.inf))
        silent[w] = size < least
        known = pulls & np.isfinite(e)
        runs[w] = _runs(known, silent[w], size < _BRIEFLY * least)
    lengths = {w: sorted((n for _, _, n in r), reverse=True) for w, r in runs.items()}
    out = {}
    for w, r in runs.items():
        habit = max(
            (x[k] for o, x in lengths.items() if len(x) > (k := _OWN_RUNS if o == w else _OTHER_RUNS)), default=0
        )
        long = [(a, b) for a, b, n in r if n * block_s >= _LEAST_S and n >= _LONGER * habit]
        load = np.sum([np.nan_to_num(efforts[o]) for o in sides.get(w, ()) if o in efforts], axis=0)
        grown = [_grown(a, b, silent[w]) for a, b in long]
        out[w] = [
            s
            for s, (a, b) in zip(grown, long, strict=True)
            if unanswered(efforts[w], load, found[w].driving, s)
            and not answers(efforts[w], load, (a, b))
            and not goes_with(efforts[w], [efforts[o] for o in efforts if o != w], (a, b))
        ]
    return {
        w: [s for s in spans if not any(_most_of(s, x) for o, others in out.items() if o != w for x in others)]
        for w, spans in out.items()
    }


def _next_to_nothing(effort: Array, data: FollowerData) -> float:
    """Mean effort of a block below which a drive pulls nothing: a small share of its usual effort, or what noise makes of nothing."""
    usual = float(np.nanquantile(np.abs(effort), _OWN))
    read = np.diff(np.nan_to_num(np.zeros(0) if data.effort is None else data.effort[data.fresh]))
    noise = 1.05 * float(np.median(np.abs(read))) if read.size else 0.0
    each = noise / np.sqrt(max(1.0, read.size / effort.size))
    return float(np.clip(_NOISE * each, _NOTHING * usual, _MOST * usual))


def _any_pulls(others: list[Array], driving: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Blocks in which any of some drives pulls a good part of what it usually does, shape (b,)."""
    pulls = np.zeros(driving.size, bool)
    for e in others:
        load = np.abs(np.nan_to_num(e))
        moving = load[driving & np.isfinite(e)]
        if moving.size >= _LEAST_BLOCKS:
            pulls |= load > _PULLS * float(np.quantile(moving, _USUAL))
    return pulls & driving


def _runs(
    known: NDArray[np.bool_], nothing: NDArray[np.bool_], little: NDArray[np.bool_]
) -> list[tuple[int, int, int]]:
    """Runs of `nothing` among what is known: first block, block behind the last, and how many of it are known.

    They go on over few blocks of `little`, as noise makes them.
    """
    places = np.flatnonzero(known)
    flags, near = nothing[places], little[places]
    out: list[list[int]] = []
    for a, b in runs_of(flags):
        if out and a - out[-1][1] <= _BRIEF_BLOCKS and near[out[-1][1] : a].all():
            out[-1][1] = b
        else:
            out.append([a, b])
    return [(int(places[a]), int(places[b - 1]) + 1, b - a) for a, b in out]


def _grown(start: int, stop: int, silent: NDArray[np.bool_]) -> tuple[int, int]:
    """A span with the silent blocks that it touches, whether anybody pulls in them or not."""
    before, behind = np.flatnonzero(~silent[:start]), np.flatnonzero(~silent[stop:])
    return int(before[-1]) + 1 if before.size else 0, stop + int(behind[0]) if behind.size else silent.size


def _most_of(span: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether a span is for half of its time together with another one."""
    return min(span[1], other[1]) - max(span[0], other[0]) > 0.5 * (span[1] - span[0])


def idle_drives(one: Judged, spans: list[tuple[int, int]], dragged: bool, block_s: float) -> list[Finding]:
    """Times in which a drive pulls nothing while another one does, and the speed was to change.

    Where two wheels turn the machine by what they differ, nothing but its own drive holds the speed of each: without power it leaves its
    command, and one that pulls nothing and follows it is the inner wheel of a curve, or rolls downhill.

    Parameters
    ----------
    one : Judged
        The wheel.
    spans : list[tuple[int, int]]
        From `idle_spans`.
    dragged : bool
        Whether others, or the steering, hold its wheel at nearly its speed while it has no power.
    block_s : float
        Length of a block [s].
    """
    return [
        _finding(one, a, b, dragged, block_s)
        for a, b in spans
        if _sped_up(one, a, b, dragged) and (dragged or _astray(one, a, b))
    ]


def _smooth(share: Array) -> Array:
    """Median of what is known around each block where something is known, shape (b,)."""
    wide = np.pad(share, _AROUND, constant_values=np.nan)
    known = np.flatnonzero(np.isfinite(share))
    out = np.full(share.size, np.nan)
    out[known] = np.nanmedian(np.lib.stride_tricks.sliding_window_view(wide, 2 * _AROUND + 1)[known], axis=1)
    return out


def _sped_up(one: Judged, start: int, stop: int, dragged: bool) -> bool:
    """Whether the speed had to change in blocks [start, stop), and did so, or went astray, where the wheel is dragged along.

    At one speed two loops that hold the wheels of a side may share the load in any way; a change takes effort from each of them. What is
    asked at either end of the span only, where the effort comes and goes, is no change within it.
    """
    if not one.response.answered:
        return False
    b, least = one.wheel.blocks, _CHANGES * float(np.nanquantile(np.abs(one.wheel.blocks.mean), 0.99))
    made = b.mean[start:stop][np.isfinite(b.mean[start:stop])]
    moved = not dragged or bool(made.size and np.ptp(made) > least) or _astray(one, start, stop)
    return moved and bool(np.ptp((0.5 * (b.low + b.high))[start:stop]) > least)


def _astray(one: Judged, start: int, stop: int) -> bool:
    """Whether the speed leaves what its command makes it be in a good part of blocks [start, stop)."""
    b = one.wheel.blocks
    off = np.abs(b.mean - np.clip(b.mean, b.low, b.high)) > _OFF * b.noise
    return bool(np.mean(off[start:stop]) > _PART)


def _finding(one: Judged, start: int, stop: int, dragged: bool, block_s: float) -> Finding:
    width = int(one.wheel.blocks.start[1])
    wheel = one.data.name.split(".")[1]
    text = (
        f"wheel.{wheel}.effort is next to nothing for {lasting((stop - start) * block_s, 1)} while {'the drives beside it pull' if dragged else 'the other drive pulls'} as usual: its "
        f"{{valve}} has no power{', and the others drag the {wheel} along' if dragged else ''}."
    )
    other = 0.5 * (1.0 - _P)
    return Finding(
        start=start * width, stop=min(stop * width, one.data.y.size), side=Side.ACTUATOR, mode=FaultMode.NO_SIGNAL, probability=_P,
        hypotheses=(
            Hypothesis(Side.ACTUATOR.value, FaultMode.NO_SIGNAL.value, _P),
            Hypothesis(Side.ACTUATOR.value, FaultMode.INEFFICIENT.value, other),
            Hypothesis("none", State.HEALTHY.value, other),
        ),
        epsilon=Epsilon(1.0, 1.0, 1.0), sat=None, evidence=(Sentence(About.EFFORT, text),), tier=Tier.RESPONSE,
    )  # fmt: skip
