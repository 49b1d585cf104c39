"""JSON documents with other values, keys and shapes."""

from __future__ import annotations

import copy
import json
import random
from typing import Any

ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2**31, 2**53 + 1, 2**63 - 1, 2**63, -(2**63), 1e300, -1e-300, 0.5, "", "x", "NaN", "\x1b[31m", "<script>alert(1)</script>",
    "../../up", "é" * 500, "\u202e", [], {}, [[]], [None], {"": 0}, {"a": {"b": []}}, "2024-01-01", "-1",
)  # fmt: skip
TEXTS = (
    "NaN",
    "Infinity",
    "1e999",
    "-0",
    "1" * 5000,
    "0.1" + "0" * 5000,
    '"\\ud800"',
    '"\\u0000"',
    "[" * 3000,
    '{"a":' * 3000,
    "'x'",
    "01",
    "",
)
MARK = "\uffffhere\uffff"


def paths(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values within a document."""
    out = [at] if at else []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        out += paths(inner, (*at, key))
    return out


def damaged(document: Any, known: list[tuple[Any, ...]], source: random.Random) -> tuple[bytes, str]:
    """Change one to three places of a document; `known` are its paths."""
    whole, done = copy.deepcopy(document), []
    text: str | None = None
    for _ in range(source.choice((1, 1, 1, 2, 3))):
        at = source.choice(known)
        if source.random() < 0.3:  # places near the top seldom come up among so many
            at = at[: source.randint(1, len(at))]
        parent = whole
        try:
            for key in at[:-1]:
                parent = parent[key]
            old = parent[at[-1]]
        except (KeyError, IndexError, TypeError):
            continue
        if not isinstance(parent, dict | list):
            continue
        way = source.random()
        if way < 0.15:
            del parent[at[-1]]
        elif way < 0.25 and isinstance(parent, list):
            parent[at[-1] : at[-1]] = [copy.deepcopy(old) for _ in range(source.choice((1, 2, 200)))]
        elif way < 0.3 and isinstance(parent, dict):
            parent[source.choice(("x", "", "schema", "é", *parent))] = parent.pop(at[-1])
        elif way < 0.38:
            parent[at[-1]], text = MARK, source.choice(TEXTS)
        elif way < 0.6 and isinstance(old, int | float) and not isinstance(old, bool):
            parent[at[-1]] = source.choice((-old, old * 1e9, old + 1, -1, 0, 1e300, 1e-300, 2**62, old / 3))
        elif way < 0.7 and isinstance(old, str):
            parent[at[-1]] = source.choice((old.upper(), old + "x", old * 300, ""))
        else:
            parent[at[-1]] = source.choice(ODD)
        done.append(".".join(map(str, at))[:60])
    out = json.dumps(whole)
    if text is not None:
        out = out.replace(json.dumps(MARK), text)
    return out.encode(), "; ".join(done)
