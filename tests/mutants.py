"""Takes out one safety guard after the other and requires that a test notices.

``make mutants``. Each mutant is a copy of the sources with one change; the tests that should turn
red run against it. A mutant that no test notices, or a change that no longer applies, is a failure.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
CORE = "firmware/joint/src/core"
BOARD = "firmware/joint/boards/ustepper_s32"
"""Not in the simulation: only the images have it."""


@dataclass(frozen=True)
class Mutant:
    """One guard taken out: in ``file``, ``old`` becomes ``new``; ``tests`` should notice."""

    guard: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]


HAZARDS = ("tests/firmware/test_hazards.py",)
HOST = ("firmware/tests",)
"""The core's own tests, compiled with it; not run by pytest."""
DRIVERS = ("tests/drivers",)
CONTROL = "src/bioscara/control"
LOOP = ("tests/control/test_loop.py",)
MANAGER = ("tests/control/test_manager_rules.py", "tests/control/test_cycle_rules.py")
TURN = ("tests/robot/test_call_arbiter.py",)
LIFECYCLE = ("tests/hardware/test_lifecycle.py",)
CLEARANCE = ("tests/control/test_clearance.py",)
SUPERVISOR = ("tests/control/test_supervisor.py",)
TOOL_SPEED = ("tests/control/test_tool_speed.py",)
FLIGHT_RECORD = ("tests/control/test_flight_record.py",)
TEACH_FILE = ("tests/robot/test_teach_table.py",)
HANDSHAKE = ("tests/drivers/test_handshake.py",)
ORIGINAL = ("tests/drivers/test_original.py", "tests/hardware/test_original_joints.py")
SOCKET = ("tests/sim/test_socket_bus.py",)
EMULATED_BUS = ("tests/firmware/test_emulated_bus.py",)
EMULATED_JOINT = ("tests/firmware/test_emulated_joint.py",)
EMULATED_BOOTLOADER = ("tests/firmware/test_emulated_bootloader.py",)
EMULATED_TIMING = ("tests/firmware/test_emulated_timing.py",)
FLASH = ("tests/flashing", "tests/cli/test_flash.py", "tests/cli/test_flash_on_bus.py")

