"""The numbers that travel: codes, flags, states, faults, refusals, reset causes, capabilities."""

from __future__ import annotations

from enum import IntEnum, IntFlag


class Register(IntEnum):
    """Command codes. Version 2 codes differ from each other in at least 3 bits."""

    NONE = 0x00
    PING = 0x0F
    SETUP = 0x10
    SETRPM = 0x11
    GETDRIVERRPM = 0x12
    MOVESTEPS = 0x13
    MOVEANGLE = 0x14
    MOVETOANGLE = 0x15
    GETMOTORSTATE = 0x16
    RUNCONTINUOUS = 0x17
    ANGLEMOVED = 0x18
    SETCURRENT = 0x19
    SETHOLDCURRENT = 0x1A
    SETMAXACCELERATION = 0x1B
    SETMAXDECELERATION = 0x1C
    SETMAXVELOCITY = 0x1D
    ENABLESTALLGUARD = 0x1E
    DISABLESTALLGUARD = 0x1F
    CLEARSTALL = 0x20
    SETBRAKEMODE = 0x22
    ENABLEPID = 0x23
    DISABLEPID = 0x24
    ENABLECLOSEDLOOP = 0x25
    DISABLECLOSEDLOOP = 0x26
    SETCONTROLTHRESHOLD = 0x27
    MOVETOEND = 0x28
    STOP = 0x29
    GETPIDERROR = 0x2A
    CHECKORIENTATION = 0x2B
    GETENCODERRPM = 0x2C
    HOME = 0x2D
    HOMEOFFSET = 0x2E
    HELLO = 0xC0
    ARM = 0xE6
    TRACK = 0xD5
    TRACKLOAD = 0xB4
    STATE = 0xCB
    FAULT = 0xF3
    WATCHDOG = 0xED
    CLEARFAULT = 0xDE
    BUSERRORS = 0x47
    DISARM = 0x8C
    BOOTLOADER = 0xB9
    IMAGE = 0x61
    EXCEPTION = 0x78
    CAPTURE = 0x7F
    CAPTUREBLOCK = 0xAA
    WARNINGS = 0x92


class Flags(IntFlag):
    """Last byte of every answer's content: the joint's state, not the fate of the command.

    Version 1 answers carry bits 0 to 3 only; bits 4 to 7 are zero there.
    """

    STALL = 0x01
    BUSY = 0x02
    NOTHOMED = 0x04
    NOTENABLED = 0x08
    FAULT = 0x10
    """A fault is latched; read FAULT for it (version 2)."""
    ARMED = 0x20
    """The session is armed: every write without trailer but STOP is refused (version 2)."""
    REFUSED = 0x80
    """The frame just sent was not executed; FAULT gives the reason (version 2)."""


class JointState(IntEnum):
    """Activity of the joint, in STATE."""

    DISABLED = 0
    HOLDING = 1
    POSITION = 2
    VELOCITY = 3
    TRACKING = 4
    HOMING = 5
    ORIENTATION = 6
    MOVING_TO_END = 7
    STOPPING = 8
    FAULTED = 9


class Fault(IntEnum):
    """Cause of an autonomous stop of the joint, in FAULT. A number never changes its meaning."""

    NONE = 0
    STALL = 1
    """The position error passed the stall threshold; data: the error [microsteps]."""
    FOLLOWING = 2
    """The motor did not follow the reference; data: the error [microsteps]."""
    SETPOINT_LOST = 3
    """No newer setpoint within the watchdog time; data: the silence [ms]."""
    HOMING_TIMEOUT = 4
    """Homing took longer than it may; data: the time [s]."""
    HOMING_TRAVEL = 5
    """No end stop within the travel limit; data: the travel [deg of the motor]."""
    HOMING_DISAGREEMENT = 6
    """The two touches did not agree; data: their distance [deg of the motor]."""
    ORIENTATION = 7
    """The test motion was not seen, or seen with the wrong sign or size; data: [deg] seen."""
    ENCODER = 8
    """The encoder's answer is implausible or fails its check; data: the jump [deg]."""
    RUNAWAY = 9
    """The encoder moves against the command; data: the error [microsteps]."""
    DRIVER = 10
    """The motor driver reports an error; data: its DRV_STATUS or GSTAT bits."""
    DRIVER_RESET = 11
    """The motor driver restarted and lost its settings; data: GSTAT."""
    OVERTEMPERATURE = 12
    """The motor driver is too hot and switched off; data: DRV_STATUS bits."""
    INTERNAL = 13
    """A state that cannot be; data: a line number."""
    HOMING_OBSTRUCTED = 14
    """The motor was held from the start, or stalled while backing off; data: travel [deg]."""


class Refusal(IntEnum):
    """Why a frame was not executed. A number never changes its meaning."""

    NONE = 0
    LENGTH = 1
    """The number of bytes fits no form of this register."""
    UNKNOWN_REGISTER = 2
    CRC = 3
    OLD_SEQUENCE = 4
    """The sequence number is older than the last executed one."""
    NOT_ARMED = 5
    """The command needs an armed session."""
    TRAILER_REQUIRED = 6
    """The session is armed: a write without trailer is not accepted, but STOP."""
    NOT_FINITE = 7
    OUT_OF_RANGE = 8
    """A value is outside the range of the register, or a setpoint too far from the last one."""
    NOT_ENABLED = 9
    STALLED = 10
    BUSY = 11
    FAULT_LATCHED = 12
    QUEUE_FULL = 13
    """Commands came faster than the control tick takes them."""
    WRONG_BOOT = 14
    """ARM named a boot id that is not this boot's."""
    DIRECTION = 15
    """The register cannot be used in this direction."""
    ENABLED = 16
    """Only a disabled joint takes this."""
    NOT_DISARMED = 17
    """DISARM must be the frame just before it."""


class ResetCause(IntEnum):
    """Why the joint's controller started, in HELLO."""

    UNKNOWN = 0
    POWER_ON = 1
    BROWN_OUT = 2
    """The controller's own detector. The board's supervisor acts before it: see PIN."""
    PIN = 3
    """The reset pin: the button, a debugger, or a dip of the 3.3 V supply below 2.9 V."""
    SOFTWARE = 4
    """The firmware itself: an exception of the processor, or the jump to the bootloader."""
    WATCHDOG = 5
    """The control tick did not run for about 100 ms."""


class Capability(IntFlag):
    """Abilities of the firmware beyond version 1, in HELLO."""

    TRACK = 0x01
    TWO_TOUCH_HOMING = 0x02
    WATCHDOG = 0x04
    STALL_DETECTION = 0x08
    BUS_ERRORS = 0x10
    """Counts the errors of its bus: BUSERRORS."""
    BOOTLOADER = 0x20
    """Starts its bootloader on request: DISARM and BOOTLOADER."""
    LOAD = 0x40
    """Reports its load in each cycle: TRACKLOAD."""
    DIAGNOSIS = 0x80
    """Has IMAGE, EXCEPTION, CAPTURE and CAPTUREBLOCK."""


class Warnings(IntFlag):
    """Conditions of a joint that stop nothing and that a person should know, in WARNINGS."""

    AUTOCALIBRATION = 0x01
    """The encoder has refused its settings and keeps its autocalibration, which changes the error
    of its angle while the motor turns."""


class BrakeMode(IntEnum):
    """Behaviour of the motor at standstill when its hold current is zero."""

    FREEWHEEL = 0
    COOL_BRAKE = 1
    """The coils are shorted: a passive brake."""
    HARD_BRAKE = 2
    """The hold current flows."""
