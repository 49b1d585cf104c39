"""The border around readers: what nobody foresaw is one stated error that names the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from replay.border import UnforeseenContent
from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.common.border import Bordered
from replay.readers.registry import readers


class _Broken:
    format = "odd"

    def __init__(self, error: BaseException) -> None:
        self._error = error

    def _fail(self, *_: object) -> object:
        raise self._error

    matches = summarise = read = _fail


@pytest.mark.parametrize(
    "error", [IndexError("at 7"), RecursionError("deep"), OverflowError("too large"), KeyError("k")]
)
def test_foreign_errors_are_stated(error: Exception) -> None:
    reader = Bordered(_Broken(error))  # type: ignore[arg-type]
    for act in (
        reader.matches,
        lambda p: reader.summarise(p, SourceOptions()),
        lambda p: reader.read(p, SourceOptions()),
    ):
        with pytest.raises(
            UnforeseenContent, match=rf"a\.odd cannot be read as odd: .*{type(error).__name__}"
        ) as found:
            act(Path("a.odd"))
        assert found.value.exit_code == 3
        assert found.value.__cause__ is error


def test_what_is_foreseen_stays() -> None:
    with pytest.raises(LogError, match=r"^a\.odd cannot be read: gone$"):
        Bordered(_Broken(OSError(5, "gone"))).matches(Path("a.odd"))  # type: ignore[arg-type]
    for known in (LogError("said"), MemoryError()):
        with pytest.raises(type(known)) as found:
            Bordered(_Broken(known)).matches(Path("a.odd"))  # type: ignore[arg-type]
        assert found.value is known


def test_every_reader_has_its_border() -> None:
    assert all(isinstance(reader, Bordered) for reader in readers())
