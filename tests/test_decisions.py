"""Each sentence of docs/decisions about a refusal names a test that holds it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from entries import entry

TESTS = Path(__file__).parent
DECISIONS = TESTS.parent / "docs/decisions"
REFUSED = re.compile(r"\brefuse[sd]?\b", re.IGNORECASE)

HELD = {
    "0001 refuses unknown words before argparse":
        "cli/test_arguments.py::test_wrong_usage_is_one_sentence_that_names_the_word_and_the_remedy",
    "0004 refuses every write without trailer except STOP":
        "firmware/tests/test_wire.cpp::an_armed_session_refuses_writes_without_trailer_but_never_STOP",
    "0006 refuses to open one of them again":
        "drivers/joint/test_joint.py::test_a_delayed_copy_of_arm_does_not_reopen_an_earlier_session",
    "0007 refuses everything else with its line":
        "planning/files/test_ros_message_parser.py"
        "::test_a_text_that_is_no_message_is_refused_with_its_line",
    "0007 damaged files are refused":
        "planning/files/test_ros_message_parser.py"
        "::test_a_damaged_text_that_is_accepted_is_read_alike",
    "0007 Anchors, tags and JSON-style quoted keys are refused":
        "planning/files/test_ros_message_parser.py"
        "::test_a_text_that_is_no_message_is_refused_with_its_line",
    "0009 names that come twice are refused":
        "control/manager/test_startup_and_parameter_rules.py"
        "::test_rule_42_hardware_that_comes_twice_is_refused",
    "0009 while another one uses the arm is refused, and says which":
        "robot/operations/test_operations.py"
        "::test_a_second_operation_on_a_device_is_refused_and_names_the_first",
    "0009 hardware that is not ACTIVE are refused always":
        "control/manager/test_manager_rules.py"
        "::test_rule_51_command_interfaces_of_inactive_hardware_are_refused",
    "0009 refused until those that fall back on it are inactive":
        "control/manager/test_manager_rules.py"
        "::test_rule_46_the_fallback_of_an_active_controller_stays_configured",
    "0009 circles are refused":
        "control/manager/test_cycle_rules.py::test_rule_64_fallbacks_must_be_able_to_take_over",
    "0009 refused only here are refused with a reason":
        "ros/controllers/test_homing_and_gripper.py"
        "::test_what_is_refused_to_the_panel_is_in_log_and_diagnostics",
    "0010 points between which no finite curve exists are refused":
        "control/controllers/joint_trajectory/test_rules_of_validation.py"
        "::test_rule_09_stricter_points_that_no_curve_can_join_are_refused",
    "0010 A point beyond a joint's limits is refused":
        "control/controllers/joint_trajectory/test_rules_of_validation.py"
        "::test_pln1_a_point_beyond_a_limit_is_refused_with_value_limit_and_unit",
    "0010 These names are refused":
        "ros/controllers/test_parameters.py"
        "::test_asynchronous_controllers_and_other_commanded_joints_are_refused",
    "0012 refuses the motion where that fails":
        "robot/test_disk.py::test_a_full_disk_refuses_a_gripper_motion_without_a_fault",
    "0012 refuses motions to another width before they begin":
        "robot/test_disk.py::test_a_full_disk_refuses_a_gripper_motion_without_a_fault",
    "0013 opening is refused there":
        "robot/test_planner_beside_itself.py::test_the_gripper_does_not_open_against_the_arm",
    "0013 plans next to the column are refused that a known width would allow":
        "robot/test_planner_beside_itself.py::test_collision_checks_use_the_known_jaw_width",
    "0016 more bytes than its register has must be refused":
        "firmware/tests/test_wire.cpp"
        "::HZ07_lengths_of_0_to_64_bytes_are_survived_and_only_whole_frames_executed",
    "0021 is refused while the joint is stalled":
        "drivers/joint/test_joint.py::test_the_stall_guard_neither_clears_nor_hides_a_stall",
    "0021 a `<gpio>` is refused with its line":
        "ros/arm/test_description.py"
        "::test_a_tag_that_would_have_no_effect_is_refused_with_its_line",
    "0021 a command mode that is claimed twice is refused":
        "control/manager/test_manager_rules.py"
        "::test_rule_50_claim_conflicts_are_refused_in_both_modes",
    "0022 *Refused*, with the reason":
        "model/test_overlay.py::test_fixed_values_are_refused_with_the_reason",
    "0022 `srdf_of` refuses wider ones":
        "model/test_urdf.py::test_pairs_are_freed_only_in_the_ranges_that_were_checked",
    "0022 a value that is the same is not refused":
        "model/test_overlay.py::test_any_part_of_the_file_is_the_same_arm",
    "0024 where a line of the lists is forgotten, access is refused":
        "web/access/test_scopes.py::test_what_declares_no_scope_is_for_administrators",
    "0026 building is refused with a sentence":
        "interfaces/test_beside_ros.py::test_beside_an_active_installation_nothing_is_built",
    "0028 while joints move otherwise, goals are refused":
        "robot/operations/controllers/test_controller_commands.py"
        "::test_the_jaws_move_beside_a_planned_goal_and_at_once_after_it",
    "0028 It is refused with the reason, as homing another joint":
        "robot/operations/controllers/test_controller_commands.py"
        "::test_joints_are_homed_by_triggers_in_a_safe_order",
    "0028 a motion of another program is refused while a controller is active":
        "ros/arm/test_arm_services.py"
        "::test_while_a_controller_commands_the_arm_other_motions_are_refused",
    "0028 at 100 kHz and 100 Hz they are refused":
        "robot/operations/controllers/test_run_controllers.py"
        "::test_velocities_that_the_bus_cannot_carry_are_refused_with_the_remedy",
    "0029 while the owner refuses calls that come together":
        "ros/controllers/test_manager_services.py"
        "::test_rule_43_calls_that_come_together_are_answered_one_after_the_other",
    "0029 configuring refuses them":
        "ros/controllers/test_manager_services.py"
        "::test_rule_45_a_controller_is_configured_with_the_parameters_that_it_has_by_then",
    "0029 A parameter that no type has is refused":
        "ros/controllers/test_parameters.py"
        "::test_a_misspelt_parameter_reaches_the_owner_which_refuses_it",
    "0033 unknown, missing, nested or there twice is refused with its line":
        "ros/arm/test_description.py"
        "::test_a_tag_that_would_have_no_effect_is_refused_with_its_line",
    "0039 every motion except a jog is refused with UnconfirmedError":
        "server/test_bench_file.py"
        "::test_until_a_person_confirms_it_the_arm_only_jogs_at_reduced_speed",
    "0041 `motor_power` is refused with that reason":
        "sim/test_bench.py::test_a_motor_supply_of_its_own_is_refused_with_the_remedy",
    "0042 a board that is in its bootloader before is refused":
        "cli/commands/setup/test_flash_on_bus.py"
        "::test_with_a_board_in_its_bootloader_nothing_is_begun",
    "0044 differs in MOD_2 and checksum alone or rejects them, refuses":
        "firmware/tests/test_flips.cpp"
        "::each_bit_of_the_encoders_start_may_arrive_flipped",
    "0045 refuse SETUP and the motion commands without trailer for 10 s":
        "firmware/tests/test_wire.cpp"
        "::a_joint_that_speaks_version_2_moves_for_no_frame_without_trailer",
    "0047 A `bioscara` in a hidden folder is refused":
        "service/test_service.py::test_rights_systemd_and_a_place_that_services_can_read_are_required",
    "0052 One that finds none is not refused":
        "hostile/test_gateway_connections.py"
        "::test_connections_of_the_same_address_and_token_hinder_no_stop",
    "0055 refuses questions when none came for 2 s":
        "server/test_hanging.py::test_a_suspended_owner_is_reported_after_two_seconds",
}  # fmt: skip
"""Tests by the number of a decision and words of its sentence."""
NO_PROMISE = {
    "0007 14 s to refuse 16 kB of brackets",
    "0030 Nothing is refused for the loads",
    "0036 A jog of the tool refused every velocity",
    "0040 or refused its check",
    "0047 A refused start is repeated",
}
"""Sentences about other software, former behaviour, or the absence of a check."""


def sentences() -> Iterator[str]:
    """Yield the sentences that speak of a refusal, after the number of the decision."""
    for path in sorted(DECISIONS.glob("0*.md")):
        for block in re.split(r"\n\n|\n(?=[-|#])", path.read_text()):
            for sentence in re.split(r"(?<=[.;:])\s+|\s+\|\s+", " ".join(block.split())):
                if REFUSED.search(sentence):
                    yield f"{path.name[:4]} {sentence}"


def test_each_sentence_about_a_refusal_names_its_test() -> None:
    found = list(sentences())
    words = [*HELD, *NO_PROMISE]

    def speaks(sentence: str, promise: str) -> bool:
        number, _, text = promise.partition(" ")
        return sentence.startswith(number) and text in sentence

    assert [each for each in found if not any(speaks(each, promise) for promise in words)] == []
    assert [each for each in words if not any(speaks(sentence, each) for sentence in found)] == []


def test_each_of_these_tests_exists() -> None:
    for test in HELD.values():
        with entry(test):
            path, _, name = test.partition("::")
            root = TESTS.parent if path.startswith("firmware/tests/") else TESTS
            kind = r"TEST\(" if path.endswith(".cpp") else "def "
            assert re.search(rf"^{kind}{name}\b", (root / path).read_text(), re.MULTILINE)
