// The motor as the joint's states use it: go to a position, run, follow, stop.
//
// The driver is always in positioning mode with a target at most a fraction of a second ahead of
// the command, so that the motor comes to rest if the controller hangs.
#pragma once

#include <stdint.h>

#include "hal.h"
#include "tmc5130.h"
#include "units.h"

namespace bioscara {

class Motion {
 public:
  explicit Motion(Hal& hal) : driver_(hal) {}

  Tmc5130& driver() { return driver_; }
  const Tmc5130& driver() const { return driver_; }

  float position() const { return static_cast<float>(driver_.position()); }
  float velocity() const {
    return static_cast<float>(driver_.velocity_register()) * kVelocityLsb;
  }
  bool standing() const { return driver_.velocity_register() == 0; }
  bool arrived() const { return standing() && driver_.position() == goal_; }

  // To this position and no further; renewed every tick until it has arrived.
  void go(float target, float speed, float acceleration, float deceleration);
  // Renewed every tick while it runs.
  void run(float velocity, float acceleration, float deceleration);
  // Follows a moving reference; renewed every tick.
  void follow(float position, float velocity, float limit, float acceleration);
  // Call every tick until it is standing.
  void stop(float deceleration);
  // Renames the place where the motor stands.
  void rename(float position);

 private:
  Tmc5130 driver_;
  // Position at which it is to come to rest, and how far of that the driver knows.
  int32_t goal_ = 0;
  int32_t target_ = 0;
  void aim(float target);
  float braking(float target, float deceleration) const;
};

}  // namespace bioscara
