from __future__ import annotations

import os
import re
import uuid
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import fsspec
import pytest

from diagnosis.audit.discovery.apart import span_of
from diagnosis.audit.discovery.discover import discover
from diagnosis.audit.discovery.inspect_remote import inspect_remotely, logs_at
from diagnosis.audit.discovery.listing import Entry
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.remote import RemotePlace, file_system
from diagnosis.audit.discovery.remote_mcap import span_behind
from diagnosis.audit.discovery.staging import machine_at, stage
from diagnosis.audit.store.objects import Objects
from replay.errors import ConfigError, LogError
from replay.inspection.inspect_log import inspect_index
from replay.inspection.mcap_index import mcap_index
from replay.inspection.report import InspectReport
from replay.log.content_hash import content_hash
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log
from tests.object_store import object_store

SAMPLES = Path(__file__).resolve().parents[4] / "sample_logs"
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")


class Bucket:
    """A bucket of a made-up object store on this computer, and the requests that it has met."""

    def __init__(self, url: str, requests: list[str]) -> None:
        self.url, self.requests = url, requests
        self.system = fsspec.filesystem("s3")

    def put(self, name: str, content: bytes) -> None:
        self.system.pipe_file(f"{self.url}/{name}", content)

    def counted(self) -> list[str]:
        met = list(self.requests)
        self.requests.clear()
        return met


@pytest.fixture(scope="module")
def server() -> Iterator[list[str]]:
    """Requests of a server of S3's protocol."""
    with object_store() as requests:
        yield requests


@pytest.fixture
def bucket(server: list[str]) -> Bucket:
    name = f"fleet-{uuid.uuid4().hex[:8]}"
    made = Bucket(f"s3://{name}", server)
    made.system.mkdir(name)
    return made


@pytest.fixture
def memory() -> Iterator[Any]:
    system = fsspec.filesystem("memory")
    yield system
    system.store.clear()
    system.pseudo_dirs[:] = [""]


def test_missions_in_a_bucket(bucket: Bucket) -> None:
    for name in ("H-07/m1.mcap", "H-07/m1.csv", "H-07/rec/metadata.yaml", "H-07/rec/rec_0.db3", "H-08/m1.mcap"):
        bucket.put(f"logs/{name}", name.encode())
    bucket.put("logs/H-08/notes.md", b"")
    bucket.put("logs/H-09/mission.toml", b'files = ["x.mcap"]\nmachine_id = "nine"\nmachine = "h.toml"\n')
    for name in ("x.mcap", "y.mcap", "h.toml"):
        bucket.put(f"logs/H-09/{name}", b"x")
    bucket.counted()
    found = discover([f"{bucket.url}/logs"])
    assert found.problems == ()
    assert {m.name: [f.removeprefix(f"{bucket.url}/logs/") for f in m.files] for m in found.missions} == {
        "H-07__m1": ["H-07/m1.mcap", "H-07/m1.csv"],
        "H-07__rec": ["H-07/rec"],
        "H-08__m1": ["H-08/m1.mcap"],
        "H-09": ["H-09/x.mcap"],
    }
    assert (found.left_aside, found.roots) == (1, (f"{bucket.url}/logs",))
    told = found.missions[3]
    assert (told.machine_id, told.machine_file) == ("nine", f"{bucket.url}/logs/H-09/h.toml")
    assert found.missions[0].sizes == (12, 11)
    assert all(stamp for m in found.missions for stamp in m.stamps)
    assert len(bucket.counted()) <= 6
    bucket.put("logs/H-08/m1.mcap", b"other")
    again = discover([f"{bucket.url}/logs/**/*.mcap", f"{bucket.url}/logs/H-08/m1.mcap"])
    assert {m.name for m in again.missions} == {"H-07__m1", "H-08__m1", "H-09__x", "H-09__y"}
    assert again.missions[1].stamps != found.missions[2].stamps


def test_nothing_behind_a_url(bucket: Bucket) -> None:
    found = discover([f"{bucket.url}/none", f"{bucket.url}/*.mcap", f"s3://no-{uuid.uuid4().hex}/x"])
    assert found.missions == ()
    assert [p.rpartition(": ")[2] for p in found.problems] == ["no such object", "matches no object", "no such object"]
    with pytest.raises(ConfigError, match="nosuch://x: "):
        discover(["nosuch://x"])


