"""Every public function tells the shapes, units and errors that a caller has to know."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import mfhca
from tests.docstrings import lacks, public_functions, public_in

ROOT = Path(__file__).resolve().parents[1]


def test_every_public_function_is_documented() -> None:
    found = list(public_functions(ROOT))
    assert len(found) > 2000
    poor = [f"{one.where}: {', '.join(missing)}" for one in found if (missing := lacks(one))]
    assert not poor, f"{len(poor)} docstrings lack something:\n" + "\n".join(poor)


@pytest.mark.parametrize(
    ("source", "missing"),
    [
        ("def f(x: int) -> int:\n    return x", ["docstring"]),
        ('def f(x: NDArray[np.float64]) -> None:\n    """Draw it."""', ["shape"]),
        ('def f(x: NDArray[np.float64]) -> None:\n    """Draw a signal, shape (n,)."""', []),
        ('V = NDArray[np.int8]\ndef f() -> V:\n    """Codes."""', ["shape"]),
        ('def f(x: float) -> None:\n    """Wait for so long."""', ["unit"]),
        ('def f(x: float) -> None:\n    """Wait for x [s]."""', []),
        ('def f(wait_s: float) -> None:\n    """Wait."""', []),
        ('def f() -> None:\n    """Refuse."""\n    raise ValueError("no")', ["ValueError"]),
        (
            'def f() -> None:\n    """Try."""\n    try:\n        raise ValueError\n    except ValueError:\n        pass',
            [],
        ),
        ('class A:\n    def f(self) -> Array:\n        """Values."""', ["shape"]),
        ("class _A:\n    def f(self) -> Array:\n        return 1\ndef _f(): pass", None),
    ],
)
def test_what_is_missing_is_told(source: str, missing: list[str] | None) -> None:
    found = list(public_in(source, Path("replay/a.py")))
    assert [lacks(one) for one in found] == ([] if missing is None else [missing])


def test_the_door_names_every_parameter() -> None:
    """`help(mfhca.diagnose)` is the reference; so is that of every method of what it gives."""
    poor = []
    for name in mfhca.__all__:
        thing = getattr(mfhca, name)
        doors = [(name, thing)] if inspect.isfunction(thing) else []
        if inspect.isclass(thing) and not issubclass(thing, Exception) and thing.__module__.startswith("diagnosis.api"):
            members = inspect.getmembers(thing, inspect.isfunction)
            doors = [
                (f"{name}.{key}", one) for key, one in members if key[0] != "_" and one.__module__ == thing.__module__
            ]
        for label, door in doors:
            text = inspect.getdoc(door) or ""
            unnamed = [
                key
                for key in inspect.signature(door).parameters
                if key != "self" and not re.search(rf"\b{key}\b", text)
            ]
            poor += [f"{label}({key})" for key in unnamed]
    assert not poor, poor
