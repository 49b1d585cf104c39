"""What ``metadata.yaml`` of a rosbag2 recording says: parts, topics and counts.

Only the lines that matter are looked at, in the shapes in which recorders and converters write them, so that no
document can cost time or memory: there are no anchors, no nesting and nothing is evaluated.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from replay.errors import LogError
from replay.log.reading_notes import Report

MAX_BYTES = 4 << 20
_KEYS = ("version", "compression_mode", "compression_format", "ros_distro", "storage_identifier", "message_count")
_READABLE_MODES = ("", "none", "file", "message")
_NEWEST = 9
_CUSTOM = re.compile(r"""\s*["']?custom_data["']?:""")
_MOST_CUSTOM = 100


@dataclass
class Metadata:
    """Contents of one ``metadata.yaml``.

    Attributes
    ----------
    facts : dict[str, str]
        Storage, compression and ROS distribution; empty where not stated.
    files : list[str] or None
        Parts in recorded order, or None where they are not stated.
    counts : dict[str, int] or None
        Messages per topic, or None where they are not stated.
    parts : dict[str, int]
        Messages per part, where stated.
    custom : dict[str, str]
        What the recorder was told to note (``custom_data``).
    """

    facts: dict[str, str] = field(default_factory=dict)
    files: list[str] | None = None
    counts: dict[str, int] | None = None
    parts: dict[str, int] = field(default_factory=dict)
    custom: dict[str, str] = field(default_factory=dict)


def read_metadata(folder: Path, report: Report) -> Metadata:
    """Read ``metadata.yaml`` of a folder; what cannot be used of it is reported.

    Raises
    ------
    LogError
        Where the file is there and cannot be opened.
    """
    path = folder / "metadata.yaml"
    if not path.is_file():
        report.note(f"{folder.name} has no metadata.yaml; its storage files were read in the order of their names")
        return Metadata()
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            report.lost(f"{path.name} has {size} bytes; at most {MAX_BYTES} are read, so it was left out")
            return Metadata()
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    found = parse_metadata(text)
    if found.files is None:
        report.lost(f"{path.name} names no files; the storage files were read in the order of their names")
    mode = found.facts["compression_mode"]
    if mode not in _READABLE_MODES:
        report.lost(f"{path.name}: compression mode {mode[:40]!r} is not known; the parts were read as they are")
    version = found.facts.pop("version")
    if version.isdecimal() and int(version[:9]) > _NEWEST:
        report.note(f"{path.name} is of version {version[:20]}; versions up to {_NEWEST} are known")
    return found


def parse_metadata(text: str) -> Metadata:
    """Take the lines that matter from the text of a ``metadata.yaml``."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    facts = {key: _value(lines, key).lower() for key in _KEYS if key != "message_count"}
    topics = _items(lines, "topics_with_message_count")
    counts: dict[str, int] = {}
    for item in topics or []:
        name, count = _value(item, "name"), _value(item, "message_count")
        if name and count.isdecimal() and len(count) < 19:
            counts[name] = counts.get(name, 0) + int(count)
    parts = {}
    for item in _items(lines, "files") or []:
        name, count = _value(item, "path"), _value(item, "message_count")
        if name and count.isdecimal() and len(count) < 19:
            parts[name] = int(count)
    files = _items(lines, "relative_file_paths")
    names = None if files is None else [n for item in files if (n := scalar(item[0].strip()[1:]))]
    return Metadata(facts, names, None if topics is None else counts, parts, _custom(lines))


def _value(lines: list[str], key: str) -> str:
    """Value of the first line with this key, which may follow the dash of a list."""
    pattern = re.compile(rf"""\s*(?:-[ \t]+)?["']?{key}["']?:(?:[ \t]+(.*))?$""")
    found = next((m for line in lines if key in line and (m := pattern.match(line))), None)
    return scalar(found.group(1) or "") if found else ""


def _custom(lines: list[str]) -> dict[str, str]:
    """Texts by their keys below ``custom_data``."""
    start = next((i for i, line in enumerate(lines) if _CUSTOM.match(line)), None)
    if start is None:
        return {}
    head = lines[start]
    rows = [part for part in head.partition(":")[2].strip(" {}").split(",") if part.strip()]
    for line in lines[start + 1 :]:
        if len(line) - len(line.lstrip()) <= len(head) - len(head.lstrip()):
            break
        rows.append(line)
    pairs = ((key, value) for key, colon, value in (row.partition(":") for row in rows[:_MOST_CUSTOM]) if colon)
    return {scalar(key): scalar(value) for key, value in pairs}


def _items(lines: list[str], key: str) -> list[list[str]] | None:
    """Lines of each item of a list; None where the key is absent."""
    pattern = re.compile(rf"""(\s*)["']?{key}["']?:[ \t]*(.*)$""")
    for i, line in enumerate(lines):
        found = pattern.match(line) if key in line else None
        if found is None:
            continue
        rest = found.group(2).partition(" #")[0].strip()
        if rest:
            return [["-" + part] for part in rest.strip("[]").split(",") if part.strip()]
        depth, items = None, list[list[str]]()
        for after in lines[i + 1 :]:
            indent = len(after) - len(after.lstrip())
            dash = after.lstrip().startswith("- ")
            depth = indent if depth is None and dash else depth
            if depth is None or indent < depth or (indent == depth and not dash) or indent < len(found.group(1)):
                break
            if dash and indent == depth:
                items.append([])
            items[-1].append(after)
        return items
    return None


def scalar(text: str) -> str:
    """Text of a plain or quoted YAML scalar."""
    text = text.strip()
    if text[:1] == "'":
        found = re.match(r"'((?:[^']|'')*)'", text)
        return found.group(1).replace("''", "'") if found else text
    if text[:1] == '"':
        found = re.match(r'"((?:[^"\\]|\\.)*)"', text)
        return re.sub(r"\\(.)", r"\1", found.group(1)) if found else text
    return "" if text in ("~", "null") else text.partition(" #")[0].strip()
