"""Logs' contents and timing for `mfhca inspect`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from pathlib import PurePath
from typing import TYPE_CHECKING

from rich.text import Text

from cli.tables.layout import ByWidth, bullets, section, table, text
from replay.inspection.report import UNKNOWN

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.inspection.report import InspectReport, OddValues, TopicTiming

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_DATED_NS = 365 * 86_400 * 10**9  # as pages have it: stamps before are of a clock without a date
_ZONE = (" UTC", " of a clock without a date (simulated time, or counted from a start)")
_WITHOUT_INDEX = ("csv", "twincat")
_END_NS = (1 << 63) - 10**10  # where 64 bits end, no clock stands
_LONG_VALUE = 60
_UNSHOWN = ("integrity", "rosbag2.serialized_metadata")  # told elsewhere; the recorder's own summary of what is listed
_SHOWN_METADATA = 12
_SHOWN_ODD, _SHOWN_NAMES = 8, 6
_WIDE, _WIDE_LIST = 100, 110


def inspect_document(report: InspectReport) -> dict[str, object]:
    """Everything as JSON values."""
    document = asdict(report)
    return document | {"duration_s": report.duration_s, "messages": report.messages, "status": report.status}


def inspect_parts(report: InspectReport) -> list[RenderableType]:
    """File and time; damage; a line per topic; what is unusual; how it is stored; notes."""
    quick = report.depth == "quick"
    parts: list[RenderableType] = [
        Text.assemble(text(report.source, "bold"), "  ", text(report.format), ", ", text(_when(report)))
    ]
    if report.damage:
        parts += [_degraded(report), bullets(report.damage, "red"), ""]
    parts.append(_topics(report) if report.topics else text("It holds no topics."))
    unusual = [f"{t.name}: {words}" for t in report.topics if (words := _unusual(t))]
    unusual += [f"{t.name}: {_odd(o, t)}" for t in report.topics for o in t.odd_values[:_SHOWN_ODD]]
    unusual += [
        f"{t.name}: and {len(t.odd_values) - _SHOWN_ODD} more groups of channels without usable numbers (--json shows all)"
        for t in report.topics
        if len(t.odd_values) > _SHOWN_ODD
    ]
    stored = _stored(report)
    for title, lines in (("Unusual", unusual), ("Stored", stored), ("Notes", report.notes)):
        if lines:
            parts += [section(title), bullets(lines)]
    if quick:
        known = (
            UNKNOWN.replace("the index was", "the first and last rows were")
            if report.format in _WITHOUT_INDEX
            else UNKNOWN
        )
        parts += ["", text(known[0].upper() + known[1:] + ".", "dim")]
    return parts


def list_parts(reports: Sequence[InspectReport], failures: Sequence[str]) -> list[RenderableType]:
    """A line per log, and how many of them are degraded or cannot be read."""
    folder = _common_folder([r.source for r in reports])
    rows = [
        (
            r.source.removeprefix(folder), r.format, _start(r.start_ns) if 0 < r.stop_ns < _END_NS else "–", f"{r.duration_s:.1f}", r.messages,
            len(r.topics), _bytes(r.size), _state(r),
        )
        for r in reports
    ]  # fmt: skip
    headings = ("log", "format", "start (UTC)", "s", "messages", "topics", "size", "state")
    wide = table(headings, rows, right=(3, 4, 5, 6))
    short = [(source, seconds, n, size, state) for source, _, _, seconds, n, _, size, state in rows]
    narrow = table(("log", "s", "messages", "size", "state"), short, right=(1, 2, 3))
    degraded = sum(bool(r.damage) for r in reports)
    words = [f"{len(reports)} log{'' if len(reports) == 1 else 's'} read"]
    words += [f"{degraded} degraded"] if degraded else []
    words += [f"{len(failures)} could not be read"] if failures else []
    head: list[RenderableType] = [text(f"in {folder}", "dim")] if folder else []
    return [
        *head,
        ByWidth(wide, narrow, _WIDE_LIST),
        text(", ".join(words), "bold red" if degraded or failures else "bold"),
    ]


def _common_folder(sources: Sequence[str]) -> str:
    """Give the folder that several logs share, with the separator behind it, or nothing."""
    if len(sources) < 2 or len({PurePath(s).is_absolute() for s in sources}) > 1:
        return ""
    common = os.path.commonpath([str(PurePath(s).parent) for s in sources])
    return common if not common or common.endswith(os.sep) else common + os.sep


def damage_parts(report: InspectReport) -> list[RenderableType]:
    """What one log lost; nothing for a whole one."""
    if not report.damage:
        return []
    return ["", text(report.source, "bold"), _degraded(report), bullets(report.damage, "red")]


def _degraded(report: InspectReport) -> Text:
    n = len(report.damage)
    return Text.assemble(
        ("degraded:", "bold reverse red"), f" {n} loss{'' if n == 1 else 'es'}; ", "what is left is shown"
    )


def _topics(report: InspectReport) -> RenderableType:
    if report.depth == "quick":
        rows = [(t.name, text(_short(t), "dim"), t.encoding, t.count, _mean(t.rate_hz)) for t in report.topics]
        return table(("topic", "type", "encoding", "count", "mean Hz"), rows, right=(3, 4))
    full = [_row(t) for t in report.topics]
    headings = ("topic", "type", "count", "Hz", "jitter ms", "gaps", "header−log ms", "channels")
    wide = table(headings, full, right=(2, 3, 4, 5, 6, 7))
    short = [(Text.assemble(text(name), "\n  ", kind), *rest[:-1]) for name, kind, *rest in full]
    narrow = table(("topic", "count", "Hz", "jitter ms", "gaps", "header−log ms"), short, right=(1, 2, 3, 4, 5))
    return ByWidth(wide, narrow, max(_WIDE, max(len(t.name) + len(_short(t)) for t in report.topics) + 60))


def _row(topic: TopicTiming) -> tuple[str, Text, int, str, str, int | str, str, int | str]:
    return (
        topic.name,
        text(_short(topic), "dim"),
        topic.count,
        _number(topic.rate_hz, "{:.5g}"),
        _number(topic.jitter_p99_s, "{:.2g}", 1e3),
        topic.gaps or "–",
        _number(topic.offset_s, "{:.3g}", 1e3),
        topic.channels or "–",
    )


def _short(topic: TopicTiming) -> str:
    return topic.type_name.rpartition("/")[2]


def _number(value: float | None, form: str, scale: float = 1.0) -> str:
    return "–" if value is None else form.format(value * scale)


def _mean(rate: float | None) -> str:
    return "–" if rate is None else f"{rate:.0f}" if rate >= 100 else f"{rate:.3g}"


def _unusual(topic: TopicTiming) -> str:
    """What a user should know about a topic's stamps, or why it was not decoded."""
    words = []
    if topic.note:
        words.append(topic.note)
    if topic.gaps and topic.longest_gap_s is not None:
        words.append(f"{topic.gaps} gap{'' if topic.gaps == 1 else 's'}, longest {topic.longest_gap_s:.3g} s")
    if topic.backwards:
        words.append("1 stamp goes back" if topic.backwards == 1 else f"{topic.backwards} stamps go back")
    if topic.duplicates:
        some = "1 stamp repeats" if topic.duplicates == 1 else f"{topic.duplicates} stamps repeat"
        words.append(f"{some} the one before")
    if topic.channels and topic.decoded is not None and topic.decoded < topic.count:
        words.append(f"{topic.decoded} of {topic.count} messages gave numbers")
    return "; ".join(words)


