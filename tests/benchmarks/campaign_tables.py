"""Tables of a campaign: what became of its missions, and how often its findings were right; printed by `all_clear.py`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from campaign import Outcome
from numpy.typing import NDArray

_BINS, _DRAWS = 10, 2000


def table(outcomes: Sequence[Outcome], tiers: Sequence[str]) -> Iterator[str]:
    """Lines: a machine and level of evidence each."""
    yield f"{'machine':<22}{'evidence':<9}{'faulty':>7}{'cleared':>8}{'abstain':>8}{'wrong':>6}{'named':>6}{'high wrong':>12}   healthy: stopped, watch, not assessed, ready"
    for machine in dict.fromkeys(o.machine for o in outcomes):
        for tier in tiers:
            own = [o for o in outcomes if (o.machine, o.tier) == (machine, tier)]
            if not own:
                continue
            ill, sound = ([o for o in own if (o.trouble == "healthy") is flag] for flag in (False, True))
            count = [sum(o.outcome == x for o in ill) for x in ("cleared", "abstained", "wrong part", "named")]
            wrong, high = sum(o.wrong_high for o in ill), sum(o.high for o in ill)
            states = [sum(o.status == s for o in sound) for s in ("stop", "watch", "not_assessed", "ready")]
            yield (
                f"{machine:<22}{tier:<9}{len(ill):>7}{count[0]:>8}{count[1]:>8}{count[2]:>6}{count[3]:>6}{wrong:>6} of {high:<5}"
                f"   {', '.join(map(str, states))} of {len(sound)}"
            )


def ece(p: NDArray[np.float64], right: NDArray[np.bool_]) -> float:
    """Expected calibration error of claims in ten bins of equal width, 0 of none; both of shape (n,)."""
    place = np.minimum((p * _BINS).astype(np.intp), _BINS - 1)
    off = np.bincount(place, p - right, minlength=_BINS)
    return float(np.abs(off).sum() / p.size) if p.size else 0.0


def ece_of_calibrated(p: NDArray[np.float64]) -> tuple[float, float]:
    """ECE that claims of just these probabilities have by chance if every one of them is true: mean and 95 % quantile."""
    rng = np.random.default_rng(0)
    drawn = [ece(p, rng.random(p.size) < p) for _ in range(_DRAWS)]
    return float(np.mean(drawn)), float(np.quantile(drawn, 0.95))


def claims_table(outcomes: Sequence[Outcome], tiers: Sequence[str]) -> Iterator[str]:
    """Lines: a level of evidence each, all machines together."""
    yield "evidence  high wrong   p>=0.9 right   row right      bounds hold    ECE of part and row (of calibrated ones by chance: mean, 95 %)"
    for tier in tiers:
        own = [o for o in outcomes if o.tier == tier]
        if not own:
            continue
        wrong, high, wrong_sure, sure, right, rows, held, bounded = (
            sum(getattr(o, name) for o in own if o.trouble != "healthy")
            for name in ("wrong_high", "high", "wrong_sure", "sure", "right_rows", "rows", "held", "bounded")
        )
        claims = [c for o in own for c in o.claims]
        p, true = np.array([c[0] for c in claims]), np.array([c[1] for c in claims], np.bool_)
        usual, most = ece_of_calibrated(p)
        counts = (f"{a} of {b}" for a, b in ((wrong, high), (sure - wrong_sure, sure), (right, rows), (held, bounded)))
        yield (
            f"{tier:<9} "
            + "".join(f"{c:<14} " for c in counts)
            + f"{ece(p, true):.3f} of {p.size} ({usual:.3f}, {most:.3f})"
        )
