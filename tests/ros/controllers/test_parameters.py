"""Parameters of nodes, as the owner's controllers take them."""

from __future__ import annotations

import array
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from bioscara.control.manager.registry import TYPES
from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters
from bioscara.model.urdf import URDF
from bioscara.ros.arm.description import RobotDescription
from bioscara.ros.controllers.parameter_names import described, known
from bioscara.ros.controllers.parameter_sections import sections
from bioscara.ros.controllers.parameters import for_owner, nested, without_effect
from entries import entry
from ros.controllers.upstream_parameters import (
    BROADCASTER,
    FORWARD,
    GRIPPER,
    HOMING,
    IDLE,
    NEEDED,
    OURS,
    TAKEN,
    TRAJECTORY,
    UPSTREAM,
)
from ros.descriptions import LEFT, renamed
from ros.share import PACKAGES, parameters_of

ARM = load_parameters()
DESCRIPTION = RobotDescription(URDF.read_text())
DOCUMENT = Path(__file__).parents[3] / "docs/ros2.md"
FILES = [*PACKAGES.glob("*/config/*controller*.yaml")]


def owned(kind: str, **flat: Any) -> dict[str, Any]:
    return for_owner(
        kind, {name.replace("__", "."): value for name, value in flat.items()}, DESCRIPTION
    )


def test_names_with_dots_become_groups() -> None:
    flat = {"a.b.c": 1, "a.b.d": array.array("d", [1.0, 2.0]), "e": "x"}
    assert nested(flat) == {"a": {"b": {"c": 1, "d": [1.0, 2.0]}}, "e": "x"}


@pytest.mark.parametrize("flat", [{"a": 1, "a.b": 2}, {"a.b": 2, "a": 1}])
def test_a_name_that_is_a_value_and_a_group_is_refused(flat: dict[str, int]) -> None:
    with pytest.raises(ConfigurationError, match="parameter a"):
        nested(flat)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("velocity_joint_trajectory_controller", TRAJECTORY),
        ("position_joint_trajectory_controller", TRAJECTORY),
        ("homing_controller", HOMING),
        ("gripper_controller", GRIPPER),
        ("joint_state_broadcaster", BROADCASTER),
    ],
)
def test_rule_40_the_files_of_the_bringup_are_understood(name: str, kind: str) -> None:
    flat = parameters_of(name, *FILES)
    configured(kind, {**flat, "use_sim_time": False})


def test_rule_58_and_69_parameters_of_the_manager_that_cannot_apply_are_reported() -> None:
    flat = parameters_of("controller_manager", *FILES)
    assert without_effect(flat) == []
    sentences = without_effect(
        {
            "enforce_command_limits": False,
            "handle_exceptions": True,
            "hardware_components_initial_state.inactive": ["bioscara_arm"],
            "thread_priority": 50,
            "diagnostics.threshold.controllers.periodicity.mean_error.warn": 5.0,
            "diagnostics.threshold.hardware_components.periodicity.mean_error.warn": 5.0,
            "defaults.switch_controller.strictness": "auto",
        }
    )
    assert [sentence.partition(" ")[0] for sentence in sentences] == [
        "enforce_command_limits",
        "defaults.switch_controller.strictness",
        "diagnostics.threshold.hardware_components.periodicity.mean_error.warn",
        "hardware_components_initial_state",
        "thread_priority",
    ]
    assert "limits always apply" in sentences[0]


def homing(**flat: Any) -> Any:
    """Return the parameters of homing, as the owner reads them."""
    return TYPES[HOMING].PARAMETERS.read("homing_controller", owned(HOMING, **flat))


def test_homing_joints_come_from_flattened_names_in_the_order_of_the_arm() -> None:
    flat = {
        f"{which}_interfaces__joints__{joint}__interfaces": ["home"]
        for which in ("command", "state")
        for joint in ("j4", "j2")
    }
    assert homing(**flat).joints == ("j2", "j4")
    read = homing(**flat, joints=["j4", "j2"], max_travel=[7.0, 0.4])
    assert (read.joints, read.max_travel) == (("j4", "j2"), (7.0, 0.4))
    with pytest.raises(ConfigurationError, match=r"max_travel .* give joints, too"):
        homing(**flat, max_travel=[7.0, 0.4])


COMMANDED = "command_interfaces__joints__j1__interfaces"


