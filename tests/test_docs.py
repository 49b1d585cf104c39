"""The documentation does what it says: every block of the README and of `docs/` is run, and generated pages are current."""

from __future__ import annotations

import configparser
import contextlib
import importlib.util
import io
import os
import re
import shlex
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import mfhca
from cli.main import run
from replay.machine.toml_file import load_machine
from tests.documented_files import write_documented_files
from tests.object_store import stored_logs

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    "README.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "sample_logs/README.md",
    *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md")),
]
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]+))?\)")
#: Parts of a command line that set an environment up or run these tests.
_SETUP = re.compile(r"-m venv|pip install|-m pytest|pre-commit|^(source|\.) ")
_SHELL = re.compile(r"[|<>;$&]")
_CODE = re.compile(r"# code (\d+)\s*$")
_MFHCA = 'exec "{python}" -W ignore -c "import sys; from cli.main import main; sys.argv[0] = \'mfhca\'; main()" "$@"\n'


class Block(NamedTuple):
    """A block of a page: its language, its text, and the line where it begins."""

    language: str
    text: str
    line: int

    @property
    def left_out(self) -> bool:
        return "not run: " in self.text.partition("\n")[0]


def blocks(page: str) -> list[Block]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return [Block(m[1], m[2], text.count("\n", 0, m.start()) + 1) for m in _BLOCK.finditer(text)]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("documented")
    write_documented_files(folder)
    return folder


