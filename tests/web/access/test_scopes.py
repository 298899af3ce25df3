"""The scope that each command and each task needs, in a second table to compare."""

from __future__ import annotations

import typing

import msgspec

from bioscara.api import messages as m
from bioscara.web.access.scopes import Scope, required_scope

VIEW, OPERATE, ADMIN = Scope
COMMANDS = {
    VIEW: "subscribe recall get_state get_description get_workspace get_history get_faults "
    "get_simulation get_goal get_lease get_statistics get_parameters get_log "
    "list_controllers list_flight_records get_flight_record get_joints "
    "get_trajectories list_goals make_plan stop pause query_controller "
    "get_introspection",
    OPERATE: "start add_points set_jog_velocity end_jog cancel pause_goal resume_goal resume "
    "set_speed_override simulate_fault set_simulation_speed acquire_lease renew_lease "
    "release_lease report",
    ADMIN: "set_parameters load_controller configure_controller "
    "cleanup_controller unload_controller switch_controllers set_hardware_state "
    "add_goal_points follow_goal stream_trajectory send_gripper_goal trigger_homing "
    "command_controller cancel_controller_goal set_controller_scaling "
    "set_controller_parameters",
}
TASKS = {
    OPERATE: "move_joints move_to move_linear move_relative move_circular move_named move_sequence "
    "unfold home follow execute jog move_gripper open_gripper close_gripper grasp release_load "
    "enable disable enable_gripper disable_gripper acknowledge recover set_scene set_table "
    "set_tool set_reduced_speed attach detach confirm_scene",
}


def scopes(table: dict[Scope, str]) -> dict[str, Scope]:
    return {word: scope for scope, words in table.items() for word in words.split()}


def tags(union: object) -> dict[str, type[msgspec.Struct]]:
    return {kind.__struct_config__.tag: kind for kind in typing.get_args(union)}


def bare(kind: type[msgspec.Struct]) -> typing.Any:
    """Return a message without values: its type alone decides."""
    return kind(**dict.fromkeys(kind.__struct_fields__))


def test_each_command_needs_the_scope_of_the_table() -> None:
    commands = tags(m.AnyCommand)
    expected = scopes(COMMANDS)
    assert set(commands) == set(expected)
    del commands["start"]
    found = {tag: required_scope(bare(kind)) for tag, kind in commands.items()}
    assert found == {tag: expected[tag] for tag in commands}


def test_each_task_needs_the_scope_of_the_table() -> None:
    tasks = tags(m.AnyTask)
    found = {tag: required_scope(m.Start(task=bare(kind))) for tag, kind in tasks.items()}
    assert found == scopes(TASKS)


def test_only_an_administrator_takes_a_lease_by_force() -> None:
    assert required_scope(m.AcquireLease()) == OPERATE
    assert required_scope(m.AcquireLease(force=True)) == ADMIN


def test_messages_that_need_a_lease_are_refused_to_viewers() -> None:
    for kind in typing.get_args(m.AnyCommand):
        if kind.needs_lease:
            assert required_scope(bare(kind)) > VIEW, kind
