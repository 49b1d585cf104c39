"""What a mission is in an audit: the one place with the rule.

**Which files make one mission**, in one folder (`missions_in`):

1. a folder with a ``mission.toml`` is one mission: the files that it names, else the recording that the folder is, else all
   logs and recordings in it, and no folder below it is looked through;
2. a folder with a ``metadata.yaml`` is one recording (rosbag2), and one mission; so is one that lost it
   (`diagnosis.audit.discovery.bag_folders`);
3. numbered parts (``drive_0.mcap``, ``drive_1.mcap``, …) are one recording where each goes on where the one before ended;
4. tables (CSV, Parquet, …) are part of the mission of the recording with the same stem, where there is one such recording;
5. tables whose names differ in one word, which begin and end together and hold other columns, are one mission
   (`replay.signals.together`);
6. any other log is a mission by itself.

Results of audits and reports, and what is hidden, are no logs.

**Which machine file a mission has**, where the audit is given none for all: the one that its ``mission.toml`` names, else the
``machine.toml`` in its folder or the closest searched one around it.

**What ``mission.toml`` says** (`read_mission_file`): ``files`` of the mission, its ``name``, the ``machine_id``, and
``machine``, a machine file; all of them inside its folder, all of them optional. One that is wrong makes its folder a
mission with a problem, which is not diagnosed.

**What a mission is called** (`named_missions`): its path below what all searched folders share, without ending, or the
``name`` in its ``mission.toml``, made safe as the name of a folder. Missions that would be called the same have their ending
in the name, or a mark of their path.

Files are read in the order: message logs, then tables by name.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence

from diagnosis.audit.discovery.bag_folders import is_unlisted_bag, lost_metadata, unlisted_note
from diagnosis.audit.discovery.folder_contents import FolderContents, Unnamed
from diagnosis.audit.discovery.listing import Entry, Place
from diagnosis.audit.discovery.mission_file import MISSION_FILE, MissionFile, read_mission_file, stated_machine
from diagnosis.audit.discovery.numbered_parts import missing_parts, split_recordings
from replay.errors import ConfigError
from replay.log.file_types import TABLE_ENDINGS, split_ending
from replay.signals.together import tables_together

_METADATA = "metadata.yaml"
_STORE = "fleet.sqlite"
_AUDIT_FOLDERS = ("missions", "results")
_AUDIT_FILES = ("fleet.csv", "failures.txt")
_REPORT = {"report.json", "report.parquet"}
_REPORT_TABLES = ("report.parquet", "report.windows.parquet")
_CLIPS = "clips"
#: Files that may hold logs and cannot be read as they are.
_PACKED = (".zip", ".7z", ".rar", ".tar", ".tgz", ".tar.gz", ".tar.xz", ".tar.zst")
MACHINE_FILE = "machine.toml"


def missions_in(
    place: Place, folder: Entry, files: Sequence[Entry], folders: Sequence[Entry], output: str
) -> FolderContents:
    """Missions of one folder, by the rule of the module.

    Parameters
    ----------
    place : Place
        Where it is.
    folder : Entry
        The folder.
    files, folders : Sequence[Entry]
        What is in it.
    output : str
        Real path of the folder of the audit's own results; empty: none.

    Raises
    ------
    OSError
        Where it is a recording that cannot be read.
    """
    found, names = FolderContents(), {f.name: f for f in files}
    found.machine = names[MACHINE_FILE].path if MACHINE_FILE in names else None
    if MISSION_FILE in names:
        own = [child for child in folders if not child.link]
        found.missions.append(_stated(place, folder, names[MISSION_FILE], files, own, output, found))
        found.is_mission = True
    elif _METADATA in names or is_unlisted_bag(place, folder, files, folders):
        found.notes += [] if _METADATA in names else [unlisted_note(folder)]
        found.missions.append(Unnamed(place.parent(folder.real), folder.name, (place.whole(folder),)))
        found.is_mission = True
    else:
        recordings = []
        beside = any(not child.link and is_recording(place, child) for child in folders)
        for child in folders:
            if child.name.startswith(".") or _holds_results(folder, names, child, output):
                continue
            if child.link:
                found.links.append(child)
            elif _has(place, child, MISSION_FILE):
                found.below.append(child)
            elif is_recording(place, child):
                recordings += _whole(place, child, found)
            elif lost_metadata(place, child, beside=beside):
                found.notes.append(unlisted_note(child))
                recordings += _whole(place, child, found)
            else:
                found.below.append(child)
        logs = _logs(place, folder, files, output, found)
        found.notes += missing_parts(logs)
        found.missions += missions_of(place, folder.real, logs, recordings)
    return found


def missions_of(place: Place, folder: str, files: Sequence[Entry], recordings: Sequence[Entry] = ()) -> list[Unnamed]:
    """Missions of the logs of one folder: rules 3 to 6.

    Parameters
    ----------
    place : Place
        Where they are.
    folder : str
        Real path of the folder.
    files, recordings : Sequence[Entry]
        Log files, and folders that are one recording each.
    """
    recorded: list[tuple[str, tuple[Entry, ...]]] = [(one.name, (one,)) for one in recordings]
    recorded += split_recordings(place, [f for f in files if split_ending(f.name)[1] not in TABLE_ENDINGS])
    parts = {f.path for _, group in recorded for f in group}
    tables: dict[str, list[Entry]] = defaultdict(list)
    for file in files:
        stem, ending = split_ending(file.name)
        if ending in TABLE_ENDINGS:
            tables[stem].append(file)
        elif file.path not in parts:
            recorded.append((stem, (file,)))
    count = Counter(stem for stem, _ in recorded)
    out = []
    for stem, group in recorded:
        beside = tables.pop(stem, []) if count[stem] == 1 else []
        out.append(Unnamed(folder, stem, (*group, *beside)))
    return out + _of_tables(place, folder, [(stem, table) for stem, alone in tables.items() for table in alone])


def _of_tables(place: Place, folder: str, tables: Sequence[tuple[str, Entry]]) -> list[Unnamed]:
    """Missions of tables that are no part of a recording's: rules 5 and 6."""
    out = []
    for ending in dict.fromkeys(split_ending(table.name)[1] for _, table in tables):
        own = [one for one in tables if split_ending(one[1].name)[1] == ending]
        out += _of_one_ending(place, folder, own)
    return out


