"""The scope that each command and each task needs is declared with it."""

from __future__ import annotations

import typing

from bioscara.api import messages as m
from bioscara.robot import tasks
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.tasks.task import Task

COMMANDS = typing.get_args(m.AnyCommand)


class Undeclared(Task, frozen=True, tag="undeclared"):
    """A task that says nothing of its scope."""


def test_what_declares_no_scope_is_for_administrators() -> None:
    assert Undeclared.scope is m.Command.scope is Scope.ADMIN
    undeclared: typing.Any = Undeclared()
    assert m.Start(task=undeclared).required_scope is Scope.ADMIN
    for kind in COMMANDS:
        if "controller" in kind.__name__.lower() and kind.needs_lease:
            assert kind.scope is Scope.ADMIN, kind


def test_looking_needs_no_lease_and_commanding_more_than_the_right_to_look() -> None:
    for kind in COMMANDS:
        assert not (kind.needs_lease and issubclass(kind, m.Query)), kind
        assert (kind.scope > Scope.VIEW) or not kind.needs_lease, kind
    for kind in typing.get_args(m.AnyTask):
        assert kind.scope is Scope.OPERATE, kind
    assert m.Start(task=tasks.Home()).required_scope is Scope.OPERATE


def test_the_world_of_a_simulated_arm_is_disturbed_by_operators_without_a_lease() -> None:
    for kind in (m.SimulateFault, m.PushBody, m.TiltBody, m.AddObstacle, m.TakeAway):
        assert (kind.scope, kind.needs_lease) == (Scope.OPERATE, False), kind
    assert m.GetBodies.scope is m.GetWorld.scope is Scope.VIEW


def test_only_an_administrator_takes_a_lease_by_force() -> None:
    assert m.AcquireLease().required_scope is Scope.OPERATE
    assert m.AcquireLease(force=True).required_scope is Scope.ADMIN


def test_anyone_may_look_plan_stop_and_pause() -> None:
    for kind in (m.Subscribe, m.GetState, m.MakePlan, m.StopAll, m.Pause):
        assert kind.scope is Scope.VIEW, kind