MUTANTS = (
    Mutant(
        "filler beyond the answer",
        f"{BOARD}/i2c_target.cpp",
        "stm32::i2c1().DR = sent_ < answer_size_ ? answer_[sent_] : kFiller;",
        "if (sent_ < answer_size_) stm32::i2c1().DR = answer_[sent_];",
        EMULATED_BUS,
    ),
    Mutant(
        "look at a bus that stands still",
        f"{BOARD}/main.cpp",
        "  bioscara::target.supervise();\n",
        "",
        EMULATED_BUS,
    ),
    Mutant(
        "clearing of bus errors",
        f"{BOARD}/i2c_target.cpp",
        "    bus.SR1 = ~(status & kErrors) & kClearable;\n",
        "",
        EMULATED_BUS,
    ),
    Mutant(
        "frame thrown away after a bus error",
        f"{BOARD}/i2c_target.cpp",
        "    discard();\n    suspect_ = served = true;",
        "    suspect_ = served = true;",
        EMULATED_BUS,
    ),
    Mutant(
        "bus before the tick",
        f"{BOARD}/timers.cpp",
        "kTickPriority = 3",
        "kTickPriority = 0",
        EMULATED_TIMING,
    ),
    Mutant(
        "enable pin high before it drives",
        f"{BOARD}/pins.cpp",
        "  port.BSRR = stm32::bit(high ? pin : pin + 16);\n",
        "",
        EMULATED_JOINT,
    ),
    Mutant(
        "watchdog of the controller",
        f"{BOARD}/main.cpp",
        "  watchdog::start();\n",
        "",
        EMULATED_JOINT,
    ),
    Mutant(
        "power stage opened by a fault of the processor",
        f"{BOARD}/startup.cpp",
        "  bioscara::pins::kDriverDisable.high();\n  stm32::reset();",
        "  for (;;) {\n  }",
        EMULATED_JOINT,
    ),
    Mutant(
        "crystal before anything runs",
        f"{BOARD}/main.cpp",
        "if (!clock::start()) stm32::reset();",
        "clock::start();",
        EMULATED_JOINT,
    ),
    Mutant(
        "memory's noise in the boot id",
        f"{BOARD}/main.cpp",
        "board.begin(noise);",
        "board.begin(0);",
        EMULATED_JOINT,
    ),
    Mutant(
        "unique id in the boot id",
        f"{BOARD}/boot.cpp",
        "for (int word = 0; word < 3; ++word) hash = mix(hash, stm32::unique_id()[word]);",
        "",
        EMULATED_JOINT,
    ),
    Mutant(
        "reset of the I2C peripheral after an error",
        f"{BOARD}/i2c_target.cpp",
        "    suspect_ = served = true;",
        "    served = true;",
        EMULATED_BUS,
    ),
    Mutant(
        "check of the image at each start",
        f"{BOARD}/startup.cpp",
        " || !bioscara::image_intact()",
        "",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "request for the bootloader, used up",
        f"{BOARD}/bootloader.cpp",
        "  request_mark = 0;\n",
        "",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "power stage opened before the bootloader",
        f"{BOARD}/startup.cpp",
        "  bioscara::pins::open_power_stage();\n",
        "",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "reset after a jump from the bootloader",
        f"{BOARD}/startup.cpp",
        "  if (started_by_jump()) stm32::reset();\n",
        "  (void)started_by_jump();\n",
        EMULATED_BOOTLOADER,
    ),
    Mutant(
        "one of two boards that cannot be opened",
        "src/bioscara/flashing/dfu.py",
        "if closed is not None and not serial:",
        "if False:",
        FLASH,
    ),
    Mutant(
        "CRC of a firmware image",
        "src/bioscara/flashing/image.py",
        "if found != crc:",
        "if False:",
        FLASH,
    ),
    Mutant(
        "number of the joint in a firmware image",
        "src/bioscara/flashing/image.py",
        "if self.joint != joint:",
        "if False:",
        FLASH,
    ),
    Mutant(
        "version of a firmware image",
        "src/bioscara/flashing/image.py",
        "if self.version[:2] != _host_version():",
        "if False:",
        FLASH,
    ),
    Mutant(
        "comparison of what was flashed",
        "src/bioscara/flashing/programmer.py",
        "if read_back == content:",
        "if read_back:",
        FLASH,
    ),
    Mutant(
        "size of the flash of a board in its bootloader",
        "src/bioscara/flashing/dfu.py",
        "if board.flash_size not in (0, FLASH_SIZE):",
        "if False:",
        FLASH,
    ),
    Mutant(
        "an enabled joint is not flashed",
        "src/bioscara/cli/commands/flash.py",
        "if not joint.session.flags & Flags.NOTENABLED:",
        "if False:",
        FLASH,
    ),
    Mutant(
        "an enabled joint does not start its bootloader",
        "src/bioscara/drivers/link/session.py",
        "if not self.flags & Flags.NOTENABLED:",
        "if False:",
        FLASH,
    ),
    Mutant(
        "another board in its bootloader than the joint on the bus",
        "src/bioscara/cli/commands/flash.py",
        "if in_bootloader:",
        "if False:",
        FLASH,
    ),
    Mutant(
        "a joint that did not restart was not flashed",
        "src/bioscara/cli/commands/flash.py",
        " or hello.boot_id == self._boot_id",
        "",
        FLASH,
    ),
    Mutant(
        "CRC of a frame",
        f"{CORE}/wire.cpp",
        "size) == 0 ? Refusal::NONE : Refusal::CRC",
        "size) == 0 ? Refusal::NONE : Refusal::NONE",
        HAZARDS,
    ),
    Mutant(
        "repeated sequence number",
        f"{CORE}/wire.cpp",
        "repeated = ahead == 0 && answered_ == code;",
        "repeated = false;",
        HAZARDS,
    ),
    Mutant(
        "old sequence number",
        f"{CORE}/wire.cpp",
        "!repeated && counting_ && ahead <= 0 ?",
        "false ?",
        HAZARDS,
    ),
    Mutant(
        "earlier sessions stay closed",
        f"{CORE}/wire.cpp",
        "!open && was_opened(session) ?",
        "false ?",
        DRIVERS,
    ),
    Mutant(
        "trailer in an armed session",
        f"{CORE}/wire.cpp",
        "if (armed_ && !frame.checked && code != Register::STOP)",
        "if (false)",
        HAZARDS,
    ),
    Mutant(
        "setpoint watchdog",
        f"{CORE}/joint.cpp",
        "  if (!underway() && !stopping) return;",
        "  return;",
        HAZARDS,
    ),
    Mutant(
        "what a fault cut stays cut",
        f"{CORE}/joint_sequences.cpp",
        "(state_ == JointState::FAULTED && powered_)",
        "state_ == JointState::FAULTED",
        HAZARDS,
    ),
    Mutant(
        "a check that was broken off enables nothing",
        f"{CORE}/joint_commands.cpp",
        "enabled_ = enabled_ && checked_;",
        "",
        HAZARDS,
    ),
    Mutant(
        "motion needs an enabled joint",
        f"{CORE}/wire.cpp",
        "return Refusal::NOT_ENABLED;",
        "return Refusal::NONE;",
        (*HAZARDS, *DRIVERS),
    ),
    Mutant(
        "numbers must be finite, in the joint",
        f"{CORE}/wire.cpp",
        "if (!isfinite(command.number)) return Refusal::NOT_FINITE;\n      // Beyond this",
        "// Beyond this",
        HAZARDS,
    ),
    Mutant(
        "orientation check before a motor is enabled",
        f"{CORE}/orientation.cpp",
        "passed_ = fabsf(share - 1.0F) <= kTolerance;",
        "passed_ = true;",
        HAZARDS,
    ),
    Mutant(
        "agreement of the two touches",
        f"{CORE}/homing.cpp",
        "if (fabsf(apart) > kAgreement)",
        "if (false)",
        HAZARDS,
    ),
    Mutant(
        "travel limit of homing",
        f"{CORE}/homing.cpp",
        "if (travel > kTravelMargin * configuration_.range_deg)",
        "if (false)",
        HAZARDS,
    ),
    Mutant(
        "a motor that cannot back off from its first touch",
        f"{CORE}/homing.cpp",
        "if (moved < 0.5F * kBackOff) return",
        "if (false) return",
        HOST,
    ),
    Mutant(
        "a second touch far beyond the first",
        f"{CORE}/homing.cpp",
        "if (beyond > 2.0F * kBackOff) return",
        "if (false) return",
        HOST,
    ),
    Mutant(
        "time limit of homing",
        f"{CORE}/homing.cpp",
        "if (seconds > allowed) return",
        "if (false) return",
        HOST,
    ),
    Mutant(
        "agreement with a known end stop",
        f"{CORE}/joint_sequences.cpp",
        "if (moved && !again) {",
        "if (false) {",
        HOST,
    ),
    Mutant(
        "velocity limit of a setpoint",
        f"{CORE}/wire.cpp",
        "fits = fabsf(command.velocity) <= status().max_velocity_rpm * 1.1F + 1.0F &&\n"
        "             fabsf(",
        "fits = fabsf(",
        HOST,
    ),
    Mutant(
        "a velocity limit lowered within the tick of a setpoint",
        f"{CORE}/joint_commands.cpp",
        "clamp(command.velocity * kStepsPerRpm, -max_velocity_, max_velocity_)",
        "command.velocity * kStepsPerRpm",
        HOST,
    ),
    Mutant(
        "hard deceleration after a fault",
        f"{CORE}/joint_sequences.cpp",
        "stop(fault != Fault::SETPOINT_LOST);",
        "stop(false);",
        HOST,
    ),
    Mutant(
        "the least deceleration after a fault",
        f"{CORE}/joint_sequences.cpp",
        "kBriskDeceleration);\n}\n\nvoid Joint::cut",
        "0.0F);\n}\n\nvoid Joint::cut",
        HOST,
    ),
    Mutant(
        "the home is lost with the encoder",
        f"{CORE}/joint.cpp",
        "homed_ = checked_ = false;\n    latch",
        "checked_ = false;\n    latch",
        HOST,
    ),
    Mutant(
        "the home is lost with a frozen encoder",
        f"{CORE}/joint_sequences.cpp",
        "enabled_ = homed_ = checked_",
        "enabled_ = checked_",
        HOST,
    ),
    Mutant(
        "polls of version 1 feed no setpoint",
        f"{CORE}/joint.cpp",
        "(alone_ || stopping) && !wire_.armed()",
        "!wire_.armed()",
        HOST,
    ),
    Mutant(
        "polls of an armed session feed nothing",
        f"{CORE}/joint.cpp",
        "(alone_ || stopping) && !wire_.armed()",
        "(alone_ || stopping)",
        HOST,
    ),
    Mutant(
        "a command that meets a fault within its tick",
        f"{CORE}/joint_commands.cpp",
        "(!enabled_ || stalled_ || sequence())",
        "(stalled_ || sequence())",
        HOST,
    ),
    Mutant(
        "SETUP that arrives while a stall is latched",
        f"{CORE}/joint_commands.cpp",
        " || (fault_ != Fault::NONE && wire_.armed())) return;",
        ") return;",
        HOST,
    ),
    Mutant(
        "CLEARFAULT that meets another fault within its tick",
        f"{CORE}/joint_commands.cpp",
        "if (command.bytes[0] == static_cast<uint8_t>(fault_)) {",
        "{",
        HOST,
    ),
    Mutant(
        "status of the encoder read after an error",
        f"{CORE}/tle5012b.cpp",
        "  ask(kStatus, data);\n",
        "",
        HOST,
    ),
    Mutant(
        "an encoder that starts late",
        f"{CORE}/joint.cpp",
        "starting_ = kEncoderStart;",
        "bad_samples_ = 1;",
        HOST,
    ),
    Mutant(
        "reset flags of the driver read as well as written",
        f"{CORE}/tmc5130.cpp",
        "write(GSTAT, 0x07);\n  exchange(GSTAT, 0);\n",
        "write(GSTAT, 0x07);\n",
        HOST,
    ),
    Mutant(
        "the bootloader takes two steps",
        f"{CORE}/wire.cpp",
        "return disarmed ?",
        "return true ?",
        HOST,
    ),
    Mutant(
        "an enabled joint keeps its firmware",
        f"{CORE}/wire.cpp",
        "return Refusal::ENABLED;",
        "return Refusal::NONE;",
        HOST,
    ),
    Mutant(
        "health bits of the encoder's answer",
        f"{CORE}/tle5012b.cpp",
        " && (words[1] & kSound) == kSound;",
        ";",
        HOST,
    ),
    Mutant(
        "a joint that failed its check is checked with strokes",
        f"{CORE}/joint_sequences.cpp",
        "    checked_ = false;\n    cut(",
        "    cut(",
        HOST,
    ),
    Mutant(
        "silence in a homing that pauses",
        f"{CORE}/joint.cpp",
        "creeping && !sequence();",
        "creeping;",
        HOST,
    ),
    Mutant(
        "position limit, on the host",
        "src/bioscara/drivers/joint/limits.py",
        "                and self._lower <= position <= self._upper\n",
        "",
        DRIVERS,
    ),
    Mutant(
        "room to stop, on the host",
        "src/bioscara/drivers/joint/joint.py",
        "            self._stop_unless_clear(velocity)\n",
        "            pass\n",
        DRIVERS,
    ),
    Mutant(
        "check byte of an answer to TRACK",
        "src/bioscara/protocol/codec.py",
        "check == crc8_of_8(answer, _SEED[address << 1 | 1])",
        "True",
        ("tests/protocol",),
    ),
    Mutant(
        "sequence number of an answer to TRACK",
        "src/bioscara/protocol/codec.py",
        "and echo == sequence\n",
        "\n",
        ("tests/protocol",),
    ),
    Mutant(
        "velocity limit of a setpoint, on the host",
        "src/bioscara/drivers/joint/limits.py",
        "                and self._slowest <= velocity <= self._fastest\n",
        "",
        DRIVERS,
    ),
    Mutant(
        "homed check, on the host",
        "src/bioscara/drivers/joint/readiness.py",
        "if homed and (flags & Flags.NOTHOMED or not self._feedback.offset_known):",
        "if False:",
        DRIVERS,
    ),
    Mutant(
        "number of a repeated frame, on the host",
        "src/bioscara/drivers/link/session.py",
        "if unanswered and remaining:",
        "if False:",
        ("tests/drivers/test_damaged_frames.py",),
    ),
    Mutant(
        "the end of an interrupted motion",
        "src/bioscara/robot/motions/execution.py",
        "        supervisor.halt(now)\n",
        "",
        ("tests/robot/test_pose_motions.py",),
    ),
    Mutant(
        "the way of a motion that is cancelled",
        f"{CONTROL}/controllers/joint_trajectory/sampler.py",
        "if self.collision_checked and course is self.course",
        "if not self.collision_checked and course is self.course",
        ("tests/robot/test_pose_motions.py",),
    ),
    Mutant(
        "the way of a jog that breaks off",
        f"{CONTROL}/faults/stop.py",
        "_STOPPABLE = JointTrajectoryController, JogController",
        "_STOPPABLE = (JointTrajectoryController,)",
        ("tests/robot/test_pose_motions.py",),
    ),
    Mutant(
        "pairs left out by the broad phase",
        "src/bioscara/planning/collision/broad_phase.py",
        "not distance <= self.free_distance(here)",
        "not distance <= self._range",
        ("tests/planning/test_broad_phase.py",),
    ),
    Mutant(
        "jaws on the way to another width",
        "src/bioscara/robot/motions/gripper.py",
        "            self._check_width(width)\n",
        "            pass\n",
        ("tests/robot/test_beside_itself.py",),
    ),
    Mutant(
        "position of the jaws at the gripper's width",
        "src/bioscara/planning/collision/arm_bodies.py",
        "_JAWS[body.frame] * width",
        "_JAWS[body.frame] * 0.08",
        ("tests/planning/test_bodies.py",),
    ),
    Mutant(
        "a pushed arm moves away from itself",
        "src/bioscara/planning/collision/scene.py",
        "        if (end < floor)[pushed].any():\n",
        "        if False:\n",
        ("tests/robot/test_beside_itself.py",),
    ),
    Mutant(
        "evaluation of the parts inside near hulls",
        "src/bioscara/planning/collision/scene_pairs.py",
        "        if self._rough.any():\n",
        "        if False:\n",
        ("tests/planning/test_bodies.py",),
    ),
    Mutant(
        "pairs of links that can collide",
        "src/bioscara/planning/collision/arm_pairs.py",
        "    for k in range(links, len(arm) - 1):\n",
        "    for k in range(links, links + 1):\n",
        ("tests/planning/test_bodies.py",),
    ),
    Mutant(
        "a plan is looked at again when it is executed",
        "src/bioscara/robot/motions/arm_motions.py",
        "self._checked(plan.trajectory, planned=True)",
        "plan.trajectory",
        ("tests/robot/test_execution.py",),
    ),
    Mutant(
        "commands that fall behind the plan",
        "src/bioscara/robot/connection/stack.py",
        "or allowed(joint, version, joint.max_velocity) + _late(joint, parameters),\n",
        "or 0.0,\n",
        ("tests/robot/test_execution.py",),
    ),
    Mutant(
        "arrival where the plan ends",
        "src/bioscara/robot/connection/stack.py",
        '"goal": tolerances.goal,\n',
        "\n",
        ("tests/robot/test_execution.py",),
    ),
    Mutant(
        "rest after a motion that was given up",
        "src/bioscara/robot/motions/execution.py",
        "            self._come_to_rest(zero)\n            raise GoalAbortedError",
        "            raise GoalAbortedError",
        ("tests/robot/test_execution.py",),
    ),
    Mutant(
        "no path from beyond a limit",
        "src/bioscara/robot/planner.py",
        "        if problems:\n",
        "        if False:\n",
        ("tests/robot/test_execution.py",),
    ),
    Mutant(
        "what joints latched before is a fault of the arm",
        "src/bioscara/robot/connection/arm_session.py",
        "            stack.latch(self.arm.latched(Flags.FAULT | Flags.STALL), self.clock.now())\n",
        "",
        ("tests/robot/test_connection.py",),
    ),
    Mutant(
        "a command does not move an arm that was stopped before",
        "src/bioscara/cli/arm.py",
        "if options.acknowledge or not robot.faults:",
        "if True:",
        ("tests/cli/test_latched.py",),
    ),
    Mutant(
        "one call at a time uses the arm",
        "src/bioscara/robot/connection/call_arbiter.py",
        "                if other is not None:\n",
        "                if False:\n",
        TURN,
    ),
    Mutant(
        "a stop before a motion's first cycle",
        "src/bioscara/robot/connection/arm_session.py",
        "        self.arbiter.require_not_stopped()\n",
        "",
        TURN,
    ),
    Mutant(
        "nobody asks the joints while another thread moves them",
        "src/bioscara/robot/connection/call_arbiter.py",
        "            if running is None:\n                read()",
        "            read()",
        TURN,
    ),
    Mutant(
        "limits of a trajectory",
        "src/bioscara/planning/trajectory/validation.py",
        "    if excesses:",
        "    if False:",
        ("tests/planning",),
    ),
    Mutant(
        "limits of a goal",
        f"{CONTROL}/manager/switching.py",
        "controller.limits = limits",
        "controller.limits = {}",
        ("tests/control/joint_trajectory",),
    ),
    Mutant(
        "no burst after a late cycle",
        f"{CONTROL}/loop/loop.py",
        "self._deadline += (periods + 1) * self.period",
        "self._deadline += self.period",
        LOOP,
    ),
    Mutant(
        "a cycle that raises stops the arm",
        f"{CONTROL}/loop/loop.py",
        "supervisor.crash(error, time)",
        "del error",
        LOOP,
    ),
    Mutant(
        "an interrupted cycle stops the arm",
        f"{CONTROL}/loop/loop.py",
        "            self._supervisor.halt(now)\n            raise",
        "            raise",
        LOOP,
    ),
    Mutant(
        "the way of a pause is not made up for",
        f"{CONTROL}/loop/loop.py",
        "self.period if held_up else period",
        "period",
        LOOP,
    ),
    Mutant(
        "a pause is noticed before the write",
        f"{CONTROL}/loop/loop.py",
        "if held_up and self._driving:",
        "if False and held_up and self._driving:",
        LOOP,
    ),
    Mutant(
        "modes whose cycles the bus cannot carry",
        "src/bioscara/hardware/mode_switching.py",
        "if driven and highest < capacity.rate:",
        "if False and driven and highest < capacity.rate:",
        ("tests/hardware/test_capacity.py",),
    ),
    Mutant(
        "what the gripper holds when its width cannot be kept",
        "src/bioscara/hardware/gripper.py",
        "        except GripperError as error:\n",
        "        except ZeroDivisionError as error:\n",
        ("tests/hardware/test_gripper.py",),
    ),
    Mutant(
        "a loop that was stuck is stopped",
        f"{CONTROL}/loop/loop.py",
        "        if behind > SILENCE + self.period:",
        "        if False:",
        LOOP,
    ),
    Mutant(
        "a rate that the bus cannot carry",
        f"{CONTROL}/loop/loop.py",
        "if rate > highest:",
        "if False and rate > highest:",
        LOOP,
    ),
    Mutant(
        "a watchdog fed by good cycles only",
        f"{CONTROL}/loop/loop.py",
        "if good and self._watchdog is not None:",
        "if self._watchdog is not None:",
        ("tests/control/test_realtime.py",),
    ),
    Mutant(
        "a stop that cannot raise",
        f"{CONTROL}/faults/supervisor.py",
        "except Exception:  # noqa: BLE001  joints that cannot be ramped down",
        "except BioscaraError:  # joints that cannot be ramped down",
        SUPERVISOR,
    ),
    Mutant(
        "acknowledge before recover",
        f"{CONTROL}/faults/supervisor.py",
        "if self.state is not FaultState.ACKNOWLEDGED:",
        "if self.state is FaultState.CLEAR:",
        SUPERVISOR,
    ),
    Mutant(
        "a fault after the acknowledgement",
        f"{CONTROL}/faults/supervisor.py",
        "if self.state is not FaultState.STOPPING:",
        "if self.state is FaultState.CLEAR:",
        SUPERVISOR,
    ),
    Mutant(
        "evidence of the time before the fault",
        f"{CONTROL}/faults/log.py",
        "path = evidence.write(",
        "path = self._record.freeze().write(",
        SUPERVISOR,
    ),
    Mutant(
        "the name of a power loss",
        f"{CONTROL}/faults/log.py",
        "if len(recent) >= self._joints - 1:",
        "if False:",
        ("tests/system/test_control_scenarios.py",),
    ),
    Mutant(
        "one owner of a command interface",
        f"{CONTROL}/manager/claims.py",
        "if owner is not None and owner not in leaving:",
        "if False:",
        MANAGER,
    ),
    Mutant(
        "a command that is no number",
        f"{CONTROL}/manager/execution.py",
        "if not isfinite(handle.value):",
        "if False:",
        MANAGER,
    ),
    Mutant(
        "a shutdown of all hardware, whatever one part raises",
        f"{CONTROL}/manager/manager.py",
        "except Exception as error:  # noqa: BLE001  the others",
        "except InvalidArgumentError as error:  # the others",
        MANAGER,
    ),
    Mutant(
        "joints that Ctrl-C would leave energised",
        "src/bioscara/hardware/safe_stop.py",
        "except (KeyboardInterrupt, SystemExit) as error:",
        "except ZeroDivisionError as error:",
        ("tests/robot/test_leaving.py",),
    ),
    Mutant(
        "path tolerance of a trajectory",
        f"{CONTROL}/controllers/joint_trajectory/controller.py",
        "if overtime < 0.0 or sampler.waiting is not None:",
        "if False:",
        ("tests/control/controllers/joint_trajectory/test_rules_of_tolerances.py",),
    ),
    Mutant(
        "no motion before homing",
        "src/bioscara/hardware/mode_switching.py",
        "if not axis.homed:",
        "if False:",
        ("tests/hardware/test_modes.py",),
    ),
    Mutant(
        "a wrist is not turned beside a folded elbow",
        "src/bioscara/robot/motions/homing_order.py",
        "    _require_open_elbow(by_name, wanted)\n",
        "",
        ("tests/oracle/test_homing.py",),
    ),
    Mutant(
        "the wrist is at its end stop before the elbow folds",
        "src/bioscara/robot/motions/homing_order.py",
        '"j3": ("j2", "j4")',
        '"j3": ("j2",)',
        ("tests/oracle/test_homing.py",),
    ),
    Mutant(
        "a joint that trails its commands",
        f"{CONTROL}/faults/following_error.py",
        "if not error > limit:",
        "if True:",
        ("tests/system/test_control_scenarios.py",),
    ),
    Mutant(
        "what a joint said before it was released",
        "src/bioscara/hardware/arm.py",
        "read again.\n            axis.answered = False\n",
        "read again.\n",
        LIFECYCLE,
    ),
    Mutant(
        "what a joint said before a pause",
        "src/bioscara/hardware/arm.py",
        "if (old or not axis.answered)",
        "if not axis.answered",
        LIFECYCLE,
    ),
    Mutant(
        "the home of a joint that restarted",
        "src/bioscara/hardware/axis.py",
        "(JointLostError, JointResetError)",
        "JointLostError",
        LIFECYCLE,
    ),
    Mutant(
        "unverified commands are checked",
        f"{CONTROL}/limits/collision_guard.py",
        "        if unchecked:\n            self._checking = True",
        "        if False:\n            self._checking = True",
        CLEARANCE,
    ),
    Mutant(
        "the path to rest is checked",
        f"{CONTROL}/limits/collision_guard.py",
        "joint.within(joint.after(half + more))",
        "joint.after(0.0)",
        CLEARANCE,
    ),
    Mutant(
        "a path is checked again when it has changed by the spare clearance",
        f"{CONTROL}/limits/collision_guard.py",
        "self._spare -= self._deviation(path, period)",
        "self._deviation(path, period)",
        CLEARANCE,
    ),
    Mutant(
        "a joint under velocity control takes time to react",
        f"{CONTROL}/limits/joint_limiter.py",
        "return _REACTION + 2.0 * period",
        "return 0.0",
        (*CLEARANCE, "tests/control/test_limiting_laws.py"),
    ),
    Mutant(
        "a stop ends where joints are released",
        f"{CONTROL}/limits/collision_guard.py",
        "self._commanded() != self._stop_commands",
        "False",
        CLEARANCE,
    ),
    Mutant(
        "a goal that was not swept is unverified",
        f"{CONTROL}/controllers/joint_trajectory/messages.py",
        "collision_checked: bool = False",
        "collision_checked: bool = True",
        CLEARANCE,
    ),
    Mutant(
        "the robot keeps raw setpoints clear",
        "src/bioscara/robot/connection/stack.py",
        "Limiter(limited, (self.tool_speed, self.collision_guard, self.smoothing))",
        "Limiter(limited, (self.tool_speed, self.smoothing))",
        ("tests/robot/test_pose_motions.py",),
    ),
    Mutant(
        "a tool whose speed is not known stands still",
        f"{CONTROL}/limits/tool_speed.py",
        "        if speed <= limit * _ROUNDING:\n            return",
        "        if not speed > limit * _ROUNDING:\n            return",
        TOOL_SPEED,
    ),
    Mutant(
        "no share of a speed that is no number",
        f"{CONTROL}/limits/tool_speed.py",
        "share = limit / speed if speed == speed else 0.0",
        "share = limit / speed",
        TOOL_SPEED,
    ),
    Mutant(
        "the boot of a joint that is given a new session",
        "src/bioscara/drivers/link/session.py",
        "if before is None or now is None or now.boot_id != before.boot_id:",
        "if before is None or now is None:",
        ("tests/drivers/test_damaged_frames.py",),
    ),
    Mutant(
        "a flight record is whole or does not exist",
        f"{CONTROL}/faults/flight_recorder.py",
        "                return path, partial\n",
        "                partial.unlink()\n                return path, path\n",
        FLIGHT_RECORD,
    ),
    Mutant(
        "a flight record is on the disk before it has its name",
        f"{CONTROL}/faults/flight_recorder.py",
        "                os.fsync(file.fileno())\n",
        "",
        FLIGHT_RECORD,
    ),
    Mutant(
        "a teach file is on the disk before it replaces another",
        "src/bioscara/robot/workspace/teach_file.py",
        "                os.fsync(file.fileno())\n",
        "",
        TEACH_FILE,
    ),
    Mutant(
        "the name of a teach file is on the disk",
        "src/bioscara/robot/workspace/teach_file.py",
        "            os.fsync(folder)\n",
        "            pass\n",
        TEACH_FILE,
    ),
    Mutant(
        "version 2 on this bus stays version 2",
        "src/bioscara/drivers/link/handshake.py",
        "if address in _version_2.get(bus, ()):",
        "if False:",
        HANDSHAKE,
    ),
    Mutant(
        "one plain answer makes no version 1 joint",
        "src/bioscara/drivers/link/handshake.py",
        "_V1_ANSWERS = 12",
        "_V1_ANSWERS = 1",
        HANDSHAKE,
    ),
    Mutant(
        "an answer of neither version makes no version 1 joint",
        "src/bioscara/drivers/link/handshake.py",
        "            if corrupt is None:\n",
        "            if True:\n",
        HANDSHAKE,
    ),
    Mutant(
        "an intact PING between answers of version 1",
        "src/bioscara/drivers/link/handshake.py",
        "            _require_pong(bus, address)\n",
        "",
        HANDSHAKE,
    ),
    Mutant(
        "one byte of an answer before the rest",
        "src/bioscara/drivers/link/handshake.py",
        "            if first is None:\n",
        "            if True:\n",
        HANDSHAKE,
    ),
    Mutant(
        "quiet time after a command that an original joint's loop takes",
        "src/bioscara/drivers/link/session.py",
        "sleep_until(self.timing.free_from(message))\n        try:\n            return",
        "sleep_until(0.0)\n        try:\n            return",
        ORIGINAL,
    ),
    Mutant(
        "quiet time in a cycle",
        "src/bioscara/drivers/joint/group.py",
        "if now < timing.quiet_until:",
        "if False:",
        ORIGINAL,
    ),
    Mutant(
        "quiet time before a greeting",
        "src/bioscara/drivers/link/session.py",
        "sleep_until(self.timing.quiet_until)\n        try:\n            self.hello",
        "sleep_until(0.0)\n        try:\n            self.hello",
        ORIGINAL,
    ),
    Mutant(
        "a cycle does not wait for a quiet joint",
        "src/bioscara/hardware/homing.py",
        "if self._joint.session.paused:",
        "if False:",
        ORIGINAL,
    ),
    Mutant(
        "HOME is sent once",
        "src/bioscara/drivers/joint/homing.py",
        "            repeat=False,\n",
        "",
        ORIGINAL,
    ),
    Mutant(
        "a HOME whose answer is lost is stopped",
        "src/bioscara/drivers/joint/joint.py",
        "            if self.version == 1:\n                # If only",
        "            if False:\n                # If only",
        ORIGINAL,
    ),
    Mutant(
        "registers that an original joint does not have",
        "src/bioscara/drivers/link/session.py",
        "if self.version == 1 and message.definition.support is not Support.YES:",
        "if message.definition.version > self.version:",
        ORIGINAL,
    ),
    Mutant(
        "the magic twice before more is read",
        "src/bioscara/drivers/link/handshake.py",
        "_MAGIC_TIMES = 2",
        "_MAGIC_TIMES = 1",
        ORIGINAL,
    ),
    Mutant(
        "a maximum velocity in position mode only",
        "src/bioscara/drivers/joint/settings.py",
        "            self._require_position_mode()\n",
        "            pass\n",
        ORIGINAL,
    ),
    Mutant(
        "a deadman that fired in position mode",
        "src/bioscara/drivers/joint/settings.py",
        "if not session.timing.in_position_mode or session.flags & Flags.NOTENABLED:",
        "if not session.timing.in_position_mode:",
        ORIGINAL,
    ),
    Mutant(
        "a stalled joint ignores MOVETOANGLE",
        "src/bioscara/drivers/link/original.py",
        " and not (message is _MOVE and flags & _STALL)",
        "",
        ORIGINAL,
    ),
    Mutant(
        "acceleration that an original joint takes as it is",
        "src/bioscara/drivers/joint/settings.py",
        "if not lower <= acceleration <= upper:",
        "if False:",
        ORIGINAL,
    ),
    Mutant(
        "acceleration is checked before the motor is engaged",
        "src/bioscara/drivers/joint/joint.py",
        "        settings.check_acceleration(parameters.max_acceleration)\n",
        "",
        ORIGINAL,
    ),
    Mutant(
        "acceleration of homing is checked before the home is forgotten",
        "src/bioscara/drivers/joint/homing.py",
        "            self._settings.check_acceleration(homing.acceleration)\n",
        "            pass\n",
        ORIGINAL,
    ),
    Mutant(
        "SETRPM 0 before STOP",
        "src/bioscara/drivers/link/session.py",
        "                self.write(Register.SETRPM, 0.0, repeat=False)\n",
        "                pass\n",
        ORIGINAL,
    ),
    Mutant(
        "SETRPM 0 instead of STOP in a cycle",
        "src/bioscara/drivers/joint/cyclic.py",
        "            return self._prepare(_RPM, (0.0,))\n",
        "            pass\n",
        ORIGINAL,
    ),
    Mutant(
        "what an earlier host left running is stopped",
        "src/bioscara/drivers/link/session.py",
        "if flags & Flags.BUSY or not flags & Flags.NOTENABLED:",
        "if flags & Flags.BUSY:",
        ORIGINAL,
    ),
    Mutant(
        "a move ends at its target",
        "src/bioscara/drivers/joint/monitor.py",
        "            return still and near and sample.stamp >= earliest\n",
        "            return still\n",
        ORIGINAL,
    ),
    Mutant(
        "no steps for a joint that was let go",
        "src/bioscara/drivers/joint/joint.py",
        "            self.readiness.require_ready(homed=False)\n        if position",
        "            pass\n        if position",
        ORIGINAL,
    ),
    Mutant(
        "a frame without a read before the first question",
        "src/bioscara/drivers/link/handshake.py",
        "                _wake(bus, clock, address)\n",
        "                pass\n",
        ORIGINAL,
    ),
    Mutant(
        "a second after power-up",
        "src/bioscara/drivers/link/handshake.py",
        "        clock.sleep_until(clock.now() + START_UP)\n        forget_silence",
        "        forget_silence",
        ORIGINAL,
    ),
    Mutant(
        "a second after power-up, for all joints at once",
        "src/bioscara/drivers/link/handshake.py",
        "    if awake:\n",
        "    if False:\n",
        ORIGINAL,
    ),
    Mutant(
        "a joint that fell silent in its session",
        "src/bioscara/drivers/link/session.py",
        "                note_silence(self._bus, self._address)\n",
        "                pass\n",
        ORIGINAL,
    ),
    Mutant(
        "a version 1 joint that does not acknowledge is lost at once",
        "src/bioscara/drivers/joint/cyclic.py",
        "if self.bad_cycles >= LOST_AFTER or self._session.timing.silent:",
        "if self.bad_cycles >= LOST_AFTER:",
        ORIGINAL,
    ),
    Mutant(
        "no cycle asks a joint that may be starting",
        "src/bioscara/drivers/joint/group.py",
        "if timing.silent:",
        "if False:",
        ORIGINAL,
    ),
    Mutant(
        "a second before a joint that fell silent is asked again",
        "src/bioscara/drivers/link/session.py",
        "            self.timing.quiet_until = self._clock.now() + START_UP\n",
        "            pass\n",
        ORIGINAL,
    ),
    Mutant(
        "an original joint that was lost while homing is stopped",
        "src/bioscara/hardware/arm.py",
        "                    homing.stop_lost()\n",
        "                    pass\n",
        ("tests/control/test_homing_controller.py",),
    ),
    Mutant(
        "frames of the size that a joint takes",
        "src/bioscara/bus/linux.py",
        "if not 0 <= count <= MESSAGE_MAX:",
        "if not 0 <= count:",
        ("tests/bus/test_linux_unavailable.py",),
    ),
    Mutant(
        "no reply of an interrupted transfer is left",
        "src/bioscara/sim/socket_bus.py",
        "            self._release()\n            raise\n",
        "            raise\n",
        SOCKET,
    ),
    Mutant(
        "the number of a frame on the socket",
        "src/bioscara/sim/framing.py",
        "if (frame.kind, frame.sequence) != (kind, sequence):",
        "if frame.kind != kind:",
        SOCKET,
    ),
    Mutant(
        "one host of the simulated arm at a time",
        "src/bioscara/sim/server.py",
        "            if not other.gone():\n",
        "            if False:\n",
        SOCKET,
    ),
    Mutant(
        "the deadline of a frame on the socket",
        "src/bioscara/sim/server.py",
        "if client.deadline is not None and now > client.deadline:",
        "if False:",
        SOCKET,
    ),
    Mutant(
        "raw commands do not make belts swing",
        "src/bioscara/robot/connection/stack.py",
        "Limiter(limited, (self.tool_speed, self.collision_guard, self.smoothing))",
        "Limiter(limited, (self.tool_speed, self.collision_guard))",
        ("tests/system/test_load_speed.py",),
    ),
    Mutant(
        "jogs do not make belts swing",
        "src/bioscara/robot/planner.py",
        "scene, speed, self.windows)",
        "scene, speed)",
        ("tests/system/test_load_speed.py",),
    ),
)


