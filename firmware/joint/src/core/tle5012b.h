// The encoder, with its safety word checked (TLE5012B data sheet, section 6.4).
//
// A command that writes a setting has no check: a damaged one changes another setting, or this one to
// another value. So the settings are read back, and each that differs from its first value is written
// again (docs/decisions/0044).
#pragma once

#include <stdint.h>

#include "hal.h"

namespace bioscara {

class Tle5012b {
 public:
  explicit Tle5012b(Hal& hal) : hal_(hal) {}

  // Sets the chip up and reads the first angle; false while it has none yet, or its settings are not
  // restored.
  bool setup();

  // Reads the angle; false if the answer fails its check, or the settings are not restored after a
  // reset of the chip. `counts` follows turns.
  bool sample();
  // The chip has refused its settings, alike in each try, and keeps its autocalibration.
  bool autocalibrates() const { return autocalibrates_; }
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
  // MOD_1 to TCO_Y.
  static constexpr int kSettings = 10;
  using Settings = uint16_t[kSettings];

  enum class Outcome : uint8_t { TAKEN, REFUSED, DAMAGED };

  bool read(uint16_t& angle);
  bool ask(uint16_t address, uint16_t& data, bool& sound);
  bool fetch(uint16_t address, uint16_t* words, int count);
  void write(uint16_t address, uint16_t word);
  bool read_settings(Settings& settings);
  bool read_status(bool& sound);
  bool configure();
  Outcome write_settings(uint16_t mode);

  Hal& hal_;
  uint16_t angle_ = 0;
  uint16_t previous_ = 0;
  // The settings as they were read first since boot.
  Settings first_ = {};
  bool known_ = false;
  bool autocalibrates_ = false;
  // The chip has reported no reset since it was set up; and it may have had one after that: its settings
  // may be those of its start.
  bool steady_ = false;
  bool reset_ = false;
  int32_t counts_ = 0;
  int32_t change_ = 0;
};

}  // namespace bioscara
