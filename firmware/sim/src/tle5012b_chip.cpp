#include "tle5012b_chip.h"

#include <cmath>

namespace bioscara::sim {

namespace {

constexpr std::uint16_t kAngleRegister = 0x02;
constexpr std::uint16_t kMode2Register = 0x08;
constexpr std::uint16_t kInvert = 0x0008;
// Error that belongs to the angle: 0.3 degrees once a turn (offset of the bridges, magnet off
// centre), 0.15 twice (amplitudes, orthogonality), 0.05 four times. With the tolerance they add up
// to 0.75 degrees at most, where the data sheet allows 1.
constexpr double kDegree = 1.0 / 360.0;
constexpr double kHarmonicTolerance = 0.5;
constexpr double kTwoPi = 6.283185307179586;

std::uint8_t crc(const std::uint16_t* words, std::size_t count) {
  std::uint8_t value = 0xFF;
  for (std::size_t i = 0; i < count; ++i)
    for (int byte = 1; byte >= 0; --byte) {
      value = static_cast<std::uint8_t>(value ^ (words[i] >> (8 * byte) & 0xFF));
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
  const std::uint16_t address = command >> 4 & 0x3F;
  if ((command & 0x8000) == 0) {
    if (address == kMode2Register && count > 0) mode2_ = words[0];
    return;
  }
  std::uint16_t data = 0;
  if (address == kAngleRegister) {
    const bool inverted = (mode2_ & kInvert) != 0;
    data = static_cast<std::uint16_t>(0x8000 | (inverted ? (0x8000 - angle_) & 0x7FFF : angle_));
  } else if (address == kMode2Register) {
    data = mode2_;
  }
  if (count > 0) words[0] = data;
  if (count > 1) {
    const std::uint16_t checked[2] = {command, data};
    const std::uint8_t check = crc(checked, 2);
    words[1] = static_cast<std::uint16_t>(0xFF00 | (corrupt_ ? check ^ 0x55 : check));
  }
}

}  // namespace bioscara::sim
