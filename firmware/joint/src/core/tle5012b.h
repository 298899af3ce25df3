// The encoder, with its safety word checked (TLE5012B data sheet, section 6.4).
#pragma once

#include <stdint.h>

#include "hal.h"

namespace bioscara {

class Tle5012b {
 public:
  explicit Tle5012b(Hal& hal) : hal_(hal) {}

  // Sets the chip up and reads the first angle; false while it has none yet.
  bool setup();

  // Reads the angle; false if the answer fails its check. `counts` follows turns.
  bool sample();
  // Multi-turn position [counts of 1/32768 turn]: minus the raw angle of the chip, as in the
  // original firmware. The signs of reductions, homing directions and offsets of all arms were
  // measured with that.
  int32_t counts() const { return counts_; }
  // Change in the last good sample [counts].
  int32_t change() const { return change_; }
  // Discards the last sample, which was implausible.
  void reject() {
    counts_ -= change_;
    angle_ = previous_;
  }
  // Goes on counting from the angle of the last sample, as if nothing had moved.
  void rebase() { counts_ -= change_; }

 private:
  static constexpr int kSettings = 8;

  bool read(uint16_t& angle);
  bool ask(uint16_t address, uint16_t& data);
  bool fetch(uint16_t address, uint16_t* words, int count);
  void write(uint16_t address, uint16_t word);
  bool read_settings(uint16_t (&settings)[kSettings]);
  bool settled();
  bool configure();

  Hal& hal_;
  uint16_t angle_ = 0;
  uint16_t previous_ = 0;
  // The chip has reported no reset since it was set up; and one after that: its settings are those of
  // its start.
  bool steady_ = false;
  bool reset_ = false;
  int32_t counts_ = 0;
  int32_t change_ = 0;
};

}  // namespace bioscara
