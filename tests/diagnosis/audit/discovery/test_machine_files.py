"""Machine files of missions that have none in or above their folder."""

from __future__ import annotations

from pathlib import Path

from diagnosis.audit.discovery.discover import discover
from diagnosis.audit.discovery.identity import fallback_id
from diagnosis.audit.discovery.machine_files import with_machine_files

HEAD = b"\x89MCAP0\r\n"


def put(root: Path, **contents: bytes) -> None:
    for name, content in contents.items():
        path = root / name.replace("__", "/")
        path.mkdir(parents=True, exist_ok=True)
        (path / "m.mcap").write_bytes(HEAD + content)


def found(root: Path) -> tuple[dict[str, str | None], tuple[str, ...]]:
    missions, notes = with_machine_files(discover([str(root)]).missions)
    return {m.name: m.machine_file for m in missions}, notes


def test_a_copy_is_judged_as_what_it_is_a_copy_of(tmp_path: Path) -> None:
    put(tmp_path, AX=b"one", BX=b"two", backup__x=b"one", other=b"six")
    for machine in ("AX", "BX"):
        (tmp_path / machine / "machine.toml").write_text("")
    files, (first, second) = found(tmp_path)
    assert files == {
        "AX__m": f"{tmp_path}/AX/machine.toml",
        "BX__m": f"{tmp_path}/BX/machine.toml",
        "backup__x__m": f"{tmp_path}/AX/machine.toml",
        "other__m": None,
    }
    assert first.startswith(
        f"no machine file: {tmp_path}/other/m.mcap is judged as the paper's Haulotte, as there is no machine.toml"
    )
    assert second == (
        f"backup__x__m has no machine.toml in or above its folder and has that of the same machine: {tmp_path}/AX/machine.toml"
    )


def test_a_copy_is_of_the_machine_of_its_original(tmp_path: Path) -> None:
    put(tmp_path, AX=b"one", backup__old=b"one")
    (tmp_path / "AX/machine.toml").write_text("")
    missions, _ = with_machine_files(discover([str(tmp_path)]).missions)
    assert [fallback_id(m) for m in missions] == ["AX", "AX"]


def test_a_folder_called_as_a_machine_is_of_it(tmp_path: Path) -> None:
    put(tmp_path, AX=b"one", backup__AX=b"three")
    (tmp_path / "AX/machine.toml").write_text("")
    files, notes = found(tmp_path)
    assert set(files.values()) == {f"{tmp_path}/AX/machine.toml"}
    assert len(notes) == 1


def test_all_with_machine_files_need_no_word(tmp_path: Path) -> None:
    put(tmp_path, AX=b"one")
    (tmp_path / "machine.toml").write_text("")
    assert found(tmp_path)[1] == ()
