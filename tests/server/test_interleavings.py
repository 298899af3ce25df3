"""Random interleavings of clients, their deaths, and the arm: laws that always hold.

There are no threads: requests are handled, planned, answered and stepped in the order of a random
generator, in virtual time. Also while a motion is planned, where other threads really run.
"""

from __future__ import annotations

import os
import random
from collections import Counter, deque
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.errors import BioscaraError, LeaseError
from bioscara.planning.motions.jog import JointVelocity
from bioscara.report import CycleRecord
from bioscara.robot import tasks
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory
from bioscara.server.clients.client import Later
from bioscara.server.owner import Owner
from served import HALF, own_robot

FIRST = int(os.environ.get("BIOSCARA_INTERLEAVINGS_FIRST", "0"))
SEEDS = range(FIRST, FIRST + int(os.environ.get("BIOSCARA_INTERLEAVINGS", "15")))
STEPS = 150
CLIENTS = 3


class FakeClient:
    """A client as the owner knows it, with the epoch that it believes it has."""

    def __init__(self, number: int, name: str = "") -> None:
        self.session, self.name = f"session {number}", name or f"client {number}"
        self.connected, self.gone = True, False
        self.epoch: int | None = None

    def send_record(self, goal: int, record: CycleRecord) -> None:
        """Take a record."""


class Model:
    """The right to command, derived from the requests alone."""

    def __init__(self) -> None:
        self.holder, self.epoch = "", 0
        self.time_to_live = self.until = 0.0

    def lapse(self, now: float) -> None:
        if self.holder and now >= self.until:
            self.holder = ""

    def may(self, client: FakeClient, epoch: int | None) -> bool:
        return bool(self.holder) and (client.session, epoch) == (self.holder, self.epoch)