@pytest.fixture
def place(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder in which a page is followed, with copies of the files that it may change."""
    shutil.copytree(files, tmp_path, symlinks=True, dirs_exist_ok=True)
    tools = tmp_path / ".bin"
    tools.mkdir()
    (tools / "mfhca").write_text("#!/bin/sh\n" + _MFHCA.format(python=sys.executable))
    (tools / "mfhca").chmod(0o755)
    (tools / "python").symlink_to(sys.executable)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("PATH", f"{tools}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path


class Follower:
    """Follows a page: runs its blocks one after the other and keeps what the last one printed."""

    def __init__(self, page: str) -> None:
        self.page = page
        self.printed = ""
        self.names: dict[str, Any] = {"__name__": "page"}

    def follow(self, block: Block) -> None:
        """Run one block.

        Raises
        ------
        AssertionError
            Where it does not do what the page says.
        """
        where = f"{self.page}:{block.line}"
        if block.left_out:
            self.printed = ""
        elif block.language == "bash":
            lines = [line for line in block.text.replace("\\\n", " ").splitlines() if line.strip()]
            self.printed = "".join(_run_line(line, where) for line in lines)
        elif block.language == "python":
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(block.text, where, "exec"), self.names)
            self.printed = printed.getvalue()
        elif block.language == "text":
            if self.printed:
                _check_printed(block.text, self.printed, where)
            self.printed = ""
        elif block.language == "toml":
            Path("block.toml").write_text(block.text, encoding="utf-8")
            load_machine(Path("block.toml"))
        elif block.language == "ini":
            parser = configparser.ConfigParser()
            parser.optionxform = str  # type: ignore[assignment,method-assign]
            parser.read_string(block.text)
        elif block.language == "sql":
            with contextlib.closing(sqlite3.connect(":memory:")) as database:
                database.executescript(block.text)
        elif block.language == "yaml":
            yaml = pytest.importorskip("yaml", reason="PyYAML comes with the extra dev")
            assert list(yaml.safe_load_all(block.text)), where


def _run_line(line: str, where: str) -> str:
    """Output of a command line without what sets an environment up; its code is 0 or 1, or as its comment says."""
    stated = _CODE.search(line)
    expected = {int(stated[1])} if stated else {0, 1}
    parts = [part.strip() for part in line.split("&&")]
    line = " && ".join(part for part in parts if not _SETUP.search(part)).replace(".venv/bin/", "")
    if not line:
        return ""
    words = shlex.split(line, comments=True)
    if not words:
        return ""
    if words[0] == "mfhca" and not _SHELL.search(line.partition(" #")[0].replace('"', "")):
        printed, said = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(said):
            code = run(
                [
                    path
                    for word in words[1:]
                    for path in (sorted(map(str, Path().glob(word))) if "*" in word else [word])
                ]
            )
        output, errors = printed.getvalue(), said.getvalue()
    else:
        done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False, timeout=100)
        code, output, errors = done.returncode, done.stdout, done.stderr
    assert code in expected, f"{where}: `{line}` ended with {code}\n{output}\n{errors}"
    return output + errors


def _check_printed(shown: str, printed: str, where: str) -> None:
    """Every line that the page shows was printed, in this order; `…` stands for anything."""
    rest = [" ".join(line.split()) for line in printed.splitlines()]
    for line in shown.splitlines():
        words = " ".join(line.split())
        if words in ("", "…"):
            continue
        pattern = re.compile(re.escape(words).replace("…", ".*"))
        at = next((i for i, one in enumerate(rest) if pattern.fullmatch(one)), None)
        assert at is not None, f"{where}: not printed: {line}\n--- printed:\n{printed}"
        del rest[: at + 1]


@pytest.mark.parametrize("page", [page for page in PAGES if any(block.language for block in blocks(page))])
def test_a_reader_can_follow(page: str, place: Path) -> None:
    follower = Follower(page)
    steps = blocks(page)
    bucket = any("s3://fleet/2026" in block.text for block in steps if block.language == "bash")
    with stored_logs("fleet", "2026", place / "logs") if bucket else contextlib.nullcontext():
        for block in steps:
            follower.follow(block)


def test_a_block_that_is_wrong_is_noticed(place: Path) -> None:
    for block in (
        Block("bash", "mfhca inspect nowhere.mcap\n", 1),
        Block("bash", "mfhca inspect drive.mcap | grep nothing-like-this; exit 4\n", 1),
        Block("python", "assert False\n", 1),
    ):
        with pytest.raises(AssertionError):
            Follower("page").follow(block)
    follower = Follower("page")
    follower.follow(Block("bash", "mfhca --version\n", 1))
    with pytest.raises(AssertionError, match="not printed"):
        follower.follow(Block("text", "mfhca-replay 99\n", 2))


@pytest.mark.parametrize("page", PAGES)
def test_every_block_says_what_it_is(page: str) -> None:
    """A block without a language is a drawing or an outline, never a command."""
    for block in blocks(page):
        assert block.language or not re.search(r"^(\$ |mfhca |python )", block.text, re.MULTILINE), block.line


def _links(page: str) -> Iterator[tuple[str, str]]:
    text = _BLOCK.sub("", (ROOT / page).read_text(encoding="utf-8"))
    yield from ((m[1], m[2] or "") for m in _LINK.finditer(text))


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files(page: str) -> None:
    for target, _ in _links(page):
        assert not target or ((ROOT / page).parent / target).exists(), target


def _tool(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, ROOT / ".ci" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", ["commands.md", "report-json.md", "machine-file.md"])
def test_pages_made_from_the_program_are_current(page: str) -> None:
    written = _tool("reference").PAGES[page]()
    assert (ROOT / "docs" / "reference" / page).read_text(encoding="utf-8") == written, "run python .ci/reference.py"


def test_the_page_of_the_python_api_names_all_that_is_given() -> None:
    page = _tool("site_pages").api_page()
    named = dict(re.findall(r"^## mfhca\.(\w+)\n\n::: ([\w.]+)$", page, re.MULTILINE))
    assert set(named) == set(mfhca.__all__) - {"__version__"}
    for name, place in named.items():
        assert getattr(importlib.import_module(place.rpartition(".")[0]), name) is getattr(mfhca, name)


def test_licences_name_every_locked_package() -> None:
    tool = _tool("licences")
    text = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
    for name in {**tool.pins("requirements.lock"), **tool.pins("requirements-dev.lock")}:
        assert f"\n| {name} | " in text, f"{name}: run python .ci/licences.py"


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 150
    assert all(path.stat().st_size <= 150_000 for path in (ROOT / "docs" / "pictures").iterdir())
