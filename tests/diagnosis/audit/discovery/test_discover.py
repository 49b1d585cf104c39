from __future__ import annotations

import io
import os
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from diagnosis.audit.discovery.apart import HELPER, Span
from diagnosis.audit.discovery.discover import Discovery, discover
from diagnosis.audit.discovery.identity import fallback_id
from replay.log.file_types import LOG_ENDINGS

STORE = get_typestore(Stores.ROS1_NOETIC)
T0 = 1_700_000_000


def put(root: Path, *names: str) -> None:
    for name in names:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"\x89MCAP0\r\n" + name.encode("utf-8", "surrogateescape"))


def bag(path: Path, start_s: float, topic: str = "/speed") -> None:
    number = STORE.types["std_msgs/msg/Float64"]
    with Writer(path) as writer:
        speed = writer.add_connection(topic, "std_msgs/msg/Float64", typestore=STORE)
        for i in range(20):
            raw = bytes(STORE.serialize_ros1(number(float(i)), "std_msgs/msg/Float64"))
            writer.write(speed, T0 * 10**9 + int((start_s + 0.1 * i) * 1e9), raw)


def shown(found: Discovery, root: Path) -> dict[str, list[str]]:
    return {m.name: [os.path.relpath(f, root) for f in m.files] for m in found.missions}


def test_recordings_tables_and_folders_become_missions(tmp_path: Path) -> None:
    put(
        tmp_path,
        "a/m1.mcap",
        "a/m1.csv",
        "a/m1.parquet",
        "a/other.csv",
        "b/rec/metadata.yaml",
        "b/rec/rec_0.db3",
        "b/rec.csv",
    )
    put(tmp_path, "c/x.mcap", "c/x.bag", "c/x.csv", "notes.md", ".hidden.mcap", ".git/y.mcap")
    found = discover([str(tmp_path)])
    assert shown(found, tmp_path) == {
        "a__m1": ["a/m1.mcap", "a/m1.csv", "a/m1.parquet"],
        "a__other": ["a/other.csv"],
        "b__rec": ["b/rec", "b/rec.csv"],
        "c__x.bag": ["c/x.bag"],  # two recordings of one stem: the table could be of either
        "c__x.csv": ["c/x.csv"],
        "c__x.mcap": ["c/x.mcap"],
    }
    assert found.left_aside == 2
    assert found.problems == ()
    first = found.missions[0]
    assert first.bytes == sum(first.sizes) == sum(Path(f).stat().st_size for f in first.files)
    assert first.stamps == tuple(str(Path(f).stat().st_mtime_ns) for f in first.files)


def test_words_in_any_order_and_twice_give_the_same_missions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, "logs/m1.mcap", "logs/m1.csv", "logs/deep/m2.mcap", "logs/rec/metadata.yaml", "logs/rec/rec_0.db3")
    monkeypatch.chdir(tmp_path)
    expected = discover(["logs"])
    assert [m.name for m in expected.missions] == ["deep__m2", "m1", "rec"]
    monkeypatch.setattr("sys.stdin", io.StringIO("logs/m1.csv\n\nlogs/rec/rec_0.db3\n"))
    words = ["logs/m1.mcap", "-", "./logs/../logs", "logs/**/*", "logs", "logs"]
    for given in (words, [w for w in reversed(words) if w != "-"]):
        found = discover(given)
        assert [m.name for m in found.missions] == ["deep__m2", "m1", "rec"]
        assert [[Path(f).resolve() for f in m.files] for m in found.missions] == [
            [Path(f).resolve() for f in m.files] for m in expected.missions
        ]


def test_single_words(tmp_path: Path) -> None:
    put(tmp_path, "rec/metadata.yaml", "rec/rec_0.db3", "data.bin", "empty/readme.md", "m.mcap")
    assert shown(discover([str(tmp_path / "rec")]), tmp_path) == {"rec": ["rec"]}
    assert shown(discover([str(tmp_path / "data.bin")]), tmp_path) == {"data.bin": ["data.bin"]}
    found = discover([str(tmp_path / n) for n in ("no.mcap", "*.bag", "empty", "m.mcap")])
    assert [p.partition(": ")[2].split(" (")[0] for p in found.problems] == [
        "no such file",
        "matches no file",
        "holds no log",
    ]
    assert len(found.missions) == 1


