"""Removes one safety guard after the other and requires that a test fails.

``make mutants``; with words as arguments, only the guards whose names contain one of them. Each
mutant is a copy of the sources with one change; the tests that should fail run against it, and
first without any. A mutant that no test notices, or a change that no longer applies, is a failure.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from source_places import apply

ROOT = Path(__file__).parents[1]
BOARDS = ROOT / "firmware/joint/boards"
"""Not in the simulation: only the images have it."""


@dataclass(frozen=True)
class Mutant:
    """One guard removed: in ``place``, see source_places.py, ``old`` becomes ``new``."""

    guard: str
    place: str
    old: str
    new: str
    tests: tuple[str, ...]
    """Which should notice."""


HAZARDS = ("tests/firmware/test_hazards.py",)
HOST = ("firmware/tests",)
"""The core's own tests, compiled with it; not run by pytest."""
HOST_BINARY = "build/firmware/tests"
DRIVERS = ("tests/drivers",)
ENDINGS = ("tests/server/test_endings.py",)
REMEDIES = ("tests/robot/test_remedies.py",)
LOOP = ("tests/control/loop/test_loop.py",)
MANAGER = (
    "tests/control/manager/test_manager_rules.py",
    "tests/control/manager/test_cycle_rules.py",
)
TURN = ("tests/robot/operations/test_arbiter.py",)
BUS_WATCH = ("tests/hardware/test_bus_watch.py",)
LIFECYCLE = ("tests/hardware/test_lifecycle.py",)
CLEARANCE = ("tests/control/limits/test_clearance.py",)
SUPERVISOR = ("tests/control/faults/test_supervisor.py",)
TOOL_SPEED = ("tests/control/limits/test_tool_speed.py",)
FLIGHT_RECORD = ("tests/robot/connection/test_evidence_folder.py",)
FAULT_HANDLING = ("tests/robot/operations/test_fault_handling.py",)
OPERATIONS = ("tests/robot/operations/test_operations.py",)
GRASP = ("tests/robot/operations/motions/test_grasp.py",)
CARRIED = ("tests/system/test_carried_load.py",)
TEACH_FILE = ("tests/robot/workspace/test_teach_table.py",)
GREETING = ("tests/drivers/link/test_handshake.py",)
ORIGINAL = ("tests/drivers/link/test_original.py", "tests/hardware/test_original_joints.py")
SOCKET = ("tests/sim/test_socket_bus.py",)
JOGS = ("tests/server/tasks/test_jogs.py",)
EMULATED_BUS = ("tests/firmware/test_emulated_bus.py",)
EMULATED_JOINT = ("tests/firmware/test_emulated_joint.py",)
EMULATED_BOOTLOADER = ("tests/firmware/test_emulated_bootloader.py",)
EMULATED_DIAGNOSIS = ("tests/firmware/test_emulated_diagnosis.py",)
EMULATED_TIMING = ("tests/firmware/test_emulated_timing.py",)
FLASH = (
    "tests/flashing",
    "tests/cli/commands/setup/test_flash.py",
    "tests/cli/commands/setup/test_flash_on_bus.py",
)
INTERLEAVINGS = ("tests/server/test_interleavings.py",)
HOSTILE = "tests/server/clients/test_hostile_clients.py"
LINK = "tests/remote/test_link.py"
WEB_ROUTES = ("tests/web/test_every_route.py",)
WEB_ANSWERS = ("tests/web/routes/dashboard/test_dashboard_routes.py",)
WEB_SIGN_IN = ("tests/web/access/test_sign_in.py",)
PAUSES = ("tests/server/clients/test_pauses.py",)
WEB_RELAY = ("tests/web/owner/test_relay.py",)
WEB_TOKENS = ("tests/web/access/test_tokens.py",)
WEB_GATEWAY = ("tests/web/test_gateway.py",)

