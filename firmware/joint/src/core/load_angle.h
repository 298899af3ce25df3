// The angle by which the field leads the rotor, without the rotor's own swing.
//
// At 20 to 40 % of the current the rotor swings in its field at 145 to 205 Hz, hardly damped
// (docs/simulation.md). Averages over 7 and 5 ticks have their zeros at 143 and 200 Hz; together
// they lag 5 ms. A correction that follows this angle therefore does not excite the swing.
#pragma once

#include "units.h"

namespace bioscara {

template <int ticks>
class MovingAverage {
 public:
  void reset(float value) {
    for (float& past : values_) past = value;
  }
  float update(float value) {
    values_[next_] = value;
    next_ = (next_ + 1) % ticks;
    // Added up anew each time: a running sum would accumulate rounding errors.
    float sum = 0.0F;
    for (const float past : values_) sum += past;
    return sum / static_cast<float>(ticks);
  }

 private:
  float values_[ticks] = {};
  int next_ = 0;
};

class LoadAngle {
 public:
  // After a jump of the field's or the encoder's origin.
  void reset(float error) {
    slow_.reset(error);
    fast_.reset(error);
    steps_ = error;
  }
  void update(float error) { steps_ = fast_.update(slow_.update(error)); }
  float steps() const { return steps_; }

 private:
  MovingAverage<7> slow_;
  MovingAverage<5> fast_;
  float steps_ = 0.0F;
};

}  // namespace bioscara