def test_a_full_pass_is_one_request_for_the_content(bucket: Bucket, tmp_path: Path) -> None:
    raw = bytes(range(256)) * 100_000  # 25.6 MB
    bucket.put("m1.mcap", raw)
    (mission,) = discover([f"{bucket.url}/m1.mcap"]).missions
    bucket.counted()
    staged = stage(mission, tmp_path)
    assert [r.split()[0] for r in bucket.counted()] == ["HEAD", "GET", "HEAD"]
    assert staged.paths[0].read_bytes() == raw
    assert staged.paths[0].name == "m1.mcap"
    assert staged.hashes == (content_hash(staged.paths[0])[0],)


def test_an_object_replaced_since_it_was_listed_is_refused(bucket: Bucket, tmp_path: Path) -> None:
    bucket.put("m1.mcap", b"first")
    (mission,) = discover([f"{bucket.url}/m1.mcap"]).missions
    bucket.put("m1.mcap", b"other")
    with pytest.raises(LogError, match=r"m1.mcap: was replaced while it was read"):
        stage(mission, tmp_path)


def test_an_object_replaced_or_gone_while_it_is_read_is_refused(
    bucket: Bucket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bucket.put("m1.mcap", b"first")
    (mission,) = discover([f"{bucket.url}/m1.mcap"]).missions
    get = bucket.system.get_file

    def slowly(path: str, local: str, **more: Any) -> None:
        get(path, local, **more)
        bucket.put("m1.mcap", b"other")

    monkeypatch.setattr(bucket.system, "get_file", slowly)
    with pytest.raises(LogError, match="was replaced while it was read"):
        stage(mission, tmp_path / "a")
    bucket.system.rm_file(f"{bucket.url}/m1.mcap")
    with pytest.raises(LogError, match="cannot be read"):
        stage(mission, tmp_path / "b")


def test_a_recording_behind_a_url_reads_like_a_local_one(memory: Any, tmp_path: Path) -> None:
    memory.put(str(SAMPLES / "paper_rosbag2"), "/fleet/paper_rosbag2", recursive=True)
    (mission,) = discover(["memory://fleet"]).missions
    staged = stage(mission, tmp_path)
    assert staged.hashes == (content_hash(SAMPLES / "paper_rosbag2")[0],)
    options = SourceOptions()
    assert summarise_log(staged.paths[0], options).topics == summarise_log(SAMPLES / "paper_rosbag2", options).topics
    memory.pipe_file("/fleet/paper_rosbag2/metadata.yaml", b"changed")
    with pytest.raises(LogError, match="was replaced"):
        stage(mission, tmp_path / "again")


def test_names_of_objects_stay_in_the_folder(memory: Any, tmp_path: Path) -> None:
    memory.pipe_file("/fleet/a\nb#?%20\x1b.mcap", b"x")
    memory.pipe_file("/fleet/rec/metadata.yaml", b"")
    memory.pipe_file("/fleet/rec/../../../evil.db3", b"x")
    missions = discover(["memory://fleet"]).missions
    by_name = {m.name: m for m in missions}
    staged = stage(by_name["a_b_20"], tmp_path / "a")
    assert staged.paths == (tmp_path / "a" / "0" / "a_b_20.mcap",)
    assert not list(tmp_path.rglob("evil*"))
    assert all(os.sep not in m.name for m in missions)


def test_local_files_are_read_where_they_are(tmp_path: Path) -> None:
    path = SAMPLES / "base.mcap"
    mission = MissionSource("base", (str(path),), 1, ("1",), sizes=(1,))
    assert stage(mission, tmp_path).paths == (path,)
    assert stage(mission, tmp_path, ("known",)).hashes == ("known",)
    assert list(tmp_path.iterdir()) == []


def test_parts_of_a_recording_are_read_as_one(tmp_path: Path) -> None:
    whole = SAMPLES / "base.mcap"
    parts = [tmp_path / "logs" / name for name in ("drive_9.mcap", "drive_10.mcap", "plc.csv")]
    parts[0].parent.mkdir()
    for part in parts:
        part.write_bytes(whole.read_bytes())
    mission = MissionSource("drive", tuple(map(str, parts)), 3, ("1", "2", "3"))
    staged = stage(mission, tmp_path / "private")
    assert [p.name for p in staged.paths] == ["drive", "plc.csv"]
    assert len(staged.hashes) == 3
    counts = {t.name: t.count for t in summarise_log(whole, SourceOptions()).topics}
    log = read_log(staged.paths[0], SourceOptions())
    assert {t.name: t.count for t in log.summary.topics} == {name: 2 * n for name, n in counts.items()}


def test_machine_files_behind_urls(memory: Any) -> None:
    memory.pipe_file("/fleet/h.toml", b'[machine]\nname = "Nine"\n')
    assert machine_at("memory://fleet/h.toml").name == "Nine"
    assert machine_at(str(SAMPLES / "haulotte.toml")).name
    memory.pipe_file("/fleet/off.toml", b"[nonsense]\n")
    with pytest.raises(ConfigError, match="nonsense"):
        machine_at("memory://fleet/off.toml")
    with pytest.raises(ConfigError, match="cannot read the machine file"):
        machine_at("memory://fleet/none.toml")


def never(path: Path) -> InspectReport:
    raise AssertionError(f"{path} was read whole")


def test_the_index_of_a_large_mcap_file_takes_few_requests(bucket: Bucket) -> None:
    path = SAMPLES / "paper.mcap"
    assert path.stat().st_size > 2 << 20
    bucket.put("paper.mcap", path.read_bytes())
    url = f"{bucket.url}/paper.mcap"
    logs, problems, left_aside = logs_at([url])
    assert (len(logs), problems, left_aside) == (1, [], 0)
    bucket.counted()
    here = mcap_index(path, "header")
    assert here is not None
    assert inspect_remotely(logs[0], never, "header") == replace(here, source=url)
    met = bucket.counted()
    assert [r.split()[0] for r in met] == ["GET", "GET"]
    assert all("bytes=" in r for r in met)
    system, name = file_system(url)
    assert span_behind(system, name, logs[0].bytes) == span_of(summarise_log(path, SourceOptions()))


def test_what_an_index_does_not_tell_is_read_whole(memory: Any) -> None:
    raw = (SAMPLES / "paper.mcap").read_bytes()
    memory.pipe_file("/fleet/cut.mcap", raw[: 2 << 20])
    memory.pipe_file("/fleet/none.mcap", b"")
    memory.pipe_file("/fleet/table.csv", b"t,v\n0,1\n1,2\n")
    logs, problems, _ = logs_at(["memory://fleet", "memory://nothing"])
    urls = [log.files[0] for log in logs]
    assert [url.rpartition("/")[2] for url in urls] == ["cut.mcap", "none.mcap", "table.csv"]
    assert len(problems) == 1

    def look(path: Path) -> InspectReport:
        return inspect_index(path, SourceOptions())

    cut = inspect_remotely(logs[0], look, "header")
    assert cut.source == urls[0]
    assert cut.damage
    with pytest.raises(LogError, match=f"^{re.escape(urls[1])} is empty"):
        inspect_remotely(logs[1], look, "header")
    assert inspect_remotely(logs[2], look, None).messages == 2


def test_a_damaged_mcap_file_has_no_outline(memory: Any) -> None:
    memory.pipe_file("/fleet/cut.mcap", (SAMPLES / "paper.mcap").read_bytes()[: 2 << 20])
    for name, size in (("cut", 2 << 20), ("missing", 100)):
        with pytest.raises(LogError):
            span_behind(memory, f"/fleet/{name}.mcap", size)


def test_parts_behind_urls_are_one_mission_where_they_go_on(memory: Any) -> None:
    raw = (SAMPLES / "paper.mcap").read_bytes()
    memory.pipe_file("/fleet/run_0.mcap", raw)
    memory.pipe_file("/fleet/run_1.mcap", raw)  # of the same time: another recording
    memory.pipe_file("/fleet/bag_0.bag", b"x")
    memory.pipe_file("/fleet/bag_1.bag", b"x")
    assert [m.name for m in discover(["memory://fleet"]).missions] == ["bag_0", "bag_1", "run_0", "run_1"]
    place = RemotePlace(memory)
    parts = [Entry(f"memory://fleet/run_{i}.mcap", f"run_{i}.mcap", "", len(raw)) for i in range(2)]
    assert not place.continuous(parts)
    assert place.continuous(parts[:1])


def test_result_objects_in_a_bucket_are_never_changed(bucket: Bucket) -> None:
    objects = Objects(f"{bucket.url}/results")
    name = "0123abcd-0123abcd-1.0-1.json"
    assert objects.names() == []
    assert objects.put(name, b"first")
    assert not objects.put(name, b"second")
    assert objects.read(name) == b"first"
    assert objects.put_attempt("0123abcd-0123abcd-1.0", {"attempt": {"state": "ok"}}, 1) == 2
    assert len(objects.names()) == 2


def test_packages_that_are_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> None:
        raise ImportError("Install s3fs to access S3")

    monkeypatch.setattr("fsspec.core.url_to_fs", missing)
    with pytest.raises(ConfigError, match=r"s3://x: needs a package .*mfhca-replay\[s3\]"):
        file_system("s3://x")
