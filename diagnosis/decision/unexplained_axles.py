"""What is off on a steering axle for a time that no fault explains: said with its size, whether or not it keeps a machine in."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from diagnosis.decision.short import Part, ToClear
from diagnosis.results.assessment import Assessment
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_TWICE = {
    Side.SENSOR: "compare both angles with a protractor at both stops and straight ahead",
    Side.ACTUATOR: "with the machine secured, give the {valve} a few steady commands and compare each with the {position}",
}
_ONCE = "compare the angle with a protractor at both stops and straight ahead; a log with steer.{c}.phi_true (a second angle) settles it"


def unexplained_points(
    assessments: Mapping[Part, Assessment],
    axles: Sequence[str],
    said: Collection[Part],
    twice: Collection[Part],
    words: MachineWords,
) -> list[ToClear]:
    """Parts of axles that are off for a time without a fault, each with how far and when.

    Parameters
    ----------
    assessments : Mapping[Part, Assessment]
        Of all parts.
    axles : Sequence[str]
        Steering axles.
    said : Collection[Part]
        Parts of which it is said already.
    twice : Collection[Part]
        Parts of which a second measurement is in the log.
    words : MachineWords
        How to speak of the machine.
    """
    out = []
    for part, a in assessments.items():
        if part[0] in axles and a.unexplained_size and part not in said:
            act = _TWICE[Side(part[1])] if part in twice else _ONCE.replace("{c}", part[0])
            out.append(ToClear(_sentence(part, a, words), words.fill(act), (part,)))
    return out


def unexplained_sentences(
    assessments: Mapping[Part, Assessment], axles: Sequence[str], words: MachineWords
) -> tuple[str, ...]:
    """The same for a machine that is cleared, whose checks hold it to be less than what counts."""
    return tuple(
        _sentence(part, a, words, ", less than what keeps a machine in")
        for part, a in assessments.items()
        if part[0] in axles and a.unexplained_size
    )


def _sentence(part: Part, a: Assessment, words: MachineWords, beside: str = "") -> str:
    name = words.part_words(Kind.STEER, *part)
    seconds = f"{a.unexplained_s:.1f} s of it were not judged"
    return f"The {name} is {a.unexplained_size}{beside}: no single fault explains it, so that {seconds}."
