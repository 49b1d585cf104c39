"""What `mfhca inspect` says about one log; light to import."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Depth = Literal["quick", "full"]
UNKNOWN = (
    "only the index was read: gaps, jitter, backward stamps, clock offsets and damage within the data are not known; "
    "--full reads everything"
)


@dataclass(frozen=True)
class OddValues:
    """Channels of one topic that hold no usable number in the same number of samples.

    Attributes
    ----------
    channels : tuple[str, ...]
        Their names.
    samples : int
        Samples of each.
    missing : int
        Samples without a number (empty or NaN).
    longest_s : float
        Longest time between two numbers with such samples between [s]; 0 where there is no number at all.
    longest_at_s : float
        Its start from the topic's first stamp [s].
    infinite, absurd : int
        Values that are infinite, or beyond `replay.inspection.values.ABSURD`.
    largest : float
        Largest of the latter without its sign.
    """

    channels: tuple[str, ...]
    samples: int
    missing: int = 0
    longest_s: float = 0.0
    longest_at_s: float = 0.0
    infinite: int = 0
    absurd: int = 0
    largest: float = 0.0


@dataclass(frozen=True)
class TopicTiming:
    """Timing of one topic, or of one group of table columns.

    Attributes
    ----------
    name, type_name : str
        As in `replay.log.raw_log.TopicInfo`.
    count : int
        Messages or rows by the container's index.
    rate_hz : float or None
        1 / median period [Hz]; where only the index was read, messages per second of the log; None below two stamps.
    gaps : int or None
        Periods longer than `replay.inspection.inspect_log.GAP_PERIODS` medians; None where only the index was read.
    longest_gap_s : float or None
        Longest period [s].
    jitter_p99_s : float or None
        99th percentile of |period − median| without the gaps [s].
    backwards, duplicates : int or None
        Stamps earlier than, and equal to, the one before; None where only the index was read.
    offset_s : float or None
        Median header stamp − log stamp [s]; None where only one clock exists.
    start_ns, stop_ns : int
        First and last stamp [ns]; 0 where there is none.
    note : str
        Why the topic was not decoded.
    encoding : str
        Serialisation.
    channels : int or None
        Decoded numbers; None where only the index was read.
    decoded : int or None
        Samples of the longest channel.
    odd_values : tuple[OddValues, ...]
        Channels with samples that hold no usable number; empty where only the index was read.
    """

    name: str
    type_name: str
    count: int
    rate_hz: float | None = None
    gaps: int | None = 0
    longest_gap_s: float | None = None
    jitter_p99_s: float | None = None
    backwards: int | None = 0
    duplicates: int | None = 0
    offset_s: float | None = None
    start_ns: int = 0
    stop_ns: int = 0
    note: str = ""
    encoding: str = ""
    channels: int | None = None
    decoded: int | None = None
    odd_values: tuple[OddValues, ...] = ()


@dataclass(frozen=True)
class InspectReport:
    """Contents and timing of one log.

    Attributes
    ----------
    source, format : str
        As in `replay.log.raw_log.LogSummary`.
    start_ns, stop_ns : int
        First and last log stamp [ns].
    topics : tuple[TopicTiming, ...]
        Every topic.
    channels : tuple[str, ...]
        Names of all decoded channels; empty where only the index was read.
    notes, damage : tuple[str, ...]
        One sentence each.
    metadata : Mapping[str, str]
        Stored in the container.
    depth : str
        ``quick`` where only the index was read, ``full`` where everything was.
    size : int
        Size of the file, or of a folder's files [bytes].
    clock : str
        Clock that the stamps stand on.
    integrity : str
        What checksums there are and which of them were verified.
    container : Mapping[str, object]
        How the messages are packed: ``chunks``, ``compression``, ``uncompressed_bytes``, where known.
    attachments : tuple[Mapping[str, object], ...]
        ``name``, ``media_type`` and ``size`` of the files within the log.
    """

    source: str
    format: str
    start_ns: int
    stop_ns: int
    topics: tuple[TopicTiming, ...]
    channels: tuple[str, ...]
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)
    depth: Depth = "full"
    size: int = 0
    clock: str = ""
    integrity: str = ""
    container: Mapping[str, object] = field(default_factory=dict)
    attachments: tuple[Mapping[str, object], ...] = ()

    @property
    def duration_s(self) -> float:
        """Time between the first and the last log stamp [s]."""
        return (self.stop_ns - self.start_ns) / 1e9

    @property
    def messages(self) -> int:
        """Messages or rows of all topics."""
        return sum(t.count for t in self.topics)

    @property
    def status(self) -> str:
        """``degraded`` where something was lost, else ``ok``, or ``index_ok`` where only the index was read."""
        return "degraded" if self.damage else "ok" if self.depth == "full" else "index_ok"


def mean_rate(count: int, duration_s: float) -> float | None:
    """Messages per second of the log; None below two messages. In Hz; `duration_s` in s."""
    return (count - 1) / duration_s if count > 1 and duration_s > 0 else None
