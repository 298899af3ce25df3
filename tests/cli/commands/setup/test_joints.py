"""`bioscara joints` on arms whose joints are not alike."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import pytest

import bioscara.sim
from bioscara.bus import Bus, Transaction
from bioscara.errors import CommunicationError
from bioscara.flashing import image as image_file
from bioscara.protocol import READ, TRAILER, Register, Warnings
from bioscara.protocol.crc import crc8
from bioscara.sim import FirmwareBus, SimulatedArm
from bioscara.version import __version__
from cli.said import Said
from flashing.images import crc_of, image
from flashing.told import Told

JOINTS = ("j1", "j2", "j3", "j4")
Wire = Callable[[Callable[[SimulatedArm], Bus]], None]


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    """Puts another bus in front of the arm that is simulated in this process."""
    return lambda make: monkeypatch.setattr(bioscara.sim, "BenchBus", lambda arm, _: make(arm))


class MixedBus(Bus):
    """An arm on which some joints have their original firmware; both keep the same time."""

    def __init__(self, arm: SimulatedArm, original: Collection[str]) -> None:
        self._arm, self._old = arm, SimulatedArm(v1=True)
        self._original = {0x10 + int(name[1]) for name in original}
        self._own_bus, self._old_bus = FirmwareBus(arm), FirmwareBus(self._old)

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        results: list[bytes | CommunicationError] = []
        for transaction in transactions:
            self._old.clock.sleep_until(self._arm.clock.now())
            old = transaction.address in self._original
            results += (self._old_bus if old else self._own_bus).transfer((transaction,))
        return results

    def close(self) -> None:
        self._own_bus.close()
        self._old_bus.close()


class NewerBus(Bus):
    """An arm of which one joint has firmware 1.7, of a protocol that is not known yet."""

    def __init__(self, arm: SimulatedArm, address: int) -> None:
        self._bus, self._address = FirmwareBus(arm), address

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        return [self._newer(each, self._bus.transfer((each,))[0]) for each in transactions]

    def _newer(
        self, asked: Transaction, answer: bytes | CommunicationError
    ) -> bytes | CommunicationError:
        whole = READ[Register.HELLO].answer_size + TRAILER
        hello = asked.address == self._address and asked.write[:1] == bytes((Register.HELLO,))
        if not hello or isinstance(answer, CommunicationError) or len(answer) != whole:
            return answer
        changed = answer[:2] + bytes((3, 1, 7)) + answer[5:-1]
        return changed + bytes((crc8((asked.address << 1 | 1, *changed)),))

    def close(self) -> None:
        self._bus.close()


def line(text: str, name: str) -> str:
    (found,) = re.findall(rf"^{name} .*$", text, re.M)
    return found


@pytest.mark.parametrize(
    "original",
    [names for count in (1, 2, 3) for names in itertools.combinations(JOINTS, count)],
)
def test_a_mixed_arm_lists_the_firmware_of_each_joint(
    original: tuple[str, ...], wire: Wire, said: Said
) -> None:
    wire(lambda arm: MixedBus(arm, original))
    out = said.output("joints")
    for name in JOINTS:
        told = line(out, name)
        if name in original:
            assert re.search(r"protocol 1 +NOTHOMED NOTENABLED +no", told)
            assert told.count("unknown") == 3
        else:
            assert re.search(r"protocol 2, firmware \d+\.\d+ +NOTHOMED NOTENABLED ARMED", told)
            assert "unknown" not in told


@pytest.mark.parametrize("words", [["joints"], ["joints", "--v1"]])
def test_joints_that_power_up_late_are_listed(words: list[str], wire: Wire, said: Said) -> None:
    """Read from in its first 0.6 s, a joint with its original firmware would hang the bus."""

    class SwitchedOn(FirmwareBus):
        def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
            results = super().transfer(transactions)
            if transactions[-1].address == 0x14 and 0x14 not in seen:
                arms[0].set_power("j3", True)
            seen.update(each.address for each in transactions)
            return results

    def make(arm: SimulatedArm) -> Bus:
        arms.append(arm)
        arm.set_power("j3", False)
        return SwitchedOn(arm)

    arms: list[SimulatedArm] = []
    seen: set[int] = set()
    wire(make)
    status, out, err = said(*words)
    assert (status, err) == (
        0,
        "bioscara: no device acknowledges at the address of j3; waiting 1 s, in case the arm was "
        "just switched on\n",
    )
    assert "NOTHOMED NOTENABLED" in line(out, "j3")


def test_a_joint_with_newer_firmware_is_listed_with_its_version_and_the_remedy(
    wire: Wire, said: Said
) -> None:
    wire(lambda arm: NewerBus(arm, 0x12))
    status, out, err = said("joints")
    assert status == 1
    assert re.search(r"^j2 +0x12 +protocol 3, firmware 1\.7( +-){6}$", line(out, "j2"))
    assert "missing" not in out
    assert err == (
        "bioscara: j2: firmware 1.7 speaks protocol 3, bioscara 0.1.0 1 and 2; install a bioscara "
        "of the firmware's version, or flash this one's: bioscara flash --joint 2\n"
    )
    assert "j2: firmware 1.7 speaks protocol 3" in said.refusal("move --joints 0 0.2 0 0")


def test_each_joint_is_listed_with_its_image_the_last_exception_and_its_warnings(
    wire: Wire, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setattr(image_file, "__file__", str(tmp_path / "src/bioscara/flashing/image.py"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / f"bioscara-{__version__}-j2.bin").write_bytes(image(2))

    def make(arm: SimulatedArm) -> Bus:
        bus = Told(MixedBus(arm, ("j4",)))
        bus.set_image(0x12, crc_of(image(2)))
        bus.set_image(0x13, 0x123)
        bus.set_exception(0x12, 3, 0x0800_1234, 0x8200, 1)
        bus.set_exception(0x13, 66, 0, 0, 3)
        bus.set_warnings(0x13, Warnings.AUTOCALIBRATION)
        return bus

    wire(make)
    out = said.output("joints")
    assert re.search(r"no +simulation +power on", line(out, "j1"))
    named = f"{crc_of(image(2)):08x} (bioscara-{__version__}-j2.bin)"
    assert re.search(rf"no +{re.escape(named)} +power on", line(out, "j2"))
    assert re.search(r"no +00000123 +power on", line(out, "j3"))
    assert re.search(r"no +original firmware +unknown", line(out, "j4"))
    assert out.splitlines()[-3:] == [
        "j2: restarted after HardFault at 0x08001234 (CFSR 0x00008200)",
        "j3: restarted after interrupt 50 at an unknown address (CFSR 0x00000000); 2 more starts "
        "since",
        "j3: its encoder refuses its settings and keeps its autocalibration, so the error of its "
        "angle changes while the motor turns; cycle its power, and if that does not help, replace "
        "the board",
    ]


def test_a_joint_whose_firmware_does_not_tell_its_image_is_listed_without(
    wire: Wire, said: Said
) -> None:
    def make(arm: SimulatedArm) -> Bus:
        bus = Told(FirmwareBus(arm))
        message = READ[Register.HELLO]
        (answer,) = bus.transfer(
            (Transaction(0x13, message.encode_v2(0x13, 0), message.sealed_answer_size),)
        )
        assert isinstance(answer, bytes)
        # All capabilities that our firmware had before it reported its image.
        bus.payloads[0x13, Register.HELLO] = answer[:9] + bytes((0x7F,))
        return bus

    wire(make)
    assert re.search(r"no +unknown +power on +none", line(said.output("joints"), "j3"))
