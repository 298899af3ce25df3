#include "tle5012b.h"

namespace bioscara {

namespace {

constexpr uint16_t kRead = 0x8000;
// With the lock value of the settings.
constexpr uint16_t kWrite = 0x5000;
constexpr uint16_t kStatus = 0x00;
constexpr uint16_t kAngle = 0x02;
// The settings that are written, MOD_2 to TCO_Y, and before them those that one flipped bit of the
// address makes of these: MOD_1 and SIL, whose test vectors replace the angle.
constexpr uint16_t kFirst = 0x06;
constexpr int kMode2 = 0x08 - kFirst, kOffsetX = 0x0A - kFirst, kSynchronism = 0x0C - kFirst,
              kLast = 0x0F - kFirst;
// The low byte of TCO_Y, CRC_PAR: the checksum of the 15 bytes from MOD_2 up to it.
constexpr uint16_t kChecksum = 0x00FF;
// MOD_2: range 360 degrees, no prediction, not inverted; autocalibration off, or on as after a reset.
constexpr uint16_t kFixed = 0x0800;
constexpr uint16_t kAutocalibrated = 0x0801;
constexpr uint16_t kAutocalibration = 0x0003;
constexpr int kTries = 3;
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

// Of MOD_2 and the settings after it, up to the checksum's own byte.
uint8_t checksum(const uint16_t* settings) {
  Crc crc;
  for (int i = kMode2; i < kLast; ++i) crc.add(settings[i]);
  crc.add_byte(settings[kLast] >> 8);
  return crc.value();
}

// The bits of a setting that have to be written again. Autocalibration changes OFFX, OFFY and SYNCH, which
// are compared once it is off, and suspends the check of the checksum.
uint16_t difference(const uint16_t* settings, const uint16_t* wanted, int index) {
  const bool adapted = index >= kOffsetX && index <= kSynchronism;
  if (adapted && (settings[kMode2] & kAutocalibration) != 0) return 0;
  const uint16_t bits = settings[index] ^ wanted[index];
  return index == kLast && wanted[kMode2] == kAutocalibrated ? bits & ~kChecksum : bits;
}

}  // namespace

bool Tle5012b::setup() {
  counts_ = change_ = 0;
  return configure() && read(angle_);
}

// Autocalibration would change the angle's error while the arm works: all of its measurements were made
// without. A chip that does not take the new checksum keeps autocalibration, for which it does not
// check it: without, it would report a system error with each angle. False after a damaged answer, or
// while another setting is not restored: to be called again.
bool Tle5012b::configure() {
  steady_ = false;
  if (!known_) known_ = read_settings(first_);
  if (!known_) return false;
  Outcome outcome = autocalibrates_ ? Outcome::REFUSED : write_settings(kFixed);
  if (outcome == Outcome::REFUSED) {
    autocalibrates_ = true;
    outcome = write_settings(kAutocalibrated);
  }
  if (outcome != Outcome::TAKEN) return false;
  reset_ = false;
  return true;
}

// Writes the settings that differ from the first ones, and this MOD_2 with its checksum, three times at
// most. Refused, if the chip then is as after each try, and differs in MOD_2 and checksum alone, or
// reports an error for them.
Tle5012b::Outcome Tle5012b::write_settings(uint16_t mode) {
  Settings wanted, settings = {};
  for (int i = 0; i < kSettings; ++i) wanted[i] = first_[i];
  wanted[kMode2] = mode;
  wanted[kLast] = static_cast<uint16_t>((wanted[kLast] & ~kChecksum) | checksum(wanted));
  bool alike = true;
  for (int tries = 0;; ++tries) {
    const uint16_t before[] = {settings[kMode2], settings[kLast]};
    if (!read_settings(settings)) return Outcome::DAMAGED;
    if (tries > 1) alike = alike && settings[kMode2] == before[0] && settings[kLast] == before[1];
    bool others = false, all = true;
    for (int i = 0; i < kSettings; ++i) {
      const uint16_t bits = difference(settings, wanted, i);
      all = all && bits == 0;
      others = others || (i != kMode2 && (i == kLast ? bits & ~kChecksum : bits) != 0);
    }
    bool sound = false;
    if (all && !read_status(sound)) return Outcome::DAMAGED;
    if (sound) return Outcome::TAKEN;
    if (tries == kTries) return others || !alike ? Outcome::DAMAGED : Outcome::REFUSED;
    for (int i = 0; i < kSettings; ++i)
      if (difference(settings, wanted, i) != 0) write(static_cast<uint16_t>(kFirst + i), wanted[i]);
  }
}

// Reads the status, which clears its bits, and again: false if an answer is damaged.
bool Tle5012b::read_status(bool& sound) {
  uint16_t words[2];
  if (!fetch(kStatus, words, 1)) return false;
  return ask(kStatus, words[0], sound);
}

// Errors that the safety word reports are expected here.
bool Tle5012b::read_settings(Settings& settings) {
  uint16_t words[kSettings + 1];
  const bool intact = fetch(kFirst, words, kSettings);
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

// One register with its safety word, and whether that reports no error; false if its checksum is wrong.
bool Tle5012b::ask(uint16_t address, uint16_t& data, bool& sound) {
  uint16_t words[2];
  const bool intact = fetch(address, words, 1);
  data = words[0];
  sound = intact && (words[1] & kSound) == kSound;
  if (!intact) return false;
  const bool steady = (words[1] & kSteady) != 0;
  reset_ = reset_ || (steady_ && !steady);
  steady_ = steady_ || steady;
  return true;
}

bool Tle5012b::read(uint16_t& angle) {
  uint16_t data = 0;
  bool sound = false;
  // A damaged command may have read the status, and with it the report of a reset.
  if (!ask(kAngle, data, sound)) reset_ = true;
  if (sound) {
    angle = data & 0x7FFF;
    return true;
  }
  // The chip may hold an error in its safety word until its status has been read: then the next
  // sample would be rejected for this one's error.
  ask(kStatus, data, sound);
  return false;
}

bool Tle5012b::sample() {
  if (reset_ && !configure()) return false;
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
