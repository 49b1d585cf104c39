"""The quick index of MCAP files: equal to the reader's summary, or none."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from replay.inspection.mcap_index import mcap_index
from replay.log.source_options import SourceOptions
from replay.readers.mcap.reader import McapReader


def write(path: Path, **options: object) -> Path:
    """Two topics, one of them in an encoding that is not decoded, an attachment and metadata."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=500, **options)  # type: ignore[arg-type]
        writer.start(profile="p", library="tests")
        json = writer.register_channel("/json", "json", writer.register_schema("V", "jsonschema", b"{}"))
        cbor = writer.register_channel("/cbor", "cbor", 0)
        for i in range(101):
            writer.add_message(json, 1_000_000_000 + i * 10_000_000, b'{"v": %d}' % i, 0)
        writer.add_message(cbor, 1_500_000_000, b"?", 0)
        writer.add_attachment(0, 0, "notes.txt", "text/plain", b"all well")
        writer.add_metadata("machine", {"id": "h-7"})
        writer.finish()
    return path


@pytest.mark.parametrize("start", [1 << 40, 1 << 63, (1 << 64) - 1])
def test_metadata_that_lie_beyond_the_file_are_not_looked_for(tmp_path: Path, start: int) -> None:
    path = write(tmp_path / "a.mcap", enable_crcs=False)
    raw = path.read_bytes()
    at = (
        raw.rindex(b"machine") - 20
    )  # the index of metadata ends with start, length, and the name behind its own length
    path.write_bytes(raw[:at] + start.to_bytes(8, "little") + raw[at + 8 :])
    assert mcap_index(path, "header") is None


@pytest.mark.parametrize("compression", list(CompressionType))
def test_the_index_agrees_with_the_reader(tmp_path: Path, compression: CompressionType) -> None:
    path = write(tmp_path / "a.mcap", compression=compression)
    index = mcap_index(path, "header")
    assert index is not None
    summary = McapReader().summarise(path, SourceOptions())
    assert [(t.name, t.type_name, t.count, t.encoding, t.note) for t in index.topics] == [
        (t.name, t.type_name, t.count, t.encoding, t.note) for t in summary.topics
    ]
    assert (index.start_ns, index.stop_ns) == (summary.start_ns, summary.stop_ns)
    assert index.topics[0].rate_hz == pytest.approx(100.0)
    assert index.attachments == ({"name": "notes.txt", "media_type": "text/plain", "size": 8},)
    assert index.metadata["machine.id"] == "h-7"
    assert index.metadata["library"].startswith("tests")
    assert index.container["compression"] == (compression.name.lower() if compression.value else "none")
    assert isinstance(index.container["chunks"], int)
    assert index.container["chunks"] > 5


def test_a_file_without_checksums_says_so(tmp_path: Path) -> None:
    index = mcap_index(write(tmp_path / "a.mcap", enable_crcs=False), "log")
    assert index is not None
    assert index.integrity == "not every part has a checksum; damage there cannot be detected"


@pytest.mark.parametrize("options", [{"index_types": 0}, {"use_statistics": False}])
def test_no_index_or_no_statistics_give_none(tmp_path: Path, options: dict[str, object]) -> None:
    from mcap.writer import IndexType

    chosen = {"index_types": IndexType.NONE} if "index_types" in options else options
    assert mcap_index(write(tmp_path / "a.mcap", **chosen), "log") is None


@given(st.data())
def test_damage_in_the_index_gives_none(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.mcap"
    raw = bytearray(write(path).read_bytes())
    whole = mcap_index(path, "log")
    assert whole is not None
    summary = int.from_bytes(raw[-28:-20], "little")
    at = data.draw(st.integers(summary, len(raw) - 1))
    raw[at] ^= 1 << data.draw(st.integers(0, 7))
    path.write_bytes(raw[: data.draw(st.sampled_from([len(raw), at]))])
    assert mcap_index(path, "log") is None


def test_the_quick_look_loads_no_numerical_library(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap")
    code = (
        "import sys; from cli.main import run; run(['inspect', sys.argv[1]]); "
        "sys.exit(any(m in sys.modules for m in ('numpy', 'numba', 'pandas', 'pyarrow', 'rosbags')))"
    )
    assert (
        subprocess.run([sys.executable, "-c", code, str(path)], check=False, stdout=subprocess.DEVNULL).returncode == 0
    )
