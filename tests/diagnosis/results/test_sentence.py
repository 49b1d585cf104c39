"""Sentences of evidence that say what they are about."""

from __future__ import annotations

import copy
import pickle

import orjson

from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.sentence import About, Sentence, is_about, mapped, stated_anew

SAID = Sentence(About.CASES, "{wheel}: it was this in ", "60", " of 100 cases.")


def test_a_sentence_is_its_text() -> None:
    assert SAID == "{wheel}: it was this in 60 of 100 cases."
    assert orjson.loads(orjson.dumps([SAID])) == [str(SAID)]
    for again in (copy.copy(SAID), copy.deepcopy(SAID), pickle.loads(pickle.dumps(SAID))):
        assert (again, again.about, again.parts) == (SAID, SAID.about, SAID.parts)


def test_words_are_filled_in_and_the_part_in_the_middle_is_stated_anew() -> None:
    filled = mapped(SAID, HYDRAULIC.fill)
    assert filled == "wheel: it was this in 60 of 100 cases."
    assert is_about(filled, About.TIMES, About.CASES)
    assert stated_anew(filled, About.CASES, "95") == "wheel: it was this in 95 of 100 cases."
    assert stated_anew(filled, About.SHARE, "95") is filled


def test_plain_text_is_about_nothing() -> None:
    assert not is_about("more than a million times as probable", *About)
    assert mapped("{wheel}", HYDRAULIC.fill) == "wheel"
    assert stated_anew("in 60 of 100 cases", About.CASES, "1") == "in 60 of 100 cases"