def _odd(odd: OddValues, topic: TopicTiming) -> str:
    """Say which channels hold no usable number, and how often."""
    names = [n.removeprefix(f"{topic.name}.") for n in odd.channels]
    who = ", ".join(names[:_SHOWN_NAMES]) + (
        f" and {len(names) - _SHOWN_NAMES} more" if len(names) > _SHOWN_NAMES else ""
    )
    if len(names) == topic.channels and len(names) > 1:
        who = f"all {len(names)} channels"
    one = len(names) == 1
    words = []
    if odd.missing == odd.samples:
        words.append(f"{'holds' if one else 'hold'} no number at all")
    elif odd.missing:
        words.append(
            f"{odd.missing} of {odd.samples} samples hold no number, the longest stretch lasts {odd.longest_s:.3g} s, "
            f"from {odd.longest_at_s:.1f} s on"
        )
    if odd.infinite:
        words.append(f"{odd.infinite} of {odd.samples} values are infinite")
    if odd.absurd:
        words.append(f"{odd.absurd} of {odd.samples} values are absurdly large (up to {odd.largest:.3g})")
    return who + (" " if odd.missing == odd.samples else ": ") + "; ".join(words)


def _stored(report: InspectReport) -> list[str]:
    """Size, packing, clock, checksums, attachments, metadata."""
    lines = []
    chunks, packed = report.container.get("chunks"), report.container.get("compression")
    if report.size:
        how = f", {chunks} chunks, compression {packed}" if chunks else ", not in chunks" if chunks == 0 else ""
        lines.append(_bytes(report.size) + how)
    if report.clock and report.clock != "own":
        lines.append(
            f"stamps on the {report.clock} clock" + (" (log clock where none)" if report.clock == "header" else "")
        )
    if report.integrity:
        lines.append(f"checksums: {report.integrity.removeprefix('checksums; ').removeprefix('checksums, ')}")
    lines += [
        f"attachment {a['name']}, {a['media_type'] or 'of no type'}, {_bytes(float(str(a['size'])))}"
        for a in report.attachments
    ]
    shown = {k: v for k, v in report.metadata.items() if k not in _UNSHOWN and v}
    for key, value in list(shown.items())[:_SHOWN_METADATA]:
        line = " ".join(str(value).split())
        lines.append(f"{key}: {line[:_LONG_VALUE]}{'…' if len(line) > _LONG_VALUE else ''}")
    if len(shown) > _SHOWN_METADATA:
        lines.append(f"and {len(shown) - _SHOWN_METADATA} more entries of metadata (--json shows all)")
    return lines


def _when(report: InspectReport) -> str:
    if report.stop_ns >= _END_NS:
        return "no usable stamps"
    if not report.stop_ns:
        return "no stamps"
    return f"{_start(report.start_ns, 3)}{_ZONE[_undated(report.start_ns)]}, {report.duration_s:.3f} s"


def _undated(ns: int) -> bool:
    """Whether a stamp is of simulated time, or counted from a start, and tells no date."""
    return abs(ns) < _DATED_NS


def _start(ns: int, digits: int = 0) -> str:
    """Date and time; a number of seconds where no calendar reaches, or of a clock without a date."""
    if _undated(ns):
        return f"from {ns / 1e9:.{digits}f} s"
    try:
        moment = _EPOCH + timedelta(microseconds=ns // 1000)
    except OverflowError:
        return f"{ns / 1e9:.3f} s"
    return moment.strftime("%Y-%m-%d %H:%M:%S") + (f".{moment.microsecond // 1000:03d}" if digits else "")


def _bytes(count: float) -> str:
    size = float(count)
    for unit in ("B", "kB", "MB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} GB"


def _state(report: InspectReport) -> Text:
    if report.damage:
        return text("degraded", "bold red")
    if report.depth == "full":
        return text("ok", "green")
    return text("head ok" if report.format in _WITHOUT_INDEX else "index ok")