def test_pipes_are_refused_and_left_aside(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "live.mcap")
    put(tmp_path, "m.mcap")
    assert [m.name for m in discover([str(tmp_path)]).missions] == ["m"]
    assert "not a regular file" in discover([str(tmp_path / "live.mcap")]).problems[0]


def test_names_are_safe_and_unique(tmp_path: Path) -> None:
    names = ["a/M1.mcap", "a/m1.mcap", "a b#?%20.mcap", "line\nbreak\x1b[31m.mcap", "a__b.mcap", "a/b.mcap", "con.mcap"]
    names += ["é.mcap", "x" * 230 + ".mcap", "x" * 231 + ".mcap", "...mcap", "bytes\udcff.mcap", "…/../up.mcap"]
    put(tmp_path, *names)
    found = discover([str(tmp_path)])
    called = [m.name for m in found.missions]
    assert len(called) == len(names) - 1  # "...mcap" is hidden
    assert len({name.casefold() for name in called}) == len(called)
    for name in called:
        assert len(name.encode()) <= 120
        assert "/" not in name
        assert name.isprintable()
        assert not name.startswith(".")
    assert {"a_b_20", "_con", "é", "line_break_31m"} <= set(called)
    assert called == [m.name for m in discover([str(tmp_path)]).missions]


def test_links_are_one_mission_under_the_name_of_what_they_lead_to(tmp_path: Path) -> None:
    put(tmp_path, "z/m.mcap", "outside/far.mcap")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs/a.mcap").symlink_to(tmp_path / "z/m.mcap")
    (tmp_path / "logs/z").symlink_to(tmp_path / "z")
    (tmp_path / "logs/loop").symlink_to(tmp_path / "logs")
    (tmp_path / "logs/broken.mcap").symlink_to(tmp_path / "nowhere.mcap")
    assert shown(discover([str(tmp_path)]), tmp_path) == {"z__m": ["z/m.mcap"], "outside__far": ["outside/far.mcap"]}
    assert shown(discover([str(tmp_path / "logs")]), tmp_path) == {"a": ["logs/a.mcap"]}


def test_results_are_left_aside(tmp_path: Path) -> None:
    put(tmp_path, "m.mcap", "m-report/report.json", "m-report/report.parquet", "m-report/clips/F1.mcap")
    put(tmp_path, "mfhca-audit/fleet.sqlite", "mfhca-audit/fleet.csv", "mfhca-audit/missions/m/report.parquet")
    put(tmp_path, "mfhca-audit/missions/m/clip.mcap", "own/fleet.csv", "own/missions/x.mcap")
    found = discover([str(tmp_path)], exclude=tmp_path / "own")
    assert [m.name for m in found.missions] == ["m"]


def test_results_beside_the_logs(tmp_path: Path) -> None:
    put(tmp_path, "m.mcap", "fleet.csv", "missions/m/clips/F1.mcap", "results/x.csv", "deep/n.mcap")
    found = discover([str(tmp_path)], exclude=tmp_path)
    assert [m.name for m in found.missions] == ["deep__n", "m"]


def test_numbered_parts_are_one_mission_where_they_go_on(tmp_path: Path) -> None:
    for i in range(3):
        bag(tmp_path / f"drive_{i}.bag", 2.0 * i)
        bag(tmp_path / f"run_{i}.bag", 600.0 * i)
    put(tmp_path, "drive.csv")
    bag(tmp_path / "gap_0.bag", 0.0)
    bag(tmp_path / "gap_2.bag", 2.0)
    bag(tmp_path / "kind_0.bag", 0.0)
    bag(tmp_path / "kind_1.bag", 2.0, "/other")
    found = shown(discover([str(tmp_path)]), tmp_path)
    assert found.pop("drive") == ["drive_0.bag", "drive_1.bag", "drive_2.bag", "drive.csv"]
    assert sorted(found) == ["gap_0", "gap_2", "kind_0", "kind_1", "run_0", "run_1", "run_2"]


