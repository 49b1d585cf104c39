"""Missions behind fsspec URLs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from diagnosis.audit.finder import Finder
from replay.errors import ConfigError


def file_system(url: str) -> tuple[Any, str]:
    """The file system behind a URL, and the place in it.

    Raises
    ------
    ConfigError
        Where the kind of URL is not known, or its package is not installed.
    """
    import fsspec

    try:
        system, path = fsspec.core.url_to_fs(url)
    except ImportError as error:
        raise ConfigError(
            f"{url}: needs a package that is not installed ({error}); pip install 'mfhca-replay[s3]'"
        ) from error
    except ValueError as error:
        raise ConfigError(f"{url}: {error}; expected a path, s3://, gs:// or another URL that fsspec knows") from error
    return system, path


def look_remotely(finder: Finder, urls: Sequence[str]) -> None:
    """Find what URLs stand for."""
    raise NotImplementedError
