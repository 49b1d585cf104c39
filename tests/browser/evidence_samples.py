"""Reports with everything that the evidence section can show, with thousands of faults, and of a long mission."""

from __future__ import annotations

from typing import Any

import numpy as np

from diagnosis.results.evidence_columns import steps_around
from diagnosis.results.result import Closeups
from replay.arrays.envelope import envelope
from tests import report_samples as samples

UNSTATED = (60.0, 62.0)
SPIKES = (32.5, 77.7)


def unstated() -> tuple[dict[str, Any], samples.Columns]:
    """As `decided`, and a valve whose probability passes the limit for two seconds, with its residual at a tenth of the threshold."""
    report, columns = decided()
    base, t = "evidence.FL.actuator.", columns["t"]
    inside = (t >= UNSTATED[0]) & (t < UNSTATED[1])
    columns[base + "probability"] = np.where(inside, 0.99, 0.01)
    columns[base + "threshold"] = np.full(len(t), 0.02)
    columns[base + "residual"] = np.where(inside, 0.002, 0.0)
    return report, columns


def decided() -> tuple[dict[str, Any], samples.Columns]:
    """Five faults with probabilities, detection times and an onset's shape, in a log with injected faults."""
    report, columns = samples.five_faults()
    for fault, delay in zip(report["intervals"], (0.02, 0.0, 4.0, None, 0.05), strict=True):
        base = f"evidence.{fault['component']}.{fault['side']}."
        columns[base + "probability"] = 1.0 - columns[base + "p_healthy"]
        fault["detected_s"] = None if delay is None else fault["start_s"] + delay
    own, second = "wheel.FR.v", "wheel.FR.v_true"
    report["intervals"][0]["evidence"] = [
        f"{own} stayed between 0.2095 and 0.2105 m/s while {second} moved over 0.3 m/s.",
        "The measured speed dropped by 0.15 m/s at once; a loaded drive falls with its lag.",
    ]
    report["intervals"][0]["about"] = ["", "onset"]
    report["log"]["open_loop"] = True
    return report, {k: np.asarray(v) for k, v in columns.items()}


def unclear() -> tuple[dict[str, Any], samples.Columns]:
    """The same with a first fault of which no kind has half of the probability, though each reading fits one best."""
    report, columns = decided()
    rows = (("stuck", 0.45), ("inefficient", 0.35), ("noisy", 0.2))
    report["intervals"][0]["hypotheses"] = [{"side": "sensor", "mode": mode, "p": p} for mode, p in rows]
    report["intervals"][0]["probability"] = 0.45
    return report, columns


def machine_events(*, faults: bool = True) -> tuple[dict[str, Any], samples.Columns]:
    """A mission of whose machine as a whole two things are told, one of them throughout."""
    report, columns = decided() if faults else samples.no_faults()
    spans = [{"start_s": 30.0, "stop_s": 36.0}, {"start_s": 80.0, "stop_s": 100.0}]
    report["events"] = [
        {"id": "M1", "title": "The machine did not follow its commands", "text": "For 26 s …", "spans": spans},
        {"id": "M2", "title": "The gyro contradicts the wheels", "text": "Throughout.", "spans": []},
    ]
    return report, columns


def machine_events_alone() -> tuple[dict[str, Any], samples.Columns]:
    """The same of a mission without a fault."""
    return machine_events(faults=False)


def many_faults(count: int, spans: int) -> tuple[dict[str, Any], samples.Columns]:
    """Faults of falling severity one after the other on two wheels, and as many states as wanted."""
    report, columns = samples.five_faults()
    first, wheels = report["intervals"][0], ("FR", "FL")
    report["intervals"] = [
        {
            **first,
            "id": f"F{i + 1}",
            "component": wheels[i % 2],
            "start_s": 120.0 * i / count,
            "stop_s": 120.0 * (i + 0.5) / count,
            "severity": "high" if i % 10 == 0 else "low",
        }
        for i in range(count)
    ]
    names = ("healthy", "not_excited", "stuck")
    report["states"] = [
        {
            "component": wheels[i % 2],
            "side": "sensor",
            "state": names[i % 3],
            "start_s": 120.0 * (i // 2) / spans * 2,
            "stop_s": 120.0 * (i // 2 + 1) / spans * 2,
            "reason": "held still",
        }
        for i in range(spans)
    ]
    return report, columns


def thousands() -> tuple[dict[str, Any], samples.Columns]:
    """1200 faults."""
    return many_faults(1200, 12_000)


def long_mission() -> tuple[dict[str, Any], samples.Columns]:
    """Five faults in a mission whose rows are the extremes of 64 samples each."""
    report, columns = samples.five_faults()
    report["log"]["rate_hz"] = 3200.0
    return report, columns


def spike() -> tuple[dict[str, Any], samples.Columns]:
    """A single sample of another value, in a signal that no figure shows."""
    report, columns = samples.five_faults()
    columns["imu.yaw_rate"] = np.where(np.arange(12_000) == 7_777, 0.5, 0.1)
    return report, columns


def spikes() -> tuple[dict[str, Any], samples.Columns]:
    """Two minutes at 1 kHz; three samples of wheel FR's speed jump, once within a fault and once far from any."""
    wheels, axles = ["FR", "FL", "RR", "RL"], ["front", "rear"]
    report, columns = samples.mission(wheels, axles, samples.FAULTS, rate=1000.0, geometry=samples.PLACES)
    for at in SPIKES:
        columns["wheel.FR.v"][round(at * 1000) : round(at * 1000) + 3] = 1.998
    return report, columns


def spikes_long() -> tuple[dict[str, Any], samples.Columns, Closeups]:
    """The same as extremes of 16 samples, with every sample around the faults."""
    report, columns = spikes()
    spans = [(round(1000 * f["start_s"]), round(1000 * f["stop_s"])) for f in report["intervals"]]
    step = steps_around(spans, 120_000, 0.001)
    near = {k: v[step] for k, v in columns.items() if k != "t"}
    rows = {k: envelope(v, 16) for k, v in columns.items() if k != "t"}
    return report, {"t": 0.008 * np.arange(15_000), **rows}, Closeups(step, near)


def healthy_evidence() -> tuple[dict[str, Any], samples.Columns]:
    """A mission without a fault, with the residual of one speed sensor, a check of it, and what it would have shown."""
    report, columns = samples.no_faults()
    t = columns["t"]
    columns["evidence.FR.sensor.residual"] = 0.004 * np.sin(t) + 0.006 * np.exp(-((t - 40.0) ** 2))
    columns["evidence.FR.sensor.threshold"] = np.full(len(t), 0.02)
    report["clearing"] = [
        {"component": "FR", "side": "sensor", "check": "second_measurement", "asked": "against its second measurement", "worst": 0.15,
         "limit": 0.25, "start_s": 67.5, "stop_s": 70.5, "shows": 0.25, "passed": True, "text": ""}
    ]  # fmt: skip
    report["detectability"] = {
        "rows": [
            {"component": "FR", "side": "sensor", "deviation": "inefficient", "for_s": 2.0, "size": 0.3, "unit": "1",
             "share": 1.0, "places": 9, "told": "sensor"}
        ],
        "traces": [],
    }  # fmt: skip
    return report, columns