def test_numbered_missions_are_looked_at_no_further_than_to_tell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for i in range(5):
        bag(tmp_path / f"run_{i}.bag", 600.0 * i)
    looked = []
    look = HELPER.span

    def counted(path: str) -> Span:
        looked.append(Path(path).name)
        return look(path)

    monkeypatch.setattr(HELPER, "span", counted)
    assert len(discover([str(tmp_path)]).missions) == 5
    assert looked == ["run_0.bag", "run_1.bag"]


def test_mission_file(tmp_path: Path) -> None:
    put(tmp_path, "s/a.mcap", "s/plc/export.csv", "s/rec/metadata.yaml", "s/rec/r.db3", "s/h.toml", "s/unused.mcap")
    (tmp_path / "s/mission.toml").write_text(
        'files = ["a.mcap", "plc/export.csv", "rec"]\nmachine_id = "H-07"\nmachine = "h.toml"\nname = "Monday / hall 3"\n'
    )
    put(tmp_path, "t/b.mcap", "t/c.csv")
    (tmp_path / "t/mission.toml").write_text('machine_id = "H-08"\n')
    first, second = discover([str(tmp_path)]).missions
    assert (first.name, first.machine_id, first.machine_file) == ("Monday__hall_3", "H-07", str(tmp_path / "s/h.toml"))
    assert [os.path.relpath(f, tmp_path) for f in first.files] == ["s/a.mcap", "s/plc/export.csv", "s/rec"]
    assert (second.name, second.machine_id, len(second.files)) == ("t", "H-08", 2)
    for word in ("s", "s/mission.toml", "s/unused.mcap"):
        assert discover([str(tmp_path / word)]).missions[0].files == first.files


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('machineid = "x"', "'machineid' is not a key; expected files, machine_id, machine, name"),
        ('files = ["../secret.mcap"]', "names '../secret.mcap', which is not in the folder"),
        ('files = ["/etc/passwd"]', "which is not in the folder"),
        ('files = ["link.mcap"]', "which is not in the folder"),
        ('files = ["no.mcap"]', "which is not in the folder"),
        ('files = ["a\\u0000b"]', "which is not in the folder"),
        ('machine = "../h.toml"', "machine names '../h.toml'"),
        ("files = 3", "files must be a list of names"),
        ("files = []", "files is empty"),
        ("machine_id = 7", "machine_id must be a text"),
        ('name = ""', "name must be a text"),
        ("files = [", "not valid TOML"),
        ("x = " + "[" * 3000, "nests more than 32 brackets"),
        ("files = [" + "9" * 5000 + "]", "a number of 5000 digits"),
        ("a" + ".a" * 50_000 + " = 1", "a key of 50001 parts"),
        ('files = ["https://wiki/run7.mcap"]', "which is not in the folder"),
    ],
)
def test_mission_file_that_is_off(tmp_path: Path, text: str, said: str) -> None:
    put(tmp_path, "secret.mcap", "h.toml", "s/a.mcap", "ok/b.mcap")
    (tmp_path / "s/link.mcap").symlink_to(tmp_path / "secret.mcap")
    (tmp_path / "s/mission.toml").write_text(text)
    found = discover([str(tmp_path / "s"), str(tmp_path / "ok")])
    assert [[Path(f).name for f in m.files[:1] + m.files[-1:]] for m in found.missions] == [
        ["b.mcap", "b.mcap"],
        ["a.mcap", "mission.toml"],
    ]
    assert [m.name for m in found.missions] == ["ok__b", "s"]
    assert found.missions[0].problem == ""
    assert said in found.missions[1].problem
    assert "\n" not in found.missions[1].problem


