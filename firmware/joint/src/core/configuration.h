// The settings in which the four joints differ, and tunable ones that they share.
#pragma once

#include <stdint.h>

namespace bioscara {

struct Configuration {
  uint8_t joint;
  // I2C address.
  uint8_t address;
  // First approach of homing [rpm of the motor]; chosen off the rotor's resonance.
  float homing_rpm;
  // Motor angle from end stop to end stop [deg].
  float range_deg;
  // Least deceleration after silence [steps/s^2]: with the limit of a slow motion a fast joint would
  // run on for seconds.
  float braking;
};

// Travel of a homing beyond the range before it fails.
constexpr float kTravelMargin = 1.1F;
// The time it may take: the range at the first approach's speed, with this margin, and the touches.
constexpr float kTimeMargin = 1.2F;
constexpr float kTouchSeconds = 10.0F;

constexpr float kDegreesPerRadian = 57.29578F;
constexpr float kStepsPerRadian = 51200.0F / 6.2831853F;

// Ranges are the joint limits of the arm times the reduction. At the homing currents the rotor
// resonates between 14 and 22 rad/s of the motor, where J2, with the weight it lifts, can lose the
// field: the first approach stays at 10 rad/s, for J2 at 11.5 rad/s. Braking is the acceleration at
// which the arm is configured.
constexpr Configuration configuration_of(uint8_t joint) {
  return joint == 1   ? Configuration{1, 0x11, 95.0F, 6.09294F * 35.0F * kDegreesPerRadian,
                                      70.0F * kStepsPerRadian}
         : joint == 2 ? Configuration{2, 0x12, 110.0F, 0.3396F / 0.004F * 360.0F,
                                      314.0F * kStepsPerRadian}
         : joint == 3 ? Configuration{3, 0x13, 95.0F, 5.25344F * 24.0F * kDegreesPerRadian,
                                      336.0F * kStepsPerRadian}
                      : Configuration{4, 0x14, 95.0F, 6.02138F * 12.0F * kDegreesPerRadian,
                                      360.0F * kStepsPerRadian};
}

}  // namespace bioscara
