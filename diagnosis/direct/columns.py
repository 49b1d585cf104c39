"""The series behind the plots of direct evidence: residual, probabilities of the rows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.estimation.fault_models import HEALTHY
from diagnosis.estimation.viterbi import ModePath
from diagnosis.results.evidence_columns import Pictured
from diagnosis.results.fault_rows import ROWS, codes_of
from replay.arrays.blocks import release
from replay.arrays.envelope import bucket_of, envelope, in_buckets

_SERIES = ("residual", "threshold", "expected")


def evidence_columns(found: IdentifiedPair, path: ModePath, step: NDArray[np.int64]) -> Pictured:
    """Series for the evidence plots, and every sample of them at some steps.

    Parameters
    ----------
    found : IdentifiedPair
        The pair.
    path : ModePath
        Most probable rows.
    step : NDArray[np.int64], shape (m,)
        Steps of which every sample is wanted.
    """
    pair, model, noise = found.pair, found.model, found.model.noise
    y_all, x, status, _, white, passing, _ = found.samples
    bucket, store = bucket_of(x.size), pair.store
    columns = {name: store.column(np.float64 if bucket == 1 else np.float32) for name in _SERIES}
    near: dict[str, list[NDArray[Any]]] = {name: [] for name in _SERIES}
    for part in store.blocks(x.size, bucket):
        at = step[np.searchsorted(step, part.start) : np.searchsorted(step, part.stop)] - part.start
        use, y, ref = status[part] == PAIR, y_all[part], x[part]
        residual, threshold = (
            np.where(use, y - ref, np.nan),
            3 * np.sqrt(noise**2 * white[part] + model.tolerance**2 * (passing[part] - 1.0)),
        )
        series = (residual, threshold, ref)
        for (name, column), values in zip(columns.items(), series, strict=True):
            column.append(envelope(values, bucket))
            near[name].append(values[at].astype(np.float32))
        release(y_all, x)
    out = {name: column.finish() for name, column in columns.items()}
    rows = in_buckets(np.asarray, bucket, store, path.filtered)
    out["probability"] = store.map(lambda p: np.float32(1.0) - p[:, HEALTHY], rows)
    out.update({f"p_{ROWS[i]}": rows[:, i] for i in codes_of(pair.side)})
    samples = {name: np.concatenate(parts) for name, parts in near.items()}
    exact = path.filtered[step]
    samples["probability"] = np.float32(1.0) - exact[:, HEALTHY]
    samples.update({f"p_{ROWS[i]}": exact[:, i] for i in codes_of(pair.side)})
    return Pictured(step, out, samples)
