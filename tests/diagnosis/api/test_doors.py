"""`import mfhca`: light, documented, and everything behind it."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

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