MUTANTS = (
    Mutant(
        "filler beyond the answer",
        "I2cTarget::send_next",
        "stm32::i2c1().DR = sent_ < answer_size_ ? answer_[sent_] : kFiller",
        "if (sent_ < answer_size_) stm32::i2c1().DR = answer_[sent_]",
        EMULATED_BUS,
    ),
    Mutant(
        "look at a bus that stands still",
        "control_tick_handler",
        "bioscara::target.supervise();",
        "",
        EMULATED_BUS,
    ),
    Mutant(
        "a clock that another joint holds is no bus error",
        "I2cTarget::supervise",
        "stood_ < kStuckTicks - 1",
        "stood_ < 1",
        EMULATED_BUS,
    ),
    Mutant(
        "a driver whose power stage has no supply",
        "driver_fault",
        "(gstat & (kDriverError | kUndervoltage)) != 0",
        "(gstat & kDriverError) != 0",
        HOST,
    ),
    Mutant(
        "clearing of bus errors",
        "I2cTarget::interrupt",
        "bus.SR1 = ~(status & kErrors) & kClearable;",
        "",
        EMULATED_BUS,
    ),
    Mutant(
        "frame thrown away after a bus error",
        "I2cTarget::interrupt",
        "discard();",
        "",
        EMULATED_BUS,
    ),
    Mutant(
        "bus before the tick",
        "timers",
        "kTickPriority = 3",
        "kTickPriority = 0",
        EMULATED_TIMING,
    ),
    Mutant(
        "enable pin high before it drives",
        "output",
        "port.BSRR = stm32::bit(high ? pin : pin + 16);",
        "(void)high;",
        EMULATED_JOINT,
    ),
    Mutant(
        "watchdog of the controller",
        "main::run",
        "watchdog::start();",
        "",
        EMULATED_JOINT,
    ),
    Mutant(
        "power stage opened by a fault of the processor",
        "open_and_reset",
        "bioscara::pins::kDriverDisable.high();",
        "",
        EMULATED_JOINT,
    ),
    Mutant(
        "restart after a fault of the processor",
        "open_and_reset",
        "stm32::reset();",
        "for (;;) { }",
        EMULATED_JOINT,
    ),
    Mutant(
        "address of an exception only from a stack that was usable",
        "exceptions::keep",
        "stacked(frame, status)",
        "(stacked(frame, status) || true)",
        EMULATED_DIAGNOSIS,
    ),
    Mutant(
        "no exception of before the power-up",
        "exceptions::count_start",
        "powered_up ||",
        "(powered_up && false) ||",
        EMULATED_DIAGNOSIS,
    ),
    Mutant(
        "a block of a capture only once it is captured",
        "Wire::decode",
        "fits = capture_.holds(bytes[0]);",
        "",
        HOST,
    ),
    Mutant(
        "crystal before anything runs",
        "main::run",
        "if (!clock::start()) stm32::reset",
        "clock::start",
        EMULATED_JOINT,
    ),
    Mutant(
        "memory's noise in the boot id",
        "main::run",
        "(noise)",
        "(noise & 0)",
        EMULATED_JOINT,
    ),
    Mutant(
        "unique id in the boot id",
        "next_boot_id",
        "for (int word = 0; word < 3; ++word) hash = mix(hash, stm32::unique_id()[word]);",
        "",
        EMULATED_JOINT,
    ),
    Mutant(
        "reset of the I2C peripheral after an error",
        "I2cTarget::interrupt",
        "suspect_ =",
        "",
        EMULATED_BUS,
    ),
    Mutant(
        "check of the image at each start",
        "reset_handler",
        "|| !bioscara::image_intact()",
        "",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "request for the bootloader, used up",
        "requested",
        "request_mark = 0;",
        "",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "power stage opened before the bootloader",
        "reset_handler",
        "bioscara::pins::open_power_stage();",
        "",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "reset after a jump from the bootloader",
        "reset_handler",
        "if (started_by_jump()) stm32::reset",
        "(void)started_by_jump",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "one of two boards that cannot be opened",
        "Dfu.connect",
        "closed is not None and not serial",
        "False",
        FLASH,
    ),
    Mutant(
        "CRC of a firmware image",
        "Image.from_bytes",
        "found != crc",
        "False",
        FLASH,
    ),
    Mutant(
        "number of the joint in a firmware image",
        "Image.require",
        "self.joint != joint",
        "False",
        FLASH,
    ),
    Mutant(
        "version of a firmware image",
        "Image.require",
        "self.version[:2] != _host_version()",
        "False",
        FLASH,
    ),
    Mutant(
        "comparison of what was flashed",
        "Programmer.flash",
        "== content",
        "",
        FLASH,
    ),
    Mutant(
        "size of the flash of a board in its bootloader",
        "Dfu.connect",
        "board.flash_size not in (0, FLASH_SIZE)",
        "False",
        FLASH,
    ),
    Mutant(
        "an enabled joint is not flashed",
        "JointOnBus.require_disabled",
        "not self._joint.session.flags & Flags.NOTENABLED",
        "False",
        FLASH,
    ),
    Mutant(
        "an enabled joint does not start its bootloader",
        "Session.start_bootloader",
        "not self.flags & Flags.NOTENABLED",
        "False",
        FLASH,
    ),
    Mutant(
        "another board in its bootloader than the joint on the bus",
        "JointOnBus.prepare",
        "in_bootloader:",
        "False:",
        FLASH,
    ),
    Mutant(
        "a joint that did not restart was not flashed",
        "JointOnBus.confirm",
        "or hello.boot_id == self._boot_id",
        "",
        FLASH,
    ),
    Mutant(
        "a joint that runs another image was not flashed",
        "JointOnBus.confirm",
        "or self.image not in (None, image.crc)",
        "",
        FLASH,
    ),
    Mutant(
        "a board in its bootloader before all are flashed",
        "flash_all.flash_all",
        "_require_none_in_bootloader(programmer, options)",
        "",
        FLASH,
    ),
    Mutant(
        "joints that cannot be flashed before any is",
        "_find_waiting",
        "if problems:",
        "if False:",
        FLASH,
    ),
    Mutant(
        "the first failure stops the flashing of all",
        "flash_all.flash_all",
        "return status",
        "continue",
        FLASH,
    ),
    Mutant(
        "a board is written as soon as it is the only one in its bootloader",
        "flash_all._flash",
        "board.connect()",
        "programmer._serial = programmer.list_boards()[0].serial",
        FLASH,
    ),
    Mutant(
        "CRC of a frame",
        "Wire::parse",
        "CRC",
        "NONE",
        HAZARDS,
    ),
    Mutant(
        "repeated sequence number",
        "Wire::order",
        "ahead == 0 && answered_ == code",
        "false",
        HAZARDS,
    ),
    Mutant(
        "old sequence number",
        "Wire::order",
        "!repeated && counting_ && ahead <= 0",
        "false",
        HAZARDS,
    ),
    Mutant(
        "earlier sessions stay closed",
        "Wire::may_arm",
        "!open && was_opened(session)",
        "!open && false",
        DRIVERS,
    ),
    Mutant(
        "trailer in an armed session",
        "Wire::examine",
        "armed_ && !frame.checked && code != Register::STOP",
        "false",
        HAZARDS,
    ),
    Mutant(
        "setpoint watchdog",
        "Joint::watch_silence",
        "if (!underway() && !stopping)",
        "",
        HAZARDS,
    ),
    Mutant(
        "what a fault cut stays cut",
        "Joint::apply_currents",
        "(state_ == JointState::FAULTED && powered_)",
        "state_ == JointState::FAULTED",
        HAZARDS,
    ),
    Mutant(
        "a check that was broken off enables nothing",
        "joint_commands::Joint::stop",
        "enabled_ = enabled_ && checked_;",
        "",
        HAZARDS,
    ),
    Mutant(
        "motion needs an enabled joint",
        "Wire::permitted",
        "NOT_ENABLED",
        "NONE",
        (*HAZARDS, *DRIVERS),
    ),
    Mutant(
        "numbers must be finite, in the joint",
        "Wire::decode",
        "if (!isfinite(command.number)) return Refusal::NOT_FINITE;",
        "",
        HAZARDS,
    ),
    Mutant(
        "numbers within the table's ranges, in the joint",
        "Wire::decode",
        "fits = within(kNumberRanges[row.range], command.number);",
        "",
        ("tests/firmware/test_ranges.py",),
    ),
    Mutant(
        "bytes within the table's ranges, in the joint",
        "Wire::decode",
        "fits = within(kByteRanges[row.range + at], bytes[at]);",
        "",
        ("tests/firmware/test_ranges.py",),
    ),
    Mutant(
        "encoder's sign as in the original",
        "Tle5012b::sample",
        "angle_ - angle",
        "angle - angle_",
        HOST,
    ),
    Mutant(
        "a direction that changes later is a fault",
        "Joint::run_orientation",
        "checked_ = directed_ = true;",
        "checked_ = true;",
        HOST,
    ),
    Mutant(
        "settings written anew keep the motor's direction",
        "Tmc5130::begin_setup",
        "values_[kGconfSetting] |= shaft;",
        "",
        HOST,
    ),
    Mutant(
        "settings that the driver returns differently are written again",
        "Tmc5130::exchange",
        "if (wrote_ != kNone && answer != written_) damaged_ = wrote_;",
        "",
        HOST,
    ),
    Mutant(
        "a ramp that strays from its settings is written again",
        "Tmc5130::finish",
        "if (!strayed_) return;",
        "return;",
        HOST,
    ),
    Mutant(
        "a counter of the driver that jumps is a fault",
        "Joint::supervise",
        "motion_.driver().take_jump() && powered_",
        "false",
        HOST,
    ),
    Mutant(
        "one answer alone is no reset of the driver",
        "Tmc5130::exchange",
        "spi_status_ & before & 0x03",
        "spi_status_ & 0x03",
        HOST,
    ),
    Mutant(
        "a read that becomes a write writes what is there",
        "Tmc5130::poll",
        "exchange(XACTUAL, static_cast<uint32_t>(position_ + static_cast<int32_t>(moved)));",
        "exchange(XACTUAL, 0);",
        HOST,
    ),
    Mutant(
        "orientation check before a motor is enabled",
        "Orientation::step",
        "fabsf(share - 1.0F) <= kTolerance",
        "true",
        HAZARDS,
    ),
    Mutant(
        "agreement of the two touches",
        "Homing::touch",
        "fabsf(apart) > kAgreement",
        "false",
        HAZARDS,
    ),
    Mutant(
        "travel limit of homing",
        "Homing::approach",
        "travel > kTravelMargin * configuration_.range_deg",
        "false",
        HAZARDS,
    ),
    Mutant(
        "a driver that does not answer, for want of supply",
        "Tmc5130::take_status",
        "(asked == IOIN && silent(status))",
        "false",
        HOST,
    ),
    Mutant(
        "cause of a stall in a driver that does not answer",
        "Tmc5130::read_gstat",
        "silent(ioin)",
        "false",
        HOST,
    ),
    Mutant(
        "a motor that cannot back off from its first touch",
        "Homing::step",
        "moved < 0.5F * kBackOff",
        "false",
        HOST,
    ),
    Mutant(
        "a second touch far beyond the first",
        "Homing::touch",
        "beyond > 2.0F * kBackOff",
        "false",
        HOST,
    ),
    Mutant(
        "time limit of homing",
        "Homing::step",
        "seconds > allowed",
        "false",
        HOST,
    ),
    Mutant(
        "agreement with a known end stop",
        "Joint::finish_homing",
        "moved && !again",
        "false",
        HOST,
    ),
    Mutant(
        "velocity limit of a setpoint",
        "Wire::decode",
        "command.velocity) <= status().max_velocity_rpm * 1.1F + 1.0F && fabsf(",
        "",
        HOST,
    ),
    Mutant(
        "a velocity limit lowered within the tick of a setpoint",
        "joint_commands::Joint::track",
        "clamp(command.velocity * kStepsPerRpm, -max_velocity_, max_velocity_)",
        "command.velocity * kStepsPerRpm",
        HOST,
    ),
    Mutant(
        "hard deceleration after a fault",
        "Joint::latch",
        "fault != Fault::SETPOINT_LOST",
        "false",
        HOST,
    ),
    Mutant(
        "a setpoint's time counts from its arrival",
        "Tracker::setpoint",
        "interval_ + kTickSeconds - age",
        "interval_",
        HOST,
    ),
    Mutant(
        "a lost setpoint is no new interval",
        "Tracker::setpoint",
        "alike(gap, gap_)",
        "true",
        HOST,
    ),
    Mutant(
        "the home is lost with the encoder",
        "Joint::sense",
        "homed_ =",
        "",
        HOST,
    ),
    Mutant(
        "the home is lost with a frozen encoder",
        "Joint::run_stopping",
        "homed_ =",
        "",
        HOST,
    ),
    Mutant(
        "polls of version 1 feed no setpoint",
        "Joint::watch_silence",
        "(alone_ || stopping) &&",
        "",
        HOST,
    ),
    Mutant(
        "polls of an armed session feed nothing",
        "Joint::watch_silence",
        "&& !wire_.armed()",
        "",
        HOST,
    ),
    Mutant(
        "a command that meets a fault within its tick",
        "Joint::execute",
        "!enabled_ ||",
        "",
        HOST,
    ),
    Mutant(
        "SETUP that arrives while a stall is latched",
        "Joint::set_up",
        "|| (fault_ != Fault::NONE && wire_.armed())",
        "",
        HOST,
    ),
    Mutant(
        "CLEARFAULT that meets another fault within its tick",
        "Joint::execute",
        "if (command.bytes[0] == static_cast<uint8_t>(fault_) && !driver_still_faulty())",
        "",
        HOST,
    ),
    Mutant(
        "status of the encoder read after an error",
        "Tle5012b::read",
        "ask(kStatus, data);",
        "",
        HOST,
    ),
    Mutant(
        "an encoder that starts late",
        "Joint::boot",
        "starting_ = kEncoderStart",
        "bad_samples_ = 1",
        HOST,
    ),
    Mutant(
        "reset flags of the driver read as well as written",
        "Tmc5130::begin_setup",
        "exchange(GSTAT, 0);",
        "",
        HOST,
    ),
    Mutant(
        "the bootloader takes two steps",
        "Wire::may_leave",
        "disarmed ?",
        "true ?",
        HOST,
    ),
    Mutant(
        "an enabled joint keeps its firmware",
        "Wire::may_leave",
        "ENABLED",
        "NONE",
        HOST,
    ),
    Mutant(
        "health bits of the encoder's answer",
        "Tle5012b::ask",
        "&& (words[1] & kSound) == kSound",
        "",
        HOST,
    ),
    Mutant(
        "a joint that failed its check is checked with strokes",
        "Joint::run_orientation",
        "checked_ = false;",
        "",
        HOST,
    ),
    Mutant(
        "silence in a homing that pauses",
        "Joint::watch_silence",
        "&& !sequence()",
        "",
        HOST,
    ),
    Mutant(
        "a disabled joint has no hold current",
        "Joint::apply_currents",
        "held = state_ == JointState::FAULTED && powered_",
        "held = powered_",
        HOST,
    ),
    Mutant(
        "a joint whose coils are shorted is not watched for stalls",
        "Joint::apply_currents",
        "power(false);",
        "power(brake_ == BrakeMode::COOL_BRAKE);",
        HOST,
    ),
    Mutant(
        "no motion of a field whose rotor is not known",
        "Joint::act",
        "powered_ && checked_",
        "powered_",
        HOST,
    ),
    Mutant(
        "the least deceleration after a fault",
        "Joint::stop",
        "sequence() || fault_ != Fault::NONE",
        "sequence()",
        HOST,
    ),
    Mutant(
        "position limit, on the host",
        "SetpointLimits.check_setpoint",
        "_lower <= position <= self._upper and self.",
        "",
        DRIVERS,
    ),
    Mutant(
        "room to stop, on the host",
        "Joint.set_velocity",
        "self._stop_unless_clear(velocity)",
        "pass",
        DRIVERS,
    ),
    Mutant(
        "check byte of an answer to TRACK",
        "_Track.decode_v2",
        "check == crc8_of_8(answer, _SEED[address << 1 | 1])",
        "True",
        ("tests/protocol",),
    ),
    Mutant(
        "sequence number of an answer to TRACK",
        "_Track.decode_v2",
        "echo == sequence and",
        "",
        ("tests/protocol",),
    ),
    Mutant(
        "check byte of an answer to TRACKLOAD",
        "_TrackLoad.decode_v2",
        "crc8_of_10(answer, _SEED[address << 1 | 1]) == 0",
        "True",
        ("tests/protocol",),
    ),
    Mutant(
        "sequence number of an answer to TRACKLOAD",
        "_TrackLoad.decode_v2",
        "echo == sequence and",
        "",
        ("tests/protocol",),
    ),
    Mutant(
        "velocity limit of a setpoint, on the host",
        "SetpointLimits.check_setpoint",
        "and self._slowest <= velocity <= self._fastest",
        "",
        DRIVERS,
    ),
    Mutant(
        "homed check, on the host",
        "Readiness.require_ready",
        "homed and (flags & Flags.NOTHOMED or not self._feedback.offset_known)",
        "False",
        DRIVERS,
    ),
    Mutant(
        "number of a repeated frame, on the host",
        "Session.exchange",
        "unanswered and remaining",
        "False",
        ("tests/drivers/link/test_damaged_frames.py",),
    ),
    Mutant(
        "the end of an interrupted motion",
        "MotionExecution._rest",
        "supervisor.halt(now)",
        "",
        ("tests/robot/test_robot_motions.py",),
    ),
    Mutant(
        "the way of a motion that is cancelled",
        "TrajectorySampler.brake",
        "self.collision_checked",
        "not self.collision_checked",
        ("tests/robot/test_robot_motions.py",),
    ),
    Mutant(
        "the way of a jog that breaks off",
        "_STOPPABLE",
        "JointTrajectoryController, JogController",
        "(JointTrajectoryController,)",
        ("tests/robot/test_robot_motions.py",),
    ),
    Mutant(
        "a jogged elbow keeps its side",
        "JogGenerator._ranges",
        "max(lower[2], low), min(upper[2], high)",
        "lower[2], upper[2]",
        ("tests/planning/motions/test_jog.py",),
    ),
    Mutant(
        "pairs left out by the broad phase",
        "BroadPhase.candidates",
        "free_distance(here)",
        "_range",
        ("tests/planning/collision/test_broad_phase.py",),
    ),
    Mutant(
        "jaws on the way to another width",
        "check_standing",
        "planner.check_width(width)",
        "pass",
        ("tests/robot/test_planner_beside_itself.py",),
    ),
    Mutant(
        "position of the jaws at the gripper's width",
        "_placed",
        "width for",
        "0.08 for",
        ("tests/planning/collision/test_bodies.py",),
    ),
    Mutant(
        "a pushed arm moves away from itself",
        "Scene.check",
        "(end < floor)[pushed].any()",
        "False",
        ("tests/robot/test_planner_beside_itself.py",),
    ),
    Mutant(
        "evaluation of the parts inside near hulls",
        "Layout._refine",
        "self._rough.any()",
        "False",
        ("tests/planning/collision/test_bodies.py",),
    ),
    Mutant(
        "pairs of links that can collide",
        "colliding_pairs",
        "len(arm) -",
        "links +",
        ("tests/planning/collision/test_bodies.py",),
    ),
    Mutant(
        "a plan is looked at again when it is executed",
        "Robot.execute",
        "checked(plan.trajectory, planner, planned=True)",
        "plan",
        ("tests/robot/operations/motions/test_follow_trajectory.py",),
    ),
    Mutant(
        "commands that fall behind the plan",
        "_following",
        "allowed(joint, version, joint.max_velocity) + _late(joint, parameters)",
        "0.0",
        ("tests/robot/operations/motions/test_follow_trajectory.py",),
    ),
    Mutant(
        "arrival where the plan ends",
        "_following",
        '"goal": tolerances.goal,',
        "",
        ("tests/robot/operations/motions/test_follow_trajectory.py",),
    ),
    Mutant(
        "rest after a motion that was given up",
        "MotionExecution.follow",
        "yield from self._come_to_rest(zero)",
        "pass",
        ("tests/robot/operations/motions/test_follow_trajectory.py",),
    ),
    Mutant(
        "no path from beyond a limit",
        "Planner._require_within_limits",
        "problems:",
        "False:",
        ("tests/robot/operations/motions/test_follow_trajectory.py",),
    ),
    Mutant(
        "what joints latched before is a fault of the arm",
        "ArmSession.connect",
        "stack.latch(self.arm.latched(Flags.FAULT | Flags.STALL), self.clock.now())",
        "",
        ("tests/robot/connection/test_arm_session.py",),
    ),
    Mutant(
        "a robot is released when its program ends",
        "Robot.open",
        "exit_guard.guard(self, self.stop)",
        "pass",
        ("tests/robot/connection/test_exit_guard.py",),
    ),
    Mutant(
        "a client gives its lease back when its program ends",
        "RemoteRobot.open",
        "exit_guard.guard(self, self._let_go)",
        "pass",
        ENDINGS,
    ),
    Mutant(
        "a lease ends with the process of its client",
        "Lease.lapsed",
        "if self._client.gone:",
        "if False:",
        ENDINGS,
    ),
    Mutant(
        "a killed process has ended before its parent awaits it",
        "_opened",
        'return int(struct.unpack("i", data)[0])',
        "return None",
        ENDINGS,
    ),
    Mutant(
        "the first command waits until the motion of an ended program is at rest",
        "Owner._start",
        "goal.epoch < epoch and",
        "False and",
        ENDINGS,
    ),
    Mutant(
        "a forked child leaves the connection to its parent",
        "OwnerLink.__init__",
        "in_child(self._leave_to_parent)",
        "pass",
        ENDINGS,
    ),
    Mutant(
        "a forked child leaves the arm to its parent",
        "ArmSession.__init__",
        "in_child(self._forget)",
        "pass",
        ("tests/robot/connection/test_exit_guard.py",),
    ),
    Mutant(
        "gateways end with their owner",
        "child_process.main",
        "ctypes.CDLL(None).prctl(_SET_DEATH_SIGNAL, signal.SIGTERM)",
        "pass",
        ("tests/server/test_processes.py",),
    ),
    Mutant(
        "signals do not begin a release anew",
        "_exit",
        "time.monotonic() - _closing[0] < _PATIENCE",
        "False",
        ("tests/robot/connection/test_exit_guard.py",),
    ),
    Mutant(
        "a bus that is given is stronger than the arm of the environment",
        "_choose_owner",
        "options.owned and not bus_given",
        "options.owned",
        ("tests/cli/test_arguments.py",),
    ),
    Mutant(
        "an overlay that was edited by hand is not overwritten unread",
        "OverlayFile._present",
        "text != self._text",
        "False",
        ("tests/remote/test_owner_requests.py",),
    ),
    Mutant(
        "a changed definition of the mounted tool applies at once",
        "Workspace.with_table",
        "changed if table.tool(name) == self.tool else changed.with_tool(name)",
        "changed",
        ("tests/robot/test_robot_motions.py",),
    ),
    Mutant(
        "q ends a jog during a step",
        "commands.motion.jog._jog",
        'keys.ended |= "q" in [',
        'keys.ended |= "" in [',
        ("tests/cli/commands/motion/test_jog.py",),
    ),
    Mutant(
        "Ctrl-C does not begin a release anew",
        "postponed",
        "signal.signal(signal.SIGINT, _exit)",
        "pass",
        ("tests/robot/connection/test_exit_guard.py",),
    ),
    Mutant(
        "signals keep no setpoints from joints that come to rest",
        "Arm.execute",
        "nullcontext() if ending is None else exit_guard.postponed()",
        "nullcontext()",
        ("tests/robot/connection/test_exit_guard.py",),
    ),
    Mutant(
        "a command does not move an arm that was stopped before",
        "require_acknowledgement",
        "options.acknowledge or not robot.faults",
        "True",
        ("tests/cli/test_latched.py",),
    ),
    Mutant(
        "a request to end the program at the end of a motion is raised",
        "Arm.execute",
        "ending is not None",
        "False",
        OPERATIONS,
    ),
    Mutant(
        "a callback does not wait for its own motion",
        "Arm.in_callback",
        "self._stepper is threading.current_thread()",
        "False",
        OPERATIONS,
    ),
    Mutant(
        "the speed of a load's farthest corner",
        "_arranged",
        "kinematics_with(workspace.parameters, workspace.tool, scene.overhang(tool))",
        "kinematics_with(workspace.parameters, workspace.tool)",
        CARRIED,
    ),
    Mutant(
        "the swing of the wrist with a load",
        "highest_commanded",
        "COMMANDED_SPEED - WRIST_SWING * overhang",
        "COMMANDED_SPEED",
        CARRIED,
    ),
    Mutant(
        "the turn of a load that is jogged",
        "Scara.speed_at",
        "self.overhang * abs(w)",
        "0.0",
        ("tests/kinematics/test_kinematics.py",),
    ),
    Mutant(
        "a load that is attached is clear",
        "_attached",
        "workspace.surroundings.check_load(workspace.kinematics, arm.positions())",
        "pass",
        GRASP,
    ),
    Mutant(
        "jaws that hold a load are not moved",
        "MoveGripper.prepare",
        "is not None:\n            raise LifecycleError(",
        "is not None and False:\n            raise LifecycleError(",
        GRASP,
    ),
    Mutant(
        "a load between the jaws is as wide as it is",
        "Grasp.cycles",
        "arm.jaws.hold(self._load_width)",
        "pass",
        GRASP,
    ),
    Mutant(
        "homing without a load",
        "Home.cycles",
        "(load := arm.workspace.load) is not None",
        "(load := arm.workspace.load) is not None and False",
        GRASP,
    ),
    Mutant(
        "a tool with a load stays",
        "Workspace.with_tool",
        "self.load is not None",
        "False",
        GRASP,
    ),
    Mutant(
        "jaws along the motion that the arm is making",
        "check_along",
        "scene.check(kinematics, path, start)",
        "pass",
        OPERATIONS,
    ),
    Mutant(
        "jaws at the narrow start of the motion that the arm is making",
        "check_along",
        "scene.check_standing(kinematics, start, before.surroundings)",
        "pass",
        OPERATIONS,
    ),
    Mutant(
        "jaws that were refused count as where they were",
        "MoveGripper._end",
        "self._arm.jaws.withdraw()",
        "pass",
        OPERATIONS,
    ),
    Mutant(
        "a motion that begins before the jaws move keeps clear of their travel",
        "MoveGripper.prepare",
        "arm.jaws.announce(self._width)",
        "pass",
        OPERATIONS,
    ),
    Mutant(
        "jaws that were not driven, where a motion begins meanwhile",
        "MoveGripper._ready",
        "check_standing(arm, before, self._width, motion)",
        "pass",
        OPERATIONS,
    ),
    Mutant(
        "one call at a time uses the arm",
        "Arbiter.take",
        "other.devices & claim.devices",
        "False",
        TURN,
    ),
    Mutant(
        "a call that is being refused is no operation",
        "Arm.operations",
        "each.claim in running",
        "True",
        TURN,
    ),
    Mutant(
        "a driven gripper is no joint that waits for setpoints",
        "Loop._driving",
        " and component.limits",
        "",
        TURN,
    ),
    Mutant(
        "a stop before a motion's first cycle",
        "ready",
        "operation.claim.require_not_stopped()",
        "",
        TURN,
    ),
    Mutant(
        "nobody asks the joints while another thread moves them",
        "Arm.states",
        "stepped = self._stepper is not None",
        "stepped = False",
        TURN,
    ),
    Mutant(
        "limits of a trajectory",
        "validation.check",
        "excesses:",
        "False:",
        ("tests/planning",),
    ),
    Mutant(
        "limits of a goal",
        "ControllerSwitcher._activate",
        "= limits",
        "= {}",
        ("tests/control/controllers/joint_trajectory",),
    ),
    Mutant(
        "no burst after a late cycle",
        "Loop._set_deadline",
        "(periods + 1) *",
        "",
        LOOP,
    ),
    Mutant(
        "a cycle that raises stops the arm",
        "Loop._step",
        "supervisor.crash(error, time)",
        "del error",
        LOOP,
    ),
    Mutant(
        "an interrupted cycle stops the arm",
        "Loop.step",
        "self._supervisor.halt(now)",
        "",
        LOOP,
    ),
    Mutant(
        "the way of a pause is not made up for",
        "Loop._step",
        "self.period if held_up else",
        "",
        LOOP,
    ),
    Mutant(
        "a pause is noticed before the write",
        "Loop._step",
        "held_up and",
        "False and held_up and",
        LOOP,
    ),
    Mutant(
        "modes whose cycles the bus cannot carry",
        "check_capacity",
        "driven and",
        "False and driven and",
        ("tests/hardware/test_capacity.py",),
    ),
    Mutant(
        "what the gripper holds when its width cannot be kept",
        "GripperHardware.write",
        "GripperError",
        "ZeroDivisionError",
        ("tests/hardware/test_gripper.py",),
    ),
    Mutant(
        "a loop that was stuck is stopped",
        "Loop._require_timely",
        "behind > SILENCE + self.period",
        "False",
        LOOP,
    ),
    Mutant(
        "a rate that the bus cannot carry",
        "Loop.__init__",
        "rate >",
        "False and rate >",
        LOOP,
    ),
    Mutant(
        "a watchdog fed by good cycles only",
        "Loop._step",
        "good and",
        "",
        ("tests/control/loop/test_realtime.py",),
    ),
    Mutant(
        "a stop that cannot raise",
        "Supervisor.stop",
        "Exception",
        "BioscaraError",
        SUPERVISOR,
    ),
    Mutant(
        "acknowledge before recover",
        "Supervisor.recover",
        "not FaultState.ACKNOWLEDGED",
        "FaultState.CLEAR",
        SUPERVISOR,
    ),
    Mutant(
        "a fault after the acknowledgement",
        "Supervisor._latch",
        "not FaultState.STOPPING",
        "FaultState.CLEAR",
        SUPERVISOR,
    ),
    Mutant(
        "evidence of the time before the fault",
        "FaultLog.keep",
        "self._write(evidence,",
        "self._write(self._record.freeze(),",
        SUPERVISOR,
    ),
    Mutant(
        "the name of a power loss",
        "FaultLog._detect_power_loss",
        "len(recent) >= self._joints - 1",
        "False",
        ("tests/system/test_control_scenarios.py",),
    ),
    Mutant(
        "a loss of power needs joints that do not acknowledge",
        "indicates_power_loss",
        "isinstance(cause.reason, NoAcknowledgeError)",
        "True",
        ("tests/control/faults/test_supervisor.py",),
    ),
    Mutant(
        "a stuck bus needs all joints",
        "BusWatch.stuck",
        "not line.addresses.issuperset(expected)",
        "False",
        BUS_WATCH,
    ),
    Mutant(
        "the other joints are asked before the bus is called stuck",
        "BusWatch._ask_others",
        "not line.in_a_row or len(line.addresses.intersection(expected)) < 2",
        "False",
        BUS_WATCH,
    ),
    Mutant(
        "an answer shows that the bus works",
        "Session.take",
        "self._line.in_a_row = 0",
        "",
        BUS_WATCH,
    ),
    Mutant(
        "a late loop on a stuck bus is no second fault",
        "Loop._overrun",
        "self._waits_for_the_bus",
        "False",
        ("tests/system/test_first_cause.py",),
    ),
    Mutant(
        "one owner of a command interface",
        "Claims.check",
        "owner is not None and owner not in leaving",
        "False",
        MANAGER,
    ),
    Mutant(
        "a command that is no number",
        "Execution._update_if_due",
        "not isfinite(sum([handle.value for handle in handles]))",
        "False",
        MANAGER,
    ),
    Mutant(
        "a shutdown of all hardware although one part raises",
        "ControllerManager.shutdown",
        "Exception as",
        "InvalidArgumentError as",
        MANAGER,
    ),
    Mutant(
        "joints that Ctrl-C would leave energised",
        "safe_stop._attempt",
        "(KeyboardInterrupt, SystemExit)",
        "ZeroDivisionError",
        ("tests/robot/test_arm.py",),
    ),
    Mutant(
        "rest of a motion that Ctrl-C interrupts as it begins",
        "Arm.execute",
        "if not _interrupted_after_begin(operation, error)",
        "if True",
        ("tests/robot/operations/test_ctrl_c_at_the_begin.py",),
    ),
    Mutant(
        "reduced speed of a motion whose velocity jumps",
        "moving_average.velocity_jumps",
        "bool(np.abs(jumps).max() > _SMOOTH)",
        "False",
        ("tests/system/test_load_speed.py", "tests/planning/test_moving_average.py"),
    ),
    Mutant(
        "path tolerance of a trajectory",
        "JointTrajectoryController._end_if_decided",
        "overtime < 0.0 or sampler.waiting is not None",
        "False",
        ("tests/control/controllers/joint_trajectory/test_rules_of_tolerances.py",),
    ),
    Mutant(
        "no motion before homing",
        "check_modes",
        "not axis.homed",
        "False",
        ("tests/hardware/test_modes.py",),
    ),
    Mutant(
        "a wrist is not turned beside a folded elbow",
        "joints_to_home",
        "_require_open_elbow(by_name, wanted)",
        "",
        ("tests/oracle/test_homing.py",),
    ),
    Mutant(
        "the wrist is at its end stop before the elbow folds",
        "BEFORE",
        ', "j4"',
        ",",
        ("tests/oracle/test_homing.py",),
    ),
    Mutant(
        "a joint that trails its commands",
        "FollowingErrorMonitor.check",
        "not error > limit",
        "True",
        ("tests/system/test_control_scenarios.py",),
    ),
    Mutant(
        "what a joint said before it was released",
        "ArmHardware._end_modes",
        "axis.answered = False",
        "",
        LIFECYCLE,
    ),
    Mutant(
        "what a joint said before a pause",
        "ArmHardware.read",
        "(old or not axis.answered)",
        "not axis.answered",
        LIFECYCLE,
    ),
    Mutant(
        "the home of a joint that restarted",
        "Axis.mark_missed",
        "(JointLostError, JointResetError)",
        "JointLostError",
        LIFECYCLE,
    ),
    Mutant(
        "unverified commands are checked",
        "CollisionGuard.prepare",
        "if unchecked",
        "if False",
        CLEARANCE,
    ),
    Mutant(
        "the path to rest is checked",
        "CollisionGuard._rest",
        "within(joint.after(way + more))",
        "after(0.0)",
        CLEARANCE,
    ),
    Mutant(
        "a path is checked again when it has changed by the spare clearance",
        "CollisionGuard._refusal",
        "_spare -= self.",
        "",
        CLEARANCE,
    ),
    Mutant(
        "a joint under velocity control takes time to react",
        "JointLimiter.reaction",
        "_REACTION + 2.0 * period",
        "0.0",
        (*CLEARANCE, "tests/control/limits/test_limiting_laws.py"),
    ),
    Mutant(
        "a stop ends where joints are released",
        "CollisionGuard.prepare",
        "self._commanded() != self._stop_commands",
        "False",
        CLEARANCE,
    ),
    Mutant(
        "a goal that was not swept is unverified",
        "Goal",
        "False",
        "True",
        CLEARANCE,
    ),
    Mutant(
        "the robot keeps raw setpoints clear",
        "Stack.__init__",
        "collision_guard, self.",
        "",
        ("tests/robot/test_robot_motions.py",),
    ),
    Mutant(
        "a tool whose speed is not known stands still",
        "ToolSpeedCap.apply",
        "speed <=",
        "not speed >",
        TOOL_SPEED,
    ),
    Mutant(
        "no share of a speed that is no number",
        "ToolSpeedCap.apply",
        "if speed == speed else 0.0",
        "",
        TOOL_SPEED,
    ),
    Mutant(
        "the boot of a joint that is given a new session",
        "Session._rejoin",
        "or now.boot_id != before.boot_id",
        "",
        ("tests/drivers/link/test_damaged_frames.py",),
    ),
    Mutant(
        "a flight record is whole or does not exist",
        "EvidenceFolder.write",
        "file.path.unlink(missing_ok=True)",
        "pass",
        FLIGHT_RECORD,
    ),
    Mutant(
        "a flight record is on the disk before it has its name",
        "RecordingFile.finish",
        "self._output.sync()",
        "pass",
        FLIGHT_RECORD,
    ),
    Mutant(
        "a disk that is slow to take the evidence is no overrun",
        "keep_evidence",
        "arm.stack.loop.restart()",
        "pass",
        FAULT_HANDLING,
    ),
    Mutant(
        "a teach file is on the disk before it replaces another",
        "replacing",
        "os.fsync(file.fileno())",
        "pass",
        TEACH_FILE,
    ),
    Mutant(
        "the name of a teach file is on the disk",
        "replacing",
        "os.fsync(folder)",
        "pass",
        TEACH_FILE,
    ),
    Mutant(
        "version 2 on this bus stays version 2",
        "_require_v1_flags",
        "address in _version_2.get(bus, ())",
        "False",
        GREETING,
    ),
    Mutant(
        "one plain answer makes no version 1 joint",
        "_V1_ANSWERS",
        "12",
        "1",
        GREETING,
    ),
    Mutant(
        "an answer of neither version makes no version 1 joint",
        "identify",
        "corrupt is None",
        "True",
        GREETING,
    ),
    Mutant(
        "an intact PING between answers of version 1",
        "identify",
        "_require_pong(bus, clock, address)",
        "",
        GREETING,
    ),
    Mutant(
        "one byte of an answer before the rest",
        "identify",
        "first is None",
        "True",
        GREETING,
    ),
    Mutant(
        "quiet time after a command that an original joint's loop takes",
        "Session._transfer",
        "self.timing.free_from(message)",
        "0.0",
        ORIGINAL,
    ),
    Mutant(
        "a command to an original joint waits for the end of its orientation check",
        "Session.exchange",
        "self._await_check()",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "an original joint that may be in a check is not stopped by the next host",
        "Session._open_v1",
        "if flags & Flags.BUSY and not flags & Flags.NOTHOMED:",
        "if False:",
        ORIGINAL,
    ),
    Mutant(
        "a move in steps waits for a homing that was stopped",
        "OriginalTiming.free_from",
        "message in _AFTER_HOME",
        "message in _DEFERRED",
        ORIGINAL,
    ),
    Mutant(
        "quiet time in a cycle",
        "group._exchange",
        "joint.session.paused",
        "False",
        ORIGINAL,
    ),
    Mutant(
        "quiet time before a greeting",
        "Session.open",
        "self.timing.quiet_until",
        "0.0",
        ORIGINAL,
    ),
    Mutant(
        "a cycle does not wait for a quiet joint",
        "Homing.watch",
        "self._joint.session.paused",
        "False",
        ORIGINAL,
    ),
    Mutant(
        "HOME is sent once",
        "HomingProcedure.start",
        "repeat=False,",
        "",
        ORIGINAL,
    ),
    Mutant(
        "a HOME whose answer is lost is stopped",
        "Joint.start_homing",
        "self.version == 1",
        "False",
        ORIGINAL,
    ),
    Mutant(
        "registers that an original joint does not have",
        "Session.exchange",
        "self.version == 1 and message.definition.support is not Support.YES",
        "message.definition.version > self.version",
        ORIGINAL,
    ),
    Mutant(
        "the magic twice before more is read",
        "_MAGIC_TIMES",
        "2",
        "1",
        ORIGINAL,
    ),
    Mutant(
        "a maximum velocity in position mode only",
        "Settings.set_max_velocity",
        "self._require_position_mode()",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "a deadman that fired in position mode",
        "Settings._require_position_mode",
        "or session.flags & Flags.NOTENABLED",
        "",
        ORIGINAL,
    ),
    Mutant(
        "a stalled joint ignores MOVETOANGLE",
        "OriginalTiming.answered",
        "and not (message is _MOVE and flags & _STALL)",
        "",
        ORIGINAL,
    ),
    Mutant(
        "acceleration that an original joint takes as it is",
        "Settings.check_acceleration",
        "not lower <= acceleration <= upper",
        "False",
        ORIGINAL,
    ),
    Mutant(
        "acceleration is checked before the motor is engaged",
        "Joint.enable",
        "settings.check_acceleration(parameters.max_acceleration)",
        "",
        ORIGINAL,
    ),
    Mutant(
        "acceleration of homing is checked before the home is forgotten",
        "HomingProcedure.check",
        "self._settings.check_acceleration(homing.acceleration)",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "SETRPM 0 before STOP",
        "Session.stop",
        "self.write(Register.SETRPM, 0.0, repeat=False)",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "SETRPM 0 instead of STOP in a cycle",
        "CyclicExchange.stop",
        "return self._prepare(_RPM, (0.0,))",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "what an earlier host left running is stopped",
        "Session._open_v1",
        "or not flags & Flags.NOTENABLED",
        "",
        ORIGINAL,
    ),
    Mutant(
        "a move ends at its target",
        "MotionMonitor.arrived.at_target",
        "and near and sample.stamp >= earliest",
        "",
        ORIGINAL,
    ),
    Mutant(
        "no steps for a joint that was let go",
        "Joint.move_steps",
        "self.readiness.require_ready(homed=False) if",
        "pass\n        if",
        ORIGINAL,
    ),
    Mutant(
        "a frame without a read before the first question",
        "identify",
        "_wake(bus, clock, address)",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "a second after power-up",
        "_wake",
        "clock.sleep_until(clock.now() + START_UP)",
        "",
        ORIGINAL,
    ),
    Mutant(
        "a second after power-up, for all joints at once",
        "await_power_up",
        "if awake",
        "if False",
        ORIGINAL,
    ),
    Mutant(
        "a joint that fell silent in its session",
        "Session.take",
        "note_silence(self._bus, self._address)",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "a version 1 joint that does not acknowledge is lost at once",
        "CyclicExchange.hold_last_sample",
        "or self._session.timing.silent",
        "",
        ORIGINAL,
    ),
    Mutant(
        "no cycle asks a joint that may be starting",
        "group._exchange",
        "timing.silent",
        "False",
        ORIGINAL,
    ),
    Mutant(
        "a second before a joint that fell silent is asked again",
        "Session.listens",
        "self.timing.quiet_until = self._clock.now() + START_UP",
        "pass",
        ORIGINAL,
    ),
    Mutant(
        "an original joint that was lost while homing is stopped",
        "ArmHardware.write",
        "homing.stop_lost()",
        "pass",
        ("tests/control/controllers/test_homing_controller.py",),
    ),
    Mutant(
        "frames of the size that a joint takes",
        "_check",
        "<= MESSAGE_MAX",
        "",
        ("tests/bus/test_linux_unavailable.py",),
    ),
    Mutant(
        "no reply of an interrupted transfer is left",
        "SocketBus.transfer",
        "self._release()",
        "",
        SOCKET,
    ),
    Mutant(
        "the number of a frame on the socket",
        "expect",
        "(frame.kind, frame.sequence) != (kind, sequence)",
        "frame.kind != kind",
        SOCKET,
    ),
    Mutant(
        "one host of the simulated arm at a time",
        "_Server._welcome",
        "not other.gone()",
        "False",
        SOCKET,
    ),
    Mutant(
        "waits of earlier hosts are no waits of the next one",
        "_Server._answer",
        "self._waited - client.waited",
        "self._waited",
        SOCKET,
    ),
    Mutant(
        "a host that connects again keeps its waits",
        "ServedClock.begin_connection",
        "self._before = self._waited",
        "pass",
        SOCKET,
    ),
    Mutant(
        "the deadline of a frame on the socket",
        "_Server._continue",
        "client.deadline is not None and now > client.deadline",
        "False",
        SOCKET,
    ),
    Mutant(
        "raw commands do not make belts swing",
        "Stack.__init__",
        "collision_guard, self.smoothing",
        "collision_guard",
        ("tests/system/test_load_speed.py",),
    ),
    Mutant(
        "hold begins to brake in the middle of the cycle before",
        "HoldController.update",
        "0.5 * period",
        "0.0",
        ("tests/control/limits/test_clearance.py",),
    ),
    Mutant(
        "the collision guard begins to brake in the middle of the cycle before",
        "_Stop.__init__",
        "0.5 * period",
        "0.0",
        ("tests/control/limits/test_clearance.py",),
    ),
    Mutant(
        "a stop begun under velocity control does not continue under position control",
        "CollisionGuard._commanded",
        "joint.velocity_alone",
        "False",
        ("tests/control/limits/test_clearance.py",),
    ),
    Mutant(
        "averages of late cycles end where they were commanded",
        "Smoothing.prepare",
        "self._still > sum(self.windows) + period",
        "False",
        CLEARANCE,
    ),
    Mutant(
        "raw commands at full speed do not swing the belt of j3",
        "Workspace.raw_windows",
        "self.parameters.belt_periods[first:2]",
        "self.windows",
        ("tests/control/limits/test_clearance.py",),
    ),
    Mutant(
        "averages keep to the limits of the joints",
        "JointLimiter.send",
        "not self._lower <= sent <= self._upper",
        "False",
        ("tests/control/limits/test_clearance.py",),
    ),
    Mutant(
        "jogs do not make belts swing",
        "Planner.jog",
        "workspace.windows,",
        "",
        ("tests/system/test_load_speed.py",),
    ),
    Mutant(
        "owner: a command carries the epoch of its lease",
        "Lease.require",
        "and epoch == self.epoch",
        "",
        INTERLEAVINGS,
    ),
    Mutant(
        "owner: a stop ends the lease of another client",
        "Owner._stop",
        "self.lease.end()",
        "pass",
        INTERLEAVINGS,
    ),
    Mutant(
        "owner: a goal from before a stop does not begin",
        "Owner.check",
        "if self._stops != stops:",
        "if False:",
        INTERLEAVINGS,
    ),
    Mutant(
        "owner: a goal whose lease has ended does not begin",
        "Owner.check",
        "if (self.lease.epoch, self.lease.holder) != (epoch, client.session):",
        "if False:",
        INTERLEAVINGS,
    ),
    Mutant(
        "owner: a goal whose lease ended during its planning is stopped",
        "Owner.keep",
        "if lost and (goal.needs_lease or epoch <= self._taken):",
        "if False:",
        INTERLEAVINGS,
    ),
    Mutant(
        "owner: a goal whose lease was taken during its planning is stopped",
        "Owner.keep",
        "or epoch <= self._taken",
        "",
        INTERLEAVINGS,
    ),
    Mutant(
        "owner: all goals of a client end when its lease is taken",
        "Owner._acquire",
        "if goal.session == former:",
        "if goal.session == former and goal.needs_lease:",
        ("tests/server/clients/test_stops.py",),
    ),
    Mutant(
        "controllers of a connected client are its own",
        "Loaders.former",
        "if loader.connected:",
        "if False:",
        ("tests/remote/test_remote_controllers.py",),
    ),
    Mutant(
        "no other client switches them",
        "ClientControllers._switch",
        "self._loaders.take(client, (*command.activate, *command.deactivate))",
        "pass",
        ("tests/remote/test_remote_controllers.py",),
    ),
    Mutant(
        "no other client changes them",
        "ClientControllers._change",
        "self._loaders.take(client, [name])",
        "pass",
        ("tests/remote/test_remote_controllers.py",),
    ),
    Mutant(
        "no other client sets their parameters",
        "ClientControllers._set_parameters",
        "self._loaders.take(client, [name])",
        "pass",
        ("tests/remote/test_remote_controllers.py",),
    ),
    Mutant(
        "a program talks only to the owner that it has started",
        "OwnerLink._require_process",
        "if self._pid not in (None, pid):",
        "if False:",
        ("tests/remote/test_link.py",),
    ),
    Mutant(
        "a node starts no owner where there is one",
        "owner_process.require_free",
        "raise BusyOwnerError",
        "BusyOwnerError",
        ("tests/server/test_processes.py",),
    ),
    Mutant(
        "one connection has a limited number of requests in work",
        "connection.Connection._request",
        "len(self._finishing) >= PENDING",
        "False",
        ("tests/server/clients/test_hostile_clients.py",),
    ),
    Mutant(
        "a script moves no arm with another tool",
        "sequences.script._body",
        "yield _ITS_TOOL",
        "pass",
        ("tests/robot/sequences/test_running.py",),
    ),
    Mutant(
        "a plate whose corners were exchanged is refused",
        "Grid.from_corners",
        "if exchanged := _exchanged(first, row_end, column_end):",
        "if exchanged := []:",
        ("tests/robot/workspace/test_grids.py",),
    ),
    Mutant(
        "no client declares a path clear",
        "ClientControllers._follow",
        "collision_checked=False",
        "collision_checked=True",
        ("tests/robot/operations/controllers/test_run_controllers.py",),
    ),
    Mutant(
        "the operation of controllers ends with the lease",
        "ClientControllers._switch",
        "self._admission.keep(begun, client, epoch)",
        "pass",
        ("tests/robot/operations/controllers/test_run_controllers.py",),
    ),
    Mutant(
        "a stop deactivates controllers of clients",
        "RunControllers.cycles",
        "stack.manager.switch(clock.now(), (), leaving)",
        "pass",
        ("tests/robot/operations/controllers/test_controller_commands.py",),
    ),
    Mutant(
        "a pause reaches forward controllers",
        "RunControllers._apply_speed",
        "controller.share = share",
        "pass",
        ("tests/robot/operations/controllers/test_run_controllers.py",),
    ),
    Mutant(
        "a trigger keeps the order of homing",
        "require_homing_of",
        "if other in missing:",
        "if False:",
        ("tests/robot/operations/controllers/test_controller_commands.py",),
    ),
    Mutant(
        "limits that a client gives the jaws are kept",
        "loadable_controllers._completed",
        'if given.get("limits") is None:',
        "if True:",
        ("tests/robot/operations/controllers/test_controller_commands.py",),
    ),
    Mutant(
        "limits that a client gives the jaws are not wider than those of the arm",
        "loadable_controllers._require_limits",
        "if lower < least or upper > most:",
        "if False:",
        ("tests/server/controllers/test_requests.py",),
    ),
    Mutant(
        "jaws of clients do not move beside an unknown motion",
        "_course",
        "if name is None:",
        "if True:",
        ("tests/robot/operations/controllers/test_controller_commands.py",),
    ),
    Mutant(
        "jaws of clients are checked along the course of the arm",
        "send_gripper_goal",
        "check_along(arm, course, before)",
        "pass",
        ("tests/robot/operations/controllers/test_controller_commands.py",),
    ),
    Mutant(
        "goals of clients are planned before they begin",
        "can_be_planned",
        "not trajectory.stamp",
        "False",
        ("tests/server/controllers/test_goal_tracking.py",),
    ),
    Mutant(
        "goals of clients are planned for the widths that the jaws will have",
        "PlannedGoal._begin",
        "or now.workspace is not start.workspace",
        "",
        ("tests/robot/operations/controllers/test_run_controllers.py",),
    ),
    Mutant(
        "streams of clients are slowed down to the speed limit",
        "slowed",
        "if factor <= 1.0:",
        "if True:",
        ("tests/robot/operations/controllers/test_run_controllers.py",),
    ),
    Mutant(
        "velocities alone are checked although they were planned",
        "JointTrajectoryController.collision_checked",
        "not self._velocity_only",
        "True",
        ("tests/robot/operations/controllers/test_run_controllers.py",),
    ),
    Mutant(
        "a goal succeeds at rest",
        "ToleranceMonitor.after_the_end",
        "or not stopped",
        "",
        ("tests/control/controllers/joint_trajectory/test_rules_of_tolerances.py",),
    ),
    Mutant(
        "owner: the goals of a lease end with it",
        "Owner._stop_dependent",
        "if goal.needs_lease:",
        "if False:",
        INTERLEAVINGS,
    ),
    Mutant(
        "owner: a request is carried out once",
        "Connection._request",
        "if number in session.answers or number <= session.forgotten:",
        "if False:",
        (f"{HOSTILE}::test_a_request_that_came_before_is_not_carried_out_again",),
    ),
    Mutant(
        "owner: a request of long ago is not carried out again",
        "Connection._request",
        "or number <= session.forgotten",
        "",
        (f"{HOSTILE}::test_a_request_that_came_before_is_not_carried_out_again",),
    ),
    Mutant(
        "owner: a session with a connection is kept",
        "Sessions.take",
        "and not oldest.connections",
        "",
        (f"{HOSTILE}::test_a_session_with_a_connection_is_not_forgotten",),
    ),
    Mutant(
        "owner: nothing is carried out for a client that was cut off",
        "Connection.data_received",
        "if transport.is_closing():",
        "if False:",
        (f"{HOSTILE}::test_nothing_after_the_message_that_cut_a_client_off_is_carried_out",),
    ),
    Mutant(
        "owner: the first message of a client is short",
        "Connection.__init__",
        "framing.HELLO_MAX",
        "framing.REQUEST_MAX",
        (f"{HOSTILE}::test_before_hello_only_little_is_accepted",),
    ),
    Mutant(
        "owner: other users are refused",
        "ApiServer._may",
        "if self._group is None: return False",
        "if self._group is None: return True",
        (f"{HOSTILE}::test_another_user_is_refused",),
    ),
    Mutant(
        "client: a missed answer is recalled",
        "OwnerLink._resume",
        "command=m.Recall(request=pending.request.id)",
        "command=pending.request.command, epoch=pending.request.epoch",
        (LINK,),
    ),
    Mutant(
        "client: nothing is repeated at an owner that has forgotten it",
        "OwnerLink._resume",
        "not self.welcome.resumed and",
        "False and",
        (f"{LINK}::test_a_program_that_the_owner_has_forgotten_repeats_nothing",),
    ),
    Mutant(
        "client: the ends of goals are asked for after a gap",
        "RemoteRobot._receive",
        'if message.what == "gap":',
        "if False:",
        (f"{LINK}::test_a_client_that_missed_the_end_of_its_motion_asks_for_it",),
    ),
    Mutant(
        "web: the Host is checked",
        "Guard._checked",
        'not own.is_host(headers.all("host"))',
        "False",
        WEB_ROUTES,
    ),
    Mutant(
        "web: the Origin is checked",
        "Guard._checked",
        "origins and not own.is_origin(origins)",
        "False",
        WEB_ROUTES,
    ),
    Mutant(
        "web: a path that is not public needs a credential",
        "Guard._checked",
        "credential is None and not public",
        "False",
        WEB_ROUTES,
    ),
    Mutant(
        "web: a change with a cookie needs an Origin",
        "Guard._checked",
        "origins or by_program or safe",
        "True",
        WEB_SIGN_IN,
    ),
    Mutant(
        "web: a request of another site's page is refused",
        "Guard._checked",
        "not public and headers.foreign_site()",
        "False",
        WEB_SIGN_IN,
    ),
    Mutant(
        "owner: an uploaded trajectory has a largest size",
        "Uploads.add",
        "count > POINTS_MAX",
        "False",
        ("tests/server/tasks/test_uploads.py",),
    ),
    Mutant(
        "owner: the trajectories of old goals are dropped",
        "ClientGoal.shorten",
        "self._final is None",
        "False",
        ("tests/server/tasks/test_goals.py",),
    ),
    Mutant(
        "web: requests are counted",
        "Guard._checked",
        'not self._limits(scope["path"]).take(_requester(credential, address))',
        "False",
        WEB_SIGN_IN,
    ),
    Mutant(
        "web: a wrong token is counted",
        "Guard._credential",
        "not self._sign_ins.take(address)",
        "False",
        WEB_SIGN_IN,
    ),
    Mutant(
        "web: a sign-in is counted",
        "session.add",
        "not app.state.sign_ins.take(address)",
        "False",
        WEB_SIGN_IN,
    ),
    Mutant(
        "web: a sign-in expires",
        "BrowserSessions.find",
        "self.remaining(session) <= 0.0",
        "False",
        WEB_SIGN_IN,
    ),
    Mutant(
        "web: the cookie is not for scripts",
        "session.add",
        'max_age=round(LIFETIME), path="/", secure=settings.tls, httponly=True',
        'max_age=round(LIFETIME), path="/", secure=settings.tls, httponly=False',
        WEB_SIGN_IN,
    ),
    Mutant(
        "web: a message needs its scope",
        "Relay._beyond_scope",
        "needed <= self._client.scope",
        "True",
        WEB_RELAY,
    ),
    Mutant(
        "web: a viewer cannot lift its pause",
        "Relay._as_author",
        "required_scope(m.Resume()) <= self._client.scope",
        "True",
        WEB_RELAY,
    ),
    Mutant(
        "a pause is lifted by its author",
        "Pauses.lift",
        "commands or self._is_author(client, key)",
        "True",
        PAUSES,
    ),
    Mutant(
        "a namesake lifts no pause of a connected client",
        "Pauses._is_author",
        " and not author.client.connected",
        "",
        PAUSES,
    ),
    Mutant(
        "web: a command that is not listed is for administrators",
        "scopes.required_scope",
        "type(command) not in _OPERATE",
        "False",
        ("tests/web/access/test_scopes.py",),
    ),
    Mutant(
        "web: a session belongs to its scope",
        "Relay._introduced",
        'f"web {self._client.scope.name} {session}"',
        'f"web {session}"',
        WEB_RELAY,
    ),
    Mutant(
        "web: a long body is refused",
        "http.received",
        "len(body) > longest",
        "False",
        WEB_ANSWERS,
    ),
    Mutant(
        "web: few bodies arrive at once",
        "http.body_of",
        "len(arriving) >= _BODIES",
        "False",
        WEB_ANSWERS,
    ),
    Mutant(
        "web: a recording is looked up in a list",
        "Recordings.path_of",
        "path.name == name",
        "True",
        ("tests/dashboard/test_recordings.py",),
    ),
    Mutant(
        "web: an address that is announced leads to a page",
        "gateway_pages.page_of",
        "_URL.fullmatch(url)",
        "True",
        ("tests/web/owner/test_served_arms.py",),
    ),
    Mutant(
        "web: messages are counted",
        "Relay._up",
        "not self._rate.take(1.0 + len(payload) / _UNIT)",
        "False",
        WEB_RELAY,
    ),
    Mutant(
        "web: the end of a sign-in ends its WebSockets",
        "Relay._relayed",
        "ended is not None",
        "False",
        WEB_RELAY,
    ),
    Mutant(
        "web: a newer sample replaces one that waits",
        "Outbox.put",
        "message.startswith(_SAMPLE)",
        "False",
        ("tests/web/owner/test_outbox.py",),
    ),
    Mutant(
        "web: what waits is bounded",
        "Outbox.put",
        "self._size > MOST",
        "False",
        ("tests/web/owner/test_outbox.py",),
    ),
    Mutant(
        "web: tokens that others can read are refused",
        "tokens.read_private",
        "stat.S_IMODE(status.st_mode) & 0o077",
        "0",
        WEB_TOKENS,
    ),
    Mutant(
        "web: tokens of another user are refused",
        "tokens.read_private",
        "status.st_uid != os.getuid()",
        "False",
        WEB_TOKENS,
    ),
    Mutant(
        "web: beyond this computer it needs TLS",
        "gateway._names",
        "not is_loopback(host) and not settings.tls",
        "False",
        WEB_GATEWAY,
    ),
    Mutant(
        "web: a connection without a request ends",
        "_TimedHttp._give_up",
        "self.cycle is None",
        "False",
        WEB_GATEWAY,
    ),
    Mutant(
        "owner: a jog whose client falls silent expires",
        "JogStream._require_fresh",
        "self._clock() - self._at > self._expiry",
        "False",
        JOGS,
    ),
    Mutant(
        "owner: a late velocity of a jog is refused",
        "JogStream.set",
        "self._require_fresh()",
        "pass",
        JOGS,
    ),
    Mutant(
        "owner: the end of a jog decelerates at once",
        "Jog.cycles",
        "stack.jog.cancel(now)",
        "pass",
        JOGS,
    ),
    Mutant(
        "owner: a history keeps the largest value",
        "history._thinned",
        "np.maximum(low, high)",
        "np.minimum(low, high)",
        ("tests/server/state/test_history.py",),
    ),
    Mutant(
        "a joint without motor supply keeps its fault",
        "Joint::driver_still_faulty",
        "return driver_fault(motion_.driver().read_gstat(), 0).fault != Fault::NONE;",
        "return false;",
        REMEDIES,
    ),
    Mutant(
        "a latched fault is named before a joint that is not homed",
        "Arm.positions",
        "self.stack.supervisor.require_clear()",
        "pass",
        REMEDIES,
    ),
    Mutant(
        "owner: what the last owner knew is confirmed before the arm moves by itself",
        "Operation.begin",
        "if self._needs_confirmed_scene:",
        "if False:",
        ("tests/server/test_bench_file.py",),
    ),
    Mutant(
        "owner: what clients set is written for the next owner",
        "Owner._after_cycle",
        "self._bench.keep(self._arm)",
        "pass",
        ("tests/server/test_bench_file.py",),
    ),
    Mutant(
        "owner: a bench that cannot be read is no empty one",
        "BenchFile._read",
        "raise self._unusable(str(error)) from error",
        "return None",
        ("tests/server/test_bench_file.py",),
    ),
    Mutant(
        "owner: full speed needs a confirmed bench",
        "Workspace.with_reduced_speed",
        'if not flag("reduced_speed", reduced_speed):',
        "if False:",
        ("tests/server/test_bench_file.py",),
    ),
    Mutant(
        "owner: a scene whose file is gone stays",
        "scene_file",
        "read_scene, save_scene, None,",
        "read_scene, save_scene, Scene(),",
        ("tests/server/test_bench_file.py",),
    ),
    Mutant(
        "client: a stop gives the lease to nobody who waits for it",
        "RemoteRobot.acquire_lease",
        "self._lease.stops != stops",
        "False",
        ENDINGS,
    ),
    Mutant(
        "owner: poses of another program are not overwritten",
        "KeptFile.save",
        "there != known",
        "False",
        ("tests/server/test_kept_files.py",),
    ),
    Mutant(
        "owner: poses that a change removes are kept",
        "KeptFile.save",
        "self._loses(there, value)",
        "False",
        ("tests/server/test_kept_files.py",),
    ),
    Mutant(
        "owner: a client that confirms nothing gets no queue",
        "_Subscription.full",
        "0 < self.ahead <= len(self.unconfirmed)",
        "False",
        ("tests/server/state/test_samples.py",),
    ),
    Mutant(
        "owner: the speed of a simulation is bounded",
        "Simulation.set_speed",
        "not SLOWEST <= speed <= FASTEST",
        "False",
        ("tests/server/test_simulation.py",),
    ),
    Mutant(
        "simulation: clear ends what disturbs the bus",
        "Bench._disturb",
        "injection.cancel()",
        "pass",
        ("tests/sim/test_bench.py",),
    ),
)


