"""``bioscara flash --all``: the boards of all joints on USB, one after the other."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from functools import partial

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.flashed_joint import BoardToFlash, JointOnBus, describe, first_installed
from bioscara.cli.opened_arm import own_arm
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.parser import Options
from bioscara.cli.signals import raising_keyboard_interrupt
from bioscara.clock import MonotonicClock
from bioscara.errors import BioscaraError, BusUnavailableError, FlashError
from bioscara.flashing import BUTTON, JOINTS, Dfu, Image, prebuilt, read_image
from bioscara.robot import Robot

Pair = tuple[JointOnBus, Image]
"""A joint and the image for it."""


def flash_all(options: Options, output: Output) -> ExitStatus:
    """Flash each joint that does not have its image; stop at the first failure.

    Raises:
        ImageError: An image is missing or not for its joint; nothing was written.
        FlashError: A board is in its bootloader already, or a joint cannot be flashed over the bus;
            nothing was written.
        BioscaraError: The bus cannot be used; nothing was written.
    """
    images = [_image(number) for number in JOINTS]
    for image in images:
        output.line(describe(image))
    programmer = first_installed(Dfu(MonotonicClock()))
    robot = own_arm(options, parameters_from(options))
    with robot.bus, raising_keyboard_interrupt():
        _require_none_in_bootloader(programmer, options)
        waiting = _find_waiting(robot, images, options, output)
        done: list[str] = []
        for joint, image in waiting:
            status = _flash(joint, image, programmer, options, output)
            if status is not ExitStatus.OK:
                rest = [each.name for each, _ in waiting[len(done) :]]
                complain(_stopped(done, rest, image, options))
                return status
            done.append(joint.name)
    output.line(
        f"done: {_listed(done)} flashed and confirmed"
        if done
        else "done: each joint has its image, nothing was written"
    )
    return ExitStatus.OK


def _image(number: int) -> Image:
    image = read_image(prebuilt(number))
    image.require(number)
    return image


def _require_none_in_bootloader(programmer: Dfu, options: Options) -> None:
    boards = programmer.list_boards()
    if boards:
        serials = ", ".join(board.serial for board in boards)
        raise FlashError(
            f"a board is in its bootloader already, serial number {serials}, and of which joint it "
            f"is, is not known: press its RESET, or flash it as the joint that it is, as with "
            f"{_alone(JOINTS[0], options)}; then repeat: {options.typed()}"
        )


def _find_waiting(
    robot: Robot, images: Sequence[Image], options: Options, output: Output
) -> list[Pair]:
    """Return the joints that do not have their image; nothing is written.

    Raises:
        FlashError: One does not answer, is enabled, or does not start its bootloader on request.
        BusUnavailableError: The bus cannot be opened.
    """
    waiting: list[Pair] = []
    problems: list[str] = []
    for driver, image in zip(robot.joints, images, strict=True):
        report = partial(_report, output, driver.name)
        joint = JointOnBus(driver, robot.clock, report)
        try:
            firmware = joint.identify()
        except BusUnavailableError:
            raise
        except BioscaraError as error:
            problems.append(str(error))
            continue
        if joint.image == image.crc:
            report(f"{firmware}: already has its image")
            continue
        report(f"{firmware}: waits for image {image.crc:08x}")
        waiting.append((joint, image))
        if not joint.starts_bootloader:
            what = "the original firmware has" if joint.is_original else "its firmware has"
            problems.append(
                f"{joint.name}: {what} no request for the bootloader: {BUTTON}, then "
                f"{_alone(image.joint, options)}"
            )
            continue
        try:
            joint.require_disabled()
        except FlashError as error:
            problems.append(str(error))
    if problems:
        raise FlashError(f"{'; '.join(problems)}; then repeat: {options.typed()}")
    return waiting


def _flash(
    joint: JointOnBus, image: Image, programmer: Dfu, options: Options, output: Output
) -> ExitStatus:
    report = partial(_report, output, joint.name)
    board = BoardToFlash(programmer, joint.name, _alone(image.joint, options), report)
    try:
        joint.start_bootloader(programmer)
        board.connect()
    except BioscaraError as error:
        complain(str(error))
        return ExitStatus.FAILED
    except KeyboardInterrupt:
        return ExitStatus.INTERRUPTED
    status = board.write(image)
    if status is not ExitStatus.OK:
        return status
    try:
        return joint.confirm(image)
    except BusUnavailableError as error:
        complain(f"flashed, but not confirmed: {error}")
        return ExitStatus.FAILED
    except KeyboardInterrupt:
        return ExitStatus.INTERRUPTED


def _stopped(done: Sequence[str], rest: Sequence[str], image: Image, options: Options) -> str:
    """Return what was done, what was not, and the commands that go on."""
    flashed = f"{_listed(done)} flashed and confirmed" if done else "none flashed and confirmed"
    return (
        f"stopped: {flashed}, {_listed(rest)} not; go on with {_alone(image.joint, options)}, then "
        f"{options.typed()}"
    )


def _alone(number: int, options: Options) -> str:
    """Return the command as typed, for one joint."""
    words = (("--joint", str(number)) if word == "--all" else (word,) for word in options.words)
    return shlex.join(["bioscara", *(each for part in words for each in part)])


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)


def _report(output: Output, name: str, text: str) -> None:
    output.line(f"{name}: {text}")
