"""Sentences that quote a file stay short, and keep their end."""

from __future__ import annotations

from pathlib import Path

import pytest

from replay.border import MAX_SENTENCE, UnforeseenContent, UnforeseenValue, bordered, shortened
from replay.errors import ConfigError, LogError
from replay.log.reading_notes import Report


def test_long_sentences_keep_their_ends() -> None:
    text = f"a.csv: column {'x' * 9000!r} rises; give [sources] time"
    assert len(shortened(text)) == MAX_SENTENCE
    assert shortened(text).startswith("a.csv: column 'xxx")
    assert shortened(text).endswith("x' rises; give [sources] time")
    assert shortened("short") == "short"


def test_sentences_are_one_line_without_control_characters() -> None:
    assert shortened("columns 'a\r\nb', \x1b[31mred\x9b0m\u2028c") == "columns 'a b',  [31mred 0m c"
    with pytest.raises(LogError, match=r"^a\.csv: x y$"), bordered(Path("a.csv"), "csv"):
        raise LogError("a.csv: x\ny")


def test_the_border_keeps_the_kind_of_a_long_error() -> None:
    with pytest.raises(LogError, match=r"^a\.csv: x+ … x+$") as found, bordered(Path("a.csv"), "csv"):
        raise LogError("a.csv: " + "x" * 9000)
    assert type(found.value) is LogError
    assert len(str(found.value)) == MAX_SENTENCE


def test_what_was_said_of_a_log_is_shortened_too() -> None:
    report = Report()
    report.note("x" * 9000)
    report.lost("y" * 9000)
    assert [len(text) for text in (*report.notes, *report.damage)] == [MAX_SENTENCE] * 2


def test_settings_have_their_own_kind() -> None:
    with (
        pytest.raises(
            UnforeseenValue, match=r"m\.toml cannot be read as machine file: .*KeyError .*; look, and report"
        ) as found,
        bordered(Path("m.toml"), "machine file", UnforeseenValue, "look"),
    ):
        raise KeyError("x")
    assert isinstance(found.value, ConfigError)
    assert not isinstance(found.value, UnforeseenContent)
