"""Topics that a clip holds beside the original messages: mapped signals, the replayed loop, and evidence series."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.control.loop import Replay
from replay.export.formats.joint_states import joint_states
from replay.export.formats.message_layout import Layout, TopicBatch
from replay.export.replay_log import replay_topics
from replay.log.open_loop import TOPIC
from replay.machine.config import Machine
from replay.signals.signal import Signals
from replay.signals.timeline import Timeline

EVIDENCE, MAPPED = "/mfhca/evidence", "/mfhca/mapped_"


def signal_topics(signals: Signals, start_ns: int, stop_ns: int) -> list[tuple[TopicBatch, tuple[str, ...]]]:
    """Mapped signals between two stamps: a JointState topic ``/mfhca/mapped_<n>`` per set of stamps, with its names.

    Values are SI and stand in ``position``, under the signals' canonical names.
    """
    groups: dict[bytes, tuple[NDArray[np.int64], dict[str, NDArray[np.float64]]]] = {}
    for name, signal in signals.items.items():
        a, b = np.searchsorted(signal.stamps, (start_ns, stop_ns))
        if b > a:
            stamps = np.array(signal.stamps[a:b])
            groups.setdefault(stamps.tobytes(), (stamps, {}))[1][name] = signal.values[a:b]
    ordered = sorted(groups.values(), key=lambda g: -g[0].size)
    return [
        (columns_topic(f"{MAPPED}{i}", columns, stamps), tuple(columns))
        for i, (stamps, columns) in enumerate(ordered, 1)
    ]


def loop_topics(timeline: Timeline, replay: Replay, machine: Machine, start_ns: int, stop_ns: int) -> list[TopicBatch]:
    """Topics of the replayed loop (`replay.export.replay_log`) between two stamps, values to single precision.

    Raises
    ------
    ValueError
        Where the loop was not replayed step by step.
    """
    if replay.bucket != 1:
        raise ValueError("the loop was replayed in buckets")
    a, b = (min(max(-(-(t - timeline.start_ns) // timeline.step_ns), 0), timeline.size) for t in (start_ns, stop_ns))
    if b <= a:
        return []
    part = replace(timeline, start_ns=timeline.start_ns + a * timeline.step_ns, size=b - a)
    values = {f.name: getattr(replay, f.name) for f in fields(replay)}
    cut: dict[str, Any] = {n: _single(x[a:b]) for n, x in values.items() if isinstance(x, np.ndarray)}
    return replay_topics(part, replace(replay, **cut), machine)


def evidence_topic(
    columns: Mapping[str, NDArray[np.floating]], component: str, first_ns: int, start_ns: int, stop_ns: int
) -> tuple[TopicBatch, tuple[str, ...]] | None:
    """Evidence of one component as the topic ``/mfhca/evidence``, with its names; None where there is none.

    Each column of shape (n,).

    Parameters
    ----------
    columns : Mapping[str, NDArray[np.floating]]
        Columns of a result: ``t`` [s] and ``evidence.<component>.<side>.<leaf>``.
    component : str
        Wheel or steering axle.
    first_ns : int
        Stamp of t = 0.
    start_ns, stop_ns : int
        Part to keep.
    """
    if "t" not in columns:
        return None
    stamps = first_ns + np.round(np.asarray(columns["t"], np.float64) * 1e9).astype(np.int64)
    a, b = np.searchsorted(stamps, (start_ns, stop_ns))
    prefix = f"evidence.{component}."
    found = {n.removeprefix("evidence."): _single(c[a:b]) for n, c in columns.items() if n.startswith(prefix)}
    found |= {n.replace(".threshold", ".minus_threshold"): -c for n, c in found.items() if n.endswith(".threshold")}
    found = {n: c for n, c in found.items() if np.isfinite(c).any()}
    return (columns_topic(EVIDENCE, found, stamps[a:b]), tuple(found)) if found else None


def _single(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Values to single precision, which halves what they take in the file."""
    return np.asarray(values, np.float32).astype(np.float64)


def open_loop_topic(stamp: int) -> TopicBatch:
    """Mark that faults were injected into the recording, which a clip would else lose."""
    layout = Layout("cdr")
    layout.varying("data", "u1")
    return TopicBatch(TOPIC, "std_msgs/msg/Bool", layout, {"data": np.ones(1, np.uint8)}, np.array([stamp], np.int64))


def columns_topic(topic: str, columns: Mapping[str, NDArray[np.float64]], stamps: NDArray[np.int64]) -> TopicBatch:
    """JointState messages whose joints are the columns and whose positions are their values.

    Columns and stamps [ns] of shape (n,).
    """
    return joint_states(topic, list(columns), np.column_stack(list(columns.values())), stamps)
