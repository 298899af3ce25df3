// The clock tree: 84 MHz from the 20 MHz crystal, and 10 MHz for the motor driver.
#pragma once

#include <stdint.h>

namespace bioscara::clock {

// APB1, which clocks I2C, SPI2 and SPI3; its timers run at twice that.
constexpr uint32_t kApb1Megahertz = 42;
constexpr uint32_t kTimerMegahertz = 84;

// Returns false where the crystal or the PLL does not start: nothing may run then, as every speed
// of the motor would be wrong.
bool start();

}  // namespace bioscara::clock
