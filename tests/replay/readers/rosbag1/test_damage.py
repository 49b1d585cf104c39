"""ROS 1 bags built byte by byte: every intact message comes back, and what is lost is told."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from rosbags.rosbag1 import Reader

from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log
from replay.readers.rosbag1.records_kernel import MAX_FIELDS, scan_bag

OPTIONS = SourceOptions()
T0 = 1_700_000_000
PER_CHUNK, CHUNKS = 10, 6
DIGEST = b"fdb28210bfa9d7c91146260178d9a584"
PACK: dict[str, Callable[[bytes], bytes]] = {"none": bytes, "lz4": lz4.frame.compress, "bz2": bz2.compress}


def record(data: bytes, **fields: bytes) -> bytes:
    head = b"".join(struct.pack("<I", len(n) + 1 + len(v)) + n.encode() + b"=" + v for n, v in fields.items())
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def stamp(i: int) -> bytes:
    return struct.pack("<II", T0 + i, 0)


def message(i: int, connection: int = 0) -> bytes:
    return record(struct.pack("<d", i), op=b"\x02", conn=struct.pack("<I", connection), time=stamp(i))


def connection(number: int = 0, topic: bytes = b"/speed", text: bytes = b"float64 data") -> bytes:
    inner = record(
        b"", topic=topic, type=b"std_msgs/Float64", md5sum=DIGEST, message_definition=text, latching=b"0"
    )[4:-4]  # fmt: skip
    return record(inner, op=b"\x07", conn=struct.pack("<I", number), topic=topic)


class Bag:
    """A bag of /speed, counting up at 1 Hz, that a test takes apart before it is written."""

    def __init__(self, compression: str = "none") -> None:
        self.pack, self.compression = PACK[compression], compression.encode()
        self.chunks = [[message(i + PER_CHUNK * k) for i in range(PER_CHUNK)] for k in range(CHUNKS)]
        self.chunks[0].insert(0, connection())
        self.index = [connection()]
        self.extra = b""
        self.closed, self.starts = True, list[int]()

    def chunk(self, content: bytes) -> bytes:
        size = struct.pack("<I", len(content))
        return record(self.pack(content), op=b"\x05", compression=self.compression, size=size)

    def header(self, index: int, fields: dict[str, bytes]) -> bytes:
        counts = {
            "index_pos": struct.pack("<Q", index if self.closed else 0),
            "conn_count": struct.pack("<I", len(self.index)),
            "chunk_count": struct.pack("<I", len(self.chunks) if self.closed else 0),
        }
        bare = record(b"", op=b"\x03", **counts, **fields)
        return b"#ROSBAG V2.0\n" + bare[:-4] + struct.pack("<I", 4096 - len(bare)) + b" " * (4096 - len(bare))

    def bytes(self, **fields: bytes) -> bytes:
        body, infos = b"", b""
        for k, parts in enumerate(self.chunks):
            self.starts.append(4109 + len(body))
            times, at = b"", 0
            for part in parts:
                if b"op=\x02" in part:
                    times += stamp(k * PER_CHUNK + len(times) // 12) + struct.pack("<I", at)
                at += len(part)
            counts = struct.pack("<II", 0, len(times) // 12)
            infos += record(
                counts, op=b"\x06", ver=struct.pack("<I", 1), chunk_pos=struct.pack("<Q", self.starts[-1]),
                start_time=stamp(k * PER_CHUNK), end_time=stamp(k * PER_CHUNK + PER_CHUNK - 1),
                count=struct.pack("<I", 1),
            )  # fmt: skip
            body += self.chunk(b"".join(parts))
            body += record(times, op=b"\x04", ver=struct.pack("<I", 1), conn=bytes(4), count=counts[4:])
        body += self.extra
        end = b"".join(self.index) + infos if self.closed else b""
        return self.header(4109 + len(body), fields) + body + end


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., RawLog]:
    def read_bytes(raw: bytes, **options: object) -> RawLog:
        path = tmp_path / "log.bag"
        path.write_bytes(raw)
        summarise_log(path, OPTIONS)
        return read_log(path, OPTIONS, **options)  # type: ignore[arg-type]

    return read_bytes


Read = Callable[..., RawLog]
EVERY = np.arange(float(PER_CHUNK * CHUNKS))


def speed(log: RawLog) -> np.ndarray:
    return np.asarray(log.channels["/speed.data"].values) if "/speed.data" in log.channels else np.empty(0)


def told(log: RawLog, text: str) -> bool:
    return any(text in d for d in log.summary.damage)


@pytest.mark.parametrize("compression", PACK)
@pytest.mark.parametrize("closed", [True, False])
def test_whole_bags(read: Read, compression: str, closed: bool) -> None:
    bag = Bag(compression)
    bag.closed = closed
    log = read(bag.bytes())
    np.testing.assert_array_equal(speed(log), EVERY)
    assert log.summary.topics[0].count == len(EVERY)
    assert (log.summary.start_ns, log.summary.stop_ns) == (T0 * 10**9, (T0 + len(EVERY) - 1) * 10**9)
    assert (log.summary.damage == ()) == closed
    assert closed or told(log, "it has no index")


@pytest.mark.parametrize("compression", PACK)
def test_a_window_opens_its_chunks_alone(read: Read, compression: str) -> None:
    bag = Bag(compression)
    raw = bytearray(bag.bytes())
    for k in (0, 1, 4, 5):  # chunks outside the window are unreadable, and nobody notices
        raw[bag.starts[k] + 80 : bag.starts[k] + 110] = bytes(30)
    log = read(bytes(raw), window=((T0 + 23) * 10**9, (T0 + 37) * 10**9))
    np.testing.assert_array_equal(speed(log), EVERY[23:37])
    assert log.summary.damage == ()
    assert log.summary.topics[0].count == len(EVERY)
    with_topics = read(bytes(raw), topics=["/other"], window=(0, 2**62))
    assert with_topics.channels == {}


@pytest.mark.parametrize("compression", PACK)
@pytest.mark.parametrize("share", np.linspace(0.2, 0.99, 12))
def test_a_cut_bag_gives_all_complete_chunks(read: Read, compression: str, share: float) -> None:
    bag = Bag(compression)
    raw = bag.bytes()
    cut = 4200 + int(share * (len(raw) - 4200))
    log = read(raw[:cut])
    complete = sum(start < cut for start in bag.starts[1:]) * PER_CHUNK
    np.testing.assert_array_equal(speed(log), EVERY[: len(speed(log))])
    assert len(speed(log)) >= complete
    assert log.summary.damage


def test_a_cut_uncompressed_chunk_gives_its_messages(read: Read) -> None:
    bag = Bag()
    raw = bag.bytes()
    log = read(raw[: bag.starts[-1] + 60 + 5 * len(message(0)) + 10])
    assert len(speed(log)) == len(EVERY) - 5
    assert told(log, "reaches beyond the end of the file")


@pytest.mark.parametrize("count", [1, 7, 300])
def test_garbage_between_chunks_is_passed_over(read: Read, count: int) -> None:
    bag = Bag("lz4")
    raw = bag.bytes()
    rng = np.random.default_rng(count)
    log = read(raw[: bag.starts[3]] + rng.bytes(count) + raw[bag.starts[3] :])
    np.testing.assert_array_equal(speed(log), EVERY)
    assert told(log, "hold no complete record")


def test_garbage_inside_a_chunk_costs_the_messages_it_covers(read: Read) -> None:
    bag = Bag()
    raw = bytearray(bag.bytes())
    at = raw.index(message(33))
    raw[at + 5 : at + len(message(33)) + 5] = b"\xff" * len(message(33))
    log = read(bytes(raw))
    np.testing.assert_array_equal(speed(log), np.delete(EVERY, (33, 34)))
    assert told(log, "/speed: 2 of 60 messages that the index counts were not found")


@pytest.mark.parametrize("size", [0, 3, 1000, 2**31, 2**32 - 1])
def test_a_message_with_a_damaged_length_ends_where_the_next_starts(read: Read, size: int) -> None:
    bag = Bag()
    raw = bytearray(bag.bytes())
    at = raw.index(message(33)) + len(message(33)) - 12
    raw[at : at + 4] = struct.pack("<I", size)
    found = speed(read(bytes(raw)))
    assert set(found) >= set(np.delete(EVERY, 33))
    assert size < 8 or 33.0 in found


@pytest.mark.parametrize("compression", PACK)
@pytest.mark.parametrize("size", [0, 50, 2**20, 2**32 - 1])
def test_a_chunk_with_a_damaged_length_is_read(read: Read, compression: str, size: int) -> None:
    bag = Bag(compression)
    raw = bytearray(bag.bytes())
    at = bag.starts[2]
    body = at + 4 + struct.unpack_from("<I", raw, at)[0]
    raw[body : body + 4] = struct.pack("<I", size)
    log = read(bytes(raw))
    np.testing.assert_array_equal(np.sort(speed(log)), EVERY)
    assert log.summary.damage


@pytest.mark.parametrize("name", [b"size=", b"compression=", b"op=\x05"])
def test_a_chunk_with_a_damaged_header_is_read(read: Read, name: bytes) -> None:
    bag = Bag()
    raw = bytearray(bag.bytes())
    at = raw.index(name, bag.starts[2])
    raw[at] ^= 1
    log = read(bytes(raw))
    np.testing.assert_array_equal(np.sort(speed(log)), EVERY)
    assert log.summary.damage


@pytest.mark.parametrize("compression", ["lz4", "bz2"])
def test_a_damaged_compressed_chunk_is_left_out_and_counted(read: Read, compression: str) -> None:
    bag = Bag(compression)
    raw = bytearray(bag.bytes())
    raw[bag.starts[3] - 200 : bag.starts[3] - 160] = b"\xaa" * 40
    log = read(bytes(raw))
    np.testing.assert_array_equal(speed(log), np.delete(EVERY, slice(20, 30)))
    assert told(log, "/speed: 10 of 60 messages that the index counts were not found")


@pytest.mark.parametrize("where", ["index", "header", "first line"])
def test_a_damaged_index_costs_nothing_else(read: Read, where: str) -> None:
    bag = Bag("lz4")
    raw = bytearray(bag.bytes())
    places = {"index": len(raw) - 90, "header": 14, "first line": 0}
    raw[places[where] : places[where] + 12] = b"\xee" * 12
    log = read(bytes(raw))
    np.testing.assert_array_equal(speed(log), EVERY)
    assert log.summary.damage


def test_the_copy_of_a_connection_that_its_checksum_confirms_counts(read: Read) -> None:
    bag = Bag()
    bag.chunks[0][0] = connection(text=b"float32 data")
    log = read(bag.bytes())
    np.testing.assert_array_equal(speed(log), EVERY)
    assert told(log, "two records of connection 0 ('/speed') differ")


def test_a_connection_that_is_not_named_is_counted(read: Read) -> None:
    bag = Bag()
    bag.chunks[1][3:5] = [message(13, 7), message(14, 7)]
    log = read(bag.bytes())
    np.testing.assert_array_equal(speed(log), np.delete(EVERY, (13, 14)))
    assert told(log, "2 messages belong to connection 7, which is not named")


def test_connections_written_again_and_again_count_once(read: Read) -> None:
    bag = Bag()
    bag.chunks = [[connection(), *parts] for parts in bag.chunks]
    log = read(bag.bytes())
    np.testing.assert_array_equal(speed(log), EVERY)
    assert log.summary.damage == ()


def test_two_connections_of_one_topic_are_one_topic(read: Read) -> None:
    bag = Bag()
    bag.index.append(connection(1))
    bag.chunks[2][4] = message(24, 1)
    log = read(bag.bytes())
    np.testing.assert_array_equal(speed(log), EVERY)
    assert [(t.name, t.count) for t in log.summary.topics] == [("/speed", 60)]


def test_a_chunk_that_the_index_alone_knows_is_told(read: Read) -> None:
    bag = Bag("lz4")
    raw = bag.bytes()
    changed = bytearray(raw)
    changed[bag.starts[3] : bag.starts[4]] = bytes(bag.starts[4] - bag.starts[3])
    log = read(bytes(changed))
    np.testing.assert_array_equal(speed(log), np.delete(EVERY, slice(30, 40)))
    assert told(log, f"there is no chunk at byte {bag.starts[3]}")
    assert told(log, "/speed: 10 of 60 messages that the index counts were not found")


@pytest.mark.parametrize("content", [b"", bytes(1 << 20), bytes(range(256)) * 4096])
def test_a_bag_without_any_record_is_refused(read: Read, content: bytes) -> None:
    with pytest.raises(LogError, match="holds nothing that can be read"):
        read(b"#ROSBAG V2.0\n" + content)


def test_encrypted_bags_are_refused(read: Read) -> None:
    with pytest.raises(LogError, match=r"is encrypted \('rosbag/AesCbcEncryptor'\); decrypt it"):
        read(Bag().bytes(encryptor=b"rosbag/AesCbcEncryptor"))


def test_a_chunk_that_declares_too_much_is_not_expanded(read: Read) -> None:
    bag = Bag("lz4")
    bag.chunks[2] = [bytes(100 << 20)]
    raw = bag.bytes().replace(b"size=" + struct.pack("<I", 100 << 20), b"size=" + b"\xff" * 4)
    log = read(raw)
    np.testing.assert_array_equal(speed(log), np.delete(EVERY, slice(20, 30)))
    assert told(log, "was left out")


def test_every_byte_of_a_walk_is_accounted_for() -> None:
    rng = np.random.default_rng(4)
    raw = b"".join(message(i) + (rng.bytes(30) if i % 9 == 5 else b"") for i in range(100))
    records = scan_bag(np.frombuffer(raw, np.uint8))
    assert len(records.op) == 100
    assert int((4 + records.body - records.head + records.size).sum()) + records.lost == len(raw)


def mutated(raw: bytes, i: int) -> bytes:
    """Cut, flip a bit, overwrite, insert or remove bytes at a place that the seed gives."""
    rng = np.random.default_rng(i)
    place, width = int(rng.integers(13, len(raw))), int(rng.integers(1, 80))
    if i % 5 == 0:
        return raw[:place]
    if i % 5 == 1:
        return raw[:place] + bytes([raw[place] ^ 1 << int(rng.integers(0, 8))]) + raw[place + 1 :]
    noise = rng.bytes(width)
    return raw[:place] + (b"" if i % 5 == 4 else noise) + raw[place + (0 if i % 5 == 3 else width) :]


def test_a_header_of_very_many_fields_is_none() -> None:
    """From each byte of such headers another one starts, and each would be walked to its end."""
    few = record(b"abcd", op=b"\x02", conn=bytes(4), time=bytes(8), **{f"f{k}": b"" for k in range(MAX_FIELDS - 3)})
    many = record(b"abcd", op=b"\x02", conn=bytes(4), time=bytes(8), **{f"f{k}": b"" for k in range(MAX_FIELDS - 2)})
    found = scan_bag(np.frombuffer(message(1) + many + few + message(2), np.uint8))
    assert list(found.size) == [8, 4, 8]
    assert (found.gaps, found.first, found.lost) == (1, len(message(1)), len(many))
    tiny = np.frombuffer(b"\4\0\0\0\xff\xff\0\0" * (1 << 20), np.uint8)  # took half a minute
    assert scan_bag(tiny).lost == tiny.size


def test_records_within_records_lead_to_the_same_damage() -> None:
    """Each leads to a message of a wrong length behind which nothing follows; looked for once, not for each."""
    count, one = 20_000, len(message(0)) - 8
    nested = b"".join(message(k)[: one - 4] + struct.pack("<I", one * (count - 1 - k)) for k in range(count))
    wrong = message(7)[:-12] + struct.pack("<I", 2**31)
    found = scan_bag(np.frombuffer(nested + wrong + b"\xff" * 2_000_000, np.uint8))  # took twenty seconds
    assert len(found.op) == count
    assert found.lost == len(wrong) + 2_000_000
    behind = scan_bag(np.frombuffer(nested + wrong + b"\xff" * 99 + message(8), np.uint8))
    assert list(behind.size[1:]) == [99, 8]  # the outermost one stands, the wrong one is mended


def test_zeros_hold_no_record_and_end_where_one_starts() -> None:
    found = scan_bag(np.frombuffer(message(1) + bytes(1000) + message(2) + bytes(9), np.uint8))
    assert list(found.size) == [8, 8]
    assert (found.lost, found.gaps, found.first) == (1009, 2, len(message(1)))


@pytest.mark.parametrize("compression", PACK)
def test_random_damage_never_raises_nor_falls_behind_rosbags(read: Read, tmp_path: Path, compression: str) -> None:
    raw = Bag(compression).bytes()
    whole = set(EVERY)
    read(raw)
    with Reader(tmp_path / "log.bag") as reader:
        assert len(list(reader.messages())) == len(EVERY)
    for i in range(50):
        changed = mutated(raw, i)
        (tmp_path / "log.bag").write_bytes(changed)
        peer: set[float] = set()
        try:
            with Reader(tmp_path / "log.bag") as reader:
                for _, _, data in reader.messages():
                    peer.update(struct.unpack("<d", data))
        except Exception:  # rosbags fails in any way; what it gave before counts
            pass
        try:
            log = read(changed)
        except LogError:
            assert not peer & whole, i
            continue
        assert set(speed(log)) & whole >= peer & whole, i
        assert set(speed(log)) >= whole or log.summary.damage or len(speed(log)) == len(EVERY), i
