"""The state of a bench outlives its owner; a person confirms it before the arm moves."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bioscara import Box, Cylinder, Load, Prism, Robot, Scene, ToolVelocity
from bioscara.api import messages as m
from bioscara.cli import main
from bioscara.drivers.gripper.width_store import write_width
from bioscara.errors import ConfigurationError, ConflictError, LifecycleError, UnconfirmedError
from bioscara.planning.files.scene_file import read_scene, save_scene
from bioscara.sim import SimulatedArm
from programs import environment, wait_for_line
from served import HALF, NAME, RawClient, arm_served, eventually
from simulated import simulated_bus

SCENE = Scene(
    (Box("reader", (0.2, -0.4, 0.0), (0.3, -0.3, 0.1)), Cylinder("post", 0.4, 0.3, 0.02, 0, 0.3)),
    table_height=-0.05,
    margin=0.008,
)
LOAD = Load("plate", Prism.between((-0.02, -0.03, -0.02), (0.02, 0.03, 0.0)), 0.05, ("table",))


@pytest.fixture
def arm() -> SimulatedArm:
    return simulated_bus(seed=2, homed=True, at=HALF).arm


@contextmanager
def client(arm: SimulatedArm, folder: Path, width: float = 0.08, **settings: Any) -> Iterator[Any]:
    """Serve an arm that keeps its bench in a folder, and connect to it.

    The jaws are where the last owner has left them.
    """
    with (
        arm_served(arm=arm, at=None, bench=folder / "bench.json", **settings) as served,
        Robot.connect(f"arm:{NAME}") as robot,
    ):
        servo: Any = served.robot._servo
        write_width(servo.root / "width", width)
        robot.enable()
        yield robot


def unconfirmed() -> tuple[str, ...]:
    with RawClient() as look:
        state = look.request(m.GetWorkspace())
    assert isinstance(state, m.WorkspaceState)
    return state.unconfirmed


def kept(folder: Path, *parts: bytes) -> Callable[[], bool]:
    """Return a condition: the file of the bench has these texts."""
    path = folder / "bench.json"
    return lambda: path.exists() and all(part in path.read_bytes() for part in parts)


def test_scene_tool_load_and_jaws_of_the_last_owner_are_there_and_unconfirmed(
    arm: SimulatedArm, tmp_path: Path
) -> None:
    with client(arm, tmp_path) as robot:
        robot.scene = SCENE
        robot.gripper.enable()
        robot.gripper.grasp(LOAD)
        before = robot.workspace
        eventually(kept(tmp_path, b"reader", b"plate", b"0.06"))
    with client(arm, tmp_path, 0.057) as robot:
        after = robot.workspace
        assert (after.scene, after.load) == (before.scene, before.load)
        assert unconfirmed() == (
            "the scene (reader, post; a table at z = -0.05 m)",
            "the load plate",
        )
        robot.gripper.enable()
        # The jaws are as far apart as the load is wide, independent of their command.
        assert robot.workspace.widths == pytest.approx((0.057, 0.06))
        robot.confirm_scene()
        assert unconfirmed() == ()
        robot.move_relative(z=0.01)
        robot.detach()
        eventually(lambda: not kept(tmp_path, b"plate")())
    with client(arm, tmp_path) as robot:
        assert robot.load is None
        assert unconfirmed() == ("the scene (reader, post; a table at z = -0.05 m)",)


def jog_up(robot: Any) -> float:
    """Jog the tool up for some cycles; return the distance [m]."""
    before = robot.state.positions[1]
    velocities = iter([ToolVelocity(z=0.05)] * 20)
    robot.jog(lambda: next(velocities, None))
    return float(robot.state.positions[1] - before)


def test_until_a_person_confirms_it_the_arm_only_jogs_at_reduced_speed(
    arm: SimulatedArm, tmp_path: Path
) -> None:
    with client(arm, tmp_path) as robot:
        robot.scene = SCENE
        robot.attach(LOAD)
        eventually(kept(tmp_path, b"reader", b"plate"))
    with client(arm, tmp_path) as robot:
        refused: list[Callable[[], object]] = [
            lambda: robot.move_relative(z=0.01),
            lambda: robot.move_joints(HALF),
            lambda: robot.follow(robot.plan.move_relative(z=0.01).trajectory),
            robot.home,
            robot.unfold,
            robot.gripper.open,
            lambda: setattr(robot, "reduced_speed", False),
        ]
        for call in refused:
            with pytest.raises(UnconfirmedError, match=r"the load plate are from .* run; look"):
                call()
        controllers = robot.controllers
        kind = "joint_trajectory_controller/JointTrajectoryController"
        controllers.load("follower", kind, {"joints": ("j1", "j2", "j3", "j4")})
        controllers.configure("follower")
        with pytest.raises(UnconfirmedError):
            controllers.switch(["follower"])
        assert jog_up(robot) > 0.005
        # Another scene and the end of the load are as good as a confirmation.
        robot.detach()
        with pytest.raises(UnconfirmedError, match=r"the scene .* is from"):
            robot.move_relative(z=0.01)
        robot.scene = Scene()
        assert unconfirmed() == ()
        robot.move_relative(z=-0.01)


def test_a_load_of_the_last_run_is_taken_off_before_homing(tmp_path: Path) -> None:
    arm = simulated_bus(seed=2).arm
    with client(arm, tmp_path) as robot:
        robot.attach(replace(LOAD, touches=()))
        eventually(kept(tmp_path, b"plate"))
    with client(arm, tmp_path) as robot:
        robot.confirm_scene()
        with pytest.raises(LifecycleError, match=r"take it off and detach\(\) it, or hold it and"):
            robot.home()
        robot.detach()
        robot.home()


def test_a_scene_of_a_file_is_declared_and_kept_in_it(arm: SimulatedArm, tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    save_scene(path, SCENE)
    with client(arm, tmp_path, scene=path) as robot:
        assert robot.scene.zones == SCENE.zones
        assert unconfirmed() == ()
        other = Scene((Box("rack", (0.2, -0.4, 0.0), (0.3, -0.3, 0.1), 0.1, links=("gripper",)),))
        robot.scene = other
        assert read_scene(path) == other
        # The former one, which a person may have written, is not lost.
        assert read_scene(tmp_path / "scene.yaml.bak") == SCENE
        save_scene(path, SCENE)
        with pytest.raises(ConflictError, match="the file with the scene: the arm has its"):
            robot.scene = Scene()
        assert robot.scene.zones == SCENE.zones
        # A file that is removed is no empty bench.
        path.rename(tmp_path / "away.yaml")
        with pytest.raises(ConfigurationError, match=r"scene\.yaml is gone; .*restore the file"):
            robot.scene = other
        assert robot.scene.zones == SCENE.zones
        (tmp_path / "away.yaml").rename(path)
        robot.scene = other
        robot.scene = SCENE
    with client(arm, tmp_path, scene=path) as robot:
        assert (robot.scene.zones, unconfirmed()) == (SCENE.zones, ())


def test_a_declared_scene_needs_no_file_and_no_confirmation(
    arm: SimulatedArm, tmp_path: Path
) -> None:
    with client(arm, tmp_path) as robot:
        robot.scene = SCENE
        eventually(kept(tmp_path, b"reader"))
    world = Scene((Box("nest", (0.2, -0.4, 0.0), (0.3, -0.3, 0.1)),))
    with client(arm, tmp_path, declared=world) as robot:
        assert (robot.scene.zones, unconfirmed()) == (world.zones, ())
        robot.scene = SCENE


def test_a_file_that_cannot_be_used_is_no_empty_bench(arm: SimulatedArm, tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    for content, reason in (
        ('{"version": 1', "truncated"),
        ('{"version": 2, "scene": {}, "tool": "fingers", "load": null, "held": null}', "version"),
        ('{"version": 1, "scene": {}, "tool": "saw", "load": null, "held": null}', "saw"),
    ):
        path.write_text(content)
        with (
            pytest.raises(ConfigurationError, match=rf"bench\.json: .*{reason}.*; look what"),
            client(arm, tmp_path),
        ):
            pass


def test_a_killed_owner_has_kept_what_its_clients_set(
    start: Callable[..., subprocess.Popen[str]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ("-m", "bioscara", "serve", "--name", "bench", "--homed")
    env = environment(XDG_STATE_HOME=str(tmp_path / "state"))

    def served() -> subprocess.Popen[str]:
        process = start(*words, env=env, cwd=tmp_path, stderr=subprocess.STDOUT)
        wait_for_line(process, "bench is served")
        return process

    owner = served()
    robot: Any = Robot.connect("arm:bench")
    with robot:
        robot.scene = SCENE
        robot.attach(LOAD)
        path = tmp_path / "state/bioscara/bench@sim.json"
        eventually(lambda: path.exists() and b"plate" in path.read_bytes())
        owner.kill()
    owner = start(*words, env=env, cwd=tmp_path, stderr=subprocess.STDOUT)
    line = wait_for_line(owner, "not confirmed since the owner was started")
    assert "the scene (reader, post; a table at z = -0.05 m) and the load plate" in line
    wait_for_line(owner, "bench is served")
    with Robot.connect("arm:bench", timeout=10.0) as robot, pytest.raises(UnconfirmedError):
        robot.unfold()
    assert main(["move", "--arm", "bench", "--name", "center"]) == 2
    assert "'bioscara confirm'" in capsys.readouterr().err
    assert main(["status", "--arm", "bench"]) == 0
    assert main(["confirm", "--arm", "bench"]) == 0
    assert main(["confirm", "--arm", "bench"]) == 0
    out = capsys.readouterr().out
    assert "warning: not confirmed since the owner was started: the scene (reader, post" in out
    assert "bench: the load plate is confirmed" in out
    assert out.endswith("bench: there is nothing to confirm\n")
