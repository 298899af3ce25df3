// The simulation's clock.
#pragma once

#include <cstdint>

namespace bioscara::sim {

// Virtual time in tenths of a microsecond: both the ramp period and the tick are whole numbers.
using Time = std::int64_t;
constexpr Time kSecond = 10'000'000;
constexpr Time kMillisecond = kSecond / 1000;
// The step of chip, motor and mechanics [s]: 512 clocks of 10 MHz, the ramp generator's own.
constexpr double kStep = 51.2e-6;

}  // namespace bioscara::sim
