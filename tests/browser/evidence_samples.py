"""Report with everything that the evidence section can show."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests import report_samples as samples


def decided() -> tuple[dict[str, Any], samples.Columns]:
    """Five faults with probabilities, detection times and an onset's shape, in a log with injected faults."""
    report, columns = samples.five_faults()
    for fault, delay in zip(report["intervals"], (0.02, 0.0, 4.0, None, 0.05), strict=True):
        base = f"evidence.{fault['component']}.{fault['side']}."
        columns[base + "probability"] = 1.0 - columns[base + "p_healthy"]
        fault["detected_s"] = None if delay is None else fault["start_s"] + delay
    own, second = "wheel.FR.v", "wheel.FR.v_true"
    report["intervals"][0]["evidence"] = [
        f"{own} stayed within 0.001 m/s of 0.21 m/s while {second} moved over 0.3 m/s.",
        "The measured speed dropped by 0.15 m/s at once; a loaded drive falls with its lag.",
    ]
    report["log"]["open_loop"] = True
    return report, {k: np.asarray(v) for k, v in columns.items()}
