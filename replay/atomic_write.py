"""Results appear whole or not at all."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from replay.errors import OutputError


@contextmanager
def made_folder(folder: Path) -> Iterator[None]:
    """Make a folder for the block; where the block fails, remove what was made of its path and is empty."""
    made = []
    for path in (folder, *folder.parents):
        if path.exists():
            break
        made.append(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        with suppress(OSError):  # the first that is not empty, or was not made
            for path in made:
                path.rmdir()
        raise


@contextmanager
def atomic_path(path: Path, *, folder: bool = False) -> Iterator[Path]:
    """Give a temporary name beside `path`; rename it to `path` when the block ends well, else remove it.

    Parameters
    ----------
    path : Path
        Where the result shall stand; an existing file is replaced.
    folder : bool
        Whether the result is a folder; the temporary folder is made here. An existing folder is replaced only
        where it is empty or holds a rosbag2 recording (``metadata.yaml``).

    Raises
    ------
    OutputError
        Where the place cannot be written, or holds something that must not be replaced.
    """
    path = Path(path)
    if not path.name:
        raise OutputError(f"{str(path)!r} is not a file name; give a name to write to")
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
    _refuse_other_content(path, folder)
    try:
        with made_folder(path.parent):
            try:
                _remove(temporary)
                if folder:
                    temporary.mkdir()
                yield temporary
                if folder:
                    _remove(path)
                else:
                    _flush(temporary)
                temporary.replace(path)
            finally:
                with suppress(OSError):  # a read-only place refuses this too
                    _remove(temporary)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error}); give another place") from error


@contextmanager
def atomic_paths(*paths: Path) -> Iterator[tuple[Path, ...]]:
    """Give a temporary name for each of several files that belong together; all are renamed, or none.

    Raises
    ------
    OutputError
        Where one of them cannot be written, e.g. on a full disk; what stood there before still stands then.
    """
    with ExitStack() as stack:
        temporary = tuple(stack.enter_context(atomic_path(path)) for path in paths)
        yield temporary
        for path in temporary:
            _flush(path)


def _refuse_other_content(path: Path, folder: bool) -> None:
    if folder and path.is_dir() and not (path / "metadata.yaml").is_file() and any(path.iterdir()):
        raise OutputError(f"{path}: holds other files; give a new folder")
    if folder and path.exists() and not path.is_dir():
        raise OutputError(f"{path}: is a file, a folder is to be written; give another name")
    if not folder and path.is_dir():
        raise OutputError(f"{path}: is a folder, a file is to be written; give a file name")


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(FileNotFoundError, NotADirectoryError):
            path.unlink()
