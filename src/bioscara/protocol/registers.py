"""The register table: the one place that knows what travels on the wire.

From it come the codec, the C++ header of the firmware and docs/protocol.md. Version 1 rows are
fixed for life: they are those of the joints on existing arms. Motor units stay on the wire
(degrees and rpm of the motor shaft, percent); :mod:`bioscara.drivers` converts.
"""

from __future__ import annotations

from bioscara.protocol.enums import Register
from bioscara.protocol.rows import ABOVE_ZERO, Access, Definition, Field, Kind, Support

_ZERO = Field("zero", Kind.U8, padding=True)


def _percent(name: str) -> Field:
    return Field(name, Kind.U8, "%", 0, 100)


def _number(name: str, unit: str = "") -> Field:
    # Beyond this the position counter of the driver would overflow.
    return Field(name, Kind.F32, unit, -1e7, 1e7)


_R, _W, _X = Access.READ, Access.WRITE, Access.EXCHANGE
_RPM = Field("velocity", Kind.F32, "rpm")
_DIRECTION = Field("direction", Kind.U8, "", 0, 1)
_LOAD = Field("load", Kind.U8, "%")

VELOCITY_STEP_RPM = 0.1
"""Resolution of the velocities in TRACK [rpm]: 16 bits then span +-3276 rpm of the motor."""

_TRACKED = (
    Field("position", Kind.F32, "deg"),
    Field("velocity", Kind.I16, "rpm", scale=VELOCITY_STEP_RPM),
)

PROTOCOL = 2
"""The newest version of the protocol."""

WATCHDOG_MS = 60
"""Silence after which a moving joint stops [ms]: three lost cycles of 50 Hz."""
SILENCE = 1e-3 * WATCHDOG_MS
"""The same [s]."""
CAPTURE_SAMPLES = 256
"""Position errors that a joint captures."""
CAPTURE_PERIOD = 1e-3
"""Time between two of them, the period of the joint's control tick [s]."""
BLOCK_SAMPLES = 5
"""Those in one answer: as many as fit into a frame of 13 bytes (What the check byte catches)."""
MAGIC = 0x4253
"""First two bytes of HELLO's answer, the letters ``SB`` in wire order."""