@pytest.mark.parametrize(
    "text", ['machine_id = "T1"\nfiles = ["plc.csv"]', "x = 1\n machine_id='T1' # truck", 'machine_id="T1"\n[']
)
def test_a_mission_file_that_is_off_still_names_its_machine(tmp_path: Path, text: str) -> None:
    put(tmp_path, "a.mcap")
    (tmp_path / "mission.toml").write_text(text)
    (mission,) = discover([str(tmp_path)]).missions
    assert mission.machine_id == "T1"
    assert mission.problem


def test_mission_file_without_logs(tmp_path: Path) -> None:
    put(tmp_path, "s/mission.toml")
    (tmp_path / "s/mission.toml").write_text('name = "x"')
    (found,) = discover([str(tmp_path)]).missions
    assert found.files == (str(tmp_path / "s/mission.toml"),)
    assert "there is no log beside it" in found.problem


def test_missions_of_one_name_have_their_folders_names_too(tmp_path: Path) -> None:
    put(tmp_path, "s/a.mcap", "t/a.mcap")
    for folder in ("s", "t"):
        (tmp_path / folder / "mission.toml").write_text('name = "Monday"')
    assert [m.name for m in discover([str(tmp_path)]).missions] == ["Monday-s", "Monday-t"]


def test_links_to_folders_are_followed_within_what_was_given(tmp_path: Path) -> None:
    put(
        tmp_path,
        "logs/.pool/x/m.mcap",
        "logs/.pool/rec/metadata.yaml",
        "logs/.pool/rec/r.db3",
        "other/n.mcap",
        "logs/z/z.mcap",
    )
    for link, target in (
        ("AX-31", ".pool/x"),
        ("again", ".pool/x"),
        ("rec", ".pool/rec"),
        ("far", "../other"),
        ("loop", "."),
    ):
        (tmp_path / "logs" / link).symlink_to(target)
    (tmp_path / "logs/zz").symlink_to("z")
    found = discover([str(tmp_path / "logs")])
    assert sorted(shown(found, tmp_path).values()) == [["logs/AX-31/m.mcap"], ["logs/rec"], ["logs/z/z.mcap"]]
    assert sorted(fallback_id(m) for m in found.missions) == ["AX-31", tmp_path.name, "z"]
    assert found.problems == ()
    (note,) = found.notes
    assert note.startswith(f"{tmp_path}/logs/far: skipped: the link leads to {tmp_path}/other")
    both = discover([str(tmp_path / "logs"), str(tmp_path / "other")])
    assert (len(both.missions), both.notes) == (4, ())


def test_a_linked_file_belongs_to_the_folder_of_its_link(tmp_path: Path) -> None:
    put(tmp_path, "pool/m.mcap")
    (tmp_path / "AX-31").mkdir()
    (tmp_path / "AX-31/m.mcap").symlink_to("../pool/m.mcap")
    assert [fallback_id(m) for m in discover([str(tmp_path / "AX-31")]).missions] == ["AX-31"]


def test_a_folder_that_may_be_an_unmounted_disk_is_said_and_not_looked_through(tmp_path: Path) -> None:
    put(tmp_path, "m.mcap")
    (tmp_path / "disk").mkdir()
    (tmp_path / "lost.mcap").symlink_to(tmp_path / "nowhere")
    found = discover([str(tmp_path), str(tmp_path / "disk")])
    assert found.problems == (
        f"{tmp_path}/lost.mcap: the link leads nowhere (No such file or directory)",
        f"{tmp_path}/disk: holds no log ({', '.join(LOG_ENDINGS)} or a rosbag2 folder)",
    )
    assert found.roots == (str(tmp_path),)


def test_text_files_that_are_no_tables_are_left_aside(tmp_path: Path) -> None:
    put(tmp_path, "m.mcap")
    (tmp_path / "README.txt").write_text("Recorded on Monday.\nNothing special.\n")
    (tmp_path / "m.txt").write_text("notes\n")
    assert [m.files for m in discover([str(tmp_path)]).missions] == [(str(tmp_path / "m.mcap"),)]