def _build(tree: Path, target: Path) -> None:
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--upgrade"),
            *("--target", str(target), str(tree / "firmware/sim")),
        ],
        check=True,
    )


def _noticed(mutant: Mutant) -> bool:
    with tempfile.TemporaryDirectory() as folder:
        tree, target = Path(folder) / "tree", Path(folder) / "native"
        for part in ("src", "tests", "benchmarks", "firmware", "docs"):
            shutil.copytree(
                ROOT / part, tree / part, ignore=shutil.ignore_patterns("build", "__pycache__")
            )
        shutil.copy(ROOT / "pyproject.toml", tree)
        path = tree / mutant.file
        text = path.read_text()
        if text.count(mutant.old) != 1:
            raise SystemExit(f"{mutant.guard}: {mutant.file} has changed; adapt this mutant")
        path.write_text(text.replace(mutant.old, mutant.new))
        if mutant.tests == HOST:
            return _noticed_on_the_host(mutant, tree)
        search = [str(tree / "src")]
        if mutant.file.startswith("firmware") and BOARD not in mutant.file:
            _build(tree, target)
            search.insert(0, str(target))
        run = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *mutant.tests],
            cwd=tree,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(search)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        if run.returncode not in {0, 1}:
            raise SystemExit(f"{mutant.guard}: the tests did not run\n{run.stdout}")
        return run.returncode == 1


def _noticed_on_the_host(mutant: Mutant, tree: Path) -> bool:
    run = subprocess.run(
        [str(tree / "firmware/tests/run.sh"), "tests"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if not (tree / "build/firmware/tests").exists():
        raise SystemExit(f"{mutant.guard}: the firmware did not compile\n{run.stdout}")
    return run.returncode != 0


def main() -> int:
    """Try every mutant; return 1 if one goes unnoticed."""
    unnoticed = []
    for mutant in MUTANTS:
        noticed = _noticed(mutant)
        print(f"{'red ' if noticed else 'GREEN'} without: {mutant.guard}", flush=True)  # noqa: T201
        if not noticed:
            unnoticed.append(mutant.guard)
    print(f"{len(MUTANTS) - len(unnoticed)} passed, {len(unnoticed)} failed")  # noqa: T201
    return 1 if unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