@pytest.mark.parametrize(
    ("flat", "complaint"),
    [
        ({COMMANDED: ["position"]}, r"not \[home\]"),
        ({COMMANDED: ["home"], "command_interfaces__joints__j1__gains": 1.0}, r"not \[home\]"),
        ({COMMANDED: ["home"], "joints": ["j2"]}, "of other joints"),
        (
            {COMMANDED: ["home"], "state_interfaces__joints__j4__interfaces": ["home"]},
            "of other joints",
        ),
    ],
)
def test_homing_of_something_else_is_refused(flat: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        homing(**flat)


def test_rule_70_the_broadcaster_requires_joints_of_the_arm_alone() -> None:
    assert owned(BROADCASTER)["joints"] == ["j1", "j2", "j3", "j4"]
    assert owned(BROADCASTER, joints=["j2", "gripper"])["joints"] == ["j2"]
    same = {"map_interface_to_joint_state__position": "position"}
    values = owned(
        BROADCASTER, frame_id="world", use_local_topics=True, interfaces=["position"], **same
    )
    assert values == {"joints": ["j1", "j2", "j3", "j4"]}


@pytest.mark.parametrize(
    ("flat", "complaint"),
    [
        ({"joints": ["j1", "j9"]}, "'j9' is none of j1, j2, j3, j4, gripper"),
        ({"map_interface_to_joint_state__position": "home"}, "keep their names"),
    ],
)
def test_what_the_broadcaster_cannot_publish_is_refused(
    flat: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        owned(BROADCASTER, **flat)


def test_prefixed_joints_have_the_names_of_the_owner() -> None:
    description = RobotDescription(renamed(LEFT, "bioscara_arm"))
    flat = {"joints": ["left_j1"], "gains.left_j1.p": 1.0, "constraints.left_j1.goal": 0.1}
    assert for_owner(TRAJECTORY, flat, description) == {
        "joints": ["j1"],
        "gains": {"j1": {"p": 1.0}},
        "constraints": {"j1": {"goal": 0.1}},
    }


def test_asynchronous_controllers_and_other_commanded_joints_are_refused() -> None:
    assert owned(TRAJECTORY, is_async=False, joints=["j1"], command_joints=["j1"]) == {
        "joints": ["j1"]
    }
    with pytest.raises(ConfigurationError, match="no asynchronous controllers"):
        owned(TRAJECTORY, is_async=True)
    with pytest.raises(ConfigurationError, match="command_joints"):
        owned(TRAJECTORY, joints=["j1"], command_joints=["j2"])


def test_a_misspelt_parameter_reaches_the_owner_which_refuses_it(tmp_path: Path) -> None:
    values = owned(TRAJECTORY, joints=["j1"], comand_interfaces=["position"])
    with pytest.raises(ConfigurationError, match="comand_interfaces"):
        TYPES[TRAJECTORY].PARAMETERS.read("a", values)


@pytest.mark.parametrize(
    ("kind", "own"),
    [
        (TRAJECTORY, {"constraints.goal_time", "constraints.j1.goal", "gains.left_j3.p"}),
        (HOMING, {"max_travel", "command_interfaces.joints.j1.interfaces"}),
        (GRIPPER, {"allow_stalling"}),
        (BROADCASTER, {"use_local_topics", "map_interface_to_joint_state.position"}),
        (FORWARD, {"interface_name"}),
    ],
)
def test_each_type_has_its_parameters_and_those_of_all_nodes(kind: str, own: set[str]) -> None:
    assert all(known(kind, name) for name in (*own, "use_sim_time", "robot_description"))
    others = {"constrains.goal_time", "constraints.goal_tim", "constraints", "gains.j1.q"}
    if kind != TRAJECTORY:
        others |= {"constraints.goal_time", "gains.j1.p"}
    assert not any(known(kind, name) for name in others)


def test_the_parameters_of_the_arguments_belong_to_nodes_or_to_a_wildcard(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(
        "/**: {ros__parameters: {robot_description: '<robot/>'}}\n"
        "left: {homing: {ros__parameters: {update_rate: 5}}}\n"
        "homing:\n  ros__parameters:\n"
        "    command_interfaces:\n"
        "      joints: [{j1: {interfaces: [home]}}, {j2: {interfaces: [home]}}]\n"
    )
    words = ["--ros-args", "-p", "a.b:=1", "--params-file", str(file), "-p", "homing:c:=d:e"]
    assert sections(words) == {
        "/**": {"a.b", "robot_description"},
        "/left/homing": {"update_rate"},
        "/homing": {f"command_interfaces.joints.j{each}.interfaces" for each in (1, 2)} | {"c"},
    }


def test_the_interfaces_of_another_type_are_no_joints_to_home() -> None:
    with pytest.raises(ConfigurationError, match="command_interfaces is"):
        homing(command_interfaces=["velocity"])


@pytest.mark.parametrize("kind", UPSTREAM)
def test_each_parameter_of_upstream_has_an_effect_or_is_refused_or_documented(kind: str) -> None:
    text = DOCUMENT.read_text()
    for each in UPSTREAM[kind]:
        assert each.default is None or type(each.default) is type(each.other), each.name
        documented = f"`{each.name.replace('.j1.', '.JOINT.')}`" in text
        for value, expected in ((each.default, each.with_default), (each.other, each.with_other)):
            with entry(f"{each.name} {value}"):
                flat = {**NEEDED[kind], each.name: value}
                if expected in (TAKEN, IDLE):
                    configured(kind, flat)
                    assert known(kind, each.name)
                    assert expected == TAKEN or documented
                else:
                    with pytest.raises(ConfigurationError, match=expected):
                        configured(kind, flat)


@pytest.mark.parametrize("kind", UPSTREAM)
def test_there_are_no_others_and_their_defaults_are_those_of_upstream(kind: str) -> None:
    upstream = {each.name: each.default for each in UPSTREAM[kind] if each.only != "jazzy"}
    ours = {each.name: each.default for each in described(TYPES[kind].PARAMETERS, ["j1"])}
    assert ours.keys() - upstream.keys() == OURS[kind] | {"update_rate", "fallback_controllers"}
    for name in ours.keys() & upstream.keys() - NEEDED[kind].keys() - {"joints"}:
        with entry(name):
            given = ours[name]
            assert (list(given) if isinstance(given, tuple) else given) == upstream[name]


def configured(kind: str, flat: Mapping[str, Any]) -> None:
    """Configure a controller with the parameters of its node."""
    parameters = TYPES[kind].PARAMETERS.read("a", for_owner(kind, flat, DESCRIPTION))
    TYPES[kind]("a", parameters).on_configure()
