r"""JSON of documents that may hold file names which are not UTF-8: their lone surrogates are written out (``\udcff``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import orjson


def writable(document: Any) -> Any:
    """A document whose texts, keys too, can be written as UTF-8; arrays and numbers stay as they are."""
    if isinstance(document, str):
        return document if document.isascii() else document.encode("utf-8", "backslashreplace").decode()
    if document is None or document.__class__ in (float, int, bool):
        return document
    if isinstance(document, dict | Mapping):
        return {writable(key): writable(value) for key, value in document.items()}
    if isinstance(document, list | tuple):
        return [writable(value) for value in document]
    return document


def dump_json(document: Any, option: int = 0) -> bytes:
    """Bytes of a document, with options of orjson; texts that JSON cannot hold are made writable."""
    try:
        return orjson.dumps(document, option=option)
    except orjson.JSONEncodeError:
        return orjson.dumps(writable(document), option=option)
