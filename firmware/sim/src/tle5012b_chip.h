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
  void power_up();
  // One of the registers 0x06 to 0x0F.
  std::uint16_t setting(int address) const { return settings_[address - kFirst]; }

  void freeze(bool on) { frozen_ = on; }
  void jump(double turns) { jump_ += turns; }
  void corrupt(bool on) { corrupt_ = on; }
  // Takes no more writes of this setting.
  void refuse(int address) { refused_ |= 1U << address; }
  void reverse(bool on) { sign_ = on ? -1.0 : 1.0; }
  // Noise of one sample, drawn by the caller [counts].
  void set_noise(double counts) { noise_ = counts; }

 private:
  static constexpr int kFirst = 0x06, kSettings = 10;

  std::uint16_t read(int address);
  void write(int address, std::uint16_t word);
  void load_settings();
  void check_settings();

  // Error at once, twice and four times a turn: amplitude and phase [turns].
  struct Harmonic {
    double times, amplitude, phase;
  };
  Harmonic harmonics_[3];
  std::uint16_t angle_ = 0;
  std::uint16_t settings_[kSettings];
  unsigned refused_ = 0;
  // Bits of STAT, kept until it is read: a reset, and settings that do not fit their checksum.
  std::uint16_t status_ = 0;
  double jump_ = 0.0;
  double noise_ = 0.0;
  double sign_ = 1.0;
  bool frozen_ = false;
  bool corrupt_ = false;
};

}  // namespace bioscara::sim
