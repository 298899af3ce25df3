"""Tools and poses by name: the same after a file, and a file is whole or refused."""

from __future__ import annotations

import contextlib
import math
import os
import stat
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import ANGLE_MAX
from bioscara.model import load_parameters
from bioscara.robot.workspace import teach_file
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.poses import BUILT_IN, NamedPose, TeachTable
from bioscara.robot.workspace.teach_file import changing, load_table, save_table
from bioscara.robot.workspace.tools import Tool, fingers, kinematics_with
from entries import entry

PARAMETERS = load_parameters()
FINGERS = fingers(PARAMETERS)
NEEDLE = Tool("needle", Pose(0.05, 0.0, -0.2, 0.1), 0.12)
PLATE = NamedPose("plate", Joints(0.3, 0.1, 0.8, 0.0), Pose(0.5, 0.3, 0.03, 1.1), "needle", "7")
TABLE = TeachTable(FINGERS, (NEEDLE,), (PLATE, NamedPose("gate", None, Pose(0.4, 0.0, 0.2))))
BENCH = Frame("bench", Pose(0.3, -0.1, 0.02, 1.5))

# Names that mean something else in YAML are among them.
NAMES = st.one_of(
    st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,20}", fullmatch=True),
    st.sampled_from(("null", "true", "No", "y", "inf", "NaN", "e1")),
).filter(lambda name: name not in {"fingers", "center"})
TEXTS = st.text(max_size=30).filter(str.isprintable) | st.sampled_from(
    ("2026-11-03", "1.5", "~", "null", "'", '"', ": ", "# 3", "- a", "{x", "...", "---", " a ")
)
ANGLES, PLACES = st.floats(-ANGLE_MAX, ANGLE_MAX), st.floats(-1.0, 1.0)
POSES = st.builds(Pose, PLACES, PLACES, PLACES, ANGLES)
JOINTS = st.builds(Joints, ANGLES, PLACES, ANGLES, ANGLES)


@st.composite
def tables(draw: st.DrawFn) -> TeachTable:
    tools = [
        draw(st.builds(Tool, st.just(name), POSES, st.floats(0.0, 10.0)))
        for name in draw(st.lists(NAMES, max_size=3, unique=True))
    ]
    used = st.sampled_from(["fingers", *(tool.name for tool in tools)])
    poses = []
    for name in draw(st.lists(NAMES, max_size=4, unique=True)):
        joints, pose = draw(
            st.tuples(JOINTS, st.none()) | st.tuples(st.none(), POSES) | st.tuples(JOINTS, POSES)
        )
        poses.append(NamedPose(name, joints, pose, draw(used), draw(TEXTS)))
    frames = [Frame(name, draw(POSES)) for name in draw(st.lists(NAMES, max_size=3, unique=True))]
    return TeachTable(FINGERS, tuple(tools), tuple(poses), tuple(frames))


@given(table=tables())
def test_a_saved_table_is_loaded_unchanged(
    table: TeachTable, tmp_path_factory: pytest.TempPathFactory
):
    file = tmp_path_factory.getbasetemp() / "poses.yaml"
    save_table(file, table)
    assert load_table(file, FINGERS) == load_table(str(file), FINGERS) == table
    # repr distinguishes -0.0 from 0.0
    assert repr(load_table(file, FINGERS)) == repr(table)


def test_a_truncated_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "poses.yaml"
    save_table(file, TABLE)
    whole = file.read_bytes()
    for length in range(len(whole)):
        file.write_bytes(whole[:length])
        with pytest.raises(ConfigurationError, match=r"poses\.yaml, line \d+: the file is trunc"):
            load_table(file, FINGERS)


