"""``bioscara home`` of chosen joints; no others are moved."""

from __future__ import annotations

from cli.said import Said


def test_chosen_joints_are_homed_in_their_order_and_the_rest_is_named(said: Said) -> None:
    lines = said.output("home --joint j1 --joint j2").splitlines()
    assert lines[1] == "homing j2, j1"
    assert lines[-1] == "not homed: j3, j4"


def test_all_joints_chosen_end_as_all_without_a_choice(said: Said) -> None:
    chosen = said.output("home --joint j1 j2 j3 j4").splitlines()
    assert chosen[1] == "homing j2, j1, j4, j3"
    assert chosen[-1].startswith("--joints ")


def test_a_joint_whose_homing_needs_another_one_is_refused(said: Said) -> None:
    refused = said.failure("home --joint j1", status=1)
    assert (
        "j1 cannot be homed: j2 is not homed, and the hand could meet the arm; home j2" in refused
    )
