"""Which results are scored, and the truth of each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from diagnosis.api.inputs import mission_paths
from diagnosis.api.saved_results import saved_report
from replay.errors import ConfigError
from replay.log.file_types import LOG_ENDINGS


def results_and_truths(words: Sequence[Path], truth: Path | None) -> list[tuple[Path, Path]]:
    """Pair every result with its truth file.

    Parameters
    ----------
    words : Sequence[Path]
        Report folders, report.json files, logs, and folders of them; a truth file may follow the one result.
    truth : Path or None
        Truth of the one result, where it is named.

    Raises
    ------
    ConfigError
        Where a truth is missing, named for several results, or a result is given twice.
    LogError
        Where a result does not exist.
    """
    if truth is None and len(words) == 2 and is_truth(words[1]):
        words, truth = words[:1], words[1]
    elif truth is None and len(words) > 2 and (truths := [word for word in words if is_truth(word)]):
        raise ConfigError(_too_many([word for word in words if word not in truths], truths))
    results = [path for word in words for path in _missions_at(word)]
    if truth is not None and len(results) > 1:
        raise ConfigError(f"--truth {truth}: {len(results)} results are given; the option is for a single one")
    mission_paths(results)
    return [(path, truth or _truth_of(path)) for path in results]


def logs_and_their_reports(pairs: Sequence[tuple[Path, Path]]) -> list[tuple[Path, Path]]:
    """Each log with a report of the same truth that is given too: such a mission counts twice.

    Parameters
    ----------
    pairs : Sequence[tuple[Path, Path]]
        From `results_and_truths`.
    """
    logs = {truth.resolve(): path for path, truth in pairs if saved_report(path) is None}
    return [
        (logs[truth.resolve()], path)
        for path, truth in pairs
        if saved_report(path) is not None and truth.resolve() in logs
    ]


def _too_many(results: Sequence[Path], truths: Sequence[Path]) -> str:
    """What to say where truth files stand among several results."""
    logs = [path for path in results if saved_report(path) is None]
    if len(results) == 2 and len(logs) == 1 and len(truths) == 1:
        report = next(path for path in results if path not in logs)
        return (
            f"{logs[0]} and {report}: a log and a report are given with one truth; give the report to score it "
            f"(mfhca evaluate {report} {truths[0]}), or the log to diagnose it first (mfhca evaluate {logs[0]} {truths[0]})"
        )
    return (
        f"{truths[0]}: a truth may follow a single result, {len(results)} are given; leave it out where it lies beside its log, "
        "or score one result after the other"
    )


def is_truth(path: Path) -> bool:
    """Whether a word of the command line is a truth file."""
    if path.suffix.lower() != ".json" or not path.is_file():
        return False
    import orjson

    from replay.truth import SCHEMA

    try:
        document = orjson.loads(path.read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(document, dict) and document.get("schema") == SCHEMA


def _missions_at(path: Path) -> list[Path]:
    """The result itself, or the missions in a folder: its reports, else its logs that have a truth file beside them."""
    if not path.is_dir() or saved_report(path) or (path / "metadata.yaml").is_file() or _beside(path).is_file():
        return [path]
    children = sorted(path.iterdir())
    reports = [c for c in children if c.is_dir() and saved_report(c)]
    if reports:
        return reports
    logs = [c for c in children if c.name.lower().endswith(LOG_ENDINGS) or (c / "metadata.yaml").is_file()]
    return [log for log in logs if _beside(log).is_file()] or [path]


def _truth_of(path: Path) -> Path:
    """Truth file of a log: beside it; of a report: in the current folder, beside the report's folder, or in it.

    Raises
    ------
    ConfigError
        Where there is none.
    """
    saved = saved_report(path)
    if saved is None:
        places = [_beside(path)]
    else:
        from diagnosis.output import load_report

        names = [_beside(Path(str(f["path"]))).name for f in load_report(saved)["log"]["files"]]
        folder = saved.absolute().parent
        places = [near / name for name in names for near in (Path(), folder.parent, folder)]
    for place in places:
        if place.is_file():
            return place
    listed = ", ".join(str(p) for p in places)
    raise ConfigError(f"{path}: no truth file; looked for {listed}; name it with --truth")


def _beside(log: Path) -> Path:
    """The truth file that belongs beside a log."""
    from replay.truth import truth_path

    return truth_path(log.resolve() if log.name in ("", "..") else log, folder=log.is_dir())
