#include "tle5012b.h"

namespace bioscara {

namespace {

constexpr uint16_t kRead = 0x8000;
// With the lock value of the settings.
constexpr uint16_t kWrite = 0x5000;
constexpr uint16_t kStatus = 0x00;
constexpr uint16_t kAngle = 0x02;
// The settings MOD_2 to TCO_Y, whose low byte is CRC_PAR: the checksum of the 15 bytes before it.
constexpr uint16_t kMode2 = 0x08;
constexpr uint16_t kChecksum = 0x0F;
// MOD_2: range 360 degrees, no prediction, not inverted; autocalibration off, or on as after a reset.
constexpr uint16_t kFixed = 0x0800;
constexpr uint16_t kAutocalibrated = 0x0801;
// Safety word: reset (15, low after one until the status is read), system error (14, low on error),
// interface error (13), valid angle (12).
constexpr uint16_t kSteady = 0x8000;
constexpr uint16_t kSound = 0x7000;

// CRC-8 of SAE J1850: polynomial 0x1D, start 0xFF, inverted. In half bytes: each tick computes it.
struct HalfBytes {
  uint8_t crcs[16];
};
constexpr HalfBytes make_half_bytes() {
  HalfBytes made{};
  for (int value = 0; value < 16; ++value) {
    int crc = value << 4;
    for (int bit = 0; bit < 4; ++bit) crc = (crc & 0x80) != 0 ? (crc << 1) ^ 0x1D : crc << 1;
    made.crcs[value] = static_cast<uint8_t>(crc);
  }
  return made;
}
constexpr HalfBytes kHalfBytes = make_half_bytes();

class Crc {
 public:
  void add(uint16_t word) {
    add_byte(word >> 8);
    add_byte(word & 0xFF);
  }
  void add_byte(uint32_t byte) {
    crc_ ^= byte;
    for (int half = 0; half < 2; ++half) crc_ = (crc_ << 4 & 0xF0) ^ kHalfBytes.crcs[crc_ >> 4];
  }
  uint8_t value() const { return static_cast<uint8_t>(~crc_); }

 private:
  uint32_t crc_ = 0xFF;
};

// Of all settings but for the low byte of the last one.
uint8_t checksum(const uint16_t* settings, int count) {
  Crc crc;
  for (int i = 0; i + 1 < count; ++i) crc.add(settings[i]);
  crc.add_byte(settings[count - 1] >> 8);
  return crc.value();
}

}  // namespace

bool Tle5012b::setup() {
  counts_ = change_ = 0;
  return configure() && read(angle_);
}

// Autocalibration would change the angle's error while the arm works: all of its measurements were made
// without. A chip that does not take the new checksum keeps autocalibration, for which it does not
// check it: without, it would report a system error with each angle. False if it does not answer.
bool Tle5012b::configure() {
  reset_ = steady_ = false;
  uint16_t settings[kSettings];
  if (!read_settings(settings)) return false;
  if (settings[0] == kFixed && static_cast<uint8_t>(settings[7]) == checksum(settings, kSettings))
    return settled();
  write(kMode2, kFixed);
  // Now they no longer change.
  if (!read_settings(settings)) return false;
  settings[7] = static_cast<uint16_t>((settings[7] & 0xFF00) | checksum(settings, kSettings));
  write(kChecksum, settings[7]);
  uint16_t written[kSettings];
  if (!read_settings(written)) return false;
  if (written[0] == kFixed && written[7] == settings[7] && settled()) return true;
  write(kMode2, kAutocalibrated);
  settled();
  return true;
}

// Reads the status, which clears its bits; false if it reports an error again.
bool Tle5012b::settled() {
  uint16_t status = 0;
  ask(kStatus, status);
  return ask(kStatus, status);
}

// Errors that the safety word reports are expected here.
bool Tle5012b::read_settings(uint16_t (&settings)[kSettings]) {
  uint16_t words[kSettings + 1];
  const bool intact = fetch(kMode2, words, kSettings);
  for (int i = 0; i < kSettings; ++i) settings[i] = words[i];
  return intact;
}

void Tle5012b::write(uint16_t address, uint16_t word) {
  hal_.encoder_exchange(static_cast<uint16_t>(kWrite | address << 4 | 1), &word, 1);
}

// So many registers and the safety word behind them; false if its checksum is wrong.
bool Tle5012b::fetch(uint16_t address, uint16_t* words, int count) {
  const auto command = static_cast<uint16_t>(kRead | address << 4 | count);
  for (int i = 0; i <= count; ++i) words[i] = 0;
  hal_.encoder_exchange(command, words, static_cast<size_t>(count) + 1);
  Crc crc;
  crc.add(command);
  for (int i = 0; i < count; ++i) crc.add(words[i]);
  return (words[count] & 0xFF) == crc.value();
}

// One register with its safety word.
bool Tle5012b::ask(uint16_t address, uint16_t& data) {
  uint16_t words[2];
  const bool intact = fetch(address, words, 1);
  data = words[0];
  if (intact) {
    const bool steady = (words[1] & kSteady) != 0;
    reset_ = steady_ && !steady;
    steady_ = steady_ || steady;
  }
  return intact && (words[1] & kSound) == kSound;
}

bool Tle5012b::read(uint16_t& angle) {
  uint16_t data = 0;
  if (ask(kAngle, data)) {
    angle = data & 0x7FFF;
    return true;
  }
  // The chip may hold an error in its safety word until its status has been read: then the next
  // sample would be rejected for this one's error.
  ask(kStatus, data);
  return false;
}

bool Tle5012b::sample() {
  if (reset_) configure();
  uint16_t angle = 0;
  if (!read(angle)) return false;
  // The old angle minus the new one, the shorter way round: at most half a turn per sample.
  change_ = static_cast<int16_t>(static_cast<uint16_t>(angle_ - angle) * 2U) / 2;
  previous_ = angle_;
  angle_ = angle;
  counts_ += change_;
  return true;
}

}  // namespace bioscara
