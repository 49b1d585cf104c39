"""Write a result: `report.html`, `report.json` and `report.parquet`, from which the page can be made again."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from diagnosis.own_files import check_replaced
from diagnosis.report.page import build_page
from diagnosis.report.plot_data import axis_of
from diagnosis.results.document import ReportDocument
from diagnosis.results.json_text import writable
from diagnosis.results.restored import KEY, Layout, restored, sources_of
from diagnosis.results.result import Closeups, MissionResult
from diagnosis.results.stored import grid_of, grids_of, stored
from diagnosis.results.validation import report_of
from replay.arrays.processors import each
from replay.atomic_write import atomic_path, atomic_paths, made_folder
from replay.border import bordered
from replay.errors import LogError, OutputError

HTML, JSON, PARQUET, WINDOWS = "report.html", "report.json", "report.parquet", "report.windows.parquet"
_AGAIN = "run `mfhca diagnose` on the log again"


def write_result(result: MissionResult, folder: Path, *, max_size_mb: float = 8.0) -> tuple[Path, ...]:
    """Write the files of a result: all of them, or on a full disk none.

    Parameters
    ----------
    result : MissionResult
        From `diagnosis.pipeline.diagnose`.
    folder : Path
        Where to; made if absent.
    max_size_mb : float
        Size the page should keep to [MB].

    Returns
    -------
    tuple[Path, ...]
        ``report.html``, ``report.json``, ``report.parquet``, and of long missions with faults
        ``report.windows.parquet``: every sample around the worst of them, at the steps of its column ``step``.

    Raises
    ------
    OutputError
        Where the folder cannot be written.
    ConfigError
        Where a file of the result's name is there that this tool did not write.
    """
    check_replaced(folder)
    lsb = {s["name"]: s["lsb"] for s in result.report["signals"] if s["lsb"]}
    before = result.layout
    steps = {**grids_of(result.columns, lsb), **(before.steps if before else {})}
    columns, layout = _kept(result.columns, steps, before.made_of if before else None)
    windows, near_layout = result.windows, Layout([])
    if windows is not None:
        near, near_layout = _kept(windows.columns, {k: grid_of(k, v) for k, v in windows.columns.items()} | steps)
        windows = Closeups(windows.step, near)
    paths = tuple(folder / name for name in (HTML, JSON, PARQUET, *([] if windows is None else [WINDOWS])))
    report: ReportDocument = writable(result.report)
    with _made(folder), atomic_paths(*paths) as (html, document, table, *more):

        def tables() -> None:
            _write_table(columns, table, layout)
            for path in more:
                _write_table({"step": windows.step, **windows.columns} if windows else {}, path, near_layout)

        def texts() -> None:
            document.write_bytes(_json(report))
            _write_text(build_page(report, columns, closeups=windows, max_size_mb=max_size_mb), html)

        each(lambda write: write(), (tables, texts), rows=len(columns["t"]) if "t" in columns else 0)
    if windows is None:
        (folder / WINDOWS).unlink(missing_ok=True)
    return paths


@contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make the folder; where nothing can be written into it, nothing of it is left."""
    with ExitStack() as stack:
        try:
            stack.enter_context(made_folder(folder))
        except OSError as error:
            raise OutputError(
                f"{folder}: cannot make the folder ({error.strerror or error}); give another with -o"
            ) from error
        yield


def _kept(
    exact: Mapping[str, NDArray[Any]], grids: Mapping[str, float], among: Collection[str] | None = None
) -> tuple[dict[str, NDArray[Any]], Layout]:
    """Columns as a reader of the file gets them, and which of them the file makes of others."""
    near = each(
        lambda k: exact[k] if k == "t" else stored(k, exact[k], grids[k]), exact, len(next(iter(exact.values()), ()))
    )
    kept = dict(zip(exact, near, strict=True))
    made_of = sources_of(exact, kept, grids, among)
    layout = Layout(list(kept), made_of, {k: grids[k] for k in kept})
    return restored({k: v for k, v in kept.items() if k not in made_of}, layout), layout


def _write_table(columns: Mapping[str, NDArray[Any]], path: Path, layout: Layout) -> None:
    """Write columns without a copy (and without pandas, which pyarrow would load for its own conversion)."""
    own = {k: v for k, v in columns.items() if k not in layout.made_of}
    arrays = [
        pa.Array.from_buffers(pa.from_numpy_dtype(v.dtype), len(v), [None, pa.py_buffer(np.ascontiguousarray(v))])
        for v in own.values()
    ]
    fields = [pa.field(name, a.type, nullable=False) for name, a in zip(own, arrays, strict=True)]
    table = pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=layout.metadata()))
    with path.open("wb") as file:  # pyarrow opens no name that is not UTF-8
        pq.write_table(
            table,
            file,
            compression="zstd",
            compression_level=2,
            use_dictionary=False,
            use_byte_stream_split=True,
            write_statistics=False,  # extremes of whole columns: a fifth of the time, and no use to a reader
        )


