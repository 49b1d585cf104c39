"""The storage files of a rosbag2 recording: which there are, in which order, expanded where compressed."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import zstandard

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.readers.common.room import FULL, NoRoom
from replay.readers.rosbag2.metadata import Metadata, read_metadata

_STORES = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd")
_ZSTD = b"\x28\xb5\x2f\xfd"
MAX_FILE = 64 << 30
_RATIO = 200
_SPARE = 256 << 20
_PIECE = 4096  # expands to 128 MiB at most


def is_compressed(path: Path) -> bool:
    """Whether a file is a storage file in zstd."""
    if not path.name.endswith((".db3.zstd", ".mcap.zstd")):
        return False
    with path.open("rb") as file:
        return file.read(4) == _ZSTD


def storage_files(folder: Path) -> list[Path]:
    """Storage files of a folder, part 10 after part 9; of one that is there twice, the one that is not compressed."""
    files = [p for p in folder.iterdir() if p.name.endswith(_STORES) and p.is_file()]
    names = {p.name for p in files}
    return sorted((p for p in files if p.name.removesuffix(".zstd") not in names - {p.name}), key=_natural)


def _natural(path: Path) -> list[tuple[int, str]]:
    return [(int(t), "") if t.isdecimal() else (-1, t) for t in re.split(r"(\d+)", path.name)]


def find_parts(path: Path, report: Report, scratch: Path) -> tuple[list[Path], Metadata]:
    """Return the storage files in recorded order and what ``metadata.yaml`` says.

    Parameters
    ----------
    path : Path
        Folder or single file.
    report : Report
        Takes parts that are missing, damaged or outside the folder.
    scratch : Path
        Folder for expanded files.

    Raises
    ------
    LogError
        Where there is no part, or the folder cannot be read.
    """
    if path.is_file():
        files, meta = [path], Metadata()
    else:
        meta = read_metadata(path, report)
        try:
            files = _listed(path, meta, report)
        except OSError as error:
            raise LogError(f"the folder {path} cannot be read: {error.strerror or error}") from error
    if not files:
        raise LogError(
            f"{path} holds no storage file that can be read; expected .db3 or .mcap files beside metadata.yaml"
            + "".join(f"; {d}" for d in report.damage[:3])
        )
    expanded = [_expanded(f, scratch, i, report) for i, f in enumerate(files)]
    found = [f for f in expanded if f is not None]
    if not found:
        raise LogError(f"{path} holds no storage file that can be expanded: {'; '.join(report.damage[:3])}")
    return found, meta


def _listed(folder: Path, meta: Metadata, report: Report) -> list[Path]:
    """Files that the metadata list, or all that are there."""
    present = storage_files(folder)
    if meta.files is None:
        return present
    files: list[Path] = []
    for name in meta.files:
        path = _inside(folder, name, meta, report)
        if path is not None and path in files:
            report.note(f"{folder.name}: metadata.yaml lists {path.name[:80]!r} twice; it was read once")
        elif path is not None:
            files.append(path)
    extra = [p for p in present if p.resolve() not in files]
    names = ", ".join(p.name[:80] for p in extra[:5])
    if files and extra:
        report.note(f"{folder.name}: metadata.yaml does not list {names}; left out")
    elif extra:
        report.note(f"{folder.name}: metadata.yaml lists none of the files present; all {len(extra)} were read")
        return present
    return files


def _inside(folder: Path, name: str, meta: Metadata, report: Report) -> Path | None:
    """Return the listed file, if it is there and inside the folder (links followed).

    Old recorders state the folder's name as well, and some tools the absolute path of the machine that recorded.
    """
    home = folder.resolve()
    last = name.replace("\\", "/").rpartition("/")[2]
    outside = False
    for guess in (name, last):
        try:
            path = (home / guess).resolve()
            if not path.is_relative_to(home):
                outside = True
            elif path.is_file():
                return path
        except (OSError, ValueError, RuntimeError):
            continue
    if outside:
        report.lost(f"{folder.name}: metadata.yaml names {name[:80]!r} outside the folder; it was left out")
    else:
        held = meta.parts.get(name, meta.parts.get(last))
        count = "its" if held is None else f"its {held}"
        report.lost(
            f"{folder.name}: the part {name[:80]!r} named in metadata.yaml is missing; {count} messages are lost"
        )
    return None


def _expanded(path: Path, scratch: Path, serial: int, report: Report) -> Path | None:
    """Expand a zstd-compressed storage file into the scratch folder, unless it is a bomb."""
    if path.suffix != ".zstd":
        return path
    out = scratch / str(serial) / path.stem
    out.parent.mkdir()
    fair = min(MAX_FILE, _RATIO * path.stat().st_size + (64 << 20))
    room = min(fair, shutil.disk_usage(scratch).free - _SPARE)
    whole, size = False, 0
    try:
        with path.open("rb") as source, out.open("wb") as target:
            stream = zstandard.ZstdDecompressor(max_window_size=1 << 28).decompressobj(read_across_frames=False)
            block = source.read(_PIECE)
            while block:
                raw = stream.decompress(block)
                size += len(raw)
                if size > room:
                    out.unlink()
                    if room < fair:
                        raise NoRoom(f"{path.name}, which expands to more than {max(room, 0)} bytes")
                    report.lost(
                        f"{path.name} expands to more than {room} bytes, {_RATIO} times its size; it was left out"
                    )
                    return None
                target.write(raw)
                block, whole = source.read(_PIECE), stream.eof
                if stream.eof:
                    block = stream.unused_data + block
                    stream = zstandard.ZstdDecompressor(max_window_size=1 << 28).decompressobj()
    except (zstandard.ZstdError, OSError) as error:
        if isinstance(error, OSError) and error.errno in FULL:
            raise NoRoom(f"{path.name}, expanded", error) from error
        report.lost(f"{path.name} is damaged or cannot be expanded ({error}); its first {size} bytes were read")
        return out
    if not whole:
        report.lost(f"{path.name} was cut off while it was compressed; its first {size} bytes were read")
    return out
