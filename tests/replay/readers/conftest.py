"""Logs built by the tests, and the message-by-message oracle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.LATEST)
LONGEST = 64


def flat(value: Any, path: str = "") -> dict[str, Any]:
    """Numbers of a rosbags message by path, arrays indexed by number; constants (upper case) are no fields."""
    out: dict[str, Any] = {}
    if is_dataclass(value):
        for item in fields(value):
            if item.name.islower() and item.name not in ("__msgtype__", "structure_needs_at_least_one_member"):
                out |= flat(getattr(value, item.name), f"{path}.{item.name}" if path else item.name)
    elif isinstance(value, np.ndarray | list):
        if len(value) <= LONGEST:
            for i, item in enumerate(value):
                out |= flat(item, f"{path}[{i}]")
    elif not isinstance(value, str):
        out[path] = value
    return out


@pytest.fixture(scope="session")
def flatten() -> Callable[..., dict[str, Any]]:
    return flat


McapMaker = Callable[..., Path]


@pytest.fixture
def make_mcap(tmp_path: Path) -> McapMaker:
    """Write (topic, type, message, log ns, publish ns) rows in CDR with embedded definitions."""

    def make(
        rows: list[tuple[str, str, Any, int, int]],
        name: str = "log.mcap",
        compression: CompressionType = CompressionType.ZSTD,
        **options: Any,
    ) -> Path:
        path = tmp_path / name
        with path.open("wb") as file:
            writer = Writer(file, compression=compression, **options)
            writer.start(profile="ros2", library="test")
            known: dict[tuple[str, str], int] = {}
            for topic, kind, message, log, publish in rows:
                if (topic, kind) not in known:
                    text = STORE.generate_msgdef(kind, ros_version=2)[0]
                    schema = writer.register_schema(kind, "ros2msg", text.encode())
                    known[topic, kind] = writer.register_channel(topic, "cdr", schema)
                data = bytes(STORE.serialize_cdr(message, kind))
                writer.add_message(known[topic, kind], log, data, publish)
            writer.finish()
        return path

    return make


@pytest.fixture(scope="session")
def make_message() -> Callable[..., Any]:
    """Build a message of the given type from keyword arguments; ``stamp`` in ns makes its header."""
    types = STORE.types

    def make(kind: str, stamp: int | None = None, frame: str = "base", **values: Any) -> Any:
        if stamp is not None:
            time = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
            values = {"header": types["std_msgs/msg/Header"](time, frame), **values}
        return types[kind](**values)

    return make


@pytest.fixture(scope="session")
def joint_state(make_message: Callable[..., Any]) -> Callable[..., Any]:
    def make(stamp: int, names: list[str], velocity: list[float], frame: str = "base") -> Any:
        empty = np.empty(0)
        return make_message(
            "sensor_msgs/msg/JointState", stamp, frame, name=names, position=empty, velocity=np.array(velocity),
            effort=empty,
        )  # fmt: skip

    return make
