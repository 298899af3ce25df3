// Speed from positions: a critically damped tracking loop.
//
// Both poles at 150 rad/s; the speed of a ramp lags 2/150 s = 13 ms, where the filter that the arm
// was measured with lagged 63 ms. One encoder count of jitter shows as less than 0.01 rad/s.
#pragma once

#include "units.h"

namespace bioscara {

class SpeedFilter {
 public:
  void reset(float position) {
    position_ = position;
    speed_ = 0.0F;
  }
  void update(float position) {
    position_ += speed_ * kTickSeconds;
    const float error = position - position_;
    position_ += 2.0F * kPole * kTickSeconds * error;
    speed_ += kPole * kPole * kTickSeconds * error;
  }
  // Moves the origin without a step in the speed.
  void shift(float offset) { position_ += offset; }
  float speed() const { return speed_; }

 private:
  static constexpr float kPole = 150.0F;
  float position_ = 0.0F;
  float speed_ = 0.0F;
};

}  // namespace bioscara
