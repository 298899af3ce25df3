"""After any fault at any time the arm comes to rest, reports why, and can be recovered."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from bioscara.bus import Direction, When
from bioscara.errors import BioscaraError, HomingError
from bioscara.model import load_parameters
from bioscara.protocol import ResetCause
from bioscara.report import CycleRecord
from simulated import clock_is_held, simulated_robot, turn_by_hand

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
SEEDS = range(int(os.environ.get("BIOSCARA_FAULT_SEEDS", "8")))


class Scene:
    """An arm with injectable faults of bus, mechanics and host."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.random = random.Random(seed)
        self.v1 = self.random.random() < 0.2
        self.arm, self.bus, self.robot = simulated_robot(
            folder, seed=seed, v1=self.v1, controllers_fed=self.random.random() < 0.5
        )
        self.lost_turns = False

    def blow(self) -> Callable[[], object]:
        """Return one of the possible faults."""
        choose, arm, bus = self.random.choice, self.arm, self.bus
        joint = choose(NAMES)
        return choose(
            (
                lambda: bus.off(When(address=choose((0x11, 0x12, 0x13, 0x14)))),
                bus.off,
                lambda: bus.flip(choose(list(Direction)), When(probability=choose((0.01, 0.5)))),
                lambda: bus.unavailable(choose((1, 3, 100))),
                lambda: arm.add_obstacle(joint, arm.position(joint)),
                lambda: arm.reset(joint, ResetCause.BROWN_OUT),
                lambda: arm.set_supply(False),
                lambda: arm.set_power(joint, False),
                lambda: arm.hang(joint),
                lambda: arm.overheat(joint),
                lambda: self._freeze_encoder(joint),
                lambda: self._jump_encoder(joint, self.random.uniform(-0.5, 0.5)),
                lambda: arm.set_stretch(choose((1e-4, 1e-3, 5e-2))),
                lambda: arm.set_friction(joint, self.random.uniform(2.0, 20.0)),
                self.robot.stop,
                self._interrupt,
            )
        )

    def heal(self) -> None:
        """Undo the fault."""
        self.bus.clear()
        self.arm.set_supply(True)
        self.arm.set_stretch(0.0)
        # Only its own power helps an original joint that holds the clock.
        off = clock_is_held(self.arm)
        for name in NAMES:
            if off:
                self.arm.set_power(name, False)
            self.arm.set_power(name, True)
            self.arm.set_power(name, True)
            self.arm.hang(name, False)
            self.arm.overheat(name, False)
            self.arm.freeze_encoder(name, False)
            self.arm.clear_obstacles(name)
            self.arm.set_friction(name, 1.0)
        self.arm.run(1.0)

    def home(self) -> None:
        """Home; twice where it disagrees with the time before the encoder lost turns."""
        try:
            self._home_from_an_open_elbow()
        except HomingError:
            if not self.lost_turns:
                raise
            self.robot.acknowledge()
            self.robot.recover()
            self._home_from_an_open_elbow()

    def _home_from_an_open_elbow(self) -> None:
        """Home; where the elbow is folded and the wrist's position unknown, as the refusal asks."""
        try:
            self.robot.home()
        except HomingError as refused:
            if "open the elbow by hand" not in str(refused):
                raise
            self.robot.disable()
            turn_by_hand(self.arm, "j3", 2.0)
            self.robot.home()

    def _jump_encoder(self, joint: str, turns: float) -> None:
        if not self.v1:  # An original joint does not notice, so neither does its host.
            self.arm.jump_encoder(joint, turns)

    def _freeze_encoder(self, joint: str) -> None:
        self.lost_turns = True
        self.arm.freeze_encoder(joint)

    def _interrupt(self) -> None:
        raise KeyboardInterrupt


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_fault_ends_at_rest_and_can_be_recovered_from(seed: int, tmp_path: Path) -> None:
    scene = Scene(seed, tmp_path)
    robot, blow = scene.robot, scene.blow()
    strike, count = scene.random.randrange(5, 200), 0

    def observe(_: CycleRecord) -> None:
        nonlocal count
        count += 1
        if count == strike:
            blow()

    with robot:
        robot.home()
        uniform = scene.random.uniform
        goal = (uniform(-1.0, 1.0), uniform(0.2, 0.33), uniform(0.0, 1.0), uniform(-1.0, 1.0))
        with suppress(BioscaraError, KeyboardInterrupt):
            robot.move_joints(goal, on_cycle=observe)
        scene.arm.run(1.0)
        assert max(abs(scene.arm.velocity(name)) for name in NAMES) < 0.05
        scene.heal()
        if robot.faults:
            robot.acknowledge()
            robot.recover()
        scene.home()
        # A joint that was homed alone leaves the arm folded as it stands: so it gets out anywhere.
        j1, j2, _, j4 = robot.state.positions[:4]
        robot.move_joints((j1, j2, 0.0, j4))
        robot.move_joints((-0.5, 0.3, 0.5, 0.5))
        for name, position in zip(NAMES, (-0.5, 0.3, 0.5, 0.5), strict=True):
            assert scene.arm.position(name) == pytest.approx(position, abs=0.02)
        assert robot.shutdown() == []
