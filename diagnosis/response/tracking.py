"""Command-tracking evidence: a drive of which only command and response are known.

A servo may lag its command by a second or more and may pause; it is stuck when it stops early and never moves again
while its command goes on. Whether the motor or its sensor stopped cannot be told from such a log.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.noise import moving_sum, rounding_step, shifted
from diagnosis.results.assessment import CODE, Assessment, Finding, Lack, Reason
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.results.plain_numbers import plain
from diagnosis.results.result import Epsilon, Hypothesis, Sat
from diagnosis.results.sentence import lasting
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits

Array = NDArray[np.float64]

_MAX_LAG_S = 2.5
_ALIKE = 0.7  # correlation of a reading that is a copy of its command
_MIN_STILL_S = 0.5
_MOST_TO_COME, _SOME_TO_COME = (
    0.5,
    0.25,
)  # share of the commanded travel that must be still to come; of a long standstill
_LONG_S = 10.0
_JITTER, _STEPS = 8.0, 6.0  # times the position's jitter, and its rounding step: no motion
_SHARE = 0.06  # of the commanded range
_CLEAR = 4.0  # times what counts as no motion: commanded range from which a standstill shows
_CENSORED_S = 0.6  # before the end of the log, and the response's delay: a command proves nothing
_ANSWER_S = 0.5  # a motion may end as much later than the delay says
_FINE = 4.0  # times the jitter: a motion that is just ending
_SMOOTH_S = 0.5


class _Tracking(NamedTuple):
    """How a drive was commanded.

    Attributes
    ----------
    asked : Array, shape (n,)
        Commanded speed's magnitude, smoothed, delayed as the response is [m/s].
    driven : NDArray[np.bool_], shape (n,)
        Where it is commanded to move.
    last : int
        Sample after the last one at which it moved.
    proved : bool
        Whether enough was commanded after that, early enough for the drive to answer.
    lag : int
        Delay of the response [steps].
    """

    asked: Array
    driven: NDArray[np.bool_]
    last: int
    proved: bool
    lag: int


def estimate_lag(response: Array, command: Array, dt: float) -> int:
    """Delay of the response against the command in steps, by the largest correlation up to 2.5 s; 0 where none is clear.

    Both of shape (n,), `dt` in s.
    """
    r, c = np.nan_to_num(response - np.nanmean(response)), np.nan_to_num(command - np.nanmean(command))
    limit = min(round(_MAX_LAG_S / dt), r.size // 3)
    norms = np.sqrt(float(r @ r) * float(c @ c))
    if norms <= 0 or limit < 1:
        return 0
    scores = np.array([float(r[k:] @ c[: c.size - k]) / norms for k in range(limit + 1)])
    best = int(np.argmax(scores))
    return best if scores[best] > 0.3 else 0


def assess_tracking(
    v: Array, v_ref: Array, dt: float, limits: Limits, names: tuple[str, str], by_channel: Sequence[Finding] = ()
) -> tuple[Assessment, Assessment]:
    """Judge a drive by whether it follows its command at all.

    Parameters
    ----------
    v, v_ref : Array, shape (n,)
        Measured and commanded speed; NaN where not valid.
    dt : float
        Step [s].
    limits : Limits
        ``driving_speed`` is the speed above which the drive is commanded to move.
    names : tuple[str, str]
        Names of the two signals, for the text.
    by_channel : Sequence[Finding]
        What the measured speed shows alone.

    Returns
    -------
    tuple[Assessment, Assessment]
        Sensor and actuator; what may be either stands on both, as ``sensor_or_actuator``.
    """
    lag = estimate_lag(v, v_ref, dt)
    reference = shifted(v_ref, lag)
    width = max(1, round(0.1 / dt))
    asked = moving_sum(np.nan_to_num(np.abs(reference)), width) / width
    driven = asked > limits.driving_speed
    states = np.where(driven, CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED]).astype(np.int8)
    states[~np.isfinite(v) | ~np.isfinite(v_ref)] = CODE[State.NO_DATA]
    last, proved = _last_motion(v, reference, lag, dt)
    copies = _small_copy(v[last:], reference[last:], dt) > 0.0
    small = _small_copy(v, reference, dt) if copies else 0.0  # a moment before its end has any size
    found = None if copies else _standstill(v, _Tracking(asked, driven, last, proved, lag), dt, names)
    findings = sorted(
        (
            *(() if found is None else (found,)),
            *(f for f in by_channel if found is None or f.mode is not found.mode or f.stop <= found.start),
        ),
        key=lambda f: f.start,
    )
    reasons = {
        State.NOT_EXCITED: "nothing is commanded",
    }
    why = (
        Reason(
            f"it follows its command at {plain(small, 2)} of its size: a wrong unit, a scaled or wrongly mapped channel",
            Lack.UNIT,
        )
        if small
        else Reason(
            "without a {valve} command or a second measurement, only a standstill under command, and a speed that is frozen, wild or "
            "noisy, can be detected",
            Lack.SECOND,
        )
    )
    series = (("residual", np.where(np.isfinite(v), v - reference, np.nan)), ("expected", reference))
    note = f"{names[0]} against {names[1]}: lag {plain(lag * dt)} s."
    return _sides(states, findings, reasons, why, Pictured.of(steps_of(findings, v.size, dt), series), note)


def assess_channel(
    v: Array, dt: float, limits: Limits, name: str, by_channel: Sequence[Finding]
) -> tuple[Assessment, Assessment]:
    """Judge a drive of which no command is known, by its measured speed alone: nothing of it is healthy.

    Parameters
    ----------
    v : Array, shape (n,)
        Measured speed [m/s]; NaN where not valid.
    dt : float
        Step [s].
    limits : Limits
        ``driving_speed``.
    name : str
        Of the signal, for the text.
    by_channel : Sequence[Finding]
        What the measured speed shows alone.

    Returns
    -------
    tuple[Assessment, Assessment]
        Sensor and actuator.
    """
    moves = np.abs(np.nan_to_num(v)) > limits.driving_speed
    states = np.where(moves, CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED]).astype(np.int8)
    states[~np.isfinite(v)] = CODE[State.NO_DATA]
    reasons = {State.NOT_EXCITED: "it stands still, and no command is recorded"}
    why = Reason(
        "without its command or a second measurement only a speed that is frozen, wild or noisy shows", Lack.BESIDE
    )
    pictured = Pictured.of(steps_of(by_channel, v.size, dt), ())
    return _sides(states, by_channel, reasons, why, pictured, f"{name} has no command.")


def _sides(
    states: NDArray[np.int8],
    findings: Sequence[Finding],
    reasons: Mapping[State, str],
    open_: Reason,
    pictured: Pictured,
    note: str,
) -> tuple[Assessment, Assessment]:
    """Sensor and actuator with what was found of them, and why the rest is `open_`; what may be either stands on both."""
    both = tuple(f for f in findings if len(f.side.sides) > 1)
    drive = states.copy()
    for f in findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
        drive[f.start : f.stop] = CODE[State(f.mode.value) if f in both else State.MASKED]
    why = {**reasons, State.NO_DATA: "no samples", State.MASKED: "its {wheel.sensor} is faulty"}
    sensor = Assessment(
        states, why, tuple(findings), pictured.columns, Tier.TRACKING, (note,), closeups=pictured.closeups
    )
    both_sides = (sensor, Assessment(drive, why, both, {}, Tier.TRACKING, (note,)))
    first, second = (a.reasoned(State.NOT_ASSESSED, open_) for a in both_sides)
    return first, second


def _small_copy(v: Array, reference: Array, dt: float) -> float:
    """How large a speed is beside the command whose shape it has, where it is far too small; 0 where it has another shape."""
    width = max(1, round(_SMOOTH_S / dt))
    known = np.isfinite(v) & np.isfinite(reference)
    a, b = (moving_sum(np.where(known, x, 0.0), width) for x in (v, reference))
    size = float(np.sqrt(float(a @ a) * float(b @ b)))
    if size <= 0.0 or float(a @ b) / size < _ALIKE:
        return 0.0
    share = float(a @ b) / float(b @ b)
    return share if share * _CLEAR < 1.0 else 0.0  # a larger one moves, and was merely asked for little since


def _last_motion(v: Array, reference: Array, lag: int, dt: float) -> tuple[int, bool]:
    """Sample after the last one of net motion, and whether what was commanded after it shows a standstill.

    Net motion is that of the position: jitter of some counts and single wild readings come to nothing in it.
    """
    from scipy.ndimage import median_filter

    raw = np.cumsum(np.nan_to_num(v)) * dt
    width = 2 * max(1, round(0.5 * _SMOOTH_S / dt)) + 1
    place = median_filter(raw, width, mode="nearest")
    asked = np.cumsum(np.nan_to_num(reference)) * dt
    jitter = 1.4826 * float(np.median(np.abs(raw - place)))
    step = rounding_step(np.abs(np.nan_to_num(v[:100_000]))) * dt
    until = max(0, v.size - lag - round(_CENSORED_S / dt))
    # largest and smallest of all later samples
    high, low = (np.asarray(pick.accumulate(place[::-1]))[::-1] for pick in (np.maximum, np.minimum))
    later = asked[:until][::-1]
    spread = np.zeros(v.size)
    if until:
        spread[:until] = (np.maximum.accumulate(later) - np.minimum.accumulate(later))[::-1]
    least = np.maximum(max(_JITTER * jitter, _STEPS * step), _SHARE * spread)
    still = np.flatnonzero(high - low <= least)
    if not still.size:
        return v.size, False
    last = int(still[0])
    after = min(last + round(_ANSWER_S / dt), v.size - 1)
    proved = bool(spread[after] > _CLEAR * least[last])
    # the very end of the motion, by what is no jitter
    near = np.abs(place[last:] - np.median(place[last:])) <= max(_FINE * jitter, 3.0 * step, 0.1 * least[last])
    return last + int(np.argmax(near)), proved


def _standstill(v: Array, tracking: _Tracking, dt: float, names: tuple[str, str]) -> Finding | None:
    """The drive that stopped for good while its command went on; None where it did not."""
    asked, driven, last, proved, lag = tracking
    remaining = driven[last:]
    travel = float(asked[last:][remaining].sum()) * dt
    whole = float(asked[driven].sum()) * dt
    still_s = float(remaining.sum()) * dt
    to_come = _SOME_TO_COME if still_s >= _LONG_S else _MOST_TO_COME
    if not proved or still_s < _MIN_STILL_S or whole <= 0 or travel < to_come * whole:
        return None
    start = last + int(np.flatnonzero(remaining)[0])
    level = float(np.nanmean(v[start:])) if np.isfinite(v[start:]).any() else 0.0
    share = travel / whole
    p = min(0.99, 0.8 + 0.25 * share)
    mode, side = FaultMode.NO_SIGNAL, Side.SENSOR_OR_ACTUATOR
    return Finding(
        start=start,
        stop=v.size,
        side=side,
        mode=mode,
        probability=p,
        hypotheses=(Hypothesis(side.value, mode.value, p), Hypothesis("none", State.HEALTHY.value, 1 - p)),
        epsilon=Epsilon(1.0, 0.0, 1.0),
        sat=Sat(level, abs(level), level, level, "m/s"),
        evidence=(
            f"{names[0]} stopped and never moved again while {names[1]} went on for {lasting(remaining.sum() * dt, 2)}: "
            f"{100 * share:.0f} % of all commanded travel was still to come.",
            f"The response lags its command by {lag * dt:.2f} s (estimated and taken out).",
            "Without a second measurement, a drive at standstill and a dead sensor cannot be distinguished.",
        ),
        tier=Tier.TRACKING,
    )
