// The reference between two setpoints: a cubic, then straight on.
#pragma once

#include <stdint.h>

#include "units.h"

namespace bioscara {

class Tracker {
 public:
  // Starts at rest or in motion, with no setpoint yet.
  void start(float position, float velocity);

  // A setpoint to be reached one setpoint interval after its arrival, taken by a tick that began
  // at `tick`; both in microseconds.
  void setpoint(float position, float velocity, uint32_t arrival, uint32_t tick);

  // One tick on.
  void advance();
  float position() const { return position_; }
  float velocity() const { return velocity_; }

 private:
  // Until the interval is known: that of 50 Hz.
  static constexpr float kFirstInterval = 0.02F;

  float position_ = 0.0F;
  float velocity_ = 0.0F;
  // The cubic in the time since its start, that time and the cubic's duration.
  float c0_ = 0.0F, c1_ = 0.0F, c2_ = 0.0F, c3_ = 0.0F;
  float time_ = 0.0F, duration_ = 0.0F;
  // Time between the last two setpoints, 0 before there are two, and the interval measured from it.
  float gap_ = 0.0F, interval_ = kFirstInterval;
  float goal_ = 0.0F, goal_velocity_ = 0.0F;
  uint32_t arrival_ = 0;
  bool known_ = false;
};

}  // namespace bioscara
