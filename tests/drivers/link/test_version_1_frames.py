"""Our firmware with a host that speaks version 1 only: same frames as an original, but safe."""

from __future__ import annotations

import pytest

from bioscara.bus import Transaction
from bioscara.errors import NotSupportedError
from bioscara.protocol import Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm
from simulated import ARM, NEAR, greeted, home_error, ready


def test_it_is_identified_as_version_1() -> None:
    _, joint = greeted("j1", v1_frames=True)
    assert (joint.version, joint.hello) == (1, None)
    assert joint.get_flags() == Flags.NOTHOMED | Flags.NOTENABLED
    with pytest.raises(NotSupportedError, match="joint firmware"):
        joint.get_fault()


def test_reading_more_than_it_answers_holds_no_clock() -> None:
    bus = FirmwareBus(SimulatedArm(v1_frames=True))
    (answer,) = bus.transfer([Transaction(0x11, b"\xc0\x01\x02", 13)])
    assert isinstance(answer, bytes)
    assert answer[1:] == b"\xff" * 12
    assert answer[0] & Flags.BUSY
    (answer,) = bus.transfer([Transaction(0x11, b"\x0f", 2)])
    assert answer == b"O\x0c"


@pytest.mark.parametrize("name", NEAR)
def test_it_homes_as_precisely_as_with_version_2(name: str) -> None:
    world, joint = ready(name, v1_frames=True)
    assert joint.is_homed()
    home = next(row.home_position for row in ARM.joints if row.name == name)
    assert joint.feedback.read_offset() == pytest.approx(home, rel=1e-6)
    error = home_error(name, v1=False)
    assert joint.get_position() == pytest.approx(world.arm.position(name), abs=error)


def test_a_position_move_ends_in_silence() -> None:
    world, joint = ready("j4", v1_frames=True)
    joint.set_position(0.0)
    world.arm.run(0.2)
    stood = world.arm.position("j4")
    assert stood > 2.5
    world.arm.run(1.0)
    assert world.arm.position("j4") == pytest.approx(stood, abs=1e-2)
    assert joint.get_flags() & Flags.NOTENABLED


def test_stop_then_setmaxvelocity_stays_where_it_is() -> None:
    world, joint = ready("j4", v1_frames=True)
    joint.stop()
    world.arm.run(0.5)
    stood = world.arm.position("j4")
    joint.session.write(Register.SETMAXVELOCITY, 540.0)
    world.arm.run(1.0)
    assert world.arm.position("j4") == pytest.approx(stood, abs=2e-3)


def test_home_survives_a_frame_before_it_starts() -> None:
    world, joint = greeted("j4", v1_frames=True)
    joint.enable()
    joint.session.write(Register.HOME, 1, 11, 30, 10)
    assert joint.session.read(Register.PING).flags & Flags.BUSY
    for _ in range(1000):
        if not joint.session.read(Register.PING).flags & Flags.BUSY:
            break
        world.arm.run(0.02)
    assert not joint.session.flags & Flags.NOTHOMED
