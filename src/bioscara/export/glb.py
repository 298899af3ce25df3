"""The arm as it looks, as binary glTF 2.0."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from bioscara.dashboard.model import Visual, meshes, model_of
from bioscara.hardware.urdf_joints import Place, Triple, UrdfJoint
from bioscara.model import ArmParameters
from bioscara.model.stl import read_stl
from bioscara.version import __version__

_FLOAT, _UINT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
"""Numbers of the specification of glTF 2.0."""
_Y_UP = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""Rotation into the axes of glTF, whose y is up, as x, y, z, w."""


def glb(parameters: ArmParameters) -> bytes:
    """Return the arm as one file, in metres.

    Each link is a node with its name, below the node of its joint, if that can move: this has the
    joint's pose in its parent, and type, axis, limits and mimic as ``extras``. The link's node has
    the motion: its translation or rotation is that of the joint's position nearest to zero, and
    along or about the axis for another one.

    Raises:
        ConfigurationError: As :func:`bioscara.dashboard.model.model_of`.
    """
    model, document = model_of(parameters), _Document()
    # The link that no joint carries, which is not part of the arm.
    root = document.node("bioscara", rotation=_Y_UP)
    nodes = {joint.child: document.node(joint.child) for joint in model.joints}
    for joint in model.joints:
        parent, own = nodes.get(joint.parent, root), nodes[joint.child]
        if joint.type == "fixed":
            document.put(parent, own, joint.origin)
        else:
            carrier = document.node(joint.name, extras=_extras(joint))
            document.put(parent, carrier, joint.origin)
            document.put(carrier, own)
            document.displace(own, joint)
    files = meshes()
    for link in model.links:
        if link.visuals:
            document.draw(nodes[link.name], link.visuals, files)
    return document.written(root)


def _extras(joint: UrdfJoint) -> dict[str, Any]:
    """Return type, axis, limits and mimic of a joint, for viewers."""
    names = ("type", "axis", "lower", "upper")
    told = {name: getattr(joint, name) for name in names}
    return told | ({"mimic": msgspec.to_builtins(joint.mimic)} if joint.mimic else {})


class _Document:
    """A document of glTF, to which nodes and meshes are added."""

    def __init__(self) -> None:
        self._nodes: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._materials: dict[Triple, int] = {}
        self._accessors: list[dict[str, Any]] = []
        self._views: list[dict[str, Any]] = []
        self._binary = b""

    def node(self, name: str, **values: Any) -> int:
        """Add a node; return its number."""
        self._nodes.append({"name": name, **values})
        return len(self._nodes) - 1

    def put(self, parent: int, child: int, place: Place = (0.0,) * 6) -> None:
        """Put a node below another one, at a pose in it."""
        x, y, z, *angles = place
        self._nodes[parent].setdefault("children", []).append(child)
        if any((x, y, z)):
            self._nodes[child]["translation"] = [x, y, z]
        if any(angles):
            self._nodes[child]["rotation"] = _quaternion(angles)

    def displace(self, node: int, joint: UrdfJoint) -> None:
        """Move the node of a link to the position of its joint that is nearest to zero."""
        at = 0.0 if joint.type == "continuous" else min(max(0.0, joint.lower), joint.upper)
        if not at:
            return
        if joint.type == "prismatic":
            self._nodes[node]["translation"] = [at * part for part in joint.axis]
        else:
            sine = math.sin(at / 2.0)
            self._nodes[node]["rotation"] = [
                *(sine * part for part in joint.axis),
                math.cos(at / 2.0),
            ]

    def draw(self, node: int, visuals: Sequence[Visual], files: Mapping[str, bytes]) -> None:
        """Give a node a mesh, with a part of each colour."""
        parts = []
        for visual in visuals:
            triangles = read_stl(files[visual.mesh]).reshape(-1, 3).astype("<f4")
            # Without normals, triangles are flat, as the links' faces are.
            points, corners = np.unique(triangles, axis=0, return_inverse=True)
            parts.append(
                {
                    "attributes": {"POSITION": self._store(points, _FLOAT, _VERTICES)},
                    "indices": self._store(corners.reshape(-1).astype("<u4"), _UINT, _INDICES),
                    "material": self._material(visual.color),
                }
            )
        self._nodes[node]["mesh"] = len(self._meshes)
        self._meshes.append({"name": self._nodes[node]["name"], "primitives": parts})

    def _material(self, color: Triple) -> int:
        return self._materials.setdefault(color, len(self._materials))

    def _store(self, values: npt.NDArray[Any], kind: int, target: int) -> int:
        """Add an array to the binary part; return the number of its accessor."""
        data = values.tobytes()
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(data)}
        self._views.append({**view, "target": target})
        self._binary += data
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": kind,
            "count": len(values),
        }
        if kind == _FLOAT:
            accessor |= {
                "type": "VEC3",
                "min": values.min(axis=0).tolist(),
                "max": values.max(axis=0).tolist(),
            }
        else:
            accessor |= {"type": "SCALAR"}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def written(self, root: int) -> bytes:
        """Return the file, with a scene of this node."""
        document = {
            "asset": {"version": "2.0", "generator": f"bioscara {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [root]}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": [
                {
                    "pbrMetallicRoughness": {
                        "baseColorFactor": [*map(_linear, color), 1.0],
                        "metallicFactor": 0.0,
                        "roughnessFactor": 0.7,
                    }
                }
                for color in self._materials
            ],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._binary)}],
        }
        text = json.dumps(document, separators=(",", ":")).encode()
        chunks = [
            struct.pack("<II", len(data), kind) + data
            for data, kind in (
                (text + b" " * (-len(text) % 4), _JSON),
                (self._binary, _BINARY),  # of floats and integers of four bytes
            )
        ]
        size = 12 + sum(map(len, chunks))
        return struct.pack("<4sII", b"glTF", 2, size) + b"".join(chunks)


def _linear(value: float) -> float:
    """Return the share of light of a component of a colour, which is coded as sRGB."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def _quaternion(angles: Sequence[float]) -> list[float]:
    """Return rotations about the fixed axes x, y and z, in this order, as x, y, z, w."""
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(a / 2.0), math.cos(a / 2.0)) for a in angles)
    return [
        sx * cy * cz - cx * sy * sz,
        cx * sy * cz + sx * cy * sz,
        cx * cy * sz - sx * sy * cz,
        cx * cy * cz + sx * sy * sz,
    ]
