"""Templates of pages: compiled once, and used as they are from then on."""

from __future__ import annotations

import sys
from pathlib import Path

import jinja2
import pytest

from diagnosis.pages import environment as pages


def _page(folder: Path) -> str:
    return pages.environment(folder).get_template("page.j2").render(name="<FL>")


@pytest.fixture
def templates(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of templates, and a package of pages whose compiled modules stand beside it."""
    (tmp_path / "templates").mkdir()
    (tmp_path / "templates" / "page.j2").write_text("Wheel {{ name }}", "utf-8")
    (tmp_path / "pages" / "__pycache__").mkdir(parents=True)
    monkeypatch.setattr(pages, "__file__", str(tmp_path / "pages" / "environment.py"))
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    return tmp_path / "templates"


def test_a_template_is_compiled_once(templates: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _page(templates) == "Wheel &lt;FL&gt;"
    monkeypatch.setattr(jinja2.Environment, "_generate", None)  # what compiles
    assert _page(templates) == "Wheel &lt;FL&gt;"


def test_a_changed_template_is_compiled_again(templates: Path) -> None:
    _page(templates)
    (templates / "page.j2").write_text("Axle {{ name }}", "utf-8")
    assert _page(templates) == "Axle &lt;FL&gt;"


def test_a_template_that_cannot_be_kept_is_rendered_all_the_same(
    templates: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(jinja2.FileSystemBytecodeCache, "dump_bytecode", full)
    assert _page(templates) == "Wheel &lt;FL&gt;"


def test_without_bytecode_nothing_is_kept(templates: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert _page(templates) == "Wheel &lt;FL&gt;"
    assert not list((templates.parent / "pages" / "__pycache__").iterdir())
