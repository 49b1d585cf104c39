"""What makes two audits of a mission the same: the content of its logs, the configuration, and the tool's version."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from diagnosis.audit.discovery.mission_source import MissionSource
    from diagnosis.audit.store.records import KeyRecord
    from replay.machine.config import Machine

_SHORT = 8


@dataclass(frozen=True)
class Key:
    """Identity of a result: the same key gives the same report.

    Attributes
    ----------
    log_hash : str
        From `log_hash`, or `unhashed_log` where the files cannot be read.
    config_hash : str
        From `config_hash`.
    version : str
        Version of the tool.
    """

    log_hash: str
    config_hash: str
    version: str

    @property
    def record(self) -> KeyRecord:
        """The key as JSON."""
        return {"log_hash": self.log_hash, "config_hash": self.config_hash, "version": self.version}

    @property
    def stem(self) -> str:
        """Beginning of the names of this key's result objects."""
        return f"{self.log_hash[:_SHORT]}-{self.config_hash[:_SHORT]}-{self.version}"


def log_hash(hashes: Sequence[str], roles: Sequence[str] = ()) -> str:
    """Hash of a mission's content.

    Parameters
    ----------
    hashes : Sequence[str]
        SHA-256 of each file or folder (`replay.log.content_hash.content_hash`), in the mission's order: the first gives the clock.
    roles : Sequence[str]
        From `file_roles`; empty: no file's name matters.
    """
    return _sha256({"files": [[h, r] for h, r in zip(hashes, roles or [""] * len(hashes), strict=True)]})


def unhashed_log(mission: MissionSource) -> str:
    """Stand-in for the content of files that cannot be read: their names, sizes and stamps."""
    return _sha256({"unread": list(mission.files), "sizes": list(mission.sizes), "stamps": list(mission.stamps)})


def file_roles(names: Sequence[str], machine: Machine) -> tuple[str, ...]:
    """What the machine file tells a mission's files apart by: the patterns that their names match, one in a line.

    A copy under another name that matches the same ones is the same log.

    Parameters
    ----------
    names : Sequence[str]
        Names of the files without folders.
    machine : Machine
        Its [sources] name patterns, and its [signals] may name a source.
    """
    patterns = dict.fromkeys([*machine.sources, *(s.source for s in machine.signals.values() if s.source is not None)])
    by_path = any("/" in pattern for pattern in patterns)  # which a name alone does not tell
    return tuple(name if by_path else "\n".join(p for p in patterns if fnmatch(name, p)) for name in names)


def config_hash(machine_document: bytes | Mapping[str, object], options: Mapping[str, object], machine_id: str) -> str:
    """Hash of everything but the log that a result depends on.

    Parameters
    ----------
    machine_document : bytes or Mapping
        The machine in canonical form: `replay.machine.toml_file.dump_machine` of the loaded machine, so that comments and
        the order of keys do not count.
    options : Mapping[str, object]
        Options that change the result, as JSON values.
    machine_id : str
        Identity given by hand, in ``mission.toml`` or by the folder (`diagnosis.audit.discovery.identity.stated_id`).
    """
    document = machine_document.decode() if isinstance(machine_document, bytes) else dict(machine_document)
    return _sha256({"machine": document, "options": dict(options), "machine_id": machine_id})


def _sha256(value: object) -> str:
    return hashlib.sha256(
        json.dumps(value, sort_keys=True).encode("ascii")
    ).hexdigest()  # also of undecodable file names