def _of_one_ending(place: Place, folder: str, tables: Sequence[tuple[str, Entry]]) -> list[Unnamed]:
    groups = tables_together([stem for stem, _ in tables], lambda k: place.extent(tables[k][1]))
    taken = {k for _, group in groups for k in group}
    out = [Unnamed(folder, shared, tuple(tables[k][1] for k in group)) for shared, group in groups]
    return out + [Unnamed(folder, stem, (table,)) for k, (stem, table) in enumerate(tables) if k not in taken]


def _stated(
    place: Place,
    folder: Entry,
    file: Entry,
    files: Sequence[Entry],
    folders: Sequence[Entry],
    output: str,
    found: FolderContents,
) -> Unnamed:
    """The mission that a ``mission.toml`` describes: rule 1."""
    stated, problem = MissionFile(), ""
    try:
        stated = read_mission_file(place, folder, file)
    except ConfigError as error:
        stated, problem = MissionFile(machine_id=stated_machine(place, file)), str(error)
    logs = list(stated.files)
    if not logs and is_recording(place, folder):
        logs = _whole(place, folder, found)
    elif not logs:
        recordings = [e for c in folders if is_recording(place, c) for e in _whole(place, c, found)]
        alone = _logs(place, folder, files, output, found)
        logs = [e for mission in missions_of(place, folder.real, alone, recordings) for e in mission.files]
    if not logs:
        problem = problem or f"{file.path}: there is no log beside it; name the mission's files in it"
    if problem:
        logs.append(file)
    return Unnamed(place.parent(folder.real), stated.name or folder.name, tuple(logs), stated, folder.name, problem)


def _whole(place: Place, folder: Entry, found: FolderContents) -> list[Entry]:
    """A recording's folder as one log, if all that is in it can be listed."""
    try:
        return [place.whole(folder)]
    except OSError as error:
        found.problems.append(f"{folder.path}: the recording cannot be listed ({error.strerror or error})")
        found.unread.append(folder.real)
        return []


def _logs(place: Place, folder: Entry, files: Sequence[Entry], output: str, found: FolderContents) -> list[Entry]:
    """Logs among the files of a folder; counts the others."""
    names = {f.name for f in files}
    own = _AUDIT_FILES if _STORE in names or folder.real == output else ()
    logs = []
    for file in files:
        result = file.name in own or (file.name in _REPORT_TABLES and names >= _REPORT)
        if not result and is_log(place, file):
            logs.append(file)
        else:
            found.left_aside += 1
            if file.name.lower().endswith(_PACKED):
                found.packed.append(file.path)
    return logs


def _holds_results(folder: Entry, names: Mapping[str, Entry], child: Entry, output: str) -> bool:
    """Whether a folder holds results: of this audit, of another one, or clips of a report."""
    if _STORE in names or folder.real == output:
        return child.name in _AUDIT_FOLDERS
    return child.real == output or (child.name == _CLIPS and names.keys() >= _REPORT)


def is_log(place: Place, file: Entry) -> bool:
    """Whether a file is a log, by its name and where that says little by its content."""
    ending = split_ending(file.name)[1]
    return bool(ending) and not file.name.startswith(".") and (ending != ".txt" or place.is_log(file))


def is_recording(place: Place, folder: Entry) -> bool:
    """Whether a folder is one recording."""
    return _has(place, folder, _METADATA)


def is_mission(place: Place, folder: Entry) -> bool:
    """Whether a folder is one mission: rules 1 and 2."""
    return is_recording(place, folder) or _has(place, folder, MISSION_FILE) or lost_metadata(place, folder)


def _has(place: Place, folder: Entry, name: str) -> bool:
    found = place.inside(folder, name)
    return found is not None and not place.is_folder(found)