class Interleaving:
    """One run: the owner, its clients, and the requests that are not finished."""

    def __init__(self, robot: Robot, seed: int) -> None:
        self.robot, self.choice = robot, random.Random(seed)
        robot.runner.observers = ()
        self.time = 0.0
        self.posts: deque[Callable[[], object]] = deque()
        self.owner = Owner(
            robot,
            "left",
            self.posts.append,
            simulated=True,
            overlay=None,
            clock=lambda: self.time,
        )
        self.model = Model()
        self.born = CLIENTS
        self.clients = [FakeClient(number) for number in range(CLIENTS)]
        self.planning: list[tuple[FakeClient, int | None, Later, int]] = []
        self.planned: list[tuple[Later, Any, int]] = []
        self.sent: dict[int, int] = {}
        """Moment in which each goal was sent."""
        self.taken: dict[str, int] = {}
        """Moment in which the lease of each session was last taken by another client."""
        self.moment = self.stopped = 0
        self.nested = False
        self.pauses: dict[str, FakeClient] = {}

    def run(self) -> None:
        for _ in range(STEPS):
            self.act()
            self.check()
        self.finish()

    def act(self) -> None:
        self.moment += 1
        actions = (
            (self.acquire, 4), (self.start, 8), (self.plan, 8), (self.answer, 8), (self.cycle, 12),
            (self.drain, 8), (self.stop, 1), (self.renew, 8), (self.release, 1), (self.die, 1),
            (self.wait, 3), (self.command, 4), (self.jog, 3), (self.pause, 1), (self.resume, 2),
        )  # fmt: skip
        (action,) = self.choice.choices(
            [each for each, _ in actions], [each for _, each in actions]
        )
        action()

    def handle(self, client: FakeClient, command: Any, epoch: int | None = None) -> Any:
        """Handle a request; only the holder of the lease may be obeyed."""
        self.model.lapse(self.time)
        may = self.model.may(client, epoch)
        try:
            result = self.owner.handle(client, command, epoch)
        except LeaseError:
            assert not (command.needs_lease and may), f"{client.name} was refused its own lease"
            raise
        assert may or not command.needs_lease, f"{client.name} was obeyed without a lease"
        return result

    def someone(self) -> FakeClient:
        """Return a client: mostly the holder of the lease."""
        if self.choice.random() < 0.7:
            for client in self.clients:
                if client.session == self.model.holder:
                    return client
        return self.choice.choice(self.clients)

    def epoch_of(self, client: FakeClient) -> int | None:
        """Return the epoch that a request carries: sometimes an old one, or another's."""
        if self.choice.random() < 0.15:
            return self.choice.choice((None, self.owner.lease.epoch, self.owner.lease.epoch - 1))
        return client.epoch

    def acquire(self) -> None:
        client = self.someone()
        command = m.AcquireLease(
            time_to_live=self.choice.choice((0.3, 2.0, 60.0)), force=self.choice.random() < 0.25
        )
        model = self.model
        model.lapse(self.time)
        free = not model.holder or model.holder == client.session or command.force
        try:
            state = self.owner.handle(client, command, None)
        except LeaseError:
            assert not free
            return
        assert free
        assert isinstance(state, m.LeaseState)
        assert state.lease.epoch > model.epoch
        if model.holder not in {"", client.session}:
            self.taken[model.holder] = self.moment
        model.holder, model.epoch = client.session, state.lease.epoch
        model.time_to_live = command.time_to_live
        model.until = self.time + command.time_to_live
        client.epoch = state.lease.epoch

    def renew(self) -> None:
        client = self.someone()
        try:
            self.handle(client, m.RenewLease(), self.epoch_of(client))
        except LeaseError:
            return
        self.model.until = self.time + self.model.time_to_live

    def release(self) -> None:
        client = self.someone()
        try:
            self.handle(client, m.ReleaseLease(), self.epoch_of(client))
        except LeaseError:
            return
        self.model.holder = ""

    def stop(self) -> None:
        client = self.choice.choice(self.clients)
        self.owner.handle(client, m.StopAll(), None)
        if self.model.holder != client.session:
            self.model.holder = ""
        self.pauses.clear()
        self.moment += 1
        self.stopped = self.moment

    def die(self) -> None:
        """Replace a client by another one, as its program has ended without a word."""
        self.born += 1
        number = self.choice.randrange(CLIENTS)
        self.clients[number].connected = False
        # Sometimes its program begins again: another session of the same name.
        self.clients[number] = FakeClient(self.born, self.choice.choice(("", "of the page")))

    def start(self) -> None:
        client = self.someone()
        positions = [here + self.choice.uniform(-0.1, 0.1) for here in HALF]
        positions[1] = 0.2
        task = self.choice.choice(
            (
                tasks.MoveJoints(positions=tuple(positions)),
                tasks.MoveJoints(positions=tuple(positions), velocity_scaling=0.1),
                m.Jog(),
                tasks.Enable(),
                tasks.OpenGripper(),
                tasks.SetReducedSpeed(reduced=True),
                tasks.MoveNamed(name="nowhere"),
            )
        )
        command = m.Start(task=task, on_lease_loss=self.choice.choice(("stop", "finish")))
        try:
            epoch = self.epoch_of(client)
            later = self.handle(client, command, epoch)
        except LeaseError:
            return
        assert isinstance(later, Later)
        self.sent[self.owner.goals.last] = self.moment
        self.planning.append((client, epoch, later, self.owner.goals.last))

    def plan(self) -> None:
        """Begin an operation, as a thread of the owner does."""
        if not self.planning:
            return
        client, epoch, later, goal = self.planning.pop(self.choice.randrange(len(self.planning)))
        self.owner.expire()
        self.model.lapse(self.time)
        may = self.model.may(client, epoch)
        try:
            done = later.work()
        except BioscaraError:
            return
        assert may, "a goal has begun whose lease had ended"
        self.planned.append((later, done, goal))

    def answer(self) -> None:
        """Finish a request whose operation was begun."""
        if self.planned:
            later, done, _ = self.planned.pop(self.choice.randrange(len(self.planned)))
            later.finish(done)

    def while_planning(self) -> None:
        """Let other threads do something while one plans a motion."""
        if self.nested:
            return
        self.nested = True
        others = (self.acquire, self.stop, self.cycle, self.drain, self.wait, self.release)
        for _ in range(self.choice.randrange(3)):
            self.moment += 1
            self.choice.choice(others)()
        self.nested = False

    def cycle(self) -> None:
        for _ in range(self.choice.choice((1, 3, 30, 100))):
            self.time += 0.002
            self.robot.runner.step(idle=True)

    def drain(self) -> None:
        for _ in range(self.choice.choice((1, len(self.posts)))):
            if self.posts:
                self.posts.popleft()()

    def wait(self) -> None:
        self.time += self.choice.choice((0.01, 0.01, 0.1, 0.1, 0.5, 3.0))

    def command(self) -> None:
        client = self.someone()
        goal = self.choice.randint(1, max(self.owner.goals.last, 1))
        command = self.choice.choice(
            (
                m.Cancel(goal),
                m.PauseGoal(goal),
                m.ResumeGoal(goal),
            )
        )
        try:
            self.handle(client, command, self.epoch_of(client))
        except BioscaraError:
            return

    def pause(self) -> None:
        client = self.choice.choice(self.clients)
        self.owner.handle(client, m.Pause(), None)
        self.pauses[client.session] = client

    def resume(self) -> None:
        """Lift the pauses of a client: of its own, of its former connection, or all."""
        client, before = self.choice.choice(self.clients), self.pauses
        self.model.lapse(self.time)
        if self.model.holder == client.session:
            self.pauses = {}
        else:
            self.pauses = {
                session: author
                for session, author in before.items()
                if author is not client and (author.connected or author.name != client.name)
            }
        try:
            self.owner.handle(client, m.Resume(), None)
        except LeaseError:
            assert before, "nothing was paused"
            assert self.pauses == before, f"{client.name} was refused its own pause"

    def jog(self) -> None:
        client = self.someone()
        for goal in self.owner.goals.running:
            command = self.choice.choice(
                (
                    m.SetJogVelocity(goal=goal.number, joints=JointVelocity(0.1)),
                    m.EndJog(goal.number),
                )
            )
            try:
                self.handle(client, command, self.epoch_of(client))
            except BioscaraError:
                return

    def check(self) -> None:
        """Check the laws that hold between any two steps."""
        self.owner.expire()
        self.model.lapse(self.time)
        assert self.robot.runner.arm.pauses.keys() == self.pauses.keys()
        lease = self.owner.lease
        assert (lease.holder, lease.epoch) == (self.model.holder, self.model.epoch)
        begun = [goal for _, _, goal in self.planned]
        for goal in self.owner.goals.running:
            stopped = goal.operation.claim.stopped
            assert stopped or self.sent[goal.number] > self.stopped, "a stopped arm moves"
            assert stopped or not goal.needs_lease or goal.session == lease.holder, "no commander"
            taken = self.taken.get(goal.session, 0)
            assert stopped or self.sent[goal.number] > taken, "it goes on without its lease"
        if begun and all(self.sent[number] < self.stopped for number in begun):
            names = {goal.operation for goal in self.owner.goals.running}
            for operation in self.robot.runner.arm.operations:
                assert operation in names or operation.done or operation.claim.stopped

    def finish(self) -> None:
        """Stop everything, and check that nothing moves on and each end was reported."""
        self.stop()
        while self.planning:
            self.plan()
        while self.planned:
            self.answer()
        for _ in range(500):
            self.robot.runner.step(idle=True)
            if not self.robot.runner.arm.operations:
                break
        assert not self.robot.runner.arm.operations
        before = self.robot.state.positions
        for _ in range(30):
            self.robot.runner.step(idle=True)
        moved = max(abs(a - b) for a, b in zip(self.robot.state.positions, before, strict=True))
        assert moved < 1e-3
        while self.posts:
            self.posts.popleft()()
        told: dict[str, Counter[int]] = {"goal_accepted": Counter(), "goal_ended": Counter()}
        number = 0
        while (event := self.owner.events.after(number)) is not None:
            number = event.number
            if event.what in told and event.goal is not None:
                told[event.what][event.goal.goal] += 1
        assert told["goal_accepted"] == told["goal_ended"]
        assert set(told["goal_ended"].values()) <= {1}
        assert self.robot.faults == ()

    def settle(self) -> None:
        """Let stopped operations come to rest, also after a law was broken."""
        self.robot.stop()
        for _ in range(500):
            self.robot.runner.step(idle=True)
            if not self.robot.runner.arm.operations:
                break
        assert not self.robot.runner.arm.operations


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    with own_robot(tmp_path_factory.mktemp("evidence")) as made:
        made.home()
        yield made


