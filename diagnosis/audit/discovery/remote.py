"""Missions behind fsspec URLs: listed with few requests, read whole and checked for change."""

from __future__ import annotations

import glob
import posixpath
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from diagnosis.audit.discovery.finder import Finder
from diagnosis.audit.discovery.listing import Entry, continues, joined
from diagnosis.audit.discovery.remote_mcap import span_behind, why
from replay.errors import ConfigError, LogError
from replay.log.file_types import split_ending

_STAMPS = ("ETag", "etag", "VersionId", "generation", "mtime", "LastModified", "last_modified", "created")
_MOST_TEXT = 1 << 20


def file_system(url: str) -> tuple[Any, str]:
    """The file system behind a URL, and the place in it.

    Raises
    ------
    ConfigError
        Where the kind of URL is not known, or its package is not installed.
    LogError
        Where the server cannot be reached.
    """
    import fsspec

    try:
        system, path = fsspec.core.url_to_fs(url)
    except ImportError as error:
        raise ConfigError(
            f"{url}: needs a package that is not installed ({error}); pip install 'mfhca-replay[s3]' for s3://"
        ) from error
    except ValueError as error:
        raise ConfigError(f"{url}: {error}; expected a path, s3://, gs:// or another URL that fsspec knows") from error
    except Exception as error:  # each package raises its own kinds
        raise LogError(f"{url}: cannot be reached ({why(error)})") from error
    return system, path


def find_remotely(finder: Finder, urls: Sequence[str]) -> None:
    """Find what URLs stand for: objects, all objects below one, or globs.

    Raises
    ------
    ConfigError
        Where the kind of URL is not known, or its package is not installed.
    """
    places: dict[int, tuple[RemotePlace, list[Entry], list[Entry]]] = {}
    for url in urls:
        try:
            system, path = file_system(url)
        except LogError as error:
            finder.problems.append(str(error))
            continue
        place, files, folders = places.setdefault(id(system), (RemotePlace(system), [], []))
        try:
            hits = place.hits(path.rstrip("/") or path)
        except Exception as error:  # each package raises its own kinds
            finder.problems.append(f"{url}: cannot be listed ({why(error)})")
            continue
        if not hits:
            what = "matches no object" if glob.has_magic(url) else "no such object"
            finder.problems.append(f"{url}: {what}")
        for hit in hits:
            if place.is_folder(hit):
                folders.append(hit)
            elif not glob.has_magic(url) or split_ending(hit.name)[1]:
                files.append(hit)
            else:
                finder.left_aside += 1
    for place, files, folders in places.values():
        finder.search(place, files, folders)


