"""Whatever commands the joints, the arm keeps clear of zones, table and itself."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from bioscara.control.clearance import Clearance
from bioscara.control.forward_command_controller import ForwardCommandController
from bioscara.control.tool_speed import ToolSpeedCap
from bioscara.planning.sweep import SLACK
from bioscara.planning.zones import Box, Scene
from bioscara.robot import kinematics_of
from control.world import NAMES, PARAMETERS, World
from planning.inside import touched
from planning.scenes import free_joints, random_joints, random_scene

ARM = kinematics_of(PARAMETERS)
# Thrown to and fro at its full acceleration, j3 loses its reference whoever commands it.
JOINTS = [replace(joint, max_acceleration=0.5 * joint.max_acceleration) for joint in PARAMETERS.joints]
FORWARD = ForwardCommandController.TYPE


class Guarded:
    def __init__(self, scene: Scene, at: Sequence[float]) -> None:
        self.world = World(at=dict(zip(NAMES, at, strict=True)), joints=JOINTS)
        self.scene = scene
        limiter, manager = self.world.manager.limiter, self.world.manager
        self.guards = tuple(limiter.guards.values())
        self.cap = ToolSpeedCap(self.guards, ARM.tool_speed, math.inf)
        self.clearance = Clearance(self.guards, manager, lambda: (ARM, self.scene))
        limiter.stages = (self.cap, self.clearance)
        self.forward = {
            kind: self.world.load(kind, FORWARD, joints=NAMES, interface_name=kind)
            for kind in ("position", "velocity")
        }

    def run(self, cycles):
        rows = [[guard.here for guard in self.guards]]
        for _ in range(cycles):
            self.world.loop.step()
            rows.append([guard.here for guard in self.guards])
        return np.array(rows)

if __name__ == "__main__":
    rng = np.random.default_rng(1)
    start = (0.3, 0.2, 0.8, -0.5)
    g = Guarded(Scene((), 0.0), start)
    g.world.switch("position")
    for name, scene in (("free", Scene()), ("near", Scene((Box("w", (0.2, 0.5, 0.0), (0.7, 0.9, 0.5)),), 0.0))):
        g.scene = scene
        t=time.perf_counter()
        n=0; worst=math.inf
        for _ in range(100):
            g.forward["position"].command([*random_joints(rng)])
            rows = g.run(15); n+=15
            worst=min(worst, scene.clearance(ARM, rows).min())
        print(name, (time.perf_counter()-t)/n*1e3, "ms", worst, g.clearance.interventions, list(g.world.manager.warnings)[-3:])