@pytest.mark.parametrize("seed", SEEDS)
def test_one_client_commands_and_a_stopped_arm_stays_stopped(
    robot: Robot, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot.runner.observers = ()
    robot.speed_override = 1.0
    robot.resume()
    robot.move_joints(HALF)
    run = Interleaving(robot, seed)
    prepare = FollowTrajectory.prepare

    def interleaved(operation: FollowTrajectory, arm: Any) -> None:
        run.while_planning()
        prepare(operation, arm)
        run.while_planning()

    monkeypatch.setattr(FollowTrajectory, "prepare", interleaved)
    # Nothing steps the arm while a request waits for the rest of a former motion.
    monkeypatch.setattr("bioscara.server.owner._REST", 0.01)
    try:
        run.run()
    finally:
        run.settle()


@pytest.mark.parametrize("taken", [True, False])
def test_a_motion_whose_lease_is_taken_before_it_is_a_goal_is_stopped(
    robot: Robot, taken: bool
) -> None:
    robot.move_joints(HALF)
    run = Interleaving(robot, 0)
    first, second, _ = run.clients
    state: Any = run.owner.handle(first, m.AcquireLease(), None)
    task = tasks.MoveJoints(positions=(0.4, *HALF[1:]))
    start = m.Start(task=task, on_lease_loss="finish")
    later: Any = run.owner.handle(first, start, state.lease.epoch)
    try:
        begun = later.work()
        if not taken:
            # It lapses, and may finish.
            run.time += 3.0
        run.owner.handle(second, m.AcquireLease(force=True), None)
        later.finish(begun)
        (goal,) = run.owner.goals.running
        assert goal.operation.claim.stopped == taken
    finally:
        run.settle()
