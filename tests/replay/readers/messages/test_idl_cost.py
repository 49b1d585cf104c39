"""Definitions that would keep the parser busy for minutes are refused at once; those that recorders write are not."""

from __future__ import annotations

import time

import pytest

from replay.readers.messages.definitions import DefinitionError, resolve
from replay.readers.messages.idl_cost import MAX_MILLISECONDS, milliseconds

AROUND = "module a {{ module msg {{ {} struct I {{ double v; {} }}; }}; }};"
VERBATIM = '@verbatim (language="comment", text="a (b) ((c))" "d") @unit(value="m/s") @default (value=0.5)\n'


@pytest.mark.parametrize(
    "text",
    [
        AROUND.format("const long X = " + "(" * 3 + "5" + ")" * 3 + ";", ""),
        AROUND.format("const long X = " + "(" * 300_000, ""),
        AROUND.format("", "@range(min=((5)), max=(((6)))) short s;"),
        AROUND.format("const long X = " + "+".join(["(5|5)"] * 30) + ";", ""),
        AROUND.format("const long X = 5;" * 20_000, ""),
        AROUND.format("", "short s" + "[1]" * 9_000 + ";"),
        AROUND.format("", "sequence<" * 20 + "short" + ">" * 20 + " s;"),
        AROUND.format("/*" * 250_000, ""),
        AROUND.format('"' + "\\" * 500_000, ""),
    ],
    ids=["nested", "open", "annotation", "many", "constants", "lengths", "sequences", "comments", "quotes"],
)
def test_what_would_take_minutes_is_refused_at_once(text: str) -> None:
    start = time.process_time()
    milliseconds(text)
    if milliseconds(text) > MAX_MILLISECONDS:
        with pytest.raises(DefinitionError, match="in time"):
            resolve("a/msg/I", "ros2idl", text, False)
    assert time.process_time() - start < 5.0


@pytest.mark.parametrize(
    "text",
    [
        AROUND.format("const long X = (5);", ""),
        AROUND.format("const long X = 1 << 5; /* ((( */ // (((\n", "string<9> t; sequence<short, 5> s; double m[3];"),
        AROUND.format("", "".join(f"{VERBATIM}double w{k};\n" for k in range(200))),
    ],
    ids=["bracket", "signs", "annotations"],
)
def test_what_recorders_write_is_parsed(text: str) -> None:
    assert resolve("a/msg/I", "ros2idl", text, False).fields
