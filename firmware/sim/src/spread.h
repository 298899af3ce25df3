// Variation between arms: factors within a tolerance, drawn from the arm's seed.
#pragma once

#include <cstdint>

namespace bioscara::sim {

class Spread {
 public:
  // Seed 0 is the nominal arm: all factors 1, all phases 0.
  Spread(std::uint32_t seed, int joint)
      : nominal_(seed == 0), state_(seed * 2654435761U ^ static_cast<std::uint32_t>(joint) * 97U) {}

  // 1 - tolerance .. 1 + tolerance.
  double factor(double tolerance) {
    return nominal_ ? 1.0 : 1.0 + tolerance * (2.0 * draw() - 1.0);
  }
  // A place in a turn [turns].
  double phase() { return nominal_ ? 0.0 : draw(); }
  // Seed of a stream of noise.
  std::uint32_t seed() { return mixed(); }

 private:
  // splitmix32: neighbouring seeds give arms that have nothing in common.
  std::uint32_t mixed() {
    std::uint32_t z = (state_ += 0x9E3779B9U);
    z = (z ^ z >> 16) * 0x85EBCA6BU;
    z = (z ^ z >> 13) * 0xC2B2AE35U;
    return z ^ z >> 16;
  }
  double draw() { return static_cast<double>(mixed()) / 4294967296.0; }

  const bool nominal_;
  std::uint32_t state_;
};

}  // namespace bioscara::sim
