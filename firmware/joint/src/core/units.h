// Motor units. Inside the core a length is a microstep of 1/256 full step, 51200 per turn.
#pragma once

#include <stdint.h>

namespace bioscara {

constexpr float kStepsPerTurn = 51200.0F;
constexpr float kStepsPerDegree = kStepsPerTurn / 360.0F;
// steps/s for one rpm.
constexpr float kStepsPerRpm = kStepsPerTurn / 60.0F;
// The encoder has 32768 counts per turn.
constexpr float kStepsPerCount = kStepsPerTurn / 32768.0F;
// One electrical period: beyond half of it the torque changes sign and the rotor slips.
constexpr float kElectricalPeriod = 1024.0F;

constexpr float kTickSeconds = 1e-3F;

// TMC5130 at 10 MHz (data sheet, section 14.1): v = VMAX * f / 2^24, a = AMAX * f^2 / 2^41.
constexpr float kVelocityLsb = 1e7F / 16777216.0F;
constexpr float kAccelerationLsb = 1e14F / 2199023255552.0F;
constexpr uint32_t kVelocityMax = 0x7FFE00;
constexpr uint32_t kAccelerationMax = 0xFFFE;
// The hardest deceleration that the driver can do [steps/s^2].
constexpr float kHardDeceleration = kAccelerationLsb * 65534.0F;

// 20 rad/s^2 of the motor: even the reduced current of homing can do it with every load of the arm.
constexpr float kBriskDeceleration = 163000.0F;

// Of two numbers, neither of them NaN: fmaxf and fminf are calls.
inline float larger(float one, float other) { return one > other ? one : other; }
inline float smaller(float one, float other) { return one < other ? one : other; }

inline float clamp(float value, float low, float high) {
  return value < low ? low : value > high ? high : value;
}

}  // namespace bioscara
