"""What decided on a finding of direct evidence, in figures."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.sample_status import SILENT
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.isolation import Isolated
from diagnosis.direct.shape import shape_sentence
from diagnosis.estimation.fault_models import TOTAL_ROWS
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import About, Sentence, lasting
from diagnosis.results.sizes import amount, kept_to, probable_words
from replay.faults import FaultMode

END_SENTENCE = (
    "It stands at its end while its command asks for less, the same way: a {valve} that opens too far does so as well."
)

RANGE_SENTENCE = "It stays at the largest reading that it ever shows while its reference goes beyond that: it can show no more, or is clipped on the way."


def sentences(isolated: Isolated, found: IdentifiedPair, mode: FaultMode, epsilon: Epsilon | None) -> tuple[str, ...]:
    """Evidence of one finding.

    Parameters
    ----------
    isolated : Isolated
        The run.
    found : IdentifiedPair
        The pair.
    mode : FaultMode
        What is stated.
    epsilon : Epsilon or None
        What is stated of it.
    """
    pair, seen = found.pair, isolated.seen
    out: list[str] = []
    seconds = seen.y.size * pair.dt
    silent = int(np.count_nonzero(seen.status == SILENT))
    if silent:
        out.append(
            f"{pair.y_name} delivered nothing for {lasting(silent * pair.dt, 3)} while other channels of its source did."
        )
    if seen.use.any():
        if mode in (FaultMode.NOISY, FaultMode.OUTSIDE_TABLE):
            names = pair.y_name, pair.x_name
            out += [s for s in [shape_sentence(seen.y[seen.use], seen.x[seen.use], pair.dt, names, pair.unit)] if s]
        out += _values(isolated, found, epsilon, seconds)
        out.append(Sentence(About.DEVIATION, _deviation_words(seen.deviation, 3 * seen.noise, pair.unit)))
    if mode is FaultMode.OUTSIDE_TABLE:
        out.append("The gain is outside 0…1, which no row of the tables describes.")
    out.append(Sentence(About.TIMES, f"{pair.y_name} is {probable_words(isolated.gain)}."))
    return tuple(out)


def _deviation_words(size: float, threshold: float, unit: str) -> str:
    """How large the residual is beside the threshold of single readings, which it need not pass for its probability to pass its limit."""
    words = f"Residual, loss and noise together, {amount(size, unit)} root mean square; threshold of single readings about {amount(threshold, unit, 2)}"
    if size > threshold:
        return f"{words}."
    return f"{words}, which it need not pass: what passed its limit is the probability of all readings together."


def alike_sentence(found: IdentifiedPair) -> Sentence:
    """Why a constant value and a constant share are equally probable."""
    words = f"{found.pair.x_name} hardly moved but for its noise, so stuck and inefficient cannot be distinguished."
    return Sentence(About.EITHER, words)


def bounds_words(low: float, high: float) -> str:
    """Bounds of a share [1]: ``(95 %: 0.290 to 0.310)``."""
    return f"(95 %: {low:.3f} to {high:.3f})"


def _values(isolated: Isolated, found: IdentifiedPair, epsilon: Epsilon | None, seconds: float) -> list[str]:
    """What the channel gave beside its reference."""
    pair, seen = found.pair, isolated.seen
    y, x = seen.y[seen.use], seen.x[seen.use]
    if isolated.run.row in TOTAL_ROWS:
        other = (
            f"stood at {amount(float(np.mean(x)), pair.unit, 2)} (standard deviation {amount(float(np.std(x)), pair.unit, 2)})"
            if seen.still
            else f"moved over {amount(float(np.ptp(x)), pair.unit, 2)}"
        )
        inner = y[1:-1] if y.size > 4 else y  # the first and the last sample may be beside it
        return [
            f"{pair.y_name} {kept_to(float(np.min(inner)), float(np.max(inner)), pair.unit)} "
            f"for {lasting(seconds, 3)} while {pair.x_name} {other}."
        ]
    if epsilon is None:
        return []
    out: list[str] = [
        Sentence(
            About.SHARE,
            f"{pair.y_name} followed {1 - epsilon.value:.3f} × {pair.x_name} ",
            bounds_words(1 - epsilon.high, 1 - epsilon.low),
            f" over {lasting(seconds, 3)}.",
        )
    ]
    sat = isolated.estimate[1]
    if sat is not None:
        words = (
            f"The rest has a mean of {amount(sat.mean * epsilon.value, pair.unit)} and a root mean square of "
            f"{amount(sat.rms * epsilon.value, pair.unit)}, which is ε̂ × sat; healthy noise is {amount(seen.noise, pair.unit, 2)}."
        )
        out.append(Sentence(About.SAT, words))
    return out
