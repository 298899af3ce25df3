"""Forward kinematics of the links of a robot description."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from viser.transforms import SE3, SO3

from bioscara.hardware import Urdf
from bioscara.hardware.urdf_joints import UrdfJoint, joints_of


class KinematicTree:
    """The joints of a description, parents before children.

    Args:
        urdf: The description.

    Attributes:
        root: The link that no joint carries.
        joints: All joints.
        free: The joints that follow no other and are not fixed.

    Raises:
        ConfigurationError: The links form no tree, or a joint is of another kind.
    """

    def __init__(self, urdf: Urdf) -> None:
        self.root, self.joints = joints_of(urdf)
        self.free = tuple(j for j in self.joints if j.kind != "fixed" and j.mimic is None)
        self._origins = {joint.name: _pose(joint) for joint in self.joints}

    def place(self, positions: Mapping[str, float]) -> dict[str, SE3]:
        """Return the pose of each link in the frame of the root.

        Args:
            positions: Position of each free joint, by its name [rad or m].
        """
        links = {self.root: SE3.identity()}
        for joint in self.joints:
            if joint.mimic is not None:
                followed = positions[joint.mimic.joint]
                position = joint.mimic.multiplier * followed + joint.mimic.offset
            else:
                position = positions.get(joint.name, 0.0)
            moved = self._origins[joint.name] @ _motion(joint, position)
            links[joint.child] = links[joint.parent] @ moved
        return links


def _pose(joint: UrdfJoint) -> SE3:
    rotation = SO3.from_rpy_radians(*joint.origin.rpy)
    return SE3.from_rotation_and_translation(rotation, np.array(joint.origin.xyz))


def _motion(joint: UrdfJoint, position: float) -> SE3:
    if joint.kind == "revolute":
        return SE3.from_rotation(SO3.exp(np.array(joint.axis) * position))
    if joint.kind == "prismatic":
        return SE3.from_translation(np.array(joint.axis) * position)
    return SE3.identity()
