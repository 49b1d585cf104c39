"""TOML from files that nobody vouches for: within limits of size, depth and digits, every refusal in one sentence.

The parser of the standard library recurses with each bracket, and takes time with the square of the parts of a dotted
key and of the digits of a number; the limits lie far above what a machine file or ``mission.toml`` needs.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

MAX_BYTES = 1 << 20
MAX_DEPTH = 32
MAX_DIGITS = 100
MAX_KEYS = 20_000
_SHOWN = 120

# Strings and comments; one without its end reaches to where it must end at the latest, so that each is passed once.
_STRING = re.compile(
    r'"""(?:[^\\"]++|\\.|"(?!""))*+(?:""")?|'
    r"'''(?:[^']++|'(?!''))*+(?:''')?|"
    r'"(?:[^"\\\n]++|\\.)*+"?|'
    r"'[^'\n]*+'?|"
    r"#[^\n]*+",
    re.DOTALL,
)
_NUMBER = re.compile(r"[0-9a-fA-F_]++")
_KEY = re.compile(r"[\w\-\"'. \t]++")
_BRACKET = re.compile(r"[\[\]{}]")


class TomlError(ValueError):
    """A text is no TOML, or more than is read; the text says why and where."""


def parse_toml(text: str) -> dict[str, Any]:
    """Parse a TOML document within the limits.

    Parameters
    ----------
    text : str
        The document.

    Returns
    -------
    dict[str, Any]
        Its tables.

    Raises
    ------
    TomlError
        Where it is not valid TOML, or larger, deeper or of longer numbers than is read.
    """
    if len(text) > MAX_BYTES:
        raise TomlError(f"it has {len(text)} characters; at most {MAX_BYTES} are read")
    bare = _STRING.sub(lambda found: '""' + "\n" * found[0].count("\n"), text)
    if bare.count("=") > MAX_KEYS:
        raise TomlError(f"it has {bare.count('=')} keys; at most {MAX_KEYS} are read")
    _check_depth(bare)
    for found in _NUMBER.finditer(bare):
        if len(found[0]) > MAX_DIGITS:
            raise TomlError(
                f"line {_line(bare, found)} has a number of {len(found[0])} digits; at most {MAX_DIGITS} are read"
            )
    for found in _KEY.finditer(bare):
        if found[0].count(".") > MAX_DEPTH:
            raise TomlError(
                f"line {_line(bare, found)} has a key of {found[0].count('.') + 1} parts; at most {MAX_DEPTH} are read"
            )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise TomlError(f"not valid TOML: {str(error)[:_SHOWN]}") from error
    except (ValueError, RecursionError) as error:
        raise TomlError(f"not readable as TOML ({type(error).__name__}: {str(error)[:_SHOWN]})") from error


def _check_depth(bare: str) -> None:
    depth = 0
    for found in _BRACKET.finditer(bare):
        depth = max(depth + (1 if found[0] in "[{" else -1), 0)
        if depth > MAX_DEPTH:
            raise TomlError(f"line {_line(bare, found)} nests more than {MAX_DEPTH} brackets")


def _line(bare: str, found: re.Match[str]) -> int:
    return bare.count("\n", 0, found.start()) + 1
