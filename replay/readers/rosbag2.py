"""rosbag2 recordings: folders of SQLite or MCAP files, and single ``.db3`` files."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import zstandard

from replay.errors import LogError
from replay.rawlog import Clock, LogSummary, RawLog, Window
from replay.readers import mcap, sqlite_bag
from replay.readers.clocks import Report
from replay.sources import SourceOptions

_SQLITE = b"SQLite format 3\0"
_STORES = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd")
_MAX_METADATA = 4 << 20
_MAX_FILE = 64 << 30
_READABLE_MODES = ("", "none", "file", "message")


class Rosbag2Reader:
    """Reader of rosbag2 folders and ``.db3`` files."""

    format = "rosbag2"

    def matches(self, path: Path) -> bool:
        """Whether the path is an SQLite file, or a folder with ``metadata.yaml`` or storage files."""
        if path.is_dir():
            return (path / "metadata.yaml").is_file() or bool(_storage(path))
        with path.open("rb") as file:
            return file.read(len(_SQLITE)) == _SQLITE

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List topics and counts of all parts.

        Raises
        ------
        LogError
            Where no part can be read.
        """
        with tempfile.TemporaryDirectory(prefix="mfhca-") as scratch:
            report = Report()
            files, modes = _parts(path, report, Path(scratch))
            if _is_mcap(files, path):
                return mcap.summary_of(mcap.open_files(files, path, report), path, self.format, report)
            return _complete(sqlite_bag.summarise(files, path, report, Path(scratch)), modes)

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
    ) -> RawLog:
        """Decode the given topics of all parts.

        Raises
        ------
        LogError
            Where no part can be read.
        """
        with tempfile.TemporaryDirectory(prefix="mfhca-") as scratch:
            report = Report()
            files, modes = _parts(path, report, Path(scratch))
            if _is_mcap(files, path):
                return mcap.read_files(files, path, self.format, report, topics, clock)
            packed = modes.get("compression_mode") == "message"
            log = sqlite_bag.read(files, path, report, Path(scratch), topics, clock, packed)
            return replace(log, summary=_complete(log.summary, modes))


def _complete(summary: LogSummary, modes: dict[str, str]) -> LogSummary:
    return replace(summary, metadata={**modes, **summary.metadata})


def _is_mcap(files: list[Path], path: Path) -> bool:
    """Whether the parts are MCAP files; a mixture is refused."""
    kinds = {f.suffix == ".mcap" for f in files}
    if len(kinds) > 1:
        raise LogError(f"{path} mixes .db3 and .mcap files; give the files of one recording")
    return kinds == {True}


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sort key under which part 10 follows part 9."""
    return [(int(t), "") if t.isdigit() else (-1, t) for t in re.split(r"(\d+)", path.name)]


def _storage(folder: Path) -> list[Path]:
    return sorted((p for p in folder.iterdir() if p.name.endswith(_STORES) and p.is_file()), key=_natural)


def _parts(path: Path, report: Report, scratch: Path) -> tuple[list[Path], dict[str, str]]:
    """Return the storage files in recorded order, expanded where compressed, and facts from ``metadata.yaml``."""
    if path.is_file():
        return [path], {}
    modes: dict[str, str] = {}
    listed = _listed(path, report, modes)
    present = _storage(path)
    if listed is None:
        files = present
    else:
        files = [p for p in (_inside(path, name, report) for name in listed) if p is not None]
        extra = [p.name for p in present if p.resolve() not in {f.resolve() for f in files}]
        if files and extra:
            report.note(f"{path.name}: metadata.yaml does not list {', '.join(extra[:5])}; left out")
        elif extra:
            files = present
            report.note(f"{path.name}: metadata.yaml lists none of the files present; all {len(files)} were read")
    if not files:
        raise LogError(
            f"{path} holds no storage file that can be read; expected .db3 or .mcap files beside metadata.yaml"
        )
    return [f for f in (_expanded(f, scratch, report) for f in files) if f is not None], modes


def _listed(path: Path, report: Report, modes: dict[str, str]) -> list[str] | None:
    """Return the file names in ``metadata.yaml``, or None where there is none that can be used.

    Only the few lines that matter are looked at, so that no document can cost time or memory.
    """
    meta = path / "metadata.yaml"
    if not meta.is_file():
        report.note(f"{path.name} has no metadata.yaml; its storage files were read in the order of their names")
        return None
    if meta.stat().st_size > _MAX_METADATA:
        report.lost(
            f"{meta.name} has {meta.stat().st_size} bytes; at most {_MAX_METADATA} are read, so it was left out"
        )
        return None
    text = meta.read_text(encoding="utf-8", errors="replace")
    for key in ("compression_mode", "compression_format", "ros_distro", "storage_identifier"):
        found = re.search(rf"^\s*{key}:[ \t]*(\S+)[ \t]*$", text, re.MULTILINE)
        modes[key] = _scalar(found.group(1)).lower() if found else ""
    listed = re.search(
        r"^\s*relative_file_paths:[ \t]*(\[.*\])?[ \t]*\n((?:[ \t]*-[ \t]+\S.*\n?)*)", text + "\n", re.MULTILINE
    )
    if listed is None:
        report.lost(f"{meta.name} names no files; the storage files were read in the order of their names")
        return None
    if modes["compression_mode"] not in _READABLE_MODES:
        report.lost(f"{meta.name}: compression mode {modes['compression_mode']!r} is not known")
    if listed.group(1):
        return [_scalar(n) for n in listed.group(1)[1:-1].split(",") if n.strip()]
    return [_scalar(line.partition("-")[2]) for line in listed.group(2).splitlines()]


def _scalar(text: str) -> str:
    """Text of a plain or quoted YAML scalar."""
    text = text.strip()
    if len(text) > 1 and text[0] == text[-1] == "'":
        return text[1:-1].replace("''", "'")
    if len(text) > 1 and text[0] == text[-1] == '"':
        return re.sub(r"\\(.)", r"\1", text[1:-1])
    return text.partition(" #")[0].strip()


def _inside(folder: Path, name: str, report: Report) -> Path | None:
    """Return the listed file, if it is there and inside the folder."""
    try:
        path = (folder / name).resolve()
        inside = path.is_relative_to(folder.resolve())
        there = path.is_file()
        if not there and not inside:
            path = (folder / Path(name).name).resolve()  # absolute paths of the recording machine
            inside, there = path.is_relative_to(folder.resolve()), path.is_file()
    except (OSError, ValueError):
        inside, there = False, False
    if not inside:
        report.lost(f"{folder.name}: metadata.yaml names {name[:80]!r} outside the folder; it was left out")
        return None
    if not there:
        report.lost(f"{folder.name}: the part {name[:80]!r} named in metadata.yaml is missing; its messages are lost")
        return None
    return path


def _expanded(path: Path, scratch: Path, report: Report) -> Path | None:
    """Expand a zstd-compressed storage file into the scratch folder."""
    if path.suffix != ".zstd":
        return path
    out = scratch / path.stem
    room = min(_MAX_FILE, 200 * path.stat().st_size + (64 << 20))
    try:
        with path.open("rb") as source, out.open("wb") as target:
            stream = zstandard.ZstdDecompressor(max_window_size=1 << 28).stream_reader(source, read_across_frames=True)
            while block := stream.read(1 << 20):
                room -= len(block)
                if room < 0:
                    report.lost(f"{path.name} expands to more than 200 times its size; it was left out")
                    return None
                target.write(block)
    except zstandard.ZstdError:
        report.lost(f"{path.name} is damaged; only what could be expanded was read")
    return out
