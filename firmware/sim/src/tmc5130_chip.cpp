#include "tmc5130_chip.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tmc5130_registers.h"

namespace bioscara::sim {

namespace {

using namespace tmc5130;

// Standstill is recognised 2^20 clocks after the last step.
constexpr double kStandstillSeconds = 1048576.0 / 1e7;
// TPOWERDOWN counts in 2^18 clocks.
constexpr double kPowerDownUnit = 262144.0 / 1e7;
constexpr std::uint32_t kVersion = 0x11;
constexpr std::uint32_t kSine[] = {0xAAAAB554, 0x4A9554AA, 0x24492929, 0x10104222,
                                   0xFBFFFFFF, 0xB5BB777D, 0x49295556, 0x00404222};
// VDCMIN has a resolution of 256.
constexpr std::uint32_t kCommutation = 0x7FFF00;

}  // namespace

void Tmc5130Chip::power_up() {
  std::fill(std::begin(registers_), std::end(registers_), 0U);
  std::copy(std::begin(kSine), std::end(kSine), registers_ + MSLUT);
  registers_[MSLUTSEL] = 0xFFFF8056;
  registers_[MSLUTSTART] = 0x00F70000;
  registers_[PWMCONF] = 0x00050480;
  registers_[TPOWERDOWN] = 10;
  position_ = velocity_ = standstill_ = 0.0;
  waited_ = 0;
  gstat_ = motor_power_ ? 0x01 : 0x05;
  asked_ = 0;
  wrote_ = false;
}

void Tmc5130Chip::set_motor_power(bool on) {
  motor_power_ = on;
  if (!on) gstat_ |= 0x04;
}

std::uint8_t Tmc5130Chip::status() const {
  const bool reached = static_cast<std::int32_t>(std::lround(position_)) == xtarget();
  const bool at_speed = std::fabs(std::fabs(velocity_) - registers_[VMAX]) < 1.0;
  return static_cast<std::uint8_t>((gstat_ & 0x01) | (gstat_ & 0x02) | (standing() ? 0x08 : 0) |
                                   (at_speed ? 0x10 : 0) | (reached ? 0x20 : 0));
}

std::uint32_t Tmc5130Chip::read(std::uint8_t address) {
  switch (address) {
    case GSTAT:
      return gstat_;
    case IOIN:
      return kVersion << 24;
    case XACTUAL:
      return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(position_)));
    case VACTUAL:
      return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(velocity_))) &
             0xFFFFFF;
    case RAMP_STAT:
      return static_cast<std::uint32_t>((standing() ? 0x400 : 0) | (status() & 0x20 ? 0x200 : 0) |
                                        (status() & 0x10 ? 0x100 : 0));
    case DRV_STATUS:
      return (standstill_ >= kStandstillSeconds ? 0x80000000U : 0U) |
             (overtemperature_ ? 3U << 25 : 0U);
    case GCONF:
    case RAMPMODE:
    case XTARGET:
    case CHOPCONF:
      return registers_[address];
    default:
      return 0;  // Of those that are used: IHOLD_IRUN, PWMCONF, V1, VSTART, AMAX, DMAX, VMAX ...
  }
}

void Tmc5130Chip::write(std::uint8_t address, std::uint32_t value) {
  switch (address) {
    case GSTAT:
      // Undervoltage cannot be cleared while it lasts.
      gstat_ = static_cast<std::uint8_t>(gstat_ & ~value);
      if (!motor_power_) gstat_ |= 0x04;
      break;
    case XACTUAL:
      position_ = static_cast<std::int32_t>(value);
      break;
    case AMAX:
    case DMAX:
    case A1:
    case D1:
      registers_[address] = value & 0xFFFF;
      break;
    case TZEROWAIT:
      registers_[address] = value & 0xFFFF;
      break;
    case RAMPMODE:
      registers_[address] = value & 0x3;
      break;
    case VDCMIN:
      registers_[address] = value & kCommutation;
      break;
    case VMAX:
      registers_[address] = value & 0x7FFFFF;
      break;
    case V1:
      registers_[address] = value & 0xFFFFF;
      break;
    case VSTART:
    case VSTOP:
      registers_[address] = value & 0x3FFFF;
      break;
    case VACTUAL:
    case DRV_STATUS:
    case RAMP_STAT:
      break;
    default:
      registers_[address] = value;
  }
}

void Tmc5130Chip::exchange(const std::uint8_t (&sent)[5], std::uint8_t (&received)[5]) {
  answer(received);
  accept(sent);
}

void Tmc5130Chip::answer(std::uint8_t (&received)[5]) {
  received[0] = status();
  const std::uint32_t answer = wrote_ ? written_ : read(asked_);
  for (int i = 0; i < 4; ++i) received[1 + i] = static_cast<std::uint8_t>(answer >> (24 - 8 * i));
}

void Tmc5130Chip::accept(const std::uint8_t (&sent)[5]) {
  const auto address = static_cast<std::uint8_t>(sent[0] & 0x7F);
  wrote_ = (sent[0] & 0x80) != 0;
  if (wrote_) {
    written_ = static_cast<std::uint32_t>(sent[1]) << 24 |
               static_cast<std::uint32_t>(sent[2]) << 16 |
               static_cast<std::uint32_t>(sent[3]) << 8 | sent[4];
    write(address, written_);
  }
  asked_ = address;
}

