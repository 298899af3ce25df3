"""Requests of a client to the owner without motion: joints, overlay, simulated faults."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.errors import ConfigurationError, ConflictError, InvalidArgumentError
from bioscara.remote import RemoteRobot
from served import NAME, arm_served, eventually


def test_a_client_reads_and_replaces_the_overlay(tmp_path: Path) -> None:
    overlay = tmp_path / "mine.yaml"
    overlay.write_text("")
    with arm_served(overlay=overlay), RemoteRobot(NAME) as robot:
        before = robot.overlay()
        assert (before.overlay, before.restart) == ("", False)
        text = "joints: {j1: {reduction: 35.2}}\n"
        after = robot.set_overlay(text, before.revision)
        assert (after.overlay, after.restart) == (text, True)
        assert overlay.read_text() == text
        with pytest.raises(ConflictError, match="the overlay was changed since"):
            robot.set_overlay("", before.revision)
        with pytest.raises(ConfigurationError, match="reduction"):
            robot.set_overlay("joints: {j1: {reduction: 0}}\n", after.revision)
        assert robot.overlay() == after


def test_an_edit_of_the_overlay_by_hand_is_not_overwritten(tmp_path: Path) -> None:
    overlay, edited = tmp_path / "mine.yaml", "joints: {j1: {reduction: 35.2}}\n"
    overlay.write_text("")
    with arm_served(overlay=overlay), RemoteRobot(NAME) as robot:
        before = robot.overlay()
        overlay.write_text(edited)
        with pytest.raises(ConflictError, match="by another client or an editor"):
            robot.set_overlay("joints: {j1: {reduction: 35.1}}\n", before.revision)
        assert overlay.read_text() == edited
        after = robot.overlay()
        assert (after.overlay, after.restart) == (edited, True)
        assert not robot.set_overlay("", after.revision).restart


def test_a_client_injects_faults_and_reads_the_reports_of_the_joints() -> None:
    with arm_served(), RemoteRobot(NAME) as robot:
        robot.enable()
        before = robot.joint_reports().joints
        robot.simulate_fault("reset", "j3")
        eventually(lambda: robot.fault_list().state == "latched")
        assert robot.faults[0].kind.name == "JOINT_RESET"
        robot.acknowledge()
        robot.recover()
        after = robot.joint_reports().joints
        changed = [now.boot_id != then.boot_id for now, then in zip(after, before, strict=True)]
        assert changed == [False, False, True, False]
        with pytest.raises(InvalidArgumentError, match="j5"):
            robot.simulate_fault("reset", "j5")