REGISTERS: tuple[Definition, ...] = (
    Definition(Register.NONE, Access.NONE, "Host side only: no blocking command is running."),
    Definition(
        Register.PING,
        _R,
        "Answers the character O; N would mean not ready.",
        read=(Field("acknowledge", Kind.U8),),
    ),
    Definition(
        Register.SETUP,
        _W,
        "Engages the motor with these currents and holds here; clears NOTENABLED and STALL and "
        "switches stall detection off. Takes effect after the orientation check, during which "
        "BUSY is set; a check that STOP interrupts enables nothing. Refused while BUSY, which "
        "after a fault may show for 0.3 s until the field has run down, and in an armed session "
        "while a fault is latched.",
        written=(_percent("drive_current"), _percent("hold_current"), _ZERO, _ZERO),
    ),
    Definition(
        Register.SETRPM,
        _W,
        "Velocity mode: accelerates to this motor speed and keeps it.",
        written=(_number("velocity", "rpm"),),
        motion=True,
        setpoint=True,
    ),
    Definition(
        Register.GETDRIVERRPM,
        _R,
        "Speed of the driver's ramp, not of the rotor.",
        read=(_RPM,),
        support=Support.NAMED,
    ),
    Definition(
        Register.MOVESTEPS,
        _W,
        "Relative move. Existing firmware takes the number as microsteps of 1/256 step, "
        "although its documentation says full steps; so does this firmware.",
        written=(Field("steps", Kind.I32, "microsteps"),),
        motion=True,
    ),
    Definition(
        Register.MOVEANGLE,
        _W,
        "Relative move.",
        written=(_number("angle", "deg"),),
        motion=True,
        support=Support.NAMED,
    ),
    Definition(
        Register.MOVETOANGLE,
        _W,
        "Moves to this encoder angle within the speed and acceleration limits.",
        written=(_number("angle", "deg"),),
        motion=True,
        setpoint=True,
    ),
    Definition(
        Register.GETMOTORSTATE,
        _R,
        "Bits as the driver names them: 0x20 position reached, 0x10 velocity reached, "
        "0x08 standstill, 0x04 stall detected.",
        read=(Field("bits", Kind.U8),),
        support=Support.NAMED,
    ),
    Definition(
        Register.RUNCONTINUOUS,
        _W,
        "Velocity mode at the maximum velocity; direction 1 is positive.",
        written=(_DIRECTION,),
        motion=True,
        setpoint=True,
        support=Support.NAMED,
    ),
    Definition(
        Register.ANGLEMOVED, _R, "Encoder position.", read=(Field("angle", Kind.F32, "deg"),)
    ),
    Definition(
        Register.SETCURRENT,
        _W,
        "Drive current; 0 disables the joint. Engages no joint that is disabled.",
        written=(_percent("current"),),
    ),
    Definition(
        Register.SETHOLDCURRENT,
        _W,
        "Hold current; 0 disables the joint. Engages no joint that is disabled; its next SETUP "
        "brings its own.",
        written=(_percent("current"),),
    ),
    Definition(
        Register.SETMAXACCELERATION,
        _W,
        "Acceleration and deceleration limit; values beyond the driver's range are clamped.",
        written=(Field("acceleration", Kind.F32, "deg/s^2", 0.0),),
    ),
    Definition(
        Register.SETMAXDECELERATION,
        _W,
        "Deceleration limit alone; clamped like the former.",
        written=(Field("deceleration", Kind.F32, "deg/s^2", 0.0),),
        support=Support.NAMED,
    ),
    Definition(
        Register.SETMAXVELOCITY,
        _W,
        "Speed limit; never starts or reverses a motion.",
        written=(Field("velocity", Kind.F32, "deg/s", 0.0),),
    ),
    Definition(
        Register.ENABLESTALLGUARD,
        _W,
        "Switches stall detection on and clears STALL; lower is more sensitive.",
        written=(Field("threshold", Kind.U8),),
    ),
    Definition(
        Register.DISABLESTALLGUARD,
        _W,
        "Switches stall detection off.",
        written=(_ZERO,),
        support=Support.NAMED,
    ),
    Definition(
        Register.CLEARSTALL,
        _W,
        "Clears STALL; nothing moves.",
        written=(_ZERO,),
        support=Support.NAMED,
    ),
    Definition(
        Register.SETBRAKEMODE,
        _W,
        "Standstill behaviour at zero hold current, which a disabled joint has: 0 freewheel, 1 "
        "cool brake (shorted coils), 2 hard brake.",
        written=(Field("mode", Kind.U8, "", 0, 2),),
    ),
    Definition(
        Register.ENABLEPID, _W, "Same as ENABLECLOSEDLOOP.", written=(_ZERO,), support=Support.NAMED
    ),
    Definition(
        Register.DISABLEPID,
        _W,
        "Switches position correction off.",
        written=(_ZERO,),
        support=Support.NAMED,
    ),
    Definition(
        Register.ENABLECLOSEDLOOP,
        _W,
        "Switches position correction on: a finished move ends at the requested encoder angle.",
        written=(_ZERO,),
        support=Support.NAMED,
    ),
    Definition(
        Register.DISABLECLOSEDLOOP,
        _W,
        "Switches position correction off and disables the joint.",
        written=(_ZERO,),
    ),
    Definition(
        Register.SETCONTROLTHRESHOLD,
        _W,
        "Error below which position is not corrected.",
        written=(Field("threshold", Kind.F32, "microsteps", 0.0),),
        support=Support.NAMED,
    ),
    Definition(
        Register.MOVETOEND,
        _W,
        "Moves until the motor is held, then stops where it no longer presses: 2 degrees of the "
        "motor beside the contact, 80 where the rise of the torque was not seen; sets no home.",
        written=(
            _DIRECTION,
            Field("speed", Kind.U8, "rpm", 1, 250),
            Field("threshold", Kind.I8),
        ),
        blocking=True,
        motion=True,
        support=Support.NAMED,
    ),
    Definition(
        Register.STOP,
        _W,
        "Ramps down and holds; cancels a blocking command (clears BUSY). Mode 0 stops with the "
        "hardest deceleration, 1 with the configured one. Never refused for its state.",
        written=(Field("mode", Kind.U8, "", 0, 1),),
    ),
    Definition(
        Register.GETPIDERROR,
        _R,
        "Commanded minus measured position.",
        read=(Field("error", Kind.F32, "microsteps"),),
        support=Support.NAMED,
    ),
    Definition(
        Register.CHECKORIENTATION,
        _W,
        "Turns the motor by twice this angle and back and compares sign and size with the "
        "encoder; a motion underway ends first. Above 1.8 degrees to the other side where the "
        "rotor is held.",
        written=(Field("angle", Kind.F32, "deg", ABOVE_ZERO, 10.0),),
        blocking=True,
        motion=True,
    ),
    Definition(Register.GETENCODERRPM, _R, "Filtered encoder speed.", read=(_RPM,)),
    Definition(
        Register.HOME,
        _W,
        "Seeks the end stop at this speed, or at 95 rpm (joint 2: 110) if that is faster, backs "
        "off and touches it again at 17 rpm; the second touch becomes encoder zero. A touch is a "
        "lead of the field that grows by 2.5 times the sensitivity, 75 to 130 microsteps. Sets "
        "NOTHOMED and BUSY at once. Direction 1 is positive.",
        written=(
            _DIRECTION,
            Field("speed", Kind.U8, "rpm", 1, 250),
            Field("sensitivity", Kind.U8),
            _percent("current"),
        ),
        blocking=True,
        motion=True,
    ),
    Definition(
        Register.HOMEOFFSET,
        Access.READ_WRITE,
        "A number of the host's, stored while the joint is powered: the joint position at encoder "
        "zero.",
        written=(_number("offset"),),
        read=(Field("offset", Kind.F32),),
    ),
    Definition(
        Register.HELLO,
        _R,
        "Identity of the joint. Accepted with any sequence number and does not advance it.",
        read=(
            Field("magic", Kind.U16),
            Field("protocol", Kind.U8),
            Field("firmware_major", Kind.U8),
            Field("firmware_minor", Kind.U8),
            Field("joint", Kind.U8),
            Field("boot_id", Kind.U16),
            Field("reset_cause", Kind.U8),
            Field("capabilities", Kind.U8),
        ),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.ARM,
        _W,
        "Opens a session on this boot: from now on sequence numbers count from this frame's and "
        "every write but STOP needs a trailer. The session now armed, if named again, is answered "
        "and not re-opened, and one of the 31 before it is refused, so that a late copy can "
        "neither rewind the sequence nor bring an earlier session back.",
        written=(Field("boot_id", Kind.U16), Field("session", Kind.U16)),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.TRACK,
        _X,
        "Setpoint to be reached one setpoint interval after it arrives; the joint interpolates. "
        "Answers position and velocity.",
        written=_TRACKED,
        read=_TRACKED,
        version=2,
        support=Support.NO,
        motion=True,
        setpoint=True,
    ),
    Definition(
        Register.TRACKLOAD,
        _X,
        "As TRACK; the answer has the load of STATE as well. Only for a joint with the capability "
        "LOAD.",
        written=_TRACKED,
        read=(*_TRACKED, _LOAD),
        version=2,
        support=Support.NO,
        motion=True,
        setpoint=True,
    ),
    Definition(
        Register.STATE,
        _R,
        "Position, velocity, the activity of the joint, and how close the position error is to "
        "the stall threshold.",
        read=(
            Field("position", Kind.F32, "deg"),
            Field("velocity", Kind.F32, "rpm"),
            Field("state", Kind.U8),
            _LOAD,
        ),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.FAULT,
        _R,
        "The first fault since cleared and its number, the last refusal, and counters that "
        "saturate instead of wrapping.",
        read=(
            Field("fault", Kind.U8),
            Field("data", Kind.F32),
            Field("refusal", Kind.U8),
            Field("crc_errors", Kind.U16),
            Field("refusals", Kind.U16),
        ),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.WATCHDOG,
        Access.READ_WRITE,
        "Time without a newer setpoint after which a motion is ramped down and latched. Each "
        "newer write also counts as a setpoint: so the host keeps homing and relative moves "
        "alive.",
        written=(Field("timeout", Kind.U16, "ms", 10, 200),),
        read=(Field("timeout", Kind.U16, "ms"),),
        version=2,
        support=Support.NO,
        setpoint=True,
    ),
    Definition(
        Register.CLEARFAULT,
        _W,
        "Acknowledges the latched fault; nothing moves. A disabled joint stays disabled; a "
        "stall leaves the joint enabled.",
        written=(Field("fault", Kind.U8),),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.BUSERRORS,
        _R,
        "How often since boot the joint met an error of its bus (a START or STOP inside a byte, "
        "lost arbitration) or gave up a transfer that stood still for 4 ms; saturates.",
        read=(Field("errors", Kind.U16),),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.DISARM,
        _W,
        "Ends the session of a disabled joint at rest: writes without trailer are accepted "
        "again. The first of the two steps to the bootloader.",
        written=(Field("boot_id", Kind.U16),),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.BOOTLOADER,
        _W,
        "Starts the bootloader in the controller's ROM 20 ms later, with the power stage open; "
        "the joint answers no more until it is flashed or its power is cycled. Only in a disabled "
        "joint at rest, and only if DISARM was the frame just before it, at most 2 s ago.",
        written=(Field("boot_id", Kind.U16),),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.IMAGE,
        _R,
        "CRC-32 of the image that the joint runs, as in the image's identity; 0 for a simulated "
        "joint, which has none. This register, the next three and WARNINGS: only of a joint with "
        "the capability DIAGNOSIS.",
        read=(Field("crc32", Kind.U32),),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.EXCEPTION,
        _R,
        "The last exception of the processor since power came up, which restarted the joint: "
        "number of its vector; address of the instruction, 0 where the stack was unusable; fault "
        "status (CFSR) of the Cortex-M4; starts since then, 1 for the present one, 0 where there "
        "was no exception.",
        read=(
            Field("vector", Kind.U8),
            Field("address", Kind.U32),
            Field("status", Kind.U32),
            Field("starts", Kind.U8),
        ),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.CAPTURE,
        Access.READ_WRITE,
        f"Written: begins to capture the position error (field minus rotor) in each control tick, "
        f"{CAPTURE_SAMPLES} times, in place of the last capture. Read: how many are captured.",
        written=(Field("zero", Kind.U8, padding=True),),
        read=(Field("captured", Kind.U16),),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.CAPTUREBLOCK,
        _X,
        f"Answers {BLOCK_SAMPLES} of the captured errors, the first of them number "
        f"{BLOCK_SAMPLES} x block; saturated at 32767, 0 behind the last one. OUT_OF_RANGE until "
        "all errors of the block are captured.",
        written=(Field("block", Kind.U8, "", 0, (CAPTURE_SAMPLES - 1) // BLOCK_SAMPLES),),
        read=tuple(
            Field(f"error_{index}", Kind.I16, "microsteps") for index in range(BLOCK_SAMPLES)
        ),
        version=2,
        support=Support.NO,
    ),
    Definition(
        Register.WARNINGS,
        _R,
        "Conditions that stop nothing, as bits: 0x01 the encoder has refused its settings and "
        "keeps its autocalibration.",
        read=(Field("bits", Kind.U8),),
        version=2,
        support=Support.NO,
    ),
)
