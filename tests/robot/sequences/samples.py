"""Sequences for tests: any that can be made, and one of each kind of step that the arm can do."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import ANGLE_MAX
from bioscara.robot import tasks as t
from bioscara.robot.sequences import steps as s
from bioscara.robot.tasks.forms import LoadForm

NAMES = st.one_of(
    st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,20}", fullmatch=True),
    st.sampled_from(("null", "true", "No", "y", "inf", "NaN", "e1")),
)
TITLES = st.text(max_size=30).filter(str.isprintable) | st.sampled_from(
    ("~", "null", "'", '"', ": ", "# 3", "- a", "...", "---", "<b>&amp;</b>", "\\", '\\"')
)
_ANGLES, _LENGTHS = st.floats(-ANGLE_MAX, ANGLE_MAX), st.floats(-10.0, 10.0)
_WIDTHS, _SHARES = st.floats(0.0, 1.0), st.floats(1e-3, 1.0)
_PLACES = st.builds(Pose, _LENGTHS, _LENGTHS, _LENGTHS, _ANGLES)
_JOINTS = st.builds(Joints, _ANGLES, _LENGTHS, _ANGLES, _ANGLES)
_FRAMES = st.none() | NAMES


def _targets(
    kind: type[t.MoveTo | t.MoveLinear | t.MoveCircular], **more: st.SearchStrategy[Any]
) -> st.SearchStrategy[Any]:
    return st.builds(
        kind, pose=_PLACES, frame=_FRAMES, velocity_scaling=_SHARES, **more
    ) | st.builds(kind, pose=NAMES, velocity_scaling=_SHARES, **more)


def _corners(low: int, high: int) -> st.SearchStrategy[tuple[float, float, float]]:
    """Return corners in whole millimetres: a file has them as they were given."""
    return st.tuples(*[st.integers(low, high).map(lambda mm: mm / 1e3)] * 3)


_LOADS = st.builds(
    lambda **values: LoadForm(**values).made(),
    name=NAMES,
    lower=_corners(-100, -10),
    upper=_corners(10, 100),
    yaw=_ANGLES,
    mass=st.floats(0.0, 10.0),
    touches=st.lists(
        st.text(max_size=9) | st.sampled_from(("\U0001f9ea", "a\u2028b")), max_size=3
    ).map(tuple),
    max_speed=st.none() | st.floats(1e-3, 1.0),
)
PATHS = (
    _targets(t.MoveLinear)
    | _targets(t.MoveCircular, via=_PLACES)
    | st.builds(t.MoveCircular, pose=NAMES, via=NAMES, velocity_scaling=_SHARES)
)
STEPS = st.one_of(
    st.builds(
        t.MoveJoints,
        positions=_JOINTS,
        velocity_scaling=_SHARES,
        acceleration_scaling=_SHARES | st.just(1.0),
    ),
    st.builds(t.MoveNamed, name=NAMES, velocity_scaling=_SHARES),
    _targets(t.MoveTo),
    PATHS,
    st.builds(t.MoveRelative, x=_LENGTHS, yaw=_ANGLES),
    st.just(t.Unfold()),
    st.builds(t.MoveGripper, width=_WIDTHS),
    st.just(t.OpenGripper()),
    st.just(t.CloseGripper()),
    st.builds(t.Grasp, load=_LOADS, width=st.none() | _WIDTHS, squeeze=_WIDTHS),
    st.builds(t.Release, opening=_WIDTHS),
    st.builds(t.Wait, seconds=st.floats(0.0, 3600.0)),
).map(s.Step)


@st.composite
def sequences(draw: st.DrawFn) -> s.StepSequence:
    steps = draw(st.lists(STEPS, min_size=1, max_size=6))
    # A blend needs a path after it.
    first = st.builds(t.MoveLinear, pose=_PLACES, velocity_scaling=_SHARES)
    if draw(st.booleans()):
        joined = s.Step(draw(first), draw(st.floats(1e-4, 1.0)))
        steps = [joined, s.Step(draw(PATHS)), *steps]
    return s.StepSequence(title=draw(TITLES), tool=draw(NAMES), steps=tuple(steps))


PLATE = LoadForm(name="plate", lower=(-0.03, -0.04, -0.01), upper=(0.03, 0.04, 0.003)).made()
EACH_KIND = s.StepSequence(
    title='each kind of step, "once"',
    steps=(
        t.MoveNamed(name="center", velocity_scaling=0.9),
        t.MoveJoints(positions=(-0.6, 0.2, 1.2, -0.6)),
        s.Step(t.MoveLinear(pose=Pose(0.45, -0.1, 0.25)), 0.02),
        s.Step(t.MoveLinear(pose=Pose(0.15, 0.1, 0.05), frame="bench", velocity_scaling=0.5), 0.02),
        t.MoveCircular(pose=Pose(0.55, 0.1, 0.25), via=Pose(0.5, 0.15, 0.25)),
        t.MoveLinear(pose="gate", velocity_scaling=0.8),
        t.OpenGripper(),
        t.Grasp(PLATE),
        t.MoveCircular(pose="gate2", via="between"),
        t.Release(0.005),
        t.MoveGripper(0.06),
        t.CloseGripper(),
        t.Wait(0.01),
        t.MoveTo(pose=Pose(0.5, -0.1, 0.2)),
        t.MoveRelative(z=0.01),
        t.Unfold(),
        t.MoveTo(pose=Pose(0.5, -0.1, 0.2)),
    ),
)
"""Begins anywhere; needs the poses and the frame of :data:`TABLE`."""
TABLE = """\
schema: 2
tools: {}
poses:
  gate:
    joints: {j1: 0.0, j2: 0.2, j3: 1.2, j4: -0.6}
  between:
    pose: {x: 0.55, y: 0.15, z: 0.2, yaw: 0.0}
  gate2:
    pose: {x: 0.5, y: 0.1, z: 0.2, yaw: 0.6}
frames:
  bench: {x: 0.3, y: 0.0, z: 0.2, yaw: 0.0}
...
"""