class RemotePlace:
    """Objects of one file system of fsspec, listed once per asked place.

    Parameters
    ----------
    system : fsspec.AbstractFileSystem
        The file system.
    """

    def __init__(self, system: Any) -> None:
        self._system = system
        self._files: dict[str, dict[str, Entry]] = {}
        self._folders: dict[str, dict[str, Entry]] = {}

    def hits(self, path: str) -> list[Entry]:
        """Objects and folders behind a path or glob; a folder is listed with all that is below it."""
        self._system.invalidate_cache()
        try:
            found = {path: self._system.info(path)}
        except FileNotFoundError:
            found = self._system.glob(path, detail=True) if glob.has_magic(path) else {}
        out = []
        for name, info in sorted(found.items()):
            if info["type"] == "directory":
                below: Mapping[str, Any] = self._system.find(name, detail=True)
                for other, info_of in below.items():
                    self._enter(name, other, info_of)
                self._folders.setdefault(self._url(name), {})
                out.append(self._folder(self._url(name)))
            else:
                out.append(self._entry(name, info))
        return out

    def _enter(self, top: str, path: str, info: Mapping[str, Any]) -> None:
        """Take an object into the tree below the listed folder."""
        entry, root = self._entry(path, info), self._url(top)
        at = entry.path
        while at != root and len(at) > len(root):
            above = self.parent(at)
            if at == entry.path:
                self._files.setdefault(above, {})[entry.name] = entry
            else:
                known = self._folders.setdefault(above, {})
                if at.rpartition("/")[2] in known:
                    return
                known[at.rpartition("/")[2]] = self._folder(at)
            self._folders.setdefault(above, {})
            at = above

    def _url(self, path: str) -> str:
        url: str = self._system.unstrip_protocol(path)
        return url.rstrip("/")

    def _entry(self, path: str, info: Mapping[str, Any]) -> Entry:
        url = self._url(path)
        return Entry(url, url.rpartition("/")[2], url, int(info.get("size") or 0), stamp_of(info))

    def _folder(self, url: str) -> Entry:
        return Entry(url, url.rpartition("/")[2], url)

    def listed(self, folder: Entry) -> tuple[list[Entry], list[Entry]]:
        """Objects and folders in a folder."""
        files, folders = self._files.get(folder.path, {}), self._folders.get(folder.path, {})
        return [files[name] for name in sorted(files)], [folders[name] for name in sorted(folders)]

    def lost(self, folder: Entry) -> list[str]:
        """Nothing: there are no links."""
        return []

    def text(self, file: Entry) -> str:
        """Text of a small object.

        Raises
        ------
        OSError
            Where the object cannot be read.
        """
        try:
            raw: bytes = self._system.cat_file(self._path(file), start=0, end=_MOST_TEXT)
        except Exception as error:
            raise OSError(0, why(error)) from error
        return raw.decode()

    def _path(self, file: Entry) -> str:
        path: str = self._system._strip_protocol(file.path)
        return path

    def inside(self, folder: Entry, name: str) -> Entry | None:
        """Object or folder within a listed folder."""
        if posixpath.isabs(name) or ".." in name.split("/"):
            return None
        url = f"{folder.path}/{posixpath.normpath(name)}"
        above, last = self.parent(url), url.rpartition("/")[2]
        return self._files.get(above, {}).get(last) or self._folders.get(above, {}).get(last)

    def beside(self, folder: str, name: str) -> Entry | None:
        """Object below any URL, listed or asked for."""
        known = self._files.get(folder, {}).get(name)
        if known is not None or folder in self._folders or not folder.partition("://")[2]:
            return known
        url = f"{folder}/{name}"
        try:
            info = self._system.info(self._system._strip_protocol(url))
        except Exception:  # each package raises its own kinds; what cannot be asked for is not there
            return None
        return None if info["type"] == "directory" else self._entry(self._system._strip_protocol(url), info)

    def is_folder(self, entry: Entry) -> bool:
        """Whether it is a listed folder."""
        return entry.path in self._folders

    def parent(self, path: str) -> str:
        """URL of what holds an object."""
        return path.rstrip("/").rpartition("/")[0]

    def home(self, file: Entry) -> str:
        """URL of what holds an object."""
        return self.parent(file.path)

    def whole(self, folder: Entry) -> Entry:
        """A folder as one log."""
        rows, waiting = [], [folder]
        while waiting:
            files, folders = self.listed(waiting.pop())
            waiting += folders
            rows += [(f.path[len(folder.path) + 1 :], f.size, f.stamp) for f in files]
        return joined(folder, rows)

    def continuous(self, parts: Sequence[Entry]) -> bool:
        """Whether MCAP files go on from one to the next, by their summaries; of other formats that is not known."""
        if any(split_ending(part.name)[1] != ".mcap" for part in parts):
            return False
        try:
            return continues(span_behind(self._system, self._path(part), part.size) for part in parts)
        except LogError:
            return False

    def extent(self, table: Entry) -> None:
        """Nothing: the content is not read."""

    def is_log(self, file: Entry) -> bool:
        """Whether it may be a log; the content is not read."""
        return True


def stamp_of(info: Mapping[str, Any]) -> str:
    """What changes when an object is replaced: its ETag, version or time; empty where nothing says so."""
    value = next((info[name] for name in _STAMPS if info.get(name)), "")
    return str(value.timestamp() if isinstance(value, datetime) else value)
