"""What direct evidence shows: its sentences in figures, and the series behind its plots."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.pairs import Pair
from diagnosis.estimation import fault_models
from diagnosis.estimation.gain_bias import GainBiasModel, track_gain_bias
from diagnosis.estimation.viterbi import ModePath
from diagnosis.results.evidence_columns import Pictured
from diagnosis.results.result import Epsilon, Sat
from replay.arrays.envelope import bucket_of, envelope, in_buckets
from replay.arrays.spill import Column, blocks, in_blocks, release
from replay.faults import FaultMode

Array = NDArray[np.float64]

_SERIES = ("residual", "threshold", "expected", "delta", "delta_std", "delta_bar", "delta_bar_std")


def sentences(
    row: int,
    mode: FaultMode,
    pair: Pair,
    y: Array,
    x: Array,
    use: NDArray[np.bool_],
    status: NDArray[np.int8],
    model: fault_models.ModeModel,
    epsilon: Epsilon | None,
    sat: Sat | None,
    gain: float,
    deviation: float,
) -> tuple[str, ...]:
    """What decided, in figures."""
    out = []
    seconds = y.size * pair.dt
    silent = int(np.count_nonzero(status == fault_models.SILENT))
    if silent:
        out.append(
            f"{pair.y_name} delivered nothing for {silent * pair.dt:.3f} s while other channels of its source did."
        )
    if use.any() and row in (fault_models.STUCK, fault_models.NO_SIGNAL):
        out.append(
            f"{pair.y_name} stayed within {float(np.ptp(y[use])):.2g} {pair.unit} of {float(np.mean(y[use])):.4g} {pair.unit} "
            f"for {seconds:.3f} s while {pair.x_name} moved over {float(np.ptp(x[use])):.2g} {pair.unit}."
        )
    elif use.any() and epsilon is not None:
        out.append(
            f"{pair.y_name} followed {1 - epsilon.value:.3f} × {pair.x_name} (95 %: {1 - epsilon.high:.3f} to "
            f"{1 - epsilon.low:.3f}) over {seconds:.3f} s."
        )
        if sat is not None:
            out.append(
                f"The rest has a mean of {sat.mean * epsilon.value:.3g} and a root mean square of {sat.rms * epsilon.value:.3g} "
                f"{pair.unit}; healthy noise is {model.noise:.2g} {pair.unit}."
            )
    if use.any():
        out.append(
            f"Residual {deviation:.3g} {pair.unit} root mean square; threshold {3 * model.noise:.2g} {pair.unit}."
        )
    if mode is FaultMode.OUTSIDE_TABLE:
        out.append("The gain lies outside 0…1, which no row of the table describes.")
    out.append(f"Log-evidence against healthy: {gain:.0f}; a fault is considered from {model.switch_cost:.0f}.")
    return tuple(out)


def evidence_columns(
    pair: Pair,
    x: Array,
    status: NDArray[np.int8],
    model: fault_models.ModeModel,
    path: ModePath,
    step: NDArray[np.int64],
) -> Pictured:
    """Series for the evidence plots, and every sample of them at some steps."""
    bucket = bucket_of(x.size)
    tracked = GainBiasModel(
        noise=model.noise,
        gain_walk=0.3,
        bias_walk=0.1 * pair.span,
        gain_std=0.3,
        bias_std=0.3 * pair.span,
        relax_s=5.0,
        dt=pair.dt,
    )
    columns = {name: Column(np.float64 if bucket == 1 else np.float32) for name in _SERIES}
    near: dict[str, list[NDArray[Any]]] = {name: [] for name in _SERIES}
    state = None
    for part in blocks(x.size):
        at = step[np.searchsorted(step, part.start) : np.searchsorted(step, part.stop)] - part.start
        use, y, ref = status[part] == fault_models.PAIR, pair.y[part], x[part]
        track = track_gain_bias(y, ref, use, tracked, state)
        state = track.state
        residual, threshold = np.where(use, y - ref, np.nan), np.full(y.size, 3 * model.noise)
        series = (residual, threshold, ref, track.delta, track.delta_std, track.bias, track.bias_std)
        for (name, column), values in zip(columns.items(), series, strict=True):
            column.append(envelope(values, bucket))
            near[name].append(values[at].astype(np.float32))
        release(pair.y, x)
    out = {name: column.finish() for name, column in columns.items()}
    rows = in_buckets(np.asarray, bucket, path.filtered)
    out["probability"] = in_blocks(lambda p: np.float32(1.0) - p[:, fault_models.HEALTHY], rows)
    out.update({f"p_{name}": rows[:, i] for i, name in enumerate(fault_models.ROWS)})
    samples = {name: np.concatenate(parts) for name, parts in near.items()}
    exact = path.filtered[step]
    samples["probability"] = np.float32(1.0) - exact[:, fault_models.HEALTHY]
    samples.update({f"p_{name}": exact[:, i] for i, name in enumerate(fault_models.ROWS)})
    return Pictured(step, out, samples)
