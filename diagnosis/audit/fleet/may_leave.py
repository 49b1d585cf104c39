"""Whether a machine may go out, by its verdict and what is open: one rule for headline, lists and terminal."""

from __future__ import annotations

from diagnosis.results.vocabulary import Leave, Verdict


def leave_of(verdict: Verdict | str, cleared: bool | None, unjudged: int, *, lost: bool = False) -> Leave:
    """Whether a machine may go out.

    Parameters
    ----------
    verdict : Verdict or str
        Where the machine stands.
    cleared : bool or None
        Whether its reports let it go out; None: they do not say.
    unjudged : int
        Missions that were not judged and may be later than the last judged one.
    lost : bool
        Whether a part's loss is beyond the limit for certain, and no fault that stands says so; see `is_lost`.
    """
    if verdict == Verdict.STOP:
        return Leave.MUST_NOT
    fit = verdict == Verdict.READY or (verdict == Verdict.WATCH and cleared is True)
    return Leave.MAY if fit and not unjudged and not lost else Leave.CHECK


def is_lost(low: float, limit: float) -> bool:
    """Whether a loss is beyond its limit for certain: the lower 95 % bound of ε̂ [1] over the last mission, and the limit of ε [1]."""
    return low >= limit