void Tmc5130Chip::ramp_to(double target, double rate) {
  const double change = rate * kAcceleration * kRampPeriod / kVelocity;
  velocity_ += std::clamp(target - velocity_, -change, change);
}

// From below V1 with A1, from standstill with VSTART at once.
void Tmc5130Chip::speed_up(double target) {
  const double start = registers_[VSTART];
  if (std::fabs(velocity_) < start && std::fabs(target) >= start) {
    velocity_ = std::copysign(start, target);
    return;
  }
  const double first = registers_[V1];
  ramp_to(target, registers_[std::fabs(velocity_) < first ? A1 : AMAX]);
}

// The fastest speed from which it still stops in time: with DMAX, and below V1 with D1.
double Tmc5130Chip::allowed_speed(double distance) const {
  const double dmax = std::max(1U, registers_[DMAX]) * kAcceleration;
  const double d1 = std::max(1U, registers_[D1]) * kAcceleration;
  const double v1 = registers_[V1] * kVelocity;
  const double last = v1 * v1 / (2.0 * d1);
  const double speed = distance <= last ? std::sqrt(2.0 * d1 * distance)
                                        : std::sqrt(v1 * v1 + 2.0 * dmax * (distance - last));
  return speed / kVelocity;
}

void Tmc5130Chip::position_mode() {
  const double vmax = registers_[VMAX];
  const double distance = xtarget() - position_;
  const double stop = registers_[VSTOP];
  if (distance == 0.0 && std::fabs(velocity_) <= stop) {
    velocity_ = 0.0;
    return;
  }
  if (velocity_ == 0.0 && waited_ < registers_[TZEROWAIT]) {
    ++waited_;
    return;
  }
  const double direction = distance >= 0.0 ? 1.0 : -1.0;
  const double dmax = std::max(1U, registers_[DMAX]) * kAcceleration;
  const std::uint32_t braking = registers_[std::fabs(velocity_) < registers_[V1] ? D1 : DMAX];
  if (velocity_ * direction < 0.0) {
    ramp_to(0.0, braking);
    waited_ = 0;
    return;
  }
  const double wanted = std::min(vmax, allowed_speed(std::fabs(distance)));
  if (std::fabs(velocity_) > wanted) {
    ramp_to(direction * wanted, braking);
  } else {
    speed_up(direction * wanted);
  }
  if (vmax == 0.0) return;
  // The last step: the ramp ends on the target exactly.
  const double reach = std::fabs(velocity_) * kVelocity * kRampPeriod;
  if (reach >= std::fabs(distance) && std::fabs(velocity_) * kVelocity <=
                                          dmax * kRampPeriod * 2.0 + stop * kVelocity) {
    phase_ += shaft() * distance;
    position_ = xtarget();
    velocity_ = 0.0;
  }
}

// dcStep, above VDCMIN and without stealthChop, waits with each step for the last one. DC_TIME, which
// decides when that has been taken, is 0 here: the steps come with VDCMIN, the least speed.
void Tmc5130Chip::limit_commutation() {
  const double least = registers_[VDCMIN];
  if (least != 0.0 && std::fabs(velocity_) > least && chops())
    velocity_ = std::copysign(least, velocity_);
}

void Tmc5130Chip::step() {
  switch (registers_[RAMPMODE]) {
    case 0:
      position_mode();
      break;
    case 1:
      ramp_to(registers_[VMAX], registers_[AMAX]);
      break;
    case 2:
      ramp_to(-static_cast<double>(registers_[VMAX]), registers_[AMAX]);
      break;
    default:
      break;
  }
  limit_commutation();
  const double way = velocity_ * kVelocity * kRampPeriod;
  position_ += way;
  phase_ += shaft() * way;
  standstill_ = velocity_ == 0.0 ? standstill_ + kRampPeriod : 0.0;
}

double Tmc5130Chip::current_share(bool enabled) const {
  if (!enabled || !motor_power_ || (registers_[CHOPCONF] & 0x0F) == 0) return 0.0;
  const std::uint32_t hold = registers_[IHOLD_IRUN] & 0x1F;
  const std::uint32_t run = registers_[IHOLD_IRUN] >> 8 & 0x1F;
  const double wait = kStandstillSeconds + kPowerDownUnit * registers_[TPOWERDOWN];
  if (standstill_ < wait) return (run + 1) / 32.0;
  const bool open = hold == 0 && (registers_[PWMCONF] >> 20 & 3) != 0;
  return open ? 0.0 : (hold + 1) / 32.0;
}

bool Tmc5130Chip::chops() const {
  // stealthChop while a microstep takes at least TPWMTHRS clocks.
  const bool slow = std::fabs(velocity_) * kVelocity * registers_[TPWMTHRS] <= 1e7;
  return (registers_[GCONF] & 0x04) == 0 || !slow;
}

bool Tmc5130Chip::brakes() const {
  return (registers_[IHOLD_IRUN] & 0x1F) == 0 && (registers_[PWMCONF] >> 20 & 3) >= 2;
}

}  // namespace bioscara::sim
