// A TLE5012B angle sensor as its SPI pins see it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spread.h"

namespace bioscara::sim {

class Tle5012bChip {
 public:
  explicit Tle5012bChip(Spread& spread);

  // `turns`: shaft position in turns, latched at the chip's own rate by the caller.
  void latch(double turns);
  void exchange(std::uint16_t command, std::uint16_t* words, std::size_t count);
  void power_up() { mode2_ = 0; }

  void freeze(bool on) { frozen_ = on; }
  void jump(double turns) { jump_ += turns; }
  void corrupt(bool on) { corrupt_ = on; }
  void reverse(bool on) { sign_ = on ? -1.0 : 1.0; }
  // Noise of one sample, drawn by the caller [counts].
  void set_noise(double counts) { noise_ = counts; }

 private:
  // Error at once, twice and four times a turn: amplitude and phase [turns].
  struct Harmonic {
    double times, amplitude, phase;
  };
  Harmonic harmonics_[3];
  std::uint16_t angle_ = 0;
  std::uint16_t mode2_ = 0;
  double jump_ = 0.0;
  double noise_ = 0.0;
  double sign_ = 1.0;
  bool frozen_ = false;
  bool corrupt_ = false;
};

}  // namespace bioscara::sim
