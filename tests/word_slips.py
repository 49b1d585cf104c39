"""Slips of words in a result: sentences that begin small, empty brackets, wrong plurals, numbers that are none."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

_SLIPS = {
    "a sentence that begins small": r"[.!?] (?!wheel\.|steer\.|imu\.|mfhca|filterpy|e\.g|[xyz]\b)[a-z]",
    "empty brackets": r"\(\s*\)",
    "one of many": r"\b1 (faults|parts|wheels|missions|samples|reasons|checks|seconds)\b",
    "another word for what is said so elsewhere": r"judged too briefly|control signal|assessed the part",
    "a word that was not filled in": r"\{(?:[a-z_.]+|[\d.]+ s)\}",
    "a hyphen for a minus": r"(?:^|[\s(×=])-\d",
    "a number with an exponent": r"\d[eE][+-]\d",
    "a number that is none": r"\b(nan|inf|None)\b",
}
_NO_SENTENCES = ("path", "sha256", "channel", "name", "source")


def slips(report: Mapping[str, Any]) -> Iterator[str]:
    """Slips of words anywhere in the document."""
    for text in dict.fromkeys(_strings(report)):
        for slip, form in _SLIPS.items():
            if re.search(form, text):
                yield f"{slip}: {text[:200]!r}"


def _strings(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for key, x in value.items():
            if key not in _NO_SENTENCES:
                yield from _strings(x)
    elif isinstance(value, list):
        for x in value:
            yield from _strings(x)
