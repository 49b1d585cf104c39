"""Tables of constants that `mfhca fit` writes into machine files: every field is there, and a finite number or a list of them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import fields
from typing import Any

from replay.errors import ConfigError


def numbers_of(key: str, table: Any, kind: type, lists: Collection[str] = ()) -> dict[str, Any]:
    """Fields of a dataclass from a table of a machine file.

    Parameters
    ----------
    key : str
        Where the table stands, for messages: ``effort.FR``.
    table : Any
        All fields of `kind` and no others.
    kind : type
        A dataclass.
    lists : Collection[str]
        Its fields that are lists of numbers, which become tuples; the others are numbers.

    Raises
    ------
    ConfigError
        Where a key is missing, unknown or no finite number.
    """
    if not isinstance(table, Mapping):
        raise ConfigError(f"{key} = {table!r} is no table; expected the constants that `mfhca fit` writes")
    names = [f.name for f in fields(kind)]
    for name in table:
        if name not in names:
            raise ConfigError(f"{key}.{name} is not known; expected {', '.join(names)}")
    out: dict[str, Any] = {}
    for name in names:
        if name not in table:
            raise ConfigError(f"{key}.{name} is missing; run `mfhca fit` again, or leave [{key}] out")
        many = name in lists
        values = table[name] if many else [table[name]]
        if not isinstance(values, list) or not all(map(_is_number, values)):
            raise ConfigError(
                f"{key}.{name} = {table[name]!r}; expected {'a list of finite numbers' if many else 'a finite number'}"
            )
        out[name] = tuple(map(float, values)) if many else float(values[0])
    return out


def _is_number(value: Any) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
