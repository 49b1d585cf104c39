"""A file that was left out of a mission: a sentence of its damage that is none, for the file was read whole."""

from __future__ import annotations


class FileLeftOut(str):
    """Why a whole file is not used, as text that stands among what a log lost.

    Attributes
    ----------
    clock : bool
        Whether the reason is that its clock could not be compared with the others'.
    """

    __slots__ = ("clock",)
    clock: bool

    def __new__(cls, text: str, clock: bool = False) -> FileLeftOut:
        """Text, and whether the clock is the reason."""
        made = super().__new__(cls, text)
        made.clock = clock
        return made

    def __getnewargs__(self) -> tuple[str, bool]:  # type: ignore[override]
        """What a copy is made of."""
        return (str(self), self.clock)
