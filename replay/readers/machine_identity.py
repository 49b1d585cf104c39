"""Which machine a log says that it was recorded on."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from replay.readers.rosbag2.metadata import parse_metadata

_KEYS = ("machineid", "robotid", "vehicleid", "assetid", "machineserial", "robotserial", "serialnumber")
_ROSBAG2 = "serialized_metadata"
_LONGEST = 64


def stated_machine(logs: Iterable[Mapping[str, str]]) -> str:
    """Identity of the machine in the metadata of a mission's logs; empty where none is stated.

    Parameters
    ----------
    logs : Iterable[Mapping[str, str]]
        Metadata of each log (`replay.log.raw_log.LogSummary.metadata`), in the mission's order: the first that states one
        counts. Known keys are ``machine_id``, ``robot_id``, ``vehicle_id``, ``asset_id``, ``machine_serial``,
        ``robot_serial`` and ``serial_number``, in this order, with any signs between the words, by themselves or within a
        record (``machine.id``).
    """
    for metadata in logs:
        found: dict[str, str] = {}
        for key, value in _entries(metadata):
            parts = [re.sub(r"[^a-z0-9]", "", part.casefold()) for part in key.split(".")]
            for name in (parts[-1], "".join(parts[-2:])):
                if name in _KEYS and _usable(value):
                    found.setdefault(name, value.strip())
        if found:
            return found[min(found, key=_KEYS.index)]
    return ""


def _entries(metadata: Mapping[str, str]) -> Iterable[tuple[str, str]]:
    for key, value in metadata.items():
        yield key, value
        if key.endswith(_ROSBAG2):  # of a rosbag2 recording in MCAP
            yield from parse_metadata(value).custom.items()


def _usable(value: str) -> bool:
    return 0 < len(value.strip()) <= _LONGEST and value.strip().isprintable()
