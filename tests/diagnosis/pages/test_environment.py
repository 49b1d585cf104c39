"""Templates of pages: compiled once, and used as they are from then on."""

from __future__ import annotations

import sys
from pathlib import Path

import jinja2
import pytest
from markupsafe import Markup

from diagnosis.pages import environment as pages
from diagnosis.pages.environment import unbroken


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


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("95 % bounds, 0.3 m/s for 10.0 s", "95\u00a0% bounds, 0.3\u00a0m/s for 10.0\u00a0s"),
        ("3 samples of 2 machines", "3 samples of 2 machines"),
        ("of 57 shells at 50 Hz", "of 57 shells at 50\u00a0Hz"),
    ],
)
def test_a_number_stays_on_the_line_of_its_unit(text: str, kept: str) -> None:
    assert unbroken(text) == kept
    assert unbroken(Markup(text)) == text
    assert unbroken(7) == 7
