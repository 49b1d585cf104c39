"""The verdict on a machine as it goes into the document: status, words, and what keeps it in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.decision.short import ToClear
from diagnosis.results.assessed import Cut
from diagnosis.results.document import ActionRow, VerdictRow
from diagnosis.results.vocabulary import Verdict


@dataclass(frozen=True)
class Decision:
    """The verdict and what to do.

    Attributes
    ----------
    status : Verdict
        The verdict.
    title, text : str
        Heading and sentence.
    caveats : tuple[str, ...]
        Sentences on what limits it.
    actions : tuple[ActionRow, ...]
        One for each part with a fault, most urgent first.
    cleared : bool
        Whether the machine may go out: ``ready``, or faults to watch in a mission that is ``ready`` but for them.
    not_cleared : str
        Why ``watch`` gives no such leave, to follow *not cleared:*; empty otherwise.
    scope : tuple[Cut, ...]
        Why what was judged is not the whole mission.
    to_clear : tuple[ToClear, ...]
        What stands against ``ready`` beside the faults, and what would clear it.
    """

    status: Verdict
    title: str
    text: str
    caveats: tuple[str, ...] = ()
    actions: tuple[ActionRow, ...] = ()
    cleared: bool = False
    not_cleared: str = ""
    scope: tuple[Cut, ...] = ()
    to_clear: tuple[ToClear, ...] = ()

    def row(self, more_caveats: Sequence[str] = ()) -> VerdictRow:
        """The same for ``report.json``, with caveats that do not come from the judgement."""
        return {
            "status": self.status,
            "cleared": self.cleared,
            "not_cleared": self.not_cleared,
            "title": self.title,
            "text": self.text,
            "scope": [cut.text for cut in self.scope],
            "cuts": [cut.row() for cut in self.scope],
            "caveats": [*self.caveats, *more_caveats],
            "actions": list(self.actions),
            "to_clear": [x.row() for x in self.to_clear],
        }
