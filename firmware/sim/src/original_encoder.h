// The angle sensor as the stepper library of existing arms reads it: turns and filtered speed.
#pragma once

#include <cstdint>

#include "../../joint/src/core/hal.h"

namespace bioscara::sim {

class OriginalEncoder {
 public:
  explicit OriginalEncoder(Hal& hal) : hal_(hal) {}

  void setup();
  // Makes the present angle zero.
  void set_home();
  // One period of the library's timer.
  void sample();

  // 32768 counts are one turn of the motor.
  std::int32_t counts() const { return counts_; }
  std::int32_t microsteps() const { return static_cast<std::int32_t>(1.5625 * counts_); }
  float angle_deg() const { return static_cast<float>(counts_ * (360.0 / 32768.0)); }
  float rpm() const { return static_cast<float>(speed_ * (60.0 / 32768.0)); }

 private:
  std::uint16_t read();

  Hal& hal_;
  std::uint16_t angle_ = 0;
  std::int32_t counts_ = 0;
  // The speed filter's estimates [counts, counts/s]; the integrator is the reported speed.
  double position_ = 0.0, velocity_ = 0.0, speed_ = 0.0;
};

}  // namespace bioscara::sim
