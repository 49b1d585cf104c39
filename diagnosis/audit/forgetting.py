"""Logs that were not judged and are no longer there: left out of an audit where a user says so, and never by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from diagnosis.audit.events import Emit
from diagnosis.audit.fleet.listed import ListedMachine
from diagnosis.audit.fleet_page import FleetPage
from diagnosis.audit.store.store import FILE_NAME, Store
from replay.errors import ConfigError, OutputError


def forget_missions(output: Path, names: Sequence[str], emit: Emit) -> tuple[ListedMachine, ...]:
    """Leave missions out of an audit, write its fleet page anew, and give the machines as they stand then.

    A log that cannot be read may be the one that shows a fault, so that its absence alone clears nothing.

    Parameters
    ----------
    output : Path
        Folder of an audit.
    names : Sequence[str]
        Missions as the fleet page calls them.
    emit : Emit
        Takes the events.

    Raises
    ------
    ConfigError
        Where a mission is not known, is still there, or was judged; nothing is left out then.
    OutputError
        Where there is no audit, or it cannot be written.
    """
    store_path = output / FILE_NAME
    if not store_path.is_file():
        raise OutputError(f"{store_path}: there is no store; run `mfhca audit` first, or give its folder with -o")
    with Store.open(store_path) as store:
        known = {m.name: m for m in store.missions()}
        for name in names:
            found = known.get(name)
            if found is None:
                raise ConfigError(f"--forget {name!r}: no such mission; give its name as the fleet page has it")
            if not found.gone:
                raise ConfigError(
                    f"--forget {name!r}: its log was there in the last audit; move it out of the logs, audit again, then forget it"
                )
            if found.result is not None and found.result.verdict is not None:
                raise ConfigError(f"--forget {name!r}: it was judged, and what was found in it stays")
        store.forget(names)
    page = FleetPage(output, None, "hours", emit)
    page.renew()
    return page.machines()
