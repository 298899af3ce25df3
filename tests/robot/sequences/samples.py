"""Sequences for tests: any that can be made, and one of each kind of step that the arm can do."""

from __future__ import annotations

from hypothesis import strategies as st

from bioscara.kinematics.pose import ANGLE_MAX
from bioscara.robot.sequences import steps as s

NAMES = st.one_of(
    st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,20}", fullmatch=True),
    st.sampled_from(("null", "true", "No", "y", "inf", "NaN", "e1")),
)
TITLES = st.text(max_size=30).filter(str.isprintable) | st.sampled_from(
    ("~", "null", "'", '"', ": ", "# 3", "- a", "...", "---", "<b>&amp;</b>", "\\", '\\"')
)
_ANGLES, _LENGTHS = st.floats(-ANGLE_MAX, ANGLE_MAX), st.floats(-10.0, 10.0)
_WIDTHS, _SHARES = st.floats(0.0, 1.0), st.floats(1e-3, 1.0)
_PLACES = st.builds(s.Place, x=_LENGTHS, y=_LENGTHS, z=_LENGTHS, yaw=_ANGLES)
_JOINTS = st.builds(s.JointPositions, j1=_ANGLES, j2=_LENGTHS, j3=_ANGLES, j4=_ANGLES)
_FRAMES = st.none() | NAMES


def _targets(kind: type[s.Step], **more: st.SearchStrategy) -> st.SearchStrategy:
    return st.builds(kind, pose=_PLACES, frame=_FRAMES, speed=_SHARES, **more) | st.builds(
        kind, name=NAMES, speed=_SHARES, **more
    )


_LOADS = st.builds(
    s.LoadBox,
    name=NAMES,
    lower=st.tuples(*[st.floats(-0.1, -0.01)] * 3),
    upper=st.tuples(*[st.floats(0.01, 0.1)] * 3),
    yaw=_ANGLES,
    mass=st.floats(0.0, 10.0),
    touches=st.lists(
        st.text(max_size=9) | st.sampled_from(("\U0001f9ea", "a\u2028b")), max_size=3
    ).map(tuple),
    max_speed=st.none() | st.floats(1e-3, 1.0),
)
PATHS = (
    _targets(s.LineStep) | _targets(s.ArcStep, via=_PLACES) | _targets(s.ArcStep, via_name=NAMES)
)
STEPS = st.one_of(
    st.builds(s.JointsStep, joints=_JOINTS, speed=_SHARES),
    st.builds(s.NamedStep, name=NAMES, speed=_SHARES),
    _targets(s.PointToPointStep),
    PATHS,
    st.builds(s.GripperStep, width=_WIDTHS),
    st.builds(s.OpenStep),
    st.builds(s.CloseStep),
    st.builds(s.GraspStep, load=_LOADS, width=st.none() | _WIDTHS, squeeze=st.none() | _WIDTHS),
    st.builds(s.ReleaseStep, opening=st.none() | _WIDTHS),
    st.builds(s.WaitStep, seconds=st.floats(0.0, 3600.0)),
)


@st.composite
def sequences(draw: st.DrawFn) -> s.StepSequence:
    steps = draw(st.lists(STEPS, min_size=1, max_size=6))
    # A blend needs a path after it.
    first = draw(st.builds(s.LineStep, pose=_PLACES, blend=st.floats(1e-4, 1.0), speed=_SHARES))
    if draw(st.booleans()):
        steps = [first, draw(PATHS), *steps]
    return s.StepSequence(title=draw(TITLES), tool=draw(NAMES), steps=tuple(steps))


def place(x: float, y: float, z: float, yaw: float = 0.0) -> s.Place:
    return s.Place(x=x, y=y, z=z, yaw=yaw)


EACH_KIND = s.StepSequence(
    title='each kind of step, "once"',
    steps=(
        s.NamedStep(name="center", speed=0.9),
        s.JointsStep(joints=s.JointPositions(j1=-0.6, j2=0.2, j3=1.2, j4=-0.6)),
        s.LineStep(pose=place(0.45, -0.1, 0.25), blend=0.02),
        s.LineStep(pose=place(0.15, 0.1, 0.05), frame="bench", blend=0.02, speed=0.5),
        s.ArcStep(pose=place(0.55, 0.1, 0.25), via=place(0.5, 0.15, 0.25)),
        s.LineStep(name="gate", speed=0.8),
        s.OpenStep(),
        s.GraspStep(
            load=s.LoadBox(name="plate", lower=(-0.03, -0.04, -0.01), upper=(0.03, 0.04, 0.003))
        ),
        s.ArcStep(name="gate2", via_name="between"),
        s.ReleaseStep(opening=0.005),
        s.GripperStep(width=0.06),
        s.CloseStep(),
        s.WaitStep(seconds=0.01),
        s.PointToPointStep(pose=place(0.5, -0.1, 0.2)),
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
