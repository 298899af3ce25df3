#include "original_driver.h"

#include <algorithm>
#include <cmath>

#include "tmc5130_registers.h"

namespace bioscara::sim {

namespace {

using namespace tmc5130;

enum RampMode : std::uint32_t { POSITION = 0, POSITIVE = 1, NEGATIVE = 2 };

constexpr std::uint32_t kScaledCurrentAndStealthChop = 0x05;
constexpr std::uint32_t kShaft = 0x10;
constexpr std::uint32_t kPwmconf = 0x00050480;
constexpr std::uint32_t kFreewheel = 1U << 20;
constexpr std::uint32_t kShortLowSide = 2U << 20;
constexpr std::uint32_t kVelocityLimit = 0x7FFE00;
constexpr std::uint32_t kHardest = 0xFFFE;
constexpr double kVmaxPerRpm = 1431.656;
// Registers per full step per second (squared); 256 microsteps.
constexpr double kVmaxPerStep = 256.0 * 1.677;
constexpr double kAmaxPerStep = 256.0 * 0.0220;
constexpr double kVelocityUnit = 1e7 / 16777216.0;

std::uint32_t speed_register(double value) {
  return std::min(static_cast<std::uint32_t>(to_integer(std::fabs(value))), kVelocityLimit);
}

// 31 is the full scale. A value that is not a percentage becomes 16, which is 52 %.
std::uint32_t current_scale(int percent) {
  if (percent < 0 || percent > 100) return 16;
  return static_cast<std::uint32_t>((31 * percent + 99) / 100);
}

}  // namespace

std::int32_t to_integer(double value) {
  if (std::isnan(value)) return 0;
  return static_cast<std::int32_t>(std::clamp(value, -2147483648.0, 2147483647.0));
}

std::uint32_t OriginalDriver::exchange(std::uint8_t address, std::uint32_t value) {
  const std::uint8_t sent[5] = {
      address, static_cast<std::uint8_t>(value >> 24), static_cast<std::uint8_t>(value >> 16),
      static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
  std::uint8_t received[5] = {};
  hal_.driver_exchange(sent, received);
  return static_cast<std::uint32_t>(received[1]) << 24 |
         static_cast<std::uint32_t>(received[2]) << 16 |
         static_cast<std::uint32_t>(received[3]) << 8 | received[4];
}

void OriginalDriver::write(std::uint8_t address, std::uint32_t value) {
  exchange(address | 0x80, value);
}

std::uint32_t OriginalDriver::read(std::uint8_t address) {
  exchange(address, 0);
  return exchange(address, 0);
}

void OriginalDriver::setup() {
  hal_.driver_enable(true);
  gconf_ = kScaledCurrentAndStealthChop;
  write(GCONF, gconf_);
  write(GSTAT, 0x07);
  write(CHOPCONF, 0x00010042);  // TBL 2, HSTRT 4, TOFF 2
  write(TPWMTHRS, 5000);
  write(PWMCONF, kPwmconf | kShortLowSide);
  run_ = hold_ = current_scale(40);
  write_currents();
  write(VSTART, 0);
  write(A1, 600);
  write(V1, 0);
  write(D1, 600);
  write(VSTOP, 10);
  write(RAMPMODE, POSITION);
  write(XACTUAL, 0);
  write(XTARGET, 0);
  target_ = 0;
  positioning_ = true;
}

void OriginalDriver::move_steps(std::int32_t microsteps) {
  write(DMAX, acceleration_);
  write(AMAX, acceleration_);
  write(VMAX, max_velocity_);
  write(RAMPMODE, POSITION);
  positioning_ = true;
  off_ = 0;
  // Unsigned: the addition wraps round as in the register.
  target_ = static_cast<std::int32_t>(read(XACTUAL) + static_cast<std::uint32_t>(microsteps));
  write(XTARGET, static_cast<std::uint32_t>(target_));
}

void OriginalDriver::set_rpm(float rpm) {
  write(RAMPMODE, rpm > 0.0F ? POSITIVE : NEGATIVE);
  positioning_ = false;
  write(VMAX, speed_register(rpm * kVmaxPerRpm));
}

void OriginalDriver::set_max_velocity(float velocity) {
  max_velocity_ = speed_register(velocity * kVmaxPerStep);
  write(VMAX, max_velocity_);
}

void OriginalDriver::set_max_acceleration(float acceleration) {
  // 16 bits before the limit is applied: larger values wrap round.
  acceleration_ =
      static_cast<std::uint32_t>(to_integer(std::fabs(acceleration * kAmaxPerStep))) & 0xFFFF;
  acceleration_ = std::min(acceleration_, kHardest);
  write(AMAX, acceleration_);
  write(DMAX, acceleration_);
}

void OriginalDriver::begin_stop() {
  write(AMAX, kHardest);
  write(DMAX, kHardest);
  set_rpm(0.0F);
}

void OriginalDriver::end_stop() {
  write(AMAX, acceleration_);
  write(DMAX, acceleration_);
  target_ = static_cast<std::int32_t>(read(XACTUAL));
  write(XTARGET, static_cast<std::uint32_t>(target_));
  write(RAMPMODE, POSITION);
  positioning_ = true;
}

void OriginalDriver::set_current(int percent) {
  run_ = current_scale(percent);
  write_currents();
}

void OriginalDriver::set_hold_current(int percent) {
  hold_ = current_scale(percent);
  write_currents();
}

void OriginalDriver::write_currents() { write(IHOLD_IRUN, run_ << 8 | hold_); }

void OriginalDriver::set_brake_mode(int mode) {
  if (mode == 0 || mode == 1) {
    write(PWMCONF, kPwmconf | (mode == 0 ? kFreewheel : kShortLowSide));
    set_hold_current(0);
  } else {
    write(PWMCONF, kPwmconf);
    set_hold_current(25);
  }
}

void OriginalDriver::reverse() {
  gconf_ ^= kShaft;
  write(GCONF, gconf_);
}

OriginalDriver::Ramp OriginalDriver::ramp() {
  exchange(XACTUAL, 0);
  const auto position = static_cast<std::int32_t>(exchange(VACTUAL, 0));
  const auto velocity = static_cast<std::int32_t>(exchange(VACTUAL, 0) << 8) >> 8;  // 24 bits
  return {position, static_cast<float>(velocity * kVelocityUnit)};
}

void OriginalDriver::rewrite_position(std::int32_t position) {
  write(XACTUAL, static_cast<std::uint32_t>(position));
  write(XTARGET, static_cast<std::uint32_t>(target_));
}

void OriginalDriver::set_home() {
  target_ = positioning_ ? static_cast<std::int32_t>(read(XTARGET) - read(XACTUAL)) : 0;
  rewrite_position(0);
}

bool OriginalDriver::position_reached() {
  // The library polls every 50 us and sees a target that is only passed; the model polls less often.
  const auto off = static_cast<std::int32_t>(read(XACTUAL) - read(XTARGET));
  const bool passed = off_ != 0 && (off < 0) != (off_ < 0);
  off_ = off;
  return off == 0 || passed;
}

bool OriginalDriver::standing() { return read(VACTUAL) == 0; }

}  // namespace bioscara::sim