def test_folder_that_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, "a/m.mcap", "b/n.mcap")
    scan = os.scandir

    def refused(path: str) -> object:
        if str(path).endswith("/a"):
            raise PermissionError(13, "Permission denied")
        return scan(path)

    monkeypatch.setattr("os.scandir", refused)
    found = discover([str(tmp_path)])
    assert [m.name for m in found.missions] == ["b__n"]
    assert found.problems == (f"{tmp_path}/a: cannot be listed (Permission denied)",)
    assert found.roots == ()  # what was there may still be


def test_a_server_that_is_not_there_costs_nothing_else(tmp_path: Path) -> None:
    put(tmp_path, "m.mcap")
    found = discover(["ftp://127.0.0.1:1/logs", str(tmp_path)])
    assert [m.name for m in found.missions] == ["m"]
    assert found.problems == ("ftp://127.0.0.1:1/logs: cannot be reached (Connection refused)",)


def test_a_part_that_is_missing_is_told(tmp_path: Path) -> None:
    put(
        tmp_path,
        "g_0.bag",
        "g_1.bag",
        "g_3.bag",
        "drive_0101.bag",
        "drive_0102.bag",
        "drive_0104.bag",
        "h_0.bag",
        "h_7.bag",
        "h_999999999.bag",
    )
    found = discover([str(tmp_path)])
    assert len(found.missions) == 9
    assert found.problems == ()
    (note,) = found.notes
    assert note.startswith(f"{tmp_path}/g_0.bag: numbered like parts of one recording, of which g_2.bag is not there")


def test_a_bag_folder_that_lost_its_metadata_is_one_recording_of_the_machine_around_it(tmp_path: Path) -> None:
    put(tmp_path, "hx1/run6/metadata.yaml", "hx1/run6/run6_0.db3", "hx1/run7/run7_0.db3", "hx1/run7/run7_1.db3")
    put(tmp_path, "hx1/morning/rosbag2_2026_03_01-08_00_00_0.mcap")  # renamed, but beside recordings
    put(tmp_path, "hx2/run1/run1_0.mcap", "hx2/run1.csv", "hx3/run1_0.db3", "hx4/hx4_0.db3", "hx4/other.csv")
    put(tmp_path, "hx5/hx5_0.db3", "hx5/day/x.mcap", "hx6/hx6_0.db3", "hx6/mission.toml")
    (tmp_path / "hx6/mission.toml").write_text('machine_id = "HX6"\n', encoding="utf-8")
    found = discover([str(tmp_path)])
    assert shown(found, tmp_path) == {
        "hx1__morning": ["hx1/morning"],
        "hx1__run6": ["hx1/run6"],
        "hx1__run7": ["hx1/run7"],
        "hx2__run1": ["hx2/run1", "hx2/run1.csv"],
        "hx3__run1_0": ["hx3/run1_0.db3"],
        "hx4__hx4_0": ["hx4/hx4_0.db3"],  # beside another log: a machine's folder
        "hx4__other": ["hx4/other.csv"],
        "hx5__day__x": ["hx5/day/x.mcap"],
        "hx5__hx5_0": ["hx5/hx5_0.db3"],
        "hx6": ["hx6/hx6_0.db3"],
    }
    by_folder = {m.name: m.machine_id or fallback_id(m) for m in found.missions}
    assert {m for n, m in by_folder.items() if n.startswith("hx1")} == {"hx1"}
    assert (by_folder["hx2__run1"], by_folder["hx3__run1_0"], by_folder["hx6"]) == ("hx2", "hx3", "HX6")
    noted = sorted(os.path.relpath(n.partition(": ")[0], tmp_path) for n in found.notes)
    assert noted == ["hx1/morning", "hx1/run7", "hx2/run1"]
    for word in ("hx1/run7", "hx1/run7/run7_0.db3"):
        [mission] = discover([str(tmp_path / word)]).missions
        assert [os.path.relpath(f, tmp_path) for f in mission.files] == ["hx1/run7"]
        assert fallback_id(mission) == "hx1"
