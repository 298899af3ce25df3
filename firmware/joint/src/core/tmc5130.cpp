#include "tmc5130.h"

#include <math.h>

#include "units.h"

namespace bioscara {

namespace {

enum : uint8_t {
  GCONF = 0x00,
  GSTAT = 0x01,
  IOIN = 0x04,
  IHOLD_IRUN = 0x10,
  TPOWERDOWN = 0x11,
  TPWMTHRS = 0x13,
  RAMPMODE = 0x20,
  XACTUAL = 0x21,
  VACTUAL = 0x22,
  VSTART = 0x23,
  A1 = 0x24,
  V1 = 0x25,
  AMAX = 0x26,
  VMAX = 0x27,
  DMAX = 0x28,
  D1 = 0x2A,
  VSTOP = 0x2B,
  TZEROWAIT = 0x2C,
  XTARGET = 0x2D,
  CHOPCONF = 0x6C,
  DRV_STATUS = 0x6F,
  PWMCONF = 0x70,
};

constexpr uint8_t kWrite = 0x80;
// Current scaled from the reference input, and stealthChop below TPWMTHRS.
constexpr uint32_t kGconf = 0x05;
constexpr uint32_t kShaft = 0x10;
constexpr uint32_t kTpwmthrs = 5000;
// TBL 2, HSTRT 4, TOFF 2: the settings the arm was measured with.
constexpr uint32_t kChopconf = 0x00010042;
// With this field 0 the bridge is off, independent of the enable pin.
constexpr uint32_t kToff = 0x0F;
// Reset value; bits 20 and 21 are the freewheel field.
constexpr uint32_t kPwmconf = 0x00050480;
constexpr uint32_t kFreewheel = 1U << 20;
constexpr uint32_t kShortCoils = 2U << 20;
constexpr uint8_t kUndervoltage = 0x04;
// A chip without its supply leaves the line low or high. No register reads all ones.
constexpr uint32_t kHigh = 0xFFFFFFFF;
// The acceleration phases A1 and D1 are off while V1 is 0, but must not be 0 themselves.
constexpr uint32_t kFirstPhase = 600;
constexpr uint32_t kStopSpeed = 10;

struct Setting {
  uint8_t address;
  uint32_t value;
};
// Constant settings, and the ramp: the power stage is open, so a ramp that an earlier boot left
// running ends at once.
constexpr Setting kSettings[] = {
    {CHOPCONF, kChopconf}, {TPWMTHRS, kTpwmthrs}, {TPOWERDOWN, 10},   {VSTART, 0},
    {A1, kFirstPhase},     {V1, 0},               {D1, kFirstPhase},  {VSTOP, kStopSpeed},
    {TZEROWAIT, 0},        {AMAX, kAccelerationMax}, {DMAX, kAccelerationMax}, {RAMPMODE, 0},
};
constexpr size_t kSettingsAtOnce = 4;

uint32_t to_register(float value, float lsb, uint32_t limit) {
  const float steps = fabsf(value) / lsb;
  return steps >= static_cast<float>(limit) ? limit : static_cast<uint32_t>(steps + 0.5F);
}

// 31 is the full scale; the driver adds one, so 0 still is 1/32.
uint32_t current_scale(uint8_t percent) {
  const uint32_t scale = (31U * percent + 99U) / 100U;
  return scale > 31U ? 31U : scale;
}

// Its highest byte is the version, 0x11.
bool silent(uint32_t ioin) { return ioin >> 24 == 0 || ioin == kHigh; }

}  // namespace

Tmc5130::Tmc5130(Hal& hal) : hal_(hal), gconf_(kGconf) {}

uint32_t Tmc5130::exchange(uint8_t address, uint32_t value) {
  const uint8_t sent[5] = {address, static_cast<uint8_t>(value >> 24),
                           static_cast<uint8_t>(value >> 16), static_cast<uint8_t>(value >> 8),
                           static_cast<uint8_t>(value)};
  uint8_t received[5] = {};
  hal_.driver_exchange(sent, received);
  spi_status_ = received[0];
  // Every datagram reports a reset: at once, where GSTAT is read every 16th tick.
  if (spi_status_ != 0xFF) gstat_ |= spi_status_ & 0x01;
  return static_cast<uint32_t>(received[1]) << 24 | static_cast<uint32_t>(received[2]) << 16 |
         static_cast<uint32_t>(received[3]) << 8 | received[4];
}

void Tmc5130::write(uint8_t address, uint32_t value) { exchange(address | kWrite, value); }

void Tmc5130::setup() {
  begin_setup();
  while (!ready()) continue_setup();
}

void Tmc5130::begin_setup() {
  currents_ = speed_ = 0;
  pwm_ = kPwmconf | kFreewheel;
  acceleration_ = deceleration_ = kAccelerationMax;
  write(GCONF, gconf_);
  // Some revisions clear these bits when ones are written, others when they are read.
  write(GSTAT, 0x07);
  exchange(GSTAT, 0);
  gstat_ = 0;
  write(IHOLD_IRUN, currents_);
  write(PWMCONF, pwm_);
  write(VMAX, speed_);
  set_up_ = 0;
}

void Tmc5130::continue_setup() {
  constexpr size_t kCount = sizeof(kSettings) / sizeof(kSettings[0]);
  for (size_t written = 0; written < kSettingsAtOnce && set_up_ < kCount; ++written) {
    write(kSettings[set_up_].address, kSettings[set_up_].value);
    ++set_up_;
  }
  if (set_up_ < kCount) return;
  set_up_ = kReady;
  exchange(XACTUAL, 0);
  position_ = static_cast<int32_t>(exchange(XACTUAL, 0));
  target_ = position_;
  write(XTARGET, static_cast<uint32_t>(target_));
}

void Tmc5130::reverse() {
  gconf_ ^= kShaft;
  write(GCONF, gconf_);
}

void Tmc5130::open_bridge() { write(CHOPCONF, kChopconf & ~kToff); }

void Tmc5130::poll() {
  // Pipelined: each datagram returns the value that the previous one requested.
  exchange(XACTUAL, 0);
  position_ = static_cast<int32_t>(exchange(VACTUAL, 0));
  ++turn_;
  const uint8_t asked = turn_ % 16 == 0 ? GSTAT : turn_ % 16 == 8 ? IOIN : DRV_STATUS;
  const uint32_t raw = exchange(asked, 0);
  velocity_ = static_cast<int32_t>(raw << 8) >> 8;  // 24 bits, signed
  const uint32_t status = exchange(XACTUAL, 0);
  if (status == kHigh || (asked == IOIN && silent(status))) {
    gstat_ |= kUndervoltage;
  } else if (asked == DRV_STATUS) {
    drv_status_ = status;
  } else if (asked == GSTAT) {
    take(static_cast<uint8_t>(status & 0x07));
  }
}

uint8_t Tmc5130::read_gstat() {
  exchange(IOIN, 0);
  const uint32_t ioin = exchange(GSTAT, 0);
  const auto status = static_cast<uint8_t>(exchange(XACTUAL, 0) & 0x07);
  if (silent(ioin)) return kUndervoltage;
  take(status);
  return status;
}

void Tmc5130::take(uint8_t status) {
  if (status == 0) return;
  gstat_ |= status;
  write(GSTAT, status);  // It has just been read: see setup().
}

uint8_t Tmc5130::take_gstat() {
  const uint8_t bits = gstat_;
  gstat_ = 0;
  return bits;
}

void Tmc5130::set_target(int32_t position) {
  if (position == target_) return;
  target_ = position;
  write(XTARGET, static_cast<uint32_t>(position));
}

void Tmc5130::set_speed(float steps_per_second) {
  const uint32_t value = to_register(steps_per_second, kVelocityLsb, kVelocityMax);
  if (value == speed_) return;
  speed_ = value;
  write(VMAX, value);
}

void Tmc5130::set_acceleration(float acceleration, float deceleration) {
  // Zero would stop the ramp permanently, and DMAX = 0 is forbidden in positioning.
  uint32_t up = to_register(acceleration, kAccelerationLsb, kAccelerationMax);
  uint32_t down = to_register(deceleration, kAccelerationLsb, kAccelerationMax);
  if (up == 0) up = 1;
  if (down == 0) down = 1;
  if (up != acceleration_) write(AMAX, acceleration_ = up);
  if (down != deceleration_) write(DMAX, deceleration_ = down);
}

void Tmc5130::set_currents(uint8_t drive_percent, uint8_t hold_percent) {
  const uint32_t value = current_scale(drive_percent) << 8 | current_scale(hold_percent);
  if (value == currents_) return;
  currents_ = value;
  write(IHOLD_IRUN, value);
}

void Tmc5130::set_brake(BrakeMode mode) {
  const uint32_t value = kPwmconf | (mode == BrakeMode::FREEWHEEL    ? kFreewheel
                                     : mode == BrakeMode::COOL_BRAKE ? kShortCoils
                                                                     : 0U);
  if (value == pwm_) return;
  pwm_ = value;
  write(PWMCONF, value);
}

void Tmc5130::set_position(int32_t position) {
  write(XACTUAL, static_cast<uint32_t>(position));
  write(XTARGET, static_cast<uint32_t>(position));
  position_ = target_ = position;
}

}  // namespace bioscara
