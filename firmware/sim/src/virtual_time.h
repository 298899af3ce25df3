// The simulation's clock.
#pragma once

#include <cstdint>

namespace bioscara::sim {

// Virtual time in tenths of a microsecond: both the ramp period and the tick are whole numbers.
using Time = std::int64_t;
constexpr Time kSecond = 10'000'000;
constexpr Time kMillisecond = kSecond / 1000;

}  // namespace bioscara::sim