@contextmanager
def _copy() -> Iterator[Path]:
    """Copy what the repository has to a folder that is removed afterwards."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    with tempfile.TemporaryDirectory() as folder:
        # Tests as another user import from it, too.
        Path(folder).chmod(0o755)
        tree = Path(folder) / "tree"
        for name in filter(None, listed.stdout.split("\0")):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, tree / name)
        yield tree


def _build(tree: Path) -> None:
    """Build the firmware for the simulated arm, into ``native`` beside the tests."""
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--upgrade"),
            *("--target", str(tree / "native"), str(tree / "firmware/sim")),
        ],
        check=True,
    )


def _build_images(tree: Path) -> None:
    """Build the images before the tests, which would all fail or be skipped without them."""
    build = subprocess.run(
        ["make", "--no-print-directory", "-C", str(tree / "firmware/joint")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if build.returncode != 0:
        raise SystemExit(f"the images were not built\n{build.stdout}")


def _red(tests: tuple[str, ...], tree: Path) -> bool:
    """Return whether tests fail in a copy."""
    if tests == HOST:
        words = [str(tree / "firmware/tests/run.sh"), "tests"]
    else:
        words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    run = subprocess.run(
        words,
        cwd=tree,
        env={**os.environ, "PYTHONPATH": f"{tree / 'native'}{os.pathsep}{tree / 'src'}"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    # A crash of the core's own tests is a finding, too.
    ran = (tree / HOST_BINARY).exists() if tests == HOST else run.returncode in {0, 1}
    if not ran:
        raise SystemExit(f"{' '.join(tests)} did not run\n{run.stdout}")
    return run.returncode != 0


def _red_as_it_is(tests: tuple[str, ...]) -> bool:
    with _copy() as tree:
        if any("emulated" in each for each in tests):
            _build_images(tree)
        return _red(tests, tree)


def _noticed(mutant: Mutant) -> bool:
    with _copy() as tree:
        file, text = apply(mutant.place, mutant.old, mutant.new)
        (tree / file.relative_to(ROOT)).write_text(text)
        if file.is_relative_to(BOARDS):
            _build_images(tree)
        elif file.is_relative_to(ROOT / "firmware") and mutant.tests != HOST:
            _build(tree)
        return _red(mutant.tests, tree)


def main() -> int:
    """Try every mutant; return 1 if one goes unnoticed."""
    words = sys.argv[1:] or [""]
    mutants = [each for each in MUTANTS if any(word in each.guard for word in words)]
    tried = len(mutants)
    sets = list(dict.fromkeys(each.tests for each in mutants))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        print(f"{len(sets)} sets of tests without any mutant", flush=True)  # noqa: T201
        useless = {
            each for each, red in zip(sets, pool.map(_red_as_it_is, sets), strict=True) if red
        }
        for tests in useless:
            print(f"RED without any mutant: {' '.join(tests)}", flush=True)  # noqa: T201
        unnoticed = [each.guard for each in mutants if each.tests in useless]
        mutants = [each for each in mutants if each.tests not in useless]
        for mutant, noticed in zip(mutants, pool.map(_noticed, mutants), strict=True):
            print(f"{'red ' if noticed else 'GREEN'} without: {mutant.guard}", flush=True)  # noqa: T201
            if not noticed:
                unnoticed.append(mutant.guard)
    print(f"{tried - len(unnoticed)} passed, {len(unnoticed)} failed")  # noqa: T201
    return 1 if unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
