"""What the docstring of a public function lacks: shapes of arrays, units of numbers, errors that it raises.

Public is what has a name without an underscore: functions of the packages, and methods of their public classes. A command of the
command line is documented by its help, its docstring's first sentence.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PACKAGES = ("cli", "diagnosis", "mfhca", "replay")
_COMMANDS = ("cli", "commands")
_ARRAYS = {"NDArray", "ndarray", "Array", "Flags"}
_SHAPE = re.compile(r"\bshapes?\b|\([a-zA-Z_− 0-9]+,( ?[a-zA-Z0-9…]+)*\)")
# A unit in brackets or in words; what is a share or a probability has none.
_UNIT = re.compile(
    r"\[|\b([Ii]n|of|per|\d|and|by|as) (a )?(s|ms|ns|m|m/s|px|rad|rad/s|Hz|MB|MB/s|deg|percent|steps|samples|seconds|bytes|fractions)\b|\bSI\b"
    r"|\bunits?\b|shares?\b|fractions?\b|probabilit|probable|factor|likelihood|evidence|ratio\b|seconds|digits|m/s"
)
_NAMED_UNIT = re.compile(r"_(s|ms|ns|m|hz|mb|deg|rad|px|ppm|share|per_.*)$|^(dt|epsilon|probability|p|share|ratio)$")
_NUMBER = re.compile(r"float( \| None)?")
_INTERNAL = {"AssertionError", "NotImplementedError", "StopIteration", "Exit"}


@dataclass(frozen=True)
class Public:
    """A public function.

    Attributes
    ----------
    where : str
        File, line and name.
    node : ast.FunctionDef
        It.
    arrays : frozenset[str]
        Names that stand for arrays in its file.
    command : bool
        Whether it is a command.
    """

    where: str
    node: ast.FunctionDef
    arrays: frozenset[str]
    command: bool

    @property
    def text(self) -> str:
        """Its docstring."""
        return ast.get_docstring(self.node) or ""

    @property
    def parameters(self) -> dict[str, str]:
        """Annotation of each parameter."""
        a = self.node.args
        every = [*a.posonlyargs, *a.args, *a.kwonlyargs]
        return {one.arg: ast.unparse(one.annotation) for one in every if one.annotation is not None}

    @property
    def result(self) -> str:
        """Annotation of what it gives."""
        return ast.unparse(self.node.returns) if self.node.returns else ""


def public_functions(root: Path) -> Iterator[Public]:
    """Every public function below a folder that holds the packages."""
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            yield from public_in(path.read_text(encoding="utf-8"), path.relative_to(root))


def public_in(source: str, path: Path) -> Iterator[Public]:
    """Every public function of a file."""
    tree = ast.parse(source)
    arrays = frozenset(_ARRAYS | {name for node in tree.body for name in _array_name(node)})
    for node in tree.body:
        within = [("", node)]
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            within = [(f"{node.name}.", one) for one in node.body]
        for prefix, one in within:
            if isinstance(one, ast.FunctionDef) and not one.name.startswith("_") and not _is_derived(one):
                where = f"{path.as_posix()}:{one.lineno} {prefix}{one.name}"
                yield Public(where, one, arrays, path.parts[:2] == _COMMANDS)


def _array_name(node: ast.stmt) -> list[str]:
    """Name that a statement gives to a type of arrays."""
    if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and "NDArray" in ast.unparse(node.value):
        return [node.targets[0].id] if "[" in ast.unparse(node.value) else []
    return []


def _is_derived(node: ast.FunctionDef) -> bool:
    """Whether another function documents it: a setter, one form of several, one of a base class."""
    names = [ast.unparse(d) for d in node.decorator_list]
    return any(n.endswith(".setter") or n in ("overload", "override") for n in names)


def lacks(one: Public) -> list[str]:
    """What a docstring lacks, one word each."""
    text, types = one.text, [*one.parameters.values(), one.result]
    if not text:
        return ["docstring"]
    if one.command:
        return []
    out = []
    arrays = re.compile(rf"\b({'|'.join(sorted(one.arrays))})\b")
    if any(arrays.search(t) for t in types) and not _SHAPE.search(text):
        out.append("shape")
    numbers = [n for n, t in one.parameters.items() if _NUMBER.fullmatch(t) and not _NAMED_UNIT.search(n)]
    given = _NUMBER.fullmatch(one.result) and not _NAMED_UNIT.search(one.node.name)
    if (numbers or given) and not _UNIT.search(text):
        out.append("unit")
    return out + [name for name in sorted(_raised(one.node)) if name not in text]


def _raised(function: ast.FunctionDef) -> set[str]:
    """Errors that leave a function by its own statements; those that it catches itself do not."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.FunctionDef | ast.Lambda) and node is not function:
            return
        if isinstance(node, ast.Try) and node.handlers:
            for part in (*node.handlers, *node.orelse, *node.finalbody):
                visit(part)
            return
        if isinstance(node, ast.Raise) and node.exc is not None:
            name = ast.unparse(node.exc.func if isinstance(node.exc, ast.Call) else node.exc).rpartition(".")[2]
            if name[:1].isupper() and name not in _INTERNAL:
                found.add(name)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(function)
    return found
