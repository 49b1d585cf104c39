"""A diagnosis as records of an MCAP file, on the recorder's clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.document import ReportDocument
from diagnosis.ros.messages import ARRAY, DIAGNOSTICS, EVENTS, LOG, Arrays, events
from replay.export.clips.mcap import Definitions, Records, message_records, own_channel

_AT_ONCE = 600

#: Log stamps of moments of the mission.
Places = Callable[[NDArray[np.int64]], NDArray[np.int64]]


def diagnosis_records(
    report: ReportDocument,
    definitions: Definitions,
    places: Places,
    start_ns: int | None = None,
    stop_ns: int | None = None,
) -> Iterator[Records]:
    """Records of the topics ``/mfhca/diagnostics`` and ``/mfhca/events``; their channels are added at once.

    `places` takes and gives stamps of shape (k,) [ns].

    Parameters
    ----------
    report : ReportDocument
        The diagnosis.
    definitions : Definitions
        Of the file to write.
    places : Places
        Puts stamps of the mission's clock onto the recorder's, which decides where a viewer shows them.
    start_ns, stop_ns : int or None
        Part of the mission [ns on its clock]; None: all of it.
    """
    arrays = Arrays(report, start_ns, stop_ns)
    first, last = int(arrays.stamps[0]), int(arrays.stamps[-1])
    # The verdict stands at the mission's start, and at that of a part of it.
    told = [
        (max(ns, first), octets)
        for ns, octets in events(report)
        if ns <= last and (ns >= first or _is_first(ns, report))
    ]
    channels = own_channel(DIAGNOSTICS, ARRAY, definitions), own_channel(EVENTS, LOG, definitions)
    return _records(arrays, told, channels, places)


def _is_first(ns: int, report: ReportDocument) -> bool:
    return ns == report["log"]["start_ns"]


def _records(
    arrays: Arrays, told: list[tuple[int, bytes]], channels: tuple[int, int], places: Places
) -> Iterator[Records]:
    log_stamps = places(arrays.stamps)
    for at in range(0, log_stamps.size, _AT_ONCE):
        yield message_records(list(arrays.messages(at, at + _AT_ONCE)), log_stamps[at : at + _AT_ONCE], channels[0])
    stamps = places(np.array([ns for ns, _ in told], np.int64))
    yield message_records([octets for _, octets in told], stamps, channels[1])


def unmoved(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """`Places` where the recorder's clock is the mission's, or not known. Shape (k,) [ns]."""
    return stamps
