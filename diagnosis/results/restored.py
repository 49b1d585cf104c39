"""Columns of a result that need no room of their own: they repeat the other side's, or are the difference of two others.

A file of columns holds these once and says in its metadata how the others are made of them. What is shown of a result is
what a reader of the file gets.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

KEY = b"mfhca.restored"
#: Columns as differences, first less second; ``{part}`` is the wheel or axle.
_DIFFERENCES = (
    ("replay.{part}.e", "wheel.{part}.v", "replay.{part}.v_ref"),
    ("replay.{part}.u", "wheel.{part}.u", "replay.{part}.u_difference"),
    ("replay.{part}.u", "steer.{part}.u", "replay.{part}.u_difference"),
    ("evidence.{part}.sensor.residual", "wheel.{part}.v", "evidence.{part}.sensor.expected"),
    ("evidence.{part}.actuator.residual", "wheel.{part}.u_applied", "evidence.{part}.actuator.expected"),
    ("evidence.{part}.sensor.residual", "steer.{part}.phi", "evidence.{part}.sensor.expected"),
    ("evidence.{part}.actuator.residual", "steer.{part}.phi", "evidence.{part}.actuator.expected"),
)
_BLOCK = 1 << 15
_ROUNDING = 1e-3  # of a step, for 32-bit arithmetic

Columns = Mapping[str, NDArray[Any]]
Sources = dict[str, tuple[str, ...]]


def differences_of(name: str, columns: Columns) -> tuple[str, str] | None:
    """The two of some columns, each of shape (n,), whose difference a column is, by its name; None where there are none."""
    group, _, rest = name.partition(".")
    for whole, *two in _DIFFERENCES:
        leaf = whole.removeprefix(f"{group}.{{part}}")
        part = rest.removesuffix(leaf)
        first, second = (source.replace("{part}", part) for source in two)
        if f"{group}.{part}{leaf}" == name and leaf != whole and first in columns and second in columns:
            return first, second
    return None


def sources_of(
    exact: Columns, kept: Columns, steps: Mapping[str, float], among: Collection[str] | None = None
) -> Sources:
    """Which columns the same one of a part's other side, or the difference of two, stands for.

    Parameters
    ----------
    exact : Columns, each of shape (n,)
        Columns before they were rounded.
    kept : Columns, each of shape (n,)
        The same, rounded to be stored.
    steps : Mapping[str, float]
        Step of each column's grid, in its unit: a difference may be wrong by one step at most.
    among : Collection[str] or None
        Columns that may be made of others; None: all.

    Returns
    -------
    dict[str, tuple[str, ...]]
        One name, or minuend and subtrahend; all are columns with values of their own.
    """
    pairs: dict[str, tuple[str, str]] = {}
    asked = [name for name in kept if among is None or name in among]
    for name in asked:
        pair = differences_of(name, kept)
        if pair is None or pairs.keys() & {*pair} or not steps.get(name, 0.0):
            continue
        if _is_difference(exact[name], kept[pair[0]], kept[pair[1]], steps[name]):
            pairs[name] = pair
    needed = {p for pair in pairs.values() for p in pair}
    pairs = {name: pair for name, pair in pairs.items() if name not in needed}
    equal = _equal({name: kept[name] for name in kept if name not in pairs}, asked)
    once = {name: (other,) for name, other in equal.items()}
    return once | {name: (equal.get(a, a), equal.get(b, b)) for name, (a, b) in pairs.items()}


def _equal(kept: Columns, asked: Collection[str]) -> dict[str, str]:
    """For columns that repeat the same one of the part's other side, that one."""
    seen: dict[tuple[str, str], str] = {}
    out = {}
    for name, values in kept.items():
        part, _, rest = name.rpartition(".")
        key = part.rpartition(".")[0], rest
        other = seen.setdefault(key, name)
        alike = other != name and name in asked and values.dtype == kept[other].dtype
        if alike and np.array_equal(_bits(values), _bits(kept[other])):
            out[name] = other
    return out


def _bits(values: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(values).view(f"u{values.dtype.itemsize}")


@np.errstate(over="ignore", invalid="ignore")
def _is_difference(exact: NDArray[Any], first: NDArray[Any], second: NDArray[Any], step: float) -> bool:
    """Whether a column is the difference of two to one step, and has a sample exactly where both have."""
    for at in range(0, len(exact), _BLOCK):
        part = slice(at, at + _BLOCK)
        made = difference(first[part], second[part])
        wrong = np.abs(made - exact[part])
        known = np.isfinite(wrong)
        if not np.array_equal(np.isnan(made), np.isnan(exact[part])) or not np.array_equal(known, ~np.isnan(made)):
            return False
        if known.any() and not wrong[known].max() <= (1 + _ROUNDING) * step:
            return False
    return True


def difference(first: NDArray[Any], second: NDArray[Any]) -> NDArray[np.float32]:
    """First less second, all of shape (n,), as it is shown and as every reader of the file makes it."""
    with np.errstate(over="ignore", invalid="ignore"):
        made: NDArray[np.float32] = np.subtract(first, second, dtype=np.float32)
    return made


def restored(held: Columns, layout: Layout) -> dict[str, NDArray[Any]]:
    """All columns, each of shape (n,), in their order; those that the file does not hold are made of those that it does."""
    out = {}
    for name in layout.order:
        if name in held:
            out[name] = held[name]
        else:
            of = [held[p] for p in layout.made_of[name]]
            out[name] = of[0] if len(of) == 1 else difference(of[0], of[1])
    return out


@dataclass(frozen=True)
class Layout:
    """What a file says of its columns.

    Attributes
    ----------
    order : list[str]
        All columns, those that it does not hold too.
    made_of : Mapping[str, tuple[str, ...]]
        Of what those are made, as `sources_of`.
    steps : Mapping[str, float]
        Step of the grid of each, in its unit.
    """

    order: list[str]
    made_of: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    steps: Mapping[str, float] = field(default_factory=dict)

    def metadata(self) -> dict[bytes, bytes]:
        """The same as a file's metadata."""
        said = {"columns": self.order, "made_of": self.made_of, "steps": self.steps}
        return {KEY: orjson.dumps(said)}

    @classmethod
    def stated(cls, text: bytes | None, held: list[str]) -> Layout:
        """What a file states; of one that states nothing, the columns that it holds.

        Raises
        ------
        ValueError
            Where that makes no sense.
        """
        if text is None:
            return cls(held)
        said = orjson.loads(text)
        order, made_of, steps = (
            said.get(k) if isinstance(said, dict) else None for k in ("columns", "made_of", "steps")
        )
        if not isinstance(order, list) or not isinstance(made_of, dict) or not isinstance(steps, dict):
            raise ValueError("what it says of its columns is not of this tool")
        if len(made_of) > len(held):
            raise ValueError("more columns are made of others than it holds")
        own, sources = set(held), {}
        for name, of in made_of.items():
            if not isinstance(of, list) or len(of) not in (1, 2) or any(p not in held for p in of):
                raise ValueError(f"column {name[:80]!r} is made of columns that it does not hold")
            if name not in own:
                sources[name] = tuple(of)
        every = {*own, *sources}
        names = [n for n in dict.fromkeys(n for n in order if isinstance(n, str)) if n in every]
        named = {*names}
        names += [n for n in (*held, *sources) if n not in named]
        finite = {n: float(x) for n, x in steps.items() if n in every and isinstance(x, float | int) and 0 <= x < 1e30}
        return cls(names, sources, finite)
