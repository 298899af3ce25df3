#include "tle5012b.h"

namespace bioscara {

namespace {

constexpr uint16_t kRead = 0x8000;
constexpr uint16_t kStatus = 0x00;
constexpr uint16_t kAngle = 0x02;
// Safety word: system error (14, low on error), interface error (13), valid angle (12).
constexpr uint16_t kSound = 0x7000;

// CRC-8 of SAE J1850: polynomial 0x1D, start 0xFF, inverted.
uint8_t safety_crc(const uint16_t* words, int count) {
  uint8_t crc = 0xFF;
  for (int i = 0; i < count; ++i) {
    for (int shift = 8; shift >= 0; shift -= 8) {
      crc = static_cast<uint8_t>(crc ^ (words[i] >> shift));
      for (int bit = 0; bit < 8; ++bit)
        crc = static_cast<uint8_t>(crc & 0x80 ? (crc << 1) ^ 0x1D : crc << 1);
    }
  }
  return static_cast<uint8_t>(~crc);
}

}  // namespace

bool Tle5012b::setup() {
  counts_ = change_ = 0;
  return read(angle_);
}

// One register with its safety word.
bool Tle5012b::ask(uint16_t address, uint16_t& data) {
  const auto command = static_cast<uint16_t>(kRead | address << 4 | 1);
  uint16_t words[2] = {};
  hal_.encoder_exchange(command, words, 2);
  const uint16_t checked[2] = {command, words[0]};
  data = words[0];
  return (words[1] & 0xFF) == safety_crc(checked, 2) && (words[1] & kSound) == kSound;
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
