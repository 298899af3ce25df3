"""``bioscara joints``."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output, columns, complain
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share
from bioscara.errors import BioscaraError, BusUnavailableError, NotSupportedError

if TYPE_CHECKING:
    from bioscara.drivers import Joint
    from bioscara.model import ArmParameters
    from bioscara.protocol import Flags
    from bioscara.robot.connection.devices import Devices

_HEADINGS = ("joint", "address", "firmware", "flags", "homed", "image", "reset", "fault", "errors")


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_arm(parser)


def run(options: Options, output: Output) -> ExitStatus:
    """List the joints; nothing moves, and nothing is sent on a bus that another program uses.

    Raises:
        BusUnavailableError: The bus cannot be opened, or another program uses it.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.drivers import Joint, await_power_up
    from bioscara.flashing import known_images

    if options.arm is not None:
        return _of_owner(options, output)
    parameters = parameters_from(options)
    devices = _devices(options, parameters)
    output.line(f"arm: {devices.description}")
    missing: list[str] = []
    notes: list[str] = []
    images = known_images()
    rows: list[tuple[str, ...]] = [_HEADINGS]
    with devices.bus as bus:
        addresses = {joint.name: joint.address for joint in parameters.joints}
        await_power_up(bus, devices.clock, addresses, complain)
        for joint in (Joint(bus, devices.clock, each) for each in parameters.joints):
            try:
                joint.init()
                row, own_notes = _row(joint, images), _notes(joint)
                rows.append(row)
                notes += own_notes
            except BusUnavailableError:
                raise
            except BioscaraError as error:
                missing.append(f"{joint.name}: {str(error).removeprefix(f'{joint.name}: ')}")
                # A joint that answered hello is present, even if it is another one or too new.
                who = "missing" if joint.hello is None else joint.firmware
                rows.append((joint.name, f"{joint.parameters.address:#04x}", who, *"------"))
    output.lines(columns(rows))
    for sentence in notes:
        output.line(sentence)
    for sentence in missing:
        complain(sentence)
    return ExitStatus.FAILED if missing else ExitStatus.OK


def _of_owner(options: Options, output: Output) -> ExitStatus:
    """List the joints of an arm that another process owns, as that process knows them."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.opened_arm import open_arm
    from bioscara.protocol import Flags

    with open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        rows: list[tuple[str, ...]] = [_HEADINGS[:5]]
        for joint, firmware, bits in zip(
            robot.parameters.joints, robot.firmware, robot.flags, strict=True
        ):
            flags = Flags(bits)
            rows.append((joint.name, f"{joint.address:#04x}", firmware, *_state(flags)))
    output.lines(columns(rows))
    return ExitStatus.OK


def _state(flags: Flags) -> tuple[str, str]:
    from bioscara.protocol import Flags

    names = " ".join(flag.name or "" for flag in flags) or "none"
    return names, "no" if flags & Flags.NOTHOMED else "yes"


def _devices(options: Options, parameters: ArmParameters) -> Devices:
    from bioscara.robot.connection.devices import devices_on, simulated_devices

    # No Robot: to import planning and control would take time from a program that moves an arm.
    if options.bus == "sim":
        return simulated_devices(parameters, v1=options.v1, seed=0)
    return devices_on(options.bus, parameters)


def _image(joint: Joint, images: Mapping[int, str]) -> str:
    from bioscara.cli.flashed_joint import image_name, image_of

    if joint.version == 1:
        return "original firmware"
    crc = image_of(joint)
    if crc is None:
        return "unknown"
    name = images.get(crc)
    return image_name(crc) + (f" ({name})" if name else "")


def _notes(joint: Joint) -> list[str]:
    """Return sentences about the exception that restarted the joint, and its warnings."""
    from bioscara.protocol import Capability, Warnings

    if joint.hello is None or not joint.hello.capabilities & Capability.DIAGNOSIS:
        return []
    notes: list[str] = []
    report = joint.get_exception()
    if report is not None:
        since = f"; {report.starts - 1} more starts since" if report.starts > 1 else ""
        notes.append(f"{joint.name}: restarted after {report}{since}")
    # Firmware from before that register has none to report.
    with suppress(NotSupportedError):
        if joint.get_warnings() & Warnings.AUTOCALIBRATION:
            notes.append(
                f"{joint.name}: its encoder refuses its settings and keeps its autocalibration, so "
                "the error of its angle changes while the motor turns; cycle its power, and if "
                "that does not help, replace the board"
            )
    return notes


def _row(joint: Joint, images: Mapping[int, str]) -> tuple[str, ...]:
    from bioscara.protocol import Capability, Flags

    flags = Flags(joint.get_flags())
    reset, fault, errors = "unknown", "unknown", "unknown"
    if joint.hello is not None:
        report = joint.get_fault()
        reset = joint.hello.reset_cause.name.lower().replace("_", " ")
        fault = "none" if report.fault == "NONE" else f"{report.fault} ({report.data:g})"
        errors = f"{report.crc_errors} broken, {report.refusals} refused"
        if joint.hello.capabilities & Capability.BUS_ERRORS:
            errors += f", {joint.get_bus_errors()} of the bus"
    return (
        joint.name,
        f"{joint.parameters.address:#04x}",
        joint.firmware,
        *_state(flags),
        _image(joint, images),
        reset,
        fault,
        errors,
    )
