"""TOML from strangers: no document costs time or memory, and every refusal says where and why."""

from __future__ import annotations

import time

import pytest

from replay.toml_text import TomlError, parse_toml


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = 1\nb = " + "9" * 5000, "line 2 has a number of 5000 digits; at most 100 are read"),
        ("a = " + "[" * 100_000, "line 1 nests more than 32 brackets"),
        ("a = " + "{a=" * 5000, "nests more than 32 brackets"),
        ("a" + ".a" * 50_000 + " = 1", "a key of 50001 parts"),
        ("[a" + '."a"' * 50_000 + "]", "a key of 50001 parts"),
        ('a = """' + "\\" * 100_001, "not valid TOML"),
        ('a = "' + '\\"' * 400_000, "not valid TOML"),
        ("a = " + "'" * 100_001, "not valid TOML"),
        ("\n".join(f"k{i} = 1" for i in range(20_001)), "it has 20001 keys"),
        ("# " + "x" * (1 << 20), "it has 1048578 characters"),
        ('x = """"\n[[[[', "not valid TOML"),
        ("a = [1", "not valid TOML"),
    ],
)
def test_what_is_refused(text: str, said: str) -> None:
    start = time.process_time()
    with pytest.raises(TomlError) as error:
        parse_toml(text)
    assert said in str(error.value)
    assert len(str(error.value)) < 200
    assert time.process_time() - start < 2.0


def test_strings_and_comments_count_for_nothing() -> None:
    text = f'a = "{"[" * 100}{"9" * 200}"\nb = """\n{"." * 100}\n"""  # {"{" * 100}\nc = \'\'\'{"9" * 200}\'\'\'\n'
    assert parse_toml(text) == {"a": "[" * 100 + "9" * 200, "b": "." * 100 + "\n", "c": "9" * 200}
    assert parse_toml("x.y.z = [[1.5, 2], [3]]\n[t.u]\nv = { w = 1979-05-27T07:32:00Z }\n")["x"] == {
        "y": {"z": [[1.5, 2], [3]]}
    }
