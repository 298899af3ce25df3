// Time: a free-running microsecond counter and the control tick.
#pragma once

#include <stdint.h>

namespace bioscara::timers {

// TIM5: 32 bits, wraps around after 71 minutes.
void start_microseconds();
uint32_t micros();

// TIM3 interrupts with this period, below the I2C interrupt.
void start_tick(uint32_t period_micros);
void acknowledge_tick();

}  // namespace bioscara::timers
