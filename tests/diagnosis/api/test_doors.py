"""`import mfhca`: light, documented, and everything behind it."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import mfhca

ROOT = Path(__file__).parents[3]
_HEAVY = ("numpy", "pandas", "plotly", "pyarrow", "numba", "scipy")


def test_the_import_loads_nothing_heavy() -> None:
    code = f"import sys, mfhca; print([m for m in {_HEAVY!r} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert out.stdout.strip() == "[]"


def test_every_name_is_there_and_told() -> None:
    assert set(dir(mfhca)) == set(mfhca.__all__)
    for name in mfhca.__all__:
        assert getattr(mfhca, name) is not None
        if name != "__version__":
            assert inspect.getdoc(getattr(mfhca, name))
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = mfhca.nothing  # type: ignore[attr-defined]


def test_types_see_what_is_loaded_late() -> None:
    """What type checkers import is what is loaded at run time, from the same place."""
    tree = ast.parse((ROOT / "mfhca" / "__init__.py").read_text(encoding="utf-8"))
    seen = {a.name: str(n.module) for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) for a in n.names}
    assert {name: home for name, home in seen.items() if name in mfhca._HOME} == mfhca._HOME
    assert set(mfhca._HOME) | {"__version__"} == set(mfhca.__all__)


@pytest.mark.parametrize("name", [n for n in mfhca.__all__ if inspect.isfunction(getattr(mfhca, n))])
def test_functions_tell_every_parameter_and_error(name: str) -> None:
    function = getattr(mfhca, name)
    text = inspect.getdoc(function) or ""
    parameters, _, rest = text.partition("Raises\n------")
    assert rest
    told = parameters.replace(",", " ").split()
    assert [p for p in inspect.signature(function).parameters if p not in told] == []


@pytest.mark.parametrize("name", [n for n in mfhca.__all__ if inspect.isclass(getattr(mfhca, n))])
def test_classes_tell_every_member(name: str) -> None:
    found = getattr(mfhca, name)
    public = [
        m
        for m in vars(found)
        if not m.startswith("_") and (callable(getattr(found, m)) or isinstance(vars(found)[m], property))
    ]
    assert [m for m in public if not inspect.getdoc(vars(found)[m])] == []


def _functions() -> dict[str, Any]:
    """Functions and methods by the name that a user writes."""
    found = {n: getattr(mfhca, n) for n in mfhca.__all__}
    out = {n: f for n, f in found.items() if inspect.isfunction(f)}
    for name, cls in found.items():
        if inspect.isclass(cls) and cls.__module__.startswith("diagnosis.api"):
            out |= {f"{name}.{m}": f for m, f in vars(cls).items() if not m.startswith("_") and inspect.isfunction(f)}
    return out


@pytest.mark.parametrize("name", _functions())
def test_arguments_with_a_unit_in_their_name_tell_it(name: str) -> None:
    text = inspect.getdoc(_functions()[name]) or ""
    for argument in inspect.signature(_functions()[name]).parameters:
        unit = re.search(r"_(s|ns|hz|mb)$", argument)
        if unit is not None:
            described = re.search(rf"^(?:\w+, )*{argument}\b.* :.*\n(?:    .*\n?)+", text, re.M)
            assert described, f"{name}: {argument}"
            assert re.search(rf"\[{unit[1]}\b", described[0], re.I), f"{name}: {argument}"


def _tables() -> dict[str, str]:
    """Docstrings of all properties that give a table."""
    out = {}
    for name in mfhca.__all__:
        for member, found in vars(getattr(mfhca, name)).items() if inspect.isclass(getattr(mfhca, name)) else ():
            getter = getattr(found, "fget", None) or getattr(found, "func", None)
            if (
                not member.startswith("_")
                and getter is not None
                and "DataFrame" in str(getter.__annotations__.get("return", ""))
            ):
                out[f"{name}.{member}"] = inspect.getdoc(found) or ""
    return out


def test_tables_tell_their_shape() -> None:
    tables = _tables()
    assert len(tables) > 8
    assert [name for name, text in tables.items() if "shape (" not in text] == []
