"""JointState messages whose joints are columns and whose positions are their values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from replay.export.formats.message_layout import Layout, TopicBatch


def joint_states(
    topic: str, names: Sequence[str], values: NDArray[np.float64], stamps: NDArray[np.int64], frame: str = ""
) -> TopicBatch:
    """One message for each stamp, in CDR.

    Parameters
    ----------
    topic : str
        Topic of the messages.
    names : Sequence[str]
        Names of the joints.
    values : NDArray[np.float64], shape (n, joints)
        Their positions.
    stamps : NDArray[np.int64], shape (n,)
        Nanoseconds since 1970.
    frame : str
        Frame of the header.
    """
    layout = Layout("cdr")
    layout.varying("sec", "u4")
    layout.varying("nanosec", "u4")
    layout.text(frame)
    layout.constant("I", len(names))
    for name in names:
        layout.text(name)
    layout.doubles("position", len(names))
    layout.doubles(None)
    layout.doubles(None)
    fields: dict[str, NDArray[np.generic]] = {
        "sec": (stamps // 1_000_000_000).astype(np.uint32),
        "nanosec": (stamps % 1_000_000_000).astype(np.uint32),
        "position": np.ascontiguousarray(values),
    }
    return TopicBatch(topic, "sensor_msgs/msg/JointState", layout, fields, stamps)