@given(cut=st.integers(0, 500), byte=st.integers(0, 255))
def test_a_changed_byte_is_refused_or_read(
    cut: int, byte: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Only the one kind of error, for any content."""
    file = tmp_path_factory.getbasetemp() / "changed.yaml"
    save_table(file, TABLE)
    data = bytearray(file.read_bytes())
    data[cut % len(data)] = byte
    file.write_bytes(data)
    with contextlib.suppress(ConfigurationError):
        load_table(file, FINGERS)


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "poses.yaml"
    file.write_text(text + "...\n")
    return file


GOOD = """schema: 1
tools:
  needle: {x: 0.05, y: 0.0, z: -0.2, yaw: 0.0, mass: 0.1}
poses:
  plate:
    joints: {j1: 0.3, j2: 0.1, j3: 0.8, j4: 0.0}
    tool: needle
"""


def test_a_hand_written_file_is_read(tmp_path: Path) -> None:
    table = load_table(written(tmp_path, GOOD), FINGERS)
    assert table.pose("plate") == NamedPose("plate", Joints(0.3, 0.1, 0.8, 0.0), None, "needle")


def test_a_table_without_frames_is_written_by_the_schema_without_them(tmp_path: Path) -> None:
    file = tmp_path / "poses.yaml"
    for table, schema in ((TABLE, 1), (TABLE.with_frame(BENCH), 2)):
        save_table(file, table)
        assert f"\nschema: {schema}\n" in file.read_text()
        assert ("frames:" in file.read_text()) is (schema == 2)
        assert load_table(file, FINGERS) == table


def test_frames_have_names() -> None:
    table = TABLE.with_frame(BENCH)
    assert table.frame("bench") is BENCH
    with pytest.raises(InvalidArgumentError, match="there is a frame bench already"):
        table.with_frame(BENCH)
    with pytest.raises(InvalidArgumentError, match=r"no frame 'bnech'; .*bench"):
        table.frame("bnech")
    with pytest.raises(InvalidArgumentError, match="no frame 'bench'; the table has none"):
        TABLE.frame("bench")
    with pytest.raises(InvalidArgumentError, match="is not a Frame"):
        TABLE.with_frame(Pose(0.1, 0.2, 0.3))


def test_an_error_names_its_line(tmp_path: Path) -> None:
    for old, new, line, complaint in (
        (
            "schema: 1",
            "schema: 3",
            1,
            "schema: 3 cannot be read; this version of bioscara reads 1 and 2",
        ),
        (
            "poses:",
            "frames: {bench: {x: 0, y: 0, z: 0, yaw: 0}}\nposes:",
            4,
            "frames are of schema 2",
        ),
        ("schema: 1", "schema: 2\nframes: {bench: {x: 300, y: 0, z: 0, yaw: 0}}", 2, "300 is out"),
        ("schema: 1", "schema: 2\nframes: {bench: {x: 0.3, y: 0, z: 0}}", 2, "yaw is missing"),
        (
            "schema: 1",
            "schema: 2\nframes:\n  4th: {x: 0, y: 0, z: 0, yaw: 0}",
            3,
            "frame name '4th'",
        ),
        ("schema: 1", "schema: yes", 1, "'yes' is not a whole number"),
        ("schema: 1\n", "", 1, "schema is missing"),
        ("poses:", "pose:", 4, "did you mean poses?"),
        ("j3: 0.8", "j5: 0.8", 6, "known here: j1, j2, j3, j4"),
        (
            "    tool: needle",
            "    pose: {x: 0.4, y: 0.1, z: 0.1, yaw: 0.0, frame: bench}",
            7,
            "poses.plate.pose.frame is not a known parameter",
        ),
        ("    tool: needle", "    frame: bench", 7, "poses.plate.frame is not a known parameter"),
        ("j3: 0.8, ", "", 6, "poses.plate.joints.j3 is missing"),
        ("j3: 0.8", "j3: .nan", 6, "poses.plate.joints.j3: nan is outside"),
        ("j3: 0.8", "j3: 45.8", 6, "j3: 45.8 is outside -6.28319 .. 6.28319 rad"),
        ("j3: 0.8", f"j3: {10**400}", 6, "is outside"),
        ("j3: 0.8", "j3: true", 6, "True is not a number"),
        ("tool: needle", "tool: neddle", 5, "no tool 'neddle'; did you mean needle?"),
        ("tool: needle", "tol: needle", 7, "did you mean tool?"),
        ("x: 0.05", "x: 50.0", 3, "tools.needle.x: 50 is outside -1 .. 1 m"),
        ("mass: 0.1", "mass: -1.0", 3, "tools.needle.mass: -1 is outside 0 .. 10 kg"),
        ("  plate:", "  center:", 5, "there is a pose center already"),
        ("  needle: {", "  fingers: {", 3, "there is a tool fingers already"),
        ("  plate:", "  a  b:", 5, "with single spaces between"),
        ("  plate:", "  7:", 5, "7 is not a name; quote it"),
        ("    joints: {j1: 0.3, j2: 0.1, j3: 0.8, j4: 0.0}\n", "", 5, "neither joints nor a pose"),
        ("    tool: needle", '    calibration: "a\\nb"', 5, "printable"),
        ("    tool: needle", "    calibration: 2026-11-03", 7, "calibration"),
        ("    tool: needle\n", "    tool: needle\n    tool: needle\n", 8, "duplicate key"),
        ("j3: 0.8", "j3: [", 6, ""),
    ):
        with entry(old):
            assert old in GOOD
            with pytest.raises(ConfigurationError) as caught:
                load_table(written(tmp_path, GOOD.replace(old, new, 1)), FINGERS)
            assert complaint in str(caught.value)
            if complaint:
                assert f"poses.yaml, line {line}: " in str(caught.value)


@pytest.mark.parametrize("text", ["[" * 1000 + "\n", "&a [*a]\n", "7\n", "a\0b\n", "- 1\n"])
def test_invalid_files_are_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"poses\.yaml"):
        load_table(written(tmp_path, text), FINGERS)


_JOINTS = "joints: {j1: 0.1, j2: 0.1, j3: 0.1, j4: 0}"


@pytest.mark.parametrize(
    "poses",
    [
        f"  a: &a\n    {_JOINTS}\n  b:\n    <<: *a\n    tool: fingers\n",
        "  a:\n    joints: {<<: {j1: 20}, j2: 0.1, j3: 0.1, j4: 0}\n",
        "  a: {joints: {j1: !!bool 3, j2: 0.1, j3: 0.1, j4: 0}}\n",
        "  <<: &p\n    <<: *p\n",
    ],
    ids=["merge of poses", "merge of joints", "tag bool", "merge of itself"],
)
def test_unusual_yaml_raises_only_configuration_errors(tmp_path: Path, poses: str) -> None:
    path = tmp_path / "poses.yaml"
    path.write_text(f"schema: 1\ntools: {{}}\nposes:\n{poses}...\n")
    with contextlib.suppress(ConfigurationError):
        load_table(path, FINGERS)


def test_an_error_in_a_merged_mapping_names_a_line(tmp_path: Path) -> None:
    poses = f"  a: &a\n    {_JOINTS}\n    tool: fingers\n  b:\n    <<: *a\n    tol: x\n"
    text = f"schema: 1\ntools: {{}}\nposes:\n{poses.replace('j1: 0.1', 'j1: 20')}"
    with pytest.raises(ConfigurationError, match=r"line 5: poses\.a\.joints\.j1: 20 is outside"):
        load_table(written(tmp_path, text), FINGERS)
    text = text.replace("j1: 20", "j1: 0.1")
    with pytest.raises(ConfigurationError, match=r"line 9: poses\.b\.tol is not a known"):
        load_table(written(tmp_path, text), FINGERS)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"none\.yaml: No such file"):
        load_table(tmp_path / "none.yaml", FINGERS)
    with pytest.raises(ConfigurationError, match="directory"):
        load_table(tmp_path, FINGERS)


def test_a_failed_save_leaves_the_file_unchanged(tmp_path: Path) -> None:
    file = tmp_path / f"{'p' * 245}.yaml"  # no room for the name of another file in the same folder
    file.write_bytes(before := b"as it was")
    broken = TeachTable(FINGERS, (), (NamedPose("a", Joints(0.0, 0.0, 0.0, 0.0)),))
    with pytest.raises(ConfigurationError, match=r"cannot be saved .* name another file"):
        save_table(file, broken)
    assert file.read_bytes() == before
    with pytest.raises(ConfigurationError, match="cannot be saved"):
        save_table(tmp_path / "no" / "poses.yaml", TABLE)


@pytest.mark.parametrize(("count", "size_max"), [(600, 2**20), (80, 2**13)])
def test_a_table_that_is_too_large_to_be_read_again_is_not_saved(
    count: int, size_max: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "poses.yaml"
    save_table(file, TABLE)
    # Within the lines that a file holds, poses cannot take 1 MiB.
    monkeypatch.setattr(teach_file, "SIZE_MAX", size_max)
    long = replace(TABLE, poses=tuple(replace(PLATE, name=f"p{i}") for i in range(count)))
    lines = 5 * count + 7
    with pytest.raises(
        ConfigurationError, match=rf"poses take 0\.\d+ MiB and {lines} lines, a file holds . MiB"
    ):
        save_table(file, long)
    assert load_table(file, FINGERS) == TABLE


def test_a_loop_of_links_is_refused_in_one_sentence(tmp_path: Path) -> None:
    os.symlink("b", tmp_path / "a")
    os.symlink("a", tmp_path / "b")
    with pytest.raises(ConfigurationError, match="a: the poses cannot be saved"):
        save_table(tmp_path / "a", TABLE)
    assert (tmp_path / "a").is_symlink()


def test_tables_saved_by_two_threads_are_whole(tmp_path: Path) -> None:
    path = tmp_path / "poses.yaml"
    small = TeachTable(FINGERS)
    large = replace(
        small, poses=tuple(NamedPose(f"p{i}", Joints(0.0, 0.1, 0.0, 0.0)) for i in range(50))
    )
    save_table(path, small)
    failures: list[Exception] = []

    def save(table: TeachTable) -> None:
        try:
            for _ in range(20):
                save_table(path, table)
        except ConfigurationError as error:
            failures.append(error)

    threads = [threading.Thread(target=save, args=(table,)) for table in (small, small, large)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        try:
            load_table(path, FINGERS)
        except ConfigurationError as error:
            failures.append(error)
    assert not failures


def test_concurrent_additions_are_all_saved(tmp_path: Path) -> None:
    path = tmp_path / "poses.yaml"
    save_table(path, TeachTable(FINGERS))

    def teach(number: int) -> None:
        with changing(path):
            pose = replace(PLATE, name=f"p{number}", tool="fingers")
            save_table(path, load_table(path, FINGERS).with_pose(pose))

    threads = [threading.Thread(target=teach, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {pose.name for pose in load_table(path, FINGERS).poses} == {f"p{i}" for i in range(8)}
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_cannot_be_locked(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="the poses cannot be saved"):  # noqa: SIM117
        with changing(tmp_path / "none" / "poses.yaml"):
            pytest.fail("it was")


def test_a_concurrent_reader_reads_the_whole_old_table(tmp_path: Path) -> None:
    file = tmp_path / "poses.yaml"
    save_table(file, TABLE)
    before = file.read_bytes()
    with file.open("rb") as reader:
        save_table(file, TeachTable(FINGERS))
        assert reader.read() == before


def test_a_table_is_synced_before_and_its_name_after_the_replacement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "poses.yaml"
    save_table(file, TeachTable(FINGERS))
    old, synced, sync = file.read_bytes(), [], os.fsync

    def fsync(number: int) -> None:
        status = os.fstat(number)
        folder = os.path.samestat(status, tmp_path.stat())
        synced.append(("folder" if folder else status.st_size, file.read_bytes()))
        sync(number)

    monkeypatch.setattr(os, "fsync", fsync)
    save_table(file, TABLE)
    new = file.read_bytes()
    assert old != new
    assert synced == [(len(new), old), ("folder", new)]


def test_saving_leaves_nothing_else_and_keeps_mode_and_link(tmp_path: Path) -> None:
    file, link = tmp_path / "poses.yaml", tmp_path / "link.yaml"
    save_table(file, TeachTable(FINGERS))
    file.chmod(0o640)
    link.symlink_to(file)
    save_table(link, TABLE)
    assert link.is_symlink()
    assert load_table(file, FINGERS) == TABLE
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert {path.name for path in tmp_path.iterdir()} == {"poses.yaml", "link.yaml"}


def test_unknown_names_get_a_suggestion() -> None:
    with pytest.raises(InvalidArgumentError, match=r"no pose 'palte'; did you mean plate\?"):
        TABLE.pose("palte")
    with pytest.raises(InvalidArgumentError, match=r"no tool 'finger'; did you mean fingers\?"):
        TABLE.tool("finger")
    with pytest.raises(InvalidArgumentError, match="there are center, gate, plate"):
        TABLE.pose("xyz")


def test_duplicate_names_are_refused() -> None:
    with pytest.raises(InvalidArgumentError, match="there is a pose plate already"):
        TABLE.with_pose(PLATE)
    with pytest.raises(InvalidArgumentError, match="there is a pose center already"):
        TABLE.with_pose(NamedPose("center", Joints(0.0, 0.0, 0.0, 0.0)))
    with pytest.raises(InvalidArgumentError, match="there is a tool fingers already"):
        TABLE.with_tool(FINGERS)


def test_a_pose_can_be_deleted_unless_it_is_built_in() -> None:
    assert TABLE.without_pose("plate").poses == TABLE.poses[1:]
    with pytest.raises(InvalidArgumentError, match="center is built in"):
        TABLE.without_pose("center")
    with pytest.raises(InvalidArgumentError, match="no pose 'plates'; did you mean plate"):
        TABLE.without_pose("plates")


@pytest.mark.parametrize("value", [math.nan, math.inf, 350.0])
def test_impossible_values_are_refused(value: float) -> None:
    with pytest.raises(InvalidArgumentError, match=r"pose a, x.* is (outside|nan|inf)"):
        NamedPose("a", None, Pose(value, 0.0, 0.0))
    with pytest.raises(InvalidArgumentError, match=r"pose a, j3.* is (outside|nan|inf)"):
        NamedPose("a", Joints(0.0, 0.0, value, 0.0))
    with pytest.raises(InvalidArgumentError, match=r"tool a, mass.* is (outside|nan|inf)"):
        Tool("a", Pose(0.0, 0.0, 0.0), value)


def test_the_fingers_are_those_of_the_parameters() -> None:
    assert FINGERS.pose_tool_in_flange == (0.11908, 0.0, -0.14409, 0.0)
    joints = (0.3, 0.1, 0.8, -0.4)
    flange = kinematics_with(PARAMETERS, Tool("none", Pose(0.0, 0.0, 0.0), 0.0)).forward(joints)
    with_needle = kinematics_with(PARAMETERS, NEEDLE).forward(joints)
    assert with_needle == pytest.approx(flange.compose(NEEDLE.pose_tool_in_flange))


def test_the_built_in_pose_is_reachable() -> None:
    arm = kinematics_with(PARAMETERS, FINGERS)
    assert [pose.name for pose in BUILT_IN] == ["center"]
    assert all(pose.joints and arm.beyond(pose.joints) == [] for pose in BUILT_IN)


def test_a_name_of_a_pose_may_have_words(tmp_path: Path) -> None:
    pose = NamedPose("left plate 1", Joints(0.0, 0.2, 0.0, 0.0))
    path = tmp_path / "poses.yaml"
    save_table(path, TeachTable(FINGERS).with_pose(pose))
    assert load_table(path, FINGERS).pose("left plate 1") == pose
    for name in (" plate", "plate ", "a  b", "a\tb", "a\nb", "1 a", "a " * 33 + "a", "a\u00a0b"):
        with pytest.raises(InvalidArgumentError, match="single spaces"):
            NamedPose(name, pose.joints)
    with pytest.raises(InvalidArgumentError, match="tool name 'a b'"):
        Tool("a b", Pose(0.0, 0.0, 0.0, 0.0))
