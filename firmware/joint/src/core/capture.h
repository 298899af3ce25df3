// The position error of successive control ticks, for a diagnosis by the host. Written by the tick,
// begun and read in the I2C interrupt, without a lock: the interrupt changes one flag alone.
#pragma once

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "../generated/registers.h"

namespace bioscara {

class Capture {
 public:
  void begin() { begun_ = true; }
  uint16_t captured() const {
    const uint16_t captured = captured_;
    return begun_ || captured == kNone ? uint16_t{0} : captured;
  }
  // Whether all errors of a block are captured.
  bool holds(uint8_t block) const {
    const size_t end = (block + 1U) * kBlockSamples;
    return block <= kCaptureBlockMost && (end < kCaptureSamples ? end : kCaptureSamples) <= captured();
  }
  // An error of a block [microsteps]; 0 behind the last one.
  int16_t error(uint8_t block, size_t index) const {
    const size_t at = block * size_t{kBlockSamples} + index;
    return at < kCaptureSamples ? errors_[at] : int16_t{0};
  }

  // Tick side.
  void add(float error) {
    if (begun_) {
      captured_ = 0;
      begun_ = false;
    }
    const uint16_t captured = captured_;
    if (captured >= kCaptureSamples) return;
    errors_[captured] = static_cast<int16_t>(fmaxf(-32768.0F, fminf(32767.0F, roundf(error))));
    captured_ = static_cast<uint16_t>(captured + 1);
  }

 private:
  // Nothing was captured yet.
  static constexpr uint16_t kNone = 0xFFFF;

  int16_t errors_[kCaptureSamples] = {};
  volatile uint16_t captured_ = kNone;
  volatile bool begun_ = false;
};

}  // namespace bioscara
