from __future__ import annotations

import bz2

import lz4.frame
import numpy as np
import pytest
import zstandard

from replay.readers.common.inflate import MAX_CHUNK, InflateError, Inflater

TEXT = bytes(range(256)) * 40
PACKED = {
    "lz4": lz4.frame.compress(TEXT), "zstd": zstandard.ZstdCompressor().compress(TEXT), "bz2": bz2.compress(TEXT),
    "none": TEXT, "": TEXT,
}  # fmt: skip


def expand(compression: str, data: bytes, size: int) -> bytes:
    return Inflater().expand(compression, np.frombuffer(data, np.uint8), size).tobytes()


@pytest.mark.parametrize("compression", PACKED)
def test_chunks_expand_to_what_was_packed(compression: str) -> None:
    assert expand(compression, PACKED[compression], len(TEXT)) == TEXT


@pytest.mark.parametrize("compression", PACKED)
@pytest.mark.parametrize("size", [0, 1, len(TEXT) - 1, len(TEXT) + 1])
def test_another_size_than_declared_is_refused(compression: str, size: int) -> None:
    with pytest.raises(InflateError, match="bytes"):
        expand(compression, PACKED[compression], size)


@pytest.mark.parametrize("compression", ["lz4", "zstd", "bz2"])
@pytest.mark.parametrize("data", [b"", b"\0" * 40, None], ids=["empty", "zeros", "cut"])
def test_damaged_bytes_are_refused(compression: str, data: bytes | None) -> None:
    with pytest.raises(InflateError):
        expand(compression, PACKED[compression][:-5] if data is None else data, len(TEXT))


def test_one_buffer_serves_chunks_of_all_sizes() -> None:
    inflater = Inflater()
    for n in (100, 5000, 7, 10_240):
        data = np.frombuffer(zstandard.ZstdCompressor().compress(TEXT[:n]), np.uint8)
        assert inflater.expand("zstd", data, n).tobytes() == TEXT[:n]


@pytest.mark.parametrize("size", [MAX_CHUNK + 1, 2**63, -1])
def test_absurd_sizes_are_refused_before_any_memory_is_taken(size: int) -> None:
    with pytest.raises(InflateError, match="declares"):
        expand("zstd", PACKED["zstd"], size)


def test_unknown_compressions_are_named() -> None:
    with pytest.raises(InflateError, match="'brotli' is not known"):
        expand("brotli", b"", 0)


def test_a_bomb_stops_at_the_declared_size() -> None:
    bomb = zstandard.ZstdCompressor().compress(bytes(64 << 20))
    with pytest.raises(InflateError, match="more than 1000 bytes"):
        expand("zstd", bomb, 1000)


@pytest.mark.parametrize(("log2", "fits"), [(27, True), (28, True), (29, False)])
def test_windows_are_limited(log2: int, fits: bool) -> None:
    parameters = zstandard.ZstdCompressionParameters(window_log=log2, enable_ldm=False)
    packer = zstandard.ZstdCompressor(compression_params=parameters).compressobj()
    data = packer.compress(TEXT) + packer.flush()
    if fits:
        assert expand("zstd", data, len(TEXT)) == TEXT
        with pytest.raises(InflateError, match="more than"):
            expand("zstd", data, len(TEXT) - 1)
    else:
        with pytest.raises(InflateError, match="damaged"):
            expand("zstd", data, len(TEXT))
