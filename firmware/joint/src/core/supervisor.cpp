#include "supervisor.h"

#include <math.h>

namespace bioscara {

namespace {

// Without stall detection three electrical periods are allowed: the rotor is lost for certain.
constexpr float kFollowing = 3.0F * kElectricalPeriod;
// The encoder runs against the field for so many ticks.
constexpr int kRunaway = 20;
constexpr float kRunawaySpeed = 2000.0F;
constexpr int kConfirm = 2;

constexpr uint8_t kReset = 0x01;
constexpr uint8_t kDriverError = 0x02;
constexpr uint8_t kUndervoltage = 0x04;
constexpr uint32_t kShort = 3U << 27;
constexpr uint32_t kOvertemperature = 1U << 25;

}  // namespace

uint8_t Supervisor::load_percent(float error) const {
  const float limit = stall_on_ ? stall_limit_ : 0.5F * kElectricalPeriod;
  return static_cast<uint8_t>(clamp(100.0F * fabsf(error) / limit, 0.0F, 255.0F));
}

Supervisor::Finding Supervisor::check(const Motion& motion, float error, int32_t encoder_change) {
  const float commanded = motion.velocity();
  const float seen = static_cast<float>(encoder_change) * kStepsPerCount / kTickSeconds;
  const bool moving = fabsf(commanded) > kRunawaySpeed;
  same_ = moving && encoder_change == 0 ? same_ + 1 : moving ? 0 : same_;
  // A lost rotor swings to and fro; one that runs away keeps its direction.
  against_ = moving && seen * commanded < -0.3F * commanded * commanded ? against_ + 1 : 0;
  if (against_ >= kRunaway) return {Fault::RUNAWAY, error};
  const float limit = stall_on_ ? stall_limit_ : kFollowing;
  lost_ = fabsf(error) > limit ? lost_ + 1 : 0;
  if (lost_ < kConfirm) return {};
  return {stall_on_ ? Fault::STALL : Fault::FOLLOWING, error};
}

Supervisor::Finding driver_fault(uint8_t gstat, uint32_t drv_status) {
  if ((gstat & kReset) != 0) return {Fault::DRIVER_RESET, static_cast<float>(gstat)};
  if ((gstat & (kDriverError | kUndervoltage)) != 0)
    return {Fault::DRIVER, static_cast<float>(gstat)};
  if ((drv_status & kOvertemperature) != 0)
    return {Fault::OVERTEMPERATURE, static_cast<float>(drv_status >> 25 & 0x3)};
  if ((drv_status & kShort) != 0) return {Fault::DRIVER, static_cast<float>(drv_status >> 24)};
  return {};
}

}  // namespace bioscara
