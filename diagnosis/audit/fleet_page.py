"""The fleet page as an audit keeps it: written while missions end and at the end, and the list of machines that it shows."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, cast

import orjson

from diagnosis.audit.events import Emit, EventFacts
from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.audit.fleet.listed import ListedMachine, listed_machines
from diagnosis.audit.fleet.read import content_mark
from diagnosis.audit.store.locks import exclusively
from diagnosis.audit.store.store import FILE_NAME
from replay.errors import OutputError
from replay.version import __version__

if TYPE_CHECKING:
    from diagnosis.audit.fleet.trend_types import Axis

PAGE_S = 60.0
_PAGE_SHARE = 20.0
_PAGE_TRIES = 3
_PAGE_NAME = "the fleet page"


class _PageState(TypedDict, total=False):
    """What says whether a `fleet.json` is up to date."""

    mark: str
    version: str
    axis: str
    baseline: object


@dataclass
class FleetPage:
    """The fleet page, written anew every now and then while missions end."""

    output: Path
    baseline: Path | None
    axis: Axis
    emit: Emit
    due: float = field(default_factory=lambda: time.monotonic() + PAGE_S)

    def emit_and_update(self, event: str, facts: EventFacts) -> None:
        """Pass an event on, and write the page when it is due."""
        self.emit(event, facts)
        if event == "tick" and time.monotonic() > self.due:
            self.update(always=True)

    def update(self, *, always: bool) -> None:
        """Write the page while missions are still to end: what goes wrong with it costs none, and shows again at the end."""
        try:
            self.write(always=always)
        except OutputError:
            raise
        except Exception as error:
            self.due = time.monotonic() + PAGE_S
            self.emit("page_failed", {"reason": f"{type(error).__name__}: {error}"})

    def write(self, *, always: bool) -> None:
        """Write the page, unless the one that is there is up to date."""
        from diagnosis.audit.fleet_files import write_fleet

        if not always and self._is_as_asked():
            return
        start = time.monotonic()
        with exclusively(self.output, _PAGE_NAME, PAGE_S):  # its three files belong together
            files = write_fleet(self.output / FILE_NAME, self.output, baseline=self.baseline, axis=self.axis)
        took = time.monotonic() - start
        self.due = time.monotonic() + max(PAGE_S, _PAGE_SHARE * took)
        self.emit("page", {"path": str(files.html), "wall_s": round(took, 3)})

    @contextmanager
    def written_on_failure(self) -> Iterator[None]:
        """Write the page also where the audit is interrupted, with what was found until then."""
        try:
            yield
        except BaseException:
            with suppress(Exception):
                self.finish()
            raise

    def renew(self) -> None:
        """Write the page with the trends that the one that is there has."""
        axis = self._state().get("axis")
        self.axis = "days" if axis == "days" else "hours"
        self.write(always=True)

    def finish(self) -> None:
        """Write the page until it shows what the store holds; another audit of this output may write both meanwhile."""
        for _ in range(_PAGE_TRIES):
            self.write(always=False)
            if self.is_current():
                return

    def is_current(self) -> bool:
        """Whether there is a page of what the store holds now."""
        return self._shows_the_store(self._state())

    def _is_as_asked(self) -> bool:
        """Whether the page is current, and as it is asked for."""
        state = self._state()
        as_asked = self.baseline is None and state.get("baseline") is None and state.get("axis") == self.axis
        return as_asked and self._shows_the_store(state)

    def _shows_the_store(self, state: _PageState) -> bool:
        page, mark = self.output / "fleet.html", content_mark(self.output / FILE_NAME)
        return (state.get("mark"), state.get("version")) == (mark, __version__) and page.is_file()

    def machines(self) -> tuple[ListedMachine, ...]:
        """The machines of the page that is there, in its order; none where it does not show what the store holds."""
        state = self._state()
        return listed_machines(cast(FleetDocument, state)) if self._shows_the_store(state) else ()

    def _state(self) -> _PageState:
        """State of the `fleet.json` that is there; empty where there is none."""
        try:
            document: object = orjson.loads((self.output / "fleet.json").read_bytes())
        except (OSError, ValueError):
            return {}
        return cast(_PageState, document) if isinstance(document, dict) else {}
