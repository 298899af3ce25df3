// The light of the board: the state of the joint, for a person next to it.
#pragma once

#include <stdint.h>

#include "hal.h"

namespace bioscara {

enum class Indication : uint8_t { DISABLED, ENABLED, FAULT };

class Indicator {
 public:
  // One control tick. The board's light is set only where it changes.
  void advance(Hal& hal, Indication now) {
    const Pattern& pattern = kPatterns[static_cast<uint8_t>(now)];
    tick_ = now == shown_ ? static_cast<uint16_t>(tick_ + 1) : uint16_t{0};
    if (tick_ >= pattern.period) tick_ = 0;
    shown_ = now;
    const bool lit = tick_ < pattern.lit;
    if (lit == lit_) return;
    lit_ = lit;
    hal.indicate(lit);
  }

 private:
  // In ticks of 1 ms. Steady light is the bootloader's.
  struct Pattern {
    uint16_t period, lit;
  };
  static constexpr Pattern kPatterns[] = {{2000, 50}, {1000, 500}, {200, 100}};

  Indication shown_ = Indication::DISABLED;
  uint16_t tick_ = 0xFFFF;  // The first one is 0.
  bool lit_ = false;
};

}  // namespace bioscara
