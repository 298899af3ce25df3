#include "tle5012b_chip.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bioscara::sim {

namespace {

constexpr std::uint16_t kAngleRegister = 0x02;
constexpr std::uint16_t kStatusRegister = 0x00;
constexpr std::uint16_t kInvert = 0x0008;
constexpr std::uint16_t kAutocalibration = 0x0003;
constexpr std::uint16_t kReset = 0x0001, kFuse = 0x0008;
constexpr int kSil = 0x07, kMode2 = 0x08, kOffsetX = 0x0A;
// SIL: test voltages in place of the sensor; settings are loaded as after a reset.
constexpr std::uint16_t kTestVectors = 0x0040, kFuseReload = 0x0400;
// Bits 14 to 11 of a command that writes a setting.
constexpr std::uint16_t kLock = 0x7800, kUnlocked = 0x5000;
// After a reset of the E1000, documented: SIL, and MOD_2, range 360 degrees, autocalibration on. The
// others depend on the derivative, or are calibrated for each device, and have made-up values: MOD_1
// before them, after them MOD_3, OFFX, OFFY, SYNCH, IFAB, MOD_4, TCO_Y with the checksum CRC_PAR, of
// MOD_2 and those after it, in its low byte.
constexpr std::uint16_t kAtReset[] = {0x8001, 0x0000, 0x0801, 0x7120, 0x03A0,
                                      0xFE40, 0x0130, 0x000D, 0x0480, 0x1700};
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
  load_settings();
  status_ = kReset;
}

void Tle5012bChip::load_settings() {
  static_assert(sizeof kAtReset == sizeof settings_);
  std::copy_n(kAtReset, kSettings, settings_);
  std::uint16_t& last = settings_[kSettings - 1];
  last = static_cast<std::uint16_t>(last | crc(settings_ + kMode2 - kFirst, 15));
}

// It checks them over and over, but for the time of autocalibration, which changes them.
void Tle5012bChip::check_settings() {
  if ((setting(kMode2) & kAutocalibration) != 0)
    ++settings_[kOffsetX - kFirst];
  else if ((settings_[kSettings - 1] & 0xFF) != crc(settings_ + kMode2 - kFirst, 15))
    status_ |= kFuse;
}

void Tle5012bChip::write(int address, std::uint16_t word) {
  if (address < kFirst || address >= kFirst + kSettings || (refused_ >> address & 1U) != 0) return;
  settings_[address - kFirst] = word;
  if (address == kSil && (word & kFuseReload) != 0) load_settings();
}

std::uint16_t Tle5012bChip::read(int address) {
  if (address == kStatusRegister) return std::exchange(status_, 0);
  if (address == kAngleRegister) {
    const bool inverted = (setting(kMode2) & kInvert) != 0;
    return static_cast<std::uint16_t>(0x8000 | (inverted ? (0x8000 - angle_) & 0x7FFF : angle_));
  }
  return address >= kFirst && address < kFirst + kSettings ? setting(address) : 0;
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
    if ((command & kLock) == kUnlocked && count > 0) write(address, words[0]);
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
  const int health = ((reported & kReset) != 0 ? 0 : 0x8000) | ((reported & kFuse) != 0 ? 0 : 0x4000) |
                     ((setting(kSil) & kTestVectors) != 0 ? 0 : 0x1000);
  words[size] = static_cast<std::uint16_t>(health | 0x2F00 | (corrupt_ ? check ^ 0x55 : check));
}

}  // namespace bioscara::sim
