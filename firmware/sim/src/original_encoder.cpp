#include "original_encoder.h"

namespace bioscara::sim {

namespace {

constexpr std::uint16_t kReadAngle = 0x8000 | 0x02 << 4 | 1;
constexpr std::uint16_t kWriteMode2 = 0x5000 | 0x08 << 4 | 1;
// Timer period that the filter assumes [s].
constexpr double kPeriod = 1.0 / 1541.85;
// Poles at -18.8 and -101 rad/s: a ramp is reported 120/1900 = 63 ms late.
constexpr double kProportional = 120.0;
constexpr double kIntegral = 1900.0;

}  // namespace

std::uint16_t OriginalEncoder::read() {
  std::uint16_t words[2] = {};
  hal_.encoder_exchange(kReadAngle, words, 2);
  return words[0] & 0x7FFF;  // The safety word is not checked.
}

// Autocalibration off, 360 degrees, not inverted. The checksum of the settings stays unchanged, and the
// chip reports a system error from then on, which it does not read.
void OriginalEncoder::setup() {
  std::uint16_t mode2 = 0x0800;
  hal_.encoder_exchange(kWriteMode2, &mode2, 1);
}

void OriginalEncoder::set_home() {
  angle_ = read();
  counts_ = 0;
  position_ = velocity_ = speed_ = 0.0;
}

void OriginalEncoder::sample() {
  const std::uint16_t angle = read();
  // The library inverts in software: the old angle minus the new one, the shorter way round.
  counts_ += static_cast<std::int16_t>(static_cast<std::uint16_t>(angle_ - angle) * 2U) / 2;
  angle_ = angle;
  position_ += velocity_ * kPeriod;
  const double error = counts_ - position_;
  speed_ += error * kIntegral * kPeriod;
  velocity_ = kProportional * error + speed_;
}

}  // namespace bioscara::sim
