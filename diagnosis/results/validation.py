"""Documents from outside: checked once against their types, with one sentence for what is wrong and where."""

from __future__ import annotations

import re
from typing import Any, TypeVar

import msgspec

from diagnosis.results.document import SCHEMA, ReportDocument
from diagnosis.results.earlier import completed, says_leave, with_leave
from replay.errors import LogError

T = TypeVar("T")

_AGAIN = "run `mfhca diagnose` on the log again"
_TYPE = re.compile(r"Expected `(?P<expected>.+?)`, got `(?P<found>.+?)`")
_WORD = re.compile(r"Invalid (?:enum value|value) (?P<found>.+)")
_LACKS = re.compile(r"Object missing required field `(?P<key>.+?)`")
_JSON_TYPES = {"dict": "object", "list": "array", "str": "text", "NoneType": "null"}


def report_of(document: object, source: str) -> ReportDocument:
    """The report in a document, with the keys that its version did not have yet; keys of later versions stay.

    Parameters
    ----------
    document : object
        Plain JSON values.
    source : str
        File that it comes from, for errors.

    Raises
    ------
    LogError
        Where it is no ``report.json`` of this tool, or not a whole one.
    """
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = repr(document.get("schema")) if isinstance(document, dict) else _type_words(type(document).__name__)
        raise LogError(f"{source}: schema {found} found, {SCHEMA!r} expected; {_AGAIN}")
    report = validated(completed(document), ReportDocument, source, _AGAIN)
    return report if says_leave(document) else with_leave(report)


def validated(document: object, kind: type[T], source: str, remedy: str) -> T:
    """A document of plain JSON values as its type: words become members of their enumerations.

    Parameters
    ----------
    document : object
        Plain JSON values.
    kind : type
        A TypedDict.
    source, remedy : str
        Where it comes from, and what to do where it is wrong, for errors.

    Raises
    ------
    LogError
        Where it is not of that type.
    """
    try:
        typed = msgspec.convert(document, kind)
    except msgspec.ValidationError as error:
        raise LogError(f"{source}: {_sentence(str(error))}; {remedy}") from error
    whole: T = _with_unknown(typed, document)
    return whole


def _sentence(error: str) -> str:
    """Place, what was found and what was expected, from a sentence of msgspec."""
    text, _, place = error.partition(" - at `$")
    at = place.rstrip("`").lstrip(".") or "the document"
    if found := _LACKS.search(text):
        return f"{at}: key {found['key']!r} expected, not found"
    if found := _TYPE.search(text):
        return f"{at}: {_type_words(found['found'])} found, {_type_words(found['expected'])} expected"
    if found := _WORD.search(text):
        return f"{at}: {found['found']} found, which is none of the words expected there"
    return f"{at}: {text}"


def _type_words(name: str) -> str:
    return " or ".join(_JSON_TYPES.get(part, part) for part in name.split(" | "))


def _with_unknown(typed: Any, document: Any) -> Any:
    """The typed values in the document's order, with the keys of which the type does not know."""
    if isinstance(typed, dict):
        return {k: _with_unknown(typed[k], v) if k in typed else v for k, v in document.items()}
    if isinstance(typed, list):
        return [_with_unknown(a, b) for a, b in zip(typed, document, strict=True)]
    return typed
