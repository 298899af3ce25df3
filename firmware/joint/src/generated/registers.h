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

enum class BrakeMode : uint8_t {
  FREEWHEEL = 0x00,
  COOL_BRAKE = 0x01,
  HARD_BRAKE = 0x02,
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
};

constexpr Definition kDefinitions[] = {
    {Register::NONE, Direction::NONE, 0, 0, 1, false, false, false},
    {Register::PING, Direction::READ, 0, 1, 1, false, false, false},
    {Register::SETUP, Direction::WRITE, 4, 0, 1, false, false, false},
    {Register::SETRPM, Direction::WRITE, 4, 0, 1, false, true, true},
    {Register::GETDRIVERRPM, Direction::READ, 0, 4, 1, false, false, false},
    {Register::MOVESTEPS, Direction::WRITE, 4, 0, 1, false, true, false},
    {Register::MOVEANGLE, Direction::WRITE, 4, 0, 1, false, true, false},
    {Register::MOVETOANGLE, Direction::WRITE, 4, 0, 1, false, true, true},
    {Register::GETMOTORSTATE, Direction::READ, 0, 1, 1, false, false, false},
    {Register::RUNCONTINUOUS, Direction::WRITE, 1, 0, 1, false, true, true},
    {Register::ANGLEMOVED, Direction::READ, 0, 4, 1, false, false, false},
    {Register::SETCURRENT, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::SETHOLDCURRENT, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::SETMAXACCELERATION, Direction::WRITE, 4, 0, 1, false, false, false},
    {Register::SETMAXDECELERATION, Direction::WRITE, 4, 0, 1, false, false, false},
    {Register::SETMAXVELOCITY, Direction::WRITE, 4, 0, 1, false, false, false},
    {Register::ENABLESTALLGUARD, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::DISABLESTALLGUARD, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::CLEARSTALL, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::SETBRAKEMODE, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::ENABLEPID, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::DISABLEPID, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::ENABLECLOSEDLOOP, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::DISABLECLOSEDLOOP, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::SETCONTROLTHRESHOLD, Direction::WRITE, 4, 0, 1, false, false, false},
    {Register::MOVETOEND, Direction::WRITE, 3, 0, 1, true, true, false},
    {Register::STOP, Direction::WRITE, 1, 0, 1, false, false, false},
    {Register::GETPIDERROR, Direction::READ, 0, 4, 1, false, false, false},
    {Register::CHECKORIENTATION, Direction::WRITE, 4, 0, 1, true, true, false},
    {Register::GETENCODERRPM, Direction::READ, 0, 4, 1, false, false, false},
    {Register::HOME, Direction::WRITE, 4, 0, 1, true, true, false},
    {Register::HOMEOFFSET, Direction::READ_WRITE, 4, 4, 1, false, false, false},
    {Register::HELLO, Direction::READ, 0, 10, 2, false, false, false},
    {Register::ARM, Direction::WRITE, 4, 0, 2, false, false, false},
    {Register::TRACK, Direction::EXCHANGE, 6, 6, 2, false, true, true},
    {Register::TRACKLOAD, Direction::EXCHANGE, 6, 7, 2, false, true, true},
    {Register::STATE, Direction::READ, 0, 10, 2, false, false, false},
    {Register::FAULT, Direction::READ, 0, 10, 2, false, false, false},
    {Register::WATCHDOG, Direction::READ_WRITE, 2, 2, 2, false, false, true},
    {Register::CLEARFAULT, Direction::WRITE, 1, 0, 2, false, false, false},
    {Register::BUSERRORS, Direction::READ, 0, 2, 2, false, false, false},
    {Register::DISARM, Direction::WRITE, 2, 0, 2, false, false, false},
    {Register::BOOTLOADER, Direction::WRITE, 2, 0, 2, false, false, false},
    {Register::IMAGE, Direction::READ, 0, 4, 2, false, false, false},
    {Register::EXCEPTION, Direction::READ, 0, 10, 2, false, false, false},
    {Register::CAPTURE, Direction::READ_WRITE, 1, 2, 2, false, false, false},
    {Register::CAPTUREBLOCK, Direction::EXCHANGE, 1, 10, 2, false, false, false},
};

constexpr uint16_t kMagic = 0x4253;
constexpr uint8_t kProtocolVersion = 2;
constexpr float kVelocityStepRpm = 0.1F;
constexpr uint16_t kCaptureSamples = 256;
constexpr uint8_t kBlockSamples = 5;
constexpr uint8_t kCaptureBlockMost = 51;

}  // namespace bioscara
