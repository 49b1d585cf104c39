"""Borders around whatever reads files from outside: what nobody foresaw comes out as one stated error.

Readers state what is wrong with a file themselves. Bytes that lead them, or a library below them, to an error which
nobody foresaw are still the file's, not the user's: they end as an error that names the file and the place in the
program. Tests and the fuzzer tell these from the foreseen ones by their type.
"""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from replay.errors import ConfigError, LogError, MfhcaError

MAX_SENTENCE = 1_500
_LONGEST, _END = 200, 400
_CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]+")
_AGAIN = "it is probably damaged: copy or record it again"


def shortened(text: str) -> str:
    """A sentence that may quote a file on one line, without its middle where it is long: what to do stands at its end."""
    text = _CONTROLS.sub(" ", text)
    return text if len(text) <= MAX_SENTENCE else f"{text[: MAX_SENTENCE - _END - 3]} … {text[-_END:]}"


class UnforeseenContent(LogError):
    """A file's content made its reader fail in a way that the reader does not know."""


class UnforeseenValue(ConfigError):
    """The same of a file of settings."""


@contextmanager
def bordered(path: Path, name: str, kind: type[MfhcaError] = UnforeseenContent, remedy: str = _AGAIN) -> Iterator[None]:
    """Turn what reading a file raises into stated errors of bounded length; a lack of memory stays what it is.

    Parameters
    ----------
    path : Path
        The file or folder that is read.
    name : str
        What it is read as.
    kind : type
        Of the error that nobody foresaw.
    remedy : str
        What the user can do.

    Raises
    ------
    LogError
        Where the file cannot be opened or read.
    MfhcaError
        Of the given kind, where its content led to an error that the reader does not know.
    """
    try:
        yield
    except MemoryError:
        raise
    except MfhcaError as error:
        text = shortened(str(error))
        if text == str(error):
            raise
        raise type(error)(text) from error
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        text = " ".join(str(error).split())[:_LONGEST]
        raise kind(
            f"{path} cannot be read as {name}: its content led to {type(error).__name__} "
            f"({text}; {Path(last.filename).name}, line {last.lineno}); {remedy}, and report this with the file"
        ) from error
