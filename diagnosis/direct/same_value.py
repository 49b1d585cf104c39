"""A part that stays at one value in several spells, whatever is asked of it: stuck each time, where one spell alone may be another constant fault as well.

In a spell in which its reference hardly moves a constant value, a constant share of a constant and a constant offset from it are the same. Over several
spells they are not: what is stuck gives one value beside references that differ, and what loses a share gives one share of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import About, Sentence, is_about
from diagnosis.results.sizes import amount
from replay.faults import FaultMode, State

_EITHER = (FaultMode.STUCK, FaultMode.INEFFICIENT)
_ALIKE = 0.05  # of probability, by which both differ where one spell does not tell them
_P = 0.97  # of what those rows have together: at 0.9 all of 64 were right on machines of eighteen kinds
_ABOUT = 0.05  # by which a share is uncertain
_BETTER, _NOISE = 4.0, 4.0  # times as near as by another row; times the noise are values apart that are one


def in_one_row(findings: Sequence[Finding], measured: Measured) -> list[Finding]:
    """Findings of one side, those of a constant value or share as of the row that all of them together are of.

    Parameters
    ----------
    findings : Sequence[Finding]
        In order of time.
    measured : Measured
        Their channel and reference.
    """
    out = list(findings)
    levels = {
        k: level
        for k, f in enumerate(out)
        if (f.mode is FaultMode.STUCK or _either(f)) and (level := _level(f, measured)) is not None
    }
    if len(levels) < 2 or not any(_either(out[k]) or out[k].probability < _P for k in levels):
        return out
    y, x = (np.array(z) for z in zip(*levels.values(), strict=True))
    share = float(x @ y) / max(float(x @ x), measured.noise**2)
    stuck, lost, offset = (float(np.max(np.abs(z - np.median(z)))) for z in (y, y - share * x, y - x))
    least = _NOISE * measured.noise
    between = " and ".join(amount(float(z), measured.unit, 2) for z in (x.min(), x.max()))
    spells = f"In {len(levels)} such spells {measured.names[0]} had one"
    beside = f"while {measured.names[1]} was between {between}."
    if stuck <= least < float(np.min(np.abs(y))) and min(lost, offset) > max(_BETTER * stuck, least):
        words = Sentence(
            About.SPELLS, f"{spells} value, about {amount(float(np.median(y)), measured.unit, 2)}, {beside}"
        )
        return [_stuck(f, words) if k in levels else f for k, f in enumerate(out)]
    if lost <= least and min(stuck, offset) > max(_BETTER * lost, least) and all(_either(out[k]) for k in levels):
        words = Sentence(About.SPELLS, f"{spells} share, {share:.2f}, of {measured.names[1]} {beside}")
        return [_lost(f, 1.0 - share, words) if k in levels else f for k, f in enumerate(out)]
    return out


def _either(f: Finding) -> bool:
    """Whether a finding is as probably stuck as inefficient."""
    stuck, lost = (sum(h.p for h in f.hypotheses if h.mode == mode.value) for mode in _EITHER)
    return f.mode in _EITHER and abs(stuck - lost) <= _ALIKE and stuck > 0.0


def _level(f: Finding, measured: Measured) -> tuple[float, float] | None:
    """Medians of channel and reference within a finding; None where nothing is known."""
    part = slice(f.start, f.stop)
    use = measured.use[part]
    if not use.any():
        return None
    y, x = (float(np.median(z[part][use])) for z in (measured.y, measured.x))
    return y, x


def _stuck(f: Finding, words: Sentence) -> Finding:
    """A finding as stuck, whatever other fault it was as well."""
    told = _of_row(f, FaultMode.STUCK, [h.mode for h in f.hypotheses if h.mode != State.HEALTHY.value], words)
    return replace(told, epsilon=None if f.epsilon is None else replace(f.epsilon, value=1.0, high=1.0))


def _lost(f: Finding, lost: float, words: Sentence) -> Finding:
    """A finding as inefficient by such a loss [1], of those that it was as probably stuck; what it lost by itself is no evidence of its own then."""
    told = _of_row(f, FaultMode.INEFFICIENT, [mode.value for mode in _EITHER], words)
    evidence = tuple(e for e in told.evidence if not is_about(e, About.SHARE) and not is_about(e, About.SAT))
    size = Epsilon(lost, max(0.0, lost - _ABOUT), min(1.0, lost + _ABOUT))
    return replace(told, epsilon=size, sat=None, evidence=evidence)


def _of_row(f: Finding, row: FaultMode, of: Sequence[str], words: Sentence) -> Finding:
    """A finding of which a row has nearly all that some rows have together, if it has less."""
    had = {mode: sum(h.p for h in f.hypotheses if h.mode == mode) for mode in of}
    every, own = sum(had.values()), had.get(row.value, 0.0)
    left = min(every - own, (1.0 - _P) * every)
    shrink = left / (every - own) if every > own else 0.0
    rows = [
        replace(h, p=every - left if h.mode == row.value else h.p * shrink if h.mode in had else h.p)
        for h in f.hypotheses
    ]
    evidence = (*(e for e in f.evidence if not is_about(e, About.EITHER)), words)
    hypotheses = tuple(sorted(rows, key=lambda h: -h.p))
    return replace(f, mode=row, probability=every - left, hypotheses=hypotheses, evidence=evidence)
