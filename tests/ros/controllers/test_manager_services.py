"""The services of the controller manager, by the calls of spawners, ``ros2 control`` and panel."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from ros.bringup_controllers import (
    BROADCASTER,
    GRIPPER,
    HOMING,
    NOTHING_TO_DO,
    POSITION,
    TRIGGER,
    VELOCITY,
    clear,
    energise,
)
from ros.rig import MANAGER, Rig, Ros, manager_type

pytestmark = pytest.mark.ros
FORWARD = "forward_command_controller/ForwardCommandController"


@pytest.fixture(autouse=True)
def cleared(ros: Ros) -> Iterator[None]:
    yield
    clear(ros)


def load(ros: Ros, name: str) -> bool:
    ok: bool = ros.manager("load_controller", name=name)["ok"]
    return ok


def configure(ros: Ros, name: str) -> bool:
    ok: bool = ros.manager("configure_controller", name=name)["ok"]
    return ok


def test_rule_43_calls_that_come_together_are_answered_one_after_the_other(ros: Ros) -> None:
    """As the panel sends them: configure, and switch without waiting."""
    assert load(ros, BROADCASTER)
    calls = [("configure_controller", {"name": BROADCASTER})]
    calls += [("list_controllers", {})] * 20
    calls += [("switch_controller", {"activate_controllers": [BROADCASTER], "strictness": 1})]
    calls += [("list_controllers", {})] * 20
    answers = ros.do(
        "calls",
        calls=[
            {"type": manager_type(name), "name": f"{MANAGER}/{name}", "request": request}
            for name, request in calls
        ],
    )["answers"]
    assert len(answers) == 42
    assert answers[0]["ok"]
    assert ros.states()[BROADCASTER] in ("active", "inactive")
    # Services of different clients are not ordered among themselves; once configured it switches.
    assert ros.switch([BROADCASTER], strictness=1)["ok"]
    assert ros.states() == {BROADCASTER: "active"}


def test_rule_44_load_takes_the_type_of_the_parameter_and_refuses_what_it_cannot_load(
    ros: Ros, ros_rig: Rig
) -> None:
    assert load(ros, VELOCITY)
    assert ros.states() == {VELOCITY: "unconfigured"}
    assert not load(ros, VELOCITY)
    ros_rig.logged(f"a controller named {VELOCITY} is loaded already")
    assert not load(ros, "nameless")
    ros_rig.logged("it has to be the parameter nameless.type of controller_manager")
    ros.set_parameters(MANAGER, odd__type="no_controller/NoController")
    assert not load(ros, "odd")
    ros_rig.logged("no_controller/NoController")
    assert f"/{VELOCITY}" in ros.do("graph")["nodes"]


def test_undeclared_parameters_files_and_arguments_of_a_spawner_reach_the_controller(
    ros: Ros, ros_rig: Rig
) -> None:
    """``spawner -p FILE --controller-ros-args``: parameters of the manager, then a load.

    As launch writes them, a section for all nodes has what no controller knows.
    """
    file = ros_rig.folder / "forward.yaml"
    file.write_text(
        "/**: {ros__parameters: {robot_description: <robot/>, of_others.gain: 1.0}}\n"
        "fallen_back:\n  ros__parameters:\n    joints: [j1, j2]\n    interface_name: velocity\n"
    )
    for given in (
        {"fallen_back__params_file": [str(file)]},
        {"fallen_back__type": FORWARD},
        {"fallen_back__fallback_controllers": [HOMING]},
        {"fallen_back__node_options_args": ["--ros-args", "-p", "update_rate:=25"]},
    ):
        assert [each["successful"] for each in ros.set_parameters(MANAGER, **given)] == [True]
    assert load(ros, "fallen_back")
    assert configure(ros, "fallen_back")
    (listed,) = ros.manager("list_controllers")["controller"]
    assert listed["required_command_interfaces"] == ["j1/velocity", "j2/velocity"]
    assert listed["update_rate"] == 25
    ros_rig.logged("of_others.gain: ignored")
    # The fallback is checked at activation: it is not loaded.
    energise(ros)
    assert "fallback" in ros.switch(["fallen_back"])["message"]
    assert ros.manager("unload_controller", name="fallen_back")["ok"]
    file.write_text(file.read_text() + "    of_nobody: 1.0\n")
    assert load(ros, "fallen_back")
    assert not configure(ros, "fallen_back")
    ros_rig.logged("fallen_back: of_nobody is not a known parameter")
    (refused,) = ros.set_parameters("/fallen_back", of_somebody=1.0)
    assert "of_somebody: a forward_command_controller" in refused["reason"]


def test_a_file_that_is_missing_is_answered(ros: Ros, ros_rig: Rig) -> None:
    ros.set_parameters(MANAGER, other__type=FORWARD, other__params_file=["/nowhere/a.yaml"])
    assert not load(ros, "other")
    ros_rig.logged("the node other cannot be made")
    ros.set_parameters(MANAGER, other__params_file=[""])
    assert ros.states() == {}


def test_rule_45_a_controller_is_configured_with_the_parameters_that_it_has_by_then(
    ros: Ros,
) -> None:
    assert load(ros, POSITION)
    assert ros.set_parameters(f"/{POSITION}", joints=["j4", "j1", "j2", "j3"])[0]["successful"]
    assert configure(ros, POSITION)
    (listed,) = ros.manager("list_controllers")["controller"]
    names = [f"{joint}/position" for joint in ("j4", "j1", "j2", "j3")]
    assert listed["required_command_interfaces"] == names
    (refused,) = ros.set_parameters(f"/{POSITION}", joints=["j1"])
    assert not refused["successful"]
    assert "joints cannot be changed while" in refused["reason"]


def test_rule_46_cleanup_and_unload_leave_active_controllers_alone(ros: Ros) -> None:
    ros.spawn(BROADCASTER)
    assert not ros.manager("cleanup_controller", name=BROADCASTER)["ok"]
    assert not ros.manager("unload_controller", name=BROADCASTER)["ok"]
    assert ros.switch((), [BROADCASTER])["ok"]
    assert ros.manager("cleanup_controller", name=BROADCASTER)["ok"]
    assert ros.manager("cleanup_controller", name=BROADCASTER)["ok"]
    assert ros.states() == {BROADCASTER: "unconfigured"}
    assert ros.manager("unload_controller", name=BROADCASTER)["ok"]
    assert not ros.manager("unload_controller", name=BROADCASTER)["ok"]
    assert ros.states() == {}
    assert f"/{BROADCASTER}" not in ros.do("graph")["nodes"]


@pytest.mark.parametrize(("strictness", "strict"), [(0, True), (1, False), (2, True), (3, False)])
def test_rule_47_and_48_a_wrong_name_refuses_a_strict_switch_alone(
    strictness: int, strict: bool, ros: Ros
) -> None:
    ros.spawn(BROADCASTER, active=False)
    answer = ros.switch([BROADCASTER, "absent"], strictness=strictness)
    assert answer["ok"] is not strict
    assert ("absent" in answer["message"]) is strict
    assert ros.states() == {BROADCASTER: "inactive" if strict else "active"}


def test_rule_47_the_default_strictness_is_a_parameter_and_other_numbers_are_refused(
    ros: Ros,
) -> None:
    ros.spawn(BROADCASTER, active=False)
    name = "defaults__switch_controller__strictness"
    ros.set_parameters(MANAGER, **{name: "best_effort"})
    assert ros.switch([BROADCASTER, "absent"], strictness=0)["ok"]
    ros.set_parameters(MANAGER, **{name: "strict"})
    assert "strictness 7 is none" in ros.switch([BROADCASTER], strictness=7)["message"]


def test_rule_48_nothing_to_do_is_a_success_unless_no_name_is_known(ros: Ros) -> None:
    ros.spawn(BROADCASTER)
    answer = ros.switch([BROADCASTER], strictness=1)
    assert answer == {"ok": True, "message": NOTHING_TO_DO}
    assert not ros.switch(["absent"], strictness=1)["ok"]


def test_rule_52_and_53_answers_say_what_was_switched(ros: Ros) -> None:
    ros.spawn(BROADCASTER, active=False)
    assert ros.switch([BROADCASTER])["message"] == "Successfully switched controllers!"
    answer = ros.manager(
        "switch_controller", deactivate_controllers=[BROADCASTER], strictness=1, timeout={"sec": 0}
    )
    assert answer["ok"]
    assert BROADCASTER in answer["message"]


def test_rule_54_controllers_are_listed_as_ros_lists_them(ros: Ros) -> None:
    energise(ros)
    ros.spawn(VELOCITY, active=False)
    (listed,) = ros.manager("list_controllers")["controller"]
    velocities = [f"j{number}/velocity" for number in (1, 2, 3, 4)]
    assert listed["type"] == "joint_trajectory_controller/JointTrajectoryController"
    assert listed["update_rate"] == 50
    assert listed["claimed_interfaces"] == []
    assert listed["required_command_interfaces"] == velocities
    assert not listed["is_chainable"]
    assert not listed["is_async"]
    assert ros.switch([VELOCITY])["ok"]
    (listed,) = ros.manager("list_controllers")["controller"]
    assert listed["claimed_interfaces"] == velocities
    interfaces = ros.manager("list_hardware_interfaces")["command_interfaces"]
    assert [each["name"] for each in interfaces if each["is_claimed"]] == velocities
    types = ros.manager("list_controller_types")
    assert TRIGGER in types["types"]
    assert len(types["types"]) == len(types["base_classes"])


def test_rule_55_components_and_interfaces_are_listed_by_the_names_of_the_description(
    ros: Ros,
) -> None:
    components = {
        each["name"]: each for each in ros.manager("list_hardware_components")["component"]
    }
    assert list(components) == ["bioscara_arm", "bioscara_gripper_128"]
    arm = components["bioscara_arm"]
    assert (arm["type"], arm["rw_rate"], arm["is_async"]) == ("system", 50, False)
    assert len(arm["command_interfaces"]) == 12
    listed = ros.manager("list_hardware_interfaces")
    names = [each["name"] for each in listed["state_interfaces"]]
    assert names == sorted(names)
    assert {"j1/home", "gripper/position"} <= set(names)
    assert all(each["data_type"] == "double" for each in listed["command_interfaces"])


def test_rule_56_a_state_is_named_by_its_number_else_by_its_label(ros: Ros) -> None:
    """The panel sends the number alone, hardware_spawner both, and compares both."""

    def change(name: str = "bioscara_gripper_128", **state: object) -> dict[str, object]:
        answer: dict[str, object] = ros.manager(
            "set_hardware_component_state", name=name, target_state=state
        )
        return answer

    active = {"ok": True, "state": {"id": 3, "label": "active"}}
    assert change(id=3) == active
    assert change(id=3, label="active") == active
    assert change(id=2, label="nonsense")["state"] == {"id": 2, "label": "inactive"}
    # Two steps.
    assert change(label="unconfigured")["state"] == {"id": 1, "label": "unconfigured"}
    assert change(label="active") == active
    assert change(label="asleep") == {"ok": False, "state": {"id": 3, "label": "active"}}
    assert change(id=9)["ok"] is False
    assert change(name="absent", id=3) == {"ok": False, "state": {"id": 0, "label": "unknown"}}


def test_rule_57_hardware_that_goes_down_takes_its_controllers_along(ros: Ros) -> None:
    energise(ros, "bioscara_gripper_128")
    ros.spawn(GRIPPER)
    assert ros.hardware("bioscara_gripper_128", "inactive")["ok"]
    assert ros.states() == {GRIPPER: "inactive"}
    assert ros.hardware("bioscara_gripper_128", "unconfigured")["ok"]
    (interface,) = [
        each
        for each in ros.manager("list_hardware_interfaces")["command_interfaces"]
        if each["name"] == "gripper/position"
    ]
    assert not interface["is_available"]


def test_controller_libraries_are_reloaded_once_no_controller_is_loaded(ros: Ros) -> None:
    energise(ros)
    ros.spawn(VELOCITY)
    assert not ros.manager("reload_controller_libraries", force_kill=False)["ok"]
    assert ros.states() == {VELOCITY: "active"}
    assert ros.manager("reload_controller_libraries", force_kill=True)["ok"]
    assert ros.states() == {}
    assert ros.manager("reload_controller_libraries", force_kill=False)["ok"]


def test_what_is_not_there_is_refused_with_a_sentence(ros: Ros, ros_rig: Rig) -> None:
    for name, value, sentence in (
        ("is_async", True, "no asynchronous controllers"),
        ("command_interfaces", ["effort"], "effort"),
    ):
        assert load(ros, POSITION)
        before = ros_rig.log
        assert ros.set_parameters(f"/{POSITION}", **{name: value})[0]["successful"]
        assert not configure(ros, POSITION)
        ros_rig.logged(sentence, before)
        assert ros.manager("unload_controller", name=POSITION)["ok"]


def test_rule_45_parameters_may_come_after_the_load(ros: Ros, ros_rig: Rig) -> None:
    ros.set_parameters(MANAGER, late__type=FORWARD)
    assert load(ros, "late")
    ros_rig.logged("joints")
    assert ros.states() == {"late": "unconfigured"}
    assert not configure(ros, "late")
    assert ros.manager("cleanup_controller", name="late")["ok"]
    ros.set_parameters("/late", joints=["j1"], interface_name="velocity")
    assert configure(ros, "late")
    assert ros.states() == {"late": "inactive"}


def test_a_switch_names_only_controllers_that_clients_see(ros: Ros) -> None:
    """The owner has its own, and those whose parameters it refuses are not there."""
    ros.spawn(BROADCASTER, active=False)
    ros.set_parameters(MANAGER, late__type=FORWARD)
    assert load(ros, "late")
    for name in ("absent", "arm.hold_controller"):
        for strictness in (1, 2):
            answer = ros.switch([name], strictness=strictness)
            assert not answer["ok"]
            assert answer["message"] == (
                f"no controller named {name} is loaded; there are: {BROADCASTER}, late"
            )
    assert ros.switch([BROADCASTER, "absent"], strictness=1)["ok"]
    answer = ros.switch(["late"])
    assert not answer["ok"]
    assert answer["message"] == "late is unconfigured: configure it first"
    assert ros.switch(["late"], strictness=1)["ok"]
    assert ros.states() == {BROADCASTER: "active", "late": "unconfigured"}
