"""Reader of ``mission.toml``; what it means for a mission says `diagnosis.audit.discovery.missions`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from diagnosis.audit.discovery.listing import Entry, Place
from replay.errors import ConfigError
from replay.toml_text import MAX_BYTES, TomlError, parse_toml

MISSION_FILE = "mission.toml"
_KEYS = ("files", "machine_id", "machine", "name")
_LONGEST = 200

_MACHINE_ID = re.compile(r"""^[ \t]*machine_id[ \t]*=[ \t]*["']([^"'\\\n]+)["']""", re.MULTILINE)


@dataclass(frozen=True)
class MissionFile:
    """Contents of a ``mission.toml``; what it does not state is empty.

    Attributes
    ----------
    files : tuple[Entry, ...]
        Files and recordings of the mission, all in its folder.
    machine_id, name : str
        Of the machine, and of the mission.
    machine : str or None
        Path of the machine file.
    """

    files: tuple[Entry, ...] = ()
    machine_id: str = ""
    name: str = ""
    machine: str | None = None


def read_mission_file(place: Place, folder: Entry, file: Entry) -> MissionFile:
    """Read a folder's ``mission.toml``.

    Raises
    ------
    ConfigError
        Where it is no such file, has an unknown key, or names what is not in its folder.
    """
    if file.size > MAX_BYTES:
        raise ConfigError(f"{file.path}: has {file.size} bytes, at most {MAX_BYTES} expected")
    try:
        data = parse_toml(place.text(file))
    except OSError as error:
        raise ConfigError(f"{file.path}: cannot be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{file.path}: byte {error.start} is not UTF-8; expected TOML text in UTF-8") from error
    except TomlError as error:
        raise ConfigError(f"{file.path}: {error}") from error
    for key in data:
        if key not in _KEYS:
            raise ConfigError(f"{file.path}: {key[:80]!r} is not a key; expected {', '.join(_KEYS)}")
    names = data.get("files", [])
    if not isinstance(names, list) or not all(isinstance(n, str) and n for n in names):
        raise ConfigError(f"{file.path}: files must be a list of names")
    if "files" in data and not names:
        raise ConfigError(f"{file.path}: files is empty; name the mission's files, or leave the key out for all logs")
    machine = _text(file, data, "machine")
    return MissionFile(
        tuple(_inside(place, folder, file, "files", name) for name in names),
        _text(file, data, "machine_id"),
        _text(file, data, "name"),
        _inside(place, folder, file, "machine", machine).path if machine else None,
    )


def stated_machine(place: Place, file: Entry) -> str:
    """The machine that a ``mission.toml`` names which is wrong otherwise; empty where it names none."""
    try:
        text = place.text(file) if file.size <= MAX_BYTES else ""
    except (OSError, UnicodeDecodeError):
        return ""
    found = _MACHINE_ID.search(text)
    return found[1].strip()[:_LONGEST] if found else ""


def _text(file: Entry, data: dict[str, object], key: str) -> str:
    value = data.get(key, "")
    if not isinstance(value, str) or len(value) > _LONGEST or (key in data and not value.strip()):
        raise ConfigError(f"{file.path}: {key} must be a text of 1 to {_LONGEST} characters")
    return value.strip()


def _inside(place: Place, folder: Entry, file: Entry, key: str, name: str) -> Entry:
    found = place.inside(folder, name)
    if found is None:
        raise ConfigError(f"{file.path}: {key} names {name[:120]!r}, which is not in the folder; expected a name in it")
    try:
        return place.whole(found) if place.is_folder(found) else found
    except OSError as error:
        reason = error.strerror or error
        raise ConfigError(f"{file.path}: {key} names {name[:120]!r}, which cannot be read ({reason})") from error
