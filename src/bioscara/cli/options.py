"""The parsed options of a command, with their defaults."""

from __future__ import annotations

import argparse
import importlib
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path

START = (-0.6, 0.2, 1.2, -0.6)
"""Default joint positions at the start of a plan [rad m rad rad]: in front of the column, with the
elbow bent, so that a line can start there. With a stretched arm, as at ``center``, none can."""
TABLE = Path("poses.yaml")
"""File with the taught poses if ``--table`` is not given; it need not exist."""
FINGERS = "fingers"


class Options(argparse.Namespace):
    """Parsed options; the set of attributes depends on the command.

    Attributes:
        command: Name of the command.
        module: Name of the module that implements it, below ``bioscara.cli.commands``.
        bus: Name of the bus.
        arm: Name of the owner whose arm is used or recorded; None for an arm of this process.
        served: Names of the arms that are served while the command simulates one of its own.
        v1: Whether the simulated joints have their original firmware.
        homed: Whether the joints of the arm simulated in this process are homed at the start.
        parameters: File with the values in which the arm differs from the committed ones, if any.
        words: All arguments after ``bioscara``, as typed.
        acknowledge: Whether to acknowledge the faults that stopped the arm before.
        realtime: Whether simulated homing runs in real time.
        paced: Whether a simulated trajectory runs in real time.
        full_speed: Whether the tool may be faster than 250 mm/s.
        priority: Real-time priority of the control loop; None for an ordinary process.
        rate: Control cycles per second [Hz]; None for the rate that suits the joints.
        degrees: Whether angles are given and shown in degrees; parsed ones are in radians.
        out: Folder for the files of the run; None for a new folder under ``runs``. Of recordings:
            their folder, or the file that a recovery writes.
        file: File of the trajectory, or of the recording.
        fit: Whether to stretch the trajectory in time to fit the limits.
        dry_run: Whether to plan a sequence, or to check a trajectory, without moving.
        pose: Goal pose of the tool: x, y, z [m] and yaw [rad]; None if joints are given.
        joints: Goal positions of the joints; None if a pose is given.
        start: Joint positions at the start of a plan; None for :data:`START`.
        scene: File with the zones and the table around the arm.
        linear: Whether the tool moves along a line.
        via: A point on the tool's arc [m].
        velocity_scaling: Share of the speed limits to use.
        real_time_factor: How many times as fast as real time an arm or a recording is.
        csv: File for the planned trajectory, or folder for the tables of a recording.
        parquet: Folder for the tables of a recording as Parquet files.
        plot: File for the plot of the motion; None for no plot.
        socket: Unix socket on which the simulated arm listens.
        seed: Seed of the simulation.
        port: TCP port of the 3D view, or of the web gateway.
        source: Source of the 3D view: a run folder, a trajectory file or a running simulated arm;
            None for sliders, or with a target.
        action: Action on poses, tools or recordings.
        force: Whether to replace a pose or tool of the same name.
        offset: Pose of the tool in the flange: x, y, z [m] and yaw [rad].
        mass: Mass of the tool [kg].
        gateways: Words of the gateways that an owner starts.
        group: Group whose members may be clients of an owner; empty for this user alone.
        evidence: Folder for the flight records of a served arm.
        json: Whether to write JSON.
        follow: Whether to wait for more.
        after: Number of the last event that is not listed.
        end: Whether to end the lease of the client that has it.
        owned: Whether the command may use the arm of a running owner.
        width: Width between the jaws [m], ``"open"`` or ``"close"``; None with ``servo_angle``.
        servo_angle: Angle of the servo of the gripper [deg]; None if a width is given.
        table: The file with taught poses; None for :data:`TABLE`.
        name: Name of a pose; of a replay, that of the served arm.
        tool: Name of a tool.
        fault: Name of a simulated fault.
        values: Its joint and its value, as far as they are given.
        calibration: Identifier of the arm's calibration; may be empty.
        joint: Number of the joint to flash; None with ``all``.
        all: Whether to flash all joints.
        swd: Whether to flash through an ST-Link instead of the USB bootloader.
        image: The firmware image; None for the available one of this version.
        max_size: Size at which the next file of a recording begins [byte].
        max_time: Duration after which it does [s].
        keep: Total size of recordings above which the oldest are deleted [byte].
        serial: Serial number of the board in its bootloader, or of the ST-Link, if given.
        host: Address on which the web gateway listens.
        allowed_host: Further names of its computer.
        tls_cert: Its certificate, if given.
        tls_key: The key of the certificate.
        tls_self_signed: Whether it makes a certificate.
        token_file: File of its tokens; None for the one next to the owner's socket.
        show: Scope whose address alone the web gateway prints; None for all.
        watch: Whether to show the demonstration in the browser.
        recordings: Folder of the recordings that browsers may load.
        ros_arguments: Arguments of ROS, from ``--ros-args`` on; empty if there are none.
    """

    command: str
    module: str
    bus: str
    arm: str | None
    served: list[str]
    v1: bool
    homed: bool
    parameters: Path | None
    words: Sequence[str]
    acknowledge: bool
    realtime: bool
    paced: bool
    full_speed: bool
    priority: int | None
    rate: int | None
    degrees: bool
    out: Path | None
    file: Path
    fit: bool
    dry_run: bool
    pose: list[float] | None
    joints: list[float] | None
    start: Sequence[float] | None
    scene: Path | None
    linear: bool
    via: list[float] | None
    velocity_scaling: float
    real_time_factor: float
    csv: Path | None
    parquet: Path | None
    plot: Path | None
    socket: Path
    seed: int
    port: int
    source: str | None
    action: str
    force: bool
    offset: list[float]
    mass: float
    width: float | str | None
    servo_angle: float | None
    gateways: list[tuple[str, ...]]
    group: str
    evidence: Path
    json: bool
    follow: bool
    after: int
    end: bool
    owned: bool
    table: Path | None
    name: str
    tool: str
    fault: str
    values: list[str]
    calibration: str
    joint: int | None
    all: bool
    swd: bool
    image: Path | None
    serial: str | None
    max_size: int
    max_time: float
    keep: int
    host: str
    allowed_host: list[str]
    tls_cert: Path | None
    tls_key: Path | None
    tls_self_signed: bool
    token_file: Path | None
    show: str | None
    watch: bool
    recordings: Path
    ros_arguments: list[str]

    def has_target(self) -> bool:
        """Return whether a target of a motion is given."""
        return bool(self.name) or self.pose is not None or self.joints is not None

    def typed(self, *more: str) -> str:
        """Return the command as typed, with further words, for a shell."""
        return shlex.join(("bioscara", *self.words, *more))

    def load_command(self) -> Callable[[Options], int]:
        """Import the module of the command and return its ``run`` function."""
        module = importlib.import_module(f"bioscara.cli.commands.{self.module}")
        run: Callable[[Options], int] = module.run
        return run
