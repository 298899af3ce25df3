#include "tle5012b_chip.h"

#include <cmath>
#include <utility>

namespace bioscara::sim {

namespace {

constexpr std::uint16_t kAngleRegister = 0x02;
constexpr std::uint16_t kStatusRegister = 0x00;
constexpr std::uint16_t kInvert = 0x0008;
constexpr std::uint16_t kAutocalibration = 0x0003;
constexpr std::uint16_t kReset = 0x0001, kFuse = 0x0008;
// Bits 14 to 11 of a command that writes a setting.
constexpr std::uint16_t kLock = 0x7800, kUnlocked = 0x5000;
// MOD_2 of the E1000 after a reset: range 360 degrees, autocalibration on, which is documented. The
// others are calibrated for each device and have made-up values: MOD_3, OFFX, OFFY, SYNCH, IFAB, MOD_4,
// TCO_Y with the checksum CRC_PAR in its low byte.
constexpr std::uint16_t kSettings[8] = {0x0801, 0x7120, 0x03A0, 0xFE40,
                                        0x0130, 0x000D, 0x0480, 0x1700};
// Error that belongs to the angle: 0.3 degrees once a turn (offset of the bridges, magnet off
// centre), 0.15 twice (amplitudes, orthogonality), 0.05 four times. With the tolerance they add up
// to 0.75 degrees at most, where the data sheet allows 1.
constexpr double kDegree = 1.0 / 360.0;
constexpr double kHarmonicTolerance = 0.5;
constexpr double kTwoPi = 6.283185307179586;

// Of so many bytes, the high one of each word first.
std::uint8_t crc(const std::uint16_t* words, std::size_t bytes) {
  std::uint8_t value = 0xFF;
  for (std::size_t i = 0; i < bytes; ++i) {
    value = static_cast<std::uint8_t>(value ^ (words[i / 2] >> (i % 2 == 0 ? 8 : 0) & 0xFF));
    for (int bit = 0; bit < 8; ++bit)
      value = static_cast<std::uint8_t>(value & 0x80 ? (value << 1) ^ 0x1D : value << 1);
  }
  return static_cast<std::uint8_t>(~value);
}

}  // namespace

Tle5012bChip::Tle5012bChip(Spread& spread) : harmonics_{{1.0, 0.3, 0.0}, {2.0, 0.15, 0.0}, {4.0, 0.05, 0.0}} {
  for (Harmonic& part : harmonics_) {
    part.amplitude *= kDegree * spread.factor(kHarmonicTolerance);
    part.phase = spread.phase();
  }
  power_up();
}

void Tle5012bChip::power_up() {
  for (int i = 0; i < 8; ++i) settings_[i] = kSettings[i];
  settings_[7] = static_cast<std::uint16_t>(settings_[7] | crc(settings_, 15));
  status_ = kReset;
}

// It checks them over and over, but for the time of autocalibration, which changes them.
void Tle5012bChip::check_settings() {
  if ((settings_[0] & kAutocalibration) != 0)
    ++settings_[2];
  else if ((settings_[7] & 0xFF) != crc(settings_, 15))
    status_ |= kFuse;
}

std::uint16_t Tle5012bChip::read(int address) {
  if (address == kStatusRegister) return std::exchange(status_, 0);
  if (address == kAngleRegister) {
    const bool inverted = (settings_[0] & kInvert) != 0;
    return static_cast<std::uint16_t>(0x8000 | (inverted ? (0x8000 - angle_) & 0x7FFF : angle_));
  }
  return address >= 0x08 && address <= 0x0F ? setting(address) : 0;
}

void Tle5012bChip::latch(double turns) {
  if (frozen_) return;
  const double seen = sign_ * turns + jump_;
  double read = seen;
  for (const Harmonic& part : harmonics_)
    read += part.amplitude * std::sin(kTwoPi * (part.times * seen + part.phase));
  // A shaft that turns forwards for the joint's parameters turns the magnet backwards for the chip
  // (docs/simulation.md, The encoder's sign).
  const double raw = -read;
  const double counts = std::floor((raw - std::floor(raw)) * 32768.0 + noise_);
  angle_ = static_cast<std::uint16_t>(static_cast<std::int32_t>(counts) & 0x7FFF);
}

void Tle5012bChip::exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) {
  const int address = command >> 4 & 0x3F;
  if ((command & 0x8000) == 0) {
    const bool setting = address >= 0x08 && address <= 0x0F && (command & kLock) == kUnlocked;
    if (setting && count > 0) settings_[address - 8] = words[0];
    return;
  }
  check_settings();
  const std::size_t size = command & 0x0F;
  const std::uint16_t reported = status_;
  std::uint16_t checked[17] = {command};
  for (std::size_t i = 0; i < size; ++i) {
    checked[i + 1] = read(address + static_cast<int>(i));
    if (i < count) words[i] = checked[i + 1];
  }
  if (count <= size) return;
  const std::uint8_t check = crc(checked, 2 * (size + 1));
  const int health = ((reported & kReset) != 0 ? 0 : 0x8000) | ((reported & kFuse) != 0 ? 0 : 0x4000);
  words[size] = static_cast<std::uint16_t>(health | 0x3F00 | (corrupt_ ? check ^ 0x55 : check));
}

}  // namespace bioscara::sim