def _read_table(path: Path) -> tuple[dict[str, NDArray[Any]], Layout]:
    """Columns of a file, and how they stand in it."""
    try:
        with path.open("rb") as file:
            table = pq.read_table(file)
        columns = {name: table.column(name).to_numpy() for name in table.column_names}
        layout = Layout.stated((table.schema.metadata or {}).get(KEY), list(columns))
    except (OSError, pa.ArrowException, ValueError, KeyError, TypeError, OverflowError) as error:
        said = " ".join(str(error).split())[:200]
        raise LogError(f"{path}: cannot be read ({said}); {_AGAIN}") from error
    if (wrong := next((name for name, values in columns.items() if values.dtype.kind not in "fiu"), None)) is not None:
        raise LogError(f"{path}: column {wrong[:80]!r} holds no numbers; {_AGAIN}")
    kept = (np.float32, np.float64)  # what this tool writes; whole numbers and halves that another wrote become floats
    numbers = {k: v if k == "step" or v.dtype in kept else v.astype(np.float64) for k, v in columns.items()}
    return restored(numbers, layout), layout


def _read_columns(path: Path, rate: float) -> tuple[dict[str, NDArray[Any]], Layout]:
    """Time series of a result, on one uniform axis, and how they stand in the file."""
    columns, layout = _read_table(path)
    try:
        axis_of(columns, rate)
    except ValueError as error:
        raise LogError(f"{path}: {error}; {_AGAIN}") from error
    return columns, layout


def _read_windows(path: Path) -> Closeups | None:
    if not path.exists():
        return None
    columns, _ = _read_table(path)
    step = columns.pop("step", None)
    if step is None or step.dtype.kind != "i" or (np.diff(step) < 1).any():
        raise LogError(f"{path}: column 'step' is missing or does not increase; {_AGAIN}")
    return Closeups(step, columns)


def rebuild(
    path: Path,
    *,
    max_size_mb: float = 8.0,
    previous: tuple[Path, ReportDocument] | None = None,
    change: Callable[[ReportDocument], ReportDocument] | None = None,
) -> Path:
    """Make ``report.html`` again from a saved result, without the log.

    Parameters
    ----------
    path : Path
        A result's folder or its ``report.json``.
    max_size_mb : float
        Size the page should keep to [MB].
    previous : tuple[Path, ReportDocument] or None
        Name and document of an earlier result of the machine to compare with; kept in ``report.json``.
    change : Callable or None
        Gives the document as it is to be kept in ``report.json`` and shown.

    Raises
    ------
    LogError
        Where the saved result is missing or not one of this tool.
    ConfigError
        Where `previous` is of another machine.
    """
    folder = path if path.is_dir() else path.parent
    source = folder / JSON if path.is_dir() else path
    saved = load_result(source)
    report, columns, windows = saved.report, saved.columns, saved.windows
    if previous is not None:
        from diagnosis.comparison.previous import with_previous

        report = with_previous(report, previous[1], str(previous[0]))
    if change is not None:
        report = change(report)
    changed = report is not saved.report
    kept: ReportDocument = writable(report) if changed else report
    with bordered(folder, "a saved result", remedy=_AGAIN):
        page = build_page(kept, columns, closeups=windows, max_size_mb=max_size_mb)
    if not changed:
        with atomic_path(folder / HTML) as html:
            _write_text(page, html)
    else:
        with atomic_paths(folder / HTML, source) as (html, document):
            document.write_bytes(_json(kept))
            _write_text(page, html)
    return folder / HTML


def load_result(path: Path) -> MissionResult:
    """Read a saved result: a ``report.json`` and the time series beside it.

    Raises
    ------
    LogError
        Where one of its files is missing, damaged, or not of this tool.
    """
    report = load_report(path)
    columns, layout = _read_columns(path.with_name(PARQUET), report["log"]["rate_hz"])
    return MissionResult(report, columns, _read_windows(path.with_name(WINDOWS)), layout if layout.steps else None)


def load_report(path: Path) -> ReportDocument:
    """Read a ``report.json``.

    Raises
    ------
    LogError
        Where it is missing, not one of this tool, or not a whole one.
    """
    try:
        document = orjson.loads(path.read_bytes())
    except OSError as error:
        raise LogError(f"{path}: cannot be read ({error.strerror or error})") from error
    except orjson.JSONDecodeError as error:
        raise LogError(f"{path}: not JSON ({error}); expected a report.json of `mfhca diagnose`") from error
    return report_of(document, str(path))


def _json(report: ReportDocument) -> bytes:
    return orjson.dumps(report, option=orjson.OPT_INDENT_2)


def _write_text(page: str, path: Path) -> None:
    path.write_text(page, encoding="utf-8", newline="\n")
