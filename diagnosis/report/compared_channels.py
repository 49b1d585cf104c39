"""What a fault's evidence compares: the channel and its reference, and the columns in which it was decided."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from diagnosis.pages.labels import number
from diagnosis.report.second_measurements import JOINT, by_position, second_of
from diagnosis.report.units import EFFORT_UNIT, MOTION, motion_unit, on_page
from diagnosis.results.document import IntervalRow
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.sentence import About
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import Side
from replay.machine.quantities import OPENING


@dataclass(frozen=True)
class Motion:
    """What a component does: wheel speed or steering angle.

    Attributes
    ----------
    title : str
        Its name.
    unit : str
        Unit of the values shown.
    scale : float
        Factor from a column's unit to `unit`.
    measured, commanded, second : str
        Columns of the channel, of its command and of a second measurement, whether or not they are there.
    """

    title: str
    unit: str
    scale: float
    measured: str
    commanded: str
    second: str


@dataclass(frozen=True)
class Pair:
    """Channel and reference of one fault.

    Attributes
    ----------
    title : str
        What is measured.
    measured, reference : str, str or None
        Columns.
    words : str
        What the reference is.
    independent : bool
        Whether the reference is recorded independently of the channel, so that a fault leaves it as it is.
    unit : str
        Unit of the values shown.
    scale : float
        Factor from a column's unit to `unit`.
    evidence : str
        Beginning of the names of the evidence columns.
    """

    title: str
    measured: str
    reference: str | None
    words: str
    independent: bool
    unit: str
    scale: float
    evidence: str

    def text(self, value: float) -> str:
        """Value with its unit. In the pair's SI unit."""
        return f"{number(value)}{'' if self.unit == '°' else ' '}{self.unit}"


def motion_of(component: str, kind: Kind, columns: Collection[str], words: MachineWords) -> Motion:
    """Columns and unit of a component's motion; of two commands the replayed one, where it is there."""
    leaf = MOTION[kind]
    own = f"{kind}.{component}.{leaf}"
    replayed = f"replay.{component}.{leaf}_ref"
    commanded = own + "_ref" if own + "_ref" in columns and replayed not in columns else replayed
    title = "Steering angle" if kind == Kind.STEER else f"{words.part.capitalize()} speed"
    return Motion(title, *on_page(motion_unit(kind, words), words), own, commanded, own + "_true")


def by_valve(fault: IntervalRow, columns: Collection[str]) -> bool:
    """Whether a fault was decided by the measured position of its valve."""
    applied = f"{fault['kind']}.{fault['component']}.u_applied"
    return fault["side"] == Side.ACTUATOR and fault["tier"] == Tier.DIRECT and applied in columns


def by_effort(fault: IntervalRow, columns: Collection[str]) -> str:
    """Column of the effort that a drive's fault was decided by; empty where it was decided otherwise."""
    effort = f"{fault['kind']}.{fault['component']}.effort"
    told = fault["side"] == Side.ACTUATOR and effort in columns and About.EFFORT in fault.get("about", ())
    return effort if told else ""


def pair_of(fault: IntervalRow, columns: Collection[str], machine_words: MachineWords) -> Pair | None:
    """Channel of a fault and what it was compared with; None where the channel is not there.

    Parameters
    ----------
    fault : IntervalRow
        One of the report's intervals.
    columns : Collection[str]
        Names of the columns.
    machine_words : MachineWords
        How to speak of the machine.
    """
    component, kind = fault["component"], fault["kind"]
    bases = [f"evidence.{component}.{side}." for side in Side(fault["side"]).sides]
    base = next((b for b in bases if any(name.startswith(b) for name in columns)), bases[0])
    if by_valve(fault, columns):
        command = f"{kind}.{component}.u"
        reference = command if command in columns else None
        return Pair(
            machine_words.position.capitalize(),
            command + "_applied",
            reference,
            "command",
            reference is not None,
            *on_page(OPENING, machine_words),
            base,
        )
    if effort := by_effort(fault, columns):
        return Pair("Effort", effort, None, "", False, EFFORT_UNIT, 1.0, base)
    motion = motion_of(component, kind, columns, machine_words)
    if motion.measured not in columns:
        return None
    choices = [(base + "expected", "expected value"), (motion.commanded, "commanded")]
    if fault["tier"] == Tier.DIRECT:
        choices.insert(0, (motion.second, "second measurement"))
    reference, words = next(((name, words) for name, words in choices if name in columns), (None, ""))
    independent = reference == motion.second
    return Pair(motion.title, motion.measured, reference, words, independent, motion.unit, motion.scale, base)


def rests_on(fault: IntervalRow, columns: Iterable[str], words: MachineWords) -> str:
    """Kind of evidence of a fault, and the channels that its sentences name in their order."""
    text, columns = " ".join(fault["evidence"]), set(columns)
    places = {}
    for name in columns:
        if "." in name and not name.startswith(("evidence.", "replay.")) and (at := _place(name, text)) >= 0:
            places[name] = at
    channels = sorted(places, key=lambda n: places[n])
    own = by_position(fault)
    tier = JOINT if own else words.evidence(Tier(fault["tier"]), Kind(fault["kind"]), second_of(fault, columns))
    return f"{tier}: {', '.join(channels)}" if tier and channels else tier or ", ".join(channels)


def _place(name: str, text: str) -> int:
    """Where a channel's name stands in a text as a whole word; −1 where it does not."""
    at = text.find(name)
    while at >= 0:
        after = text[at + len(name) : at + len(name) + 2]
        if not (after[:1].isalnum() or after[:1] == "_" or (after[:1] == "." and after[1:].isalnum())):
            return at
        at = text.find(name, at + 1)
    return -1


def shape_sentence(fault: IntervalRow) -> str:
    """The evidence sentence that states what follows from the shape of the onset; empty where none does."""
    told = zip(fault["evidence"], fault.get("about", ()), strict=False)
    return next((text for text, about in told if about == About.ONSET), "")
