"""Sentences of an assessment in the words of its machine.

Families of evidence write ``{wheel}``, ``{valve}``, ``{speed_unit}`` and the like; here, once for all of them, the machine's own
words take their place.
"""

from __future__ import annotations

from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.plain_numbers import with_minus_signs
from diagnosis.results.sentence import mapped


def worded(found: Assessment, words: MachineWords) -> Assessment:
    """The same with every reason, note, sentence of evidence and unit of speed as the machine has it."""
    return replace(
        found,
        reasons={state: _said(why, words) for state, why in found.reasons.items()},
        notes=tuple(_said(note, words) for note in found.notes),
        hidden=words.fill(found.hidden),
        unexplained_size=words.fill(found.unexplained_size),
        findings=tuple(_finding(f, words) for f in found.findings),
    )


def _finding(found: Finding, words: MachineWords) -> Finding:
    sat = found.sat
    if sat is not None and sat.unit == "m/s":
        sat = replace(sat, unit=words.speed_unit)
    return replace(
        found, evidence=tuple(mapped(text, lambda part: _said(part, words)) for text in found.evidence), sat=sat
    )


def _said(text: str, words: MachineWords) -> str:
    return with_minus_signs(words.fill(text))
