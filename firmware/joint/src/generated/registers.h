// Generated from src/bioscara/protocol by python -m bioscara.protocol.generate.
// Do not edit: change the table and generate again.
#pragma once

#include <stdint.h>

namespace bioscara {

enum class Register : uint8_t {
  NONE = 0x00,
  PING = 0x0F,
  SETUP = 0x10,
  SETRPM = 0x11,
  GETDRIVERRPM = 0x12,
  MOVESTEPS = 0x13,
  MOVEANGLE = 0x14,
  MOVETOANGLE = 0x15,
  GETMOTORSTATE = 0x16,
  RUNCONTINUOUS = 0x17,
  ANGLEMOVED = 0x18,
  SETCURRENT = 0x19,
  SETHOLDCURRENT = 0x1A,
  SETMAXACCELERATION = 0x1B,
  SETMAXDECELERATION = 0x1C,
  SETMAXVELOCITY = 0x1D,
  ENABLESTALLGUARD = 0x1E,
  DISABLESTALLGUARD = 0x1F,
  CLEARSTALL = 0x20,
  SETBRAKEMODE = 0x22,
  ENABLEPID = 0x23,
  DISABLEPID = 0x24,
  ENABLECLOSEDLOOP = 0x25,
  DISABLECLOSEDLOOP = 0x26,
  SETCONTROLTHRESHOLD = 0x27,
  MOVETOEND = 0x28,
  STOP = 0x29,
  GETPIDERROR = 0x2A,
  CHECKORIENTATION = 0x2B,
  GETENCODERRPM = 0x2C,
  HOME = 0x2D,
  HOMEOFFSET = 0x2E,
  HELLO = 0xC0,
  ARM = 0xE6,
  TRACK = 0xD5,
  TRACKLOAD = 0xB4,
  STATE = 0xCB,
  FAULT = 0xF3,
  WATCHDOG = 0xED,
  CLEARFAULT = 0xDE,
  BUSERRORS = 0x47,
  DISARM = 0x8C,
  BOOTLOADER = 0xB9,
  IMAGE = 0x61,
  EXCEPTION = 0x78,
  CAPTURE = 0x7F,
  CAPTUREBLOCK = 0xAA,
  WARNINGS = 0x92,
};

enum class Flags : uint8_t {
  STALL = 0x01,
  BUSY = 0x02,
  NOTHOMED = 0x04,
  NOTENABLED = 0x08,
  FAULT = 0x10,
  ARMED = 0x20,
  REFUSED = 0x80,
};

enum class JointState : uint8_t {
  DISABLED = 0x00,
  HOLDING = 0x01,
  POSITION = 0x02,
  VELOCITY = 0x03,
  TRACKING = 0x04,
  HOMING = 0x05,
  ORIENTATION = 0x06,
  MOVING_TO_END = 0x07,
  STOPPING = 0x08,
  FAULTED = 0x09,
};

enum class Fault : uint8_t {
  NONE = 0x00,
  STALL = 0x01,
  FOLLOWING = 0x02,
  SETPOINT_LOST = 0x03,
  HOMING_TIMEOUT = 0x04,
  HOMING_TRAVEL = 0x05,
  HOMING_DISAGREEMENT = 0x06,
  ORIENTATION = 0x07,
  ENCODER = 0x08,
  RUNAWAY = 0x09,
  DRIVER = 0x0A,
  DRIVER_RESET = 0x0B,
  OVERTEMPERATURE = 0x0C,
  INTERNAL = 0x0D,
  HOMING_OBSTRUCTED = 0x0E,
};

enum class Refusal : uint8_t {
  NONE = 0x00,
  LENGTH = 0x01,
  UNKNOWN_REGISTER = 0x02,
  CRC = 0x03,
  OLD_SEQUENCE = 0x04,
  NOT_ARMED = 0x05,
  TRAILER_REQUIRED = 0x06,
  NOT_FINITE = 0x07,
  OUT_OF_RANGE = 0x08,
  NOT_ENABLED = 0x09,
  STALLED = 0x0A,
  BUSY = 0x0B,
  FAULT_LATCHED = 0x0C,
  QUEUE_FULL = 0x0D,
  WRONG_BOOT = 0x0E,
  DIRECTION = 0x0F,
  ENABLED = 0x10,
  NOT_DISARMED = 0x11,
};

enum class ResetCause : uint8_t {
  UNKNOWN = 0x00,
  POWER_ON = 0x01,
  BROWN_OUT = 0x02,
  PIN = 0x03,
  SOFTWARE = 0x04,
  WATCHDOG = 0x05,
};

enum class Capability : uint8_t {
  TRACK = 0x01,
  TWO_TOUCH_HOMING = 0x02,
  WATCHDOG = 0x04,
  STALL_DETECTION = 0x08,
  BUS_ERRORS = 0x10,
  BOOTLOADER = 0x20,
  LOAD = 0x40,
  DIAGNOSIS = 0x80,
};

enum class Warnings : uint8_t {
  AUTOCALIBRATION = 0x01,
};

enum class BrakeMode : uint8_t {
  FREEWHEEL = 0x00,
  COOL_BRAKE = 0x01,
  HARD_BRAKE = 0x02,
};

enum class Kind : uint8_t { U8, I8, U16, I16, U32, I32, F32 };

// The range of a written value.
template <typename T>
struct Range {
  T lower;
  T upper;
};

enum class Direction : uint8_t { NONE, READ, WRITE, READ_WRITE, EXCHANGE };

// One row of the register table. Sizes are payload bytes; flags and trailer come on top.
struct Definition {
  Register code;
  Direction direction;
  uint8_t written;
  uint8_t read;
  uint8_t version;
  bool blocking;
  bool motion;
  bool setpoint;
  // Type of the first value written, and the place of its range: a number in kNumberRanges, a byte
  // and those after it in kByteRanges.
  Kind kind;
  uint8_t range;
};

constexpr Range<float> kNumberRanges[] = {
    {-10000000.0F, 10000000.0F},  // SETRPM velocity
    {-2147483648.0F, 2147483647.0F},  // MOVESTEPS steps
    {-10000000.0F, 10000000.0F},  // MOVEANGLE angle
    {-10000000.0F, 10000000.0F},  // MOVETOANGLE angle
    {0.0F, 3.4028234663852886e+38F},  // SETMAXACCELERATION acceleration
    {0.0F, 3.4028234663852886e+38F},  // SETMAXDECELERATION deceleration
    {0.0F, 3.4028234663852886e+38F},  // SETMAXVELOCITY velocity
    {0.0F, 3.4028234663852886e+38F},  // SETCONTROLTHRESHOLD threshold
    {1.401298464324817e-45F, 10.0F},  // CHECKORIENTATION angle
    {-10000000.0F, 10000000.0F},  // HOMEOFFSET offset
    {0.0F, 65535.0F},  // ARM boot_id
    {-3.4028234663852886e+38F, 3.4028234663852886e+38F},  // TRACK position
    {-3.4028234663852886e+38F, 3.4028234663852886e+38F},  // TRACKLOAD position
    {10.0F, 200.0F},  // WATCHDOG timeout
    {0.0F, 65535.0F},  // DISARM boot_id
    {0.0F, 65535.0F},  // BOOTLOADER boot_id
};

constexpr Range<uint8_t> kByteRanges[] = {
    {0, 100},  // SETUP drive_current
    {0, 100},  // SETUP hold_current
    {0, 255},  // SETUP zero
    {0, 255},  // SETUP zero
    {0, 1},  // RUNCONTINUOUS direction
    {0, 100},  // SETCURRENT current
    {0, 100},  // SETHOLDCURRENT current
    {0, 255},  // ENABLESTALLGUARD threshold
    {0, 255},  // DISABLESTALLGUARD zero
    {0, 255},  // CLEARSTALL zero
    {0, 2},  // SETBRAKEMODE mode
    {0, 255},  // ENABLEPID zero
    {0, 255},  // DISABLEPID zero
    {0, 255},  // ENABLECLOSEDLOOP zero
    {0, 255},  // DISABLECLOSEDLOOP zero
    {0, 1},  // MOVETOEND direction
    {1, 250},  // MOVETOEND speed
    {0, 255},  // MOVETOEND threshold
    {0, 1},  // STOP mode
    {0, 1},  // HOME direction
    {1, 250},  // HOME speed
    {0, 255},  // HOME sensitivity
    {0, 100},  // HOME current
    {0, 255},  // CLEARFAULT fault
    {0, 255},  // CAPTURE zero
    {0, 51},  // CAPTUREBLOCK block
};

constexpr Definition kDefinitions[] = {
    {Register::NONE, Direction::NONE, 0, 0, 1, false, false, false, Kind::U8, 0},
    {Register::PING, Direction::READ, 0, 1, 1, false, false, false, Kind::U8, 0},
    {Register::SETUP, Direction::WRITE, 4, 0, 1, false, false, false, Kind::U8, 0},
    {Register::SETRPM, Direction::WRITE, 4, 0, 1, false, true, true, Kind::F32, 0},
    {Register::GETDRIVERRPM, Direction::READ, 0, 4, 1, false, false, false, Kind::U8, 4},
    {Register::MOVESTEPS, Direction::WRITE, 4, 0, 1, false, true, false, Kind::I32, 1},
    {Register::MOVEANGLE, Direction::WRITE, 4, 0, 1, false, true, false, Kind::F32, 2},
    {Register::MOVETOANGLE, Direction::WRITE, 4, 0, 1, false, true, true, Kind::F32, 3},
    {Register::GETMOTORSTATE, Direction::READ, 0, 1, 1, false, false, false, Kind::U8, 4},
    {Register::RUNCONTINUOUS, Direction::WRITE, 1, 0, 1, false, true, true, Kind::U8, 4},
    {Register::ANGLEMOVED, Direction::READ, 0, 4, 1, false, false, false, Kind::U8, 5},
    {Register::SETCURRENT, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 5},
    {Register::SETHOLDCURRENT, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 6},
    {Register::SETMAXACCELERATION, Direction::WRITE, 4, 0, 1, false, false, false, Kind::F32, 4},
    {Register::SETMAXDECELERATION, Direction::WRITE, 4, 0, 1, false, false, false, Kind::F32, 5},
    {Register::SETMAXVELOCITY, Direction::WRITE, 4, 0, 1, false, false, false, Kind::F32, 6},
    {Register::ENABLESTALLGUARD, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 7},
    {Register::DISABLESTALLGUARD, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 8},
    {Register::CLEARSTALL, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 9},
    {Register::SETBRAKEMODE, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 10},
    {Register::ENABLEPID, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 11},
    {Register::DISABLEPID, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 12},
    {Register::ENABLECLOSEDLOOP, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 13},
    {Register::DISABLECLOSEDLOOP, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 14},
    {Register::SETCONTROLTHRESHOLD, Direction::WRITE, 4, 0, 1, false, false, false, Kind::F32, 7},
    {Register::MOVETOEND, Direction::WRITE, 3, 0, 1, true, true, false, Kind::U8, 15},
    {Register::STOP, Direction::WRITE, 1, 0, 1, false, false, false, Kind::U8, 18},
    {Register::GETPIDERROR, Direction::READ, 0, 4, 1, false, false, false, Kind::U8, 19},
    {Register::CHECKORIENTATION, Direction::WRITE, 4, 0, 1, true, true, false, Kind::F32, 8},
    {Register::GETENCODERRPM, Direction::READ, 0, 4, 1, false, false, false, Kind::U8, 19},
    {Register::HOME, Direction::WRITE, 4, 0, 1, true, true, false, Kind::U8, 19},
    {Register::HOMEOFFSET, Direction::READ_WRITE, 4, 4, 1, false, false, false, Kind::F32, 9},
    {Register::HELLO, Direction::READ, 0, 10, 2, false, false, false, Kind::U8, 23},
    {Register::ARM, Direction::WRITE, 4, 0, 2, false, false, false, Kind::U16, 10},
    {Register::TRACK, Direction::EXCHANGE, 6, 6, 2, false, true, true, Kind::F32, 11},
    {Register::TRACKLOAD, Direction::EXCHANGE, 6, 7, 2, false, true, true, Kind::F32, 12},
    {Register::STATE, Direction::READ, 0, 10, 2, false, false, false, Kind::U8, 23},
    {Register::FAULT, Direction::READ, 0, 10, 2, false, false, false, Kind::U8, 23},
    {Register::WATCHDOG, Direction::READ_WRITE, 2, 2, 2, false, false, true, Kind::U16, 13},
    {Register::CLEARFAULT, Direction::WRITE, 1, 0, 2, false, false, false, Kind::U8, 23},
    {Register::BUSERRORS, Direction::READ, 0, 2, 2, false, false, false, Kind::U8, 24},
    {Register::DISARM, Direction::WRITE, 2, 0, 2, false, false, false, Kind::U16, 14},
    {Register::BOOTLOADER, Direction::WRITE, 2, 0, 2, false, false, false, Kind::U16, 15},
    {Register::IMAGE, Direction::READ, 0, 4, 2, false, false, false, Kind::U8, 24},
    {Register::EXCEPTION, Direction::READ, 0, 10, 2, false, false, false, Kind::U8, 24},
    {Register::CAPTURE, Direction::READ_WRITE, 1, 2, 2, false, false, false, Kind::U8, 24},
    {Register::CAPTUREBLOCK, Direction::EXCHANGE, 1, 10, 2, false, false, false, Kind::U8, 25},
    {Register::WARNINGS, Direction::READ, 0, 1, 2, false, false, false, Kind::U8, 26},
};

constexpr uint16_t kMagic = 0x4253;
constexpr uint8_t kProtocolVersion = 2;
constexpr float kVelocityStepRpm = 0.1F;
constexpr uint16_t kCaptureSamples = 256;
constexpr uint8_t kBlockSamples = 5;
constexpr uint8_t kCaptureBlockMost = 51;

}  // namespace bioscara
