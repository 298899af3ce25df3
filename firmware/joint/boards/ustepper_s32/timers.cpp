#include "timers.h"

#include "clock.h"
#include "stm32f401.h"

namespace bioscara::timers {

namespace {

using stm32::Rcc;
using stm32::Timer;

// The I2C interrupt has priority 1 (i2c_target.cpp).
constexpr uint8_t kTickPriority = 3;

void count_microseconds(Timer& timer, uint32_t period) {
  timer.PSC = clock::kTimerMegahertz - 1;
  timer.ARR = period - 1;
  timer.EGR = Timer::UG;  // Takes the prescaler over.
  timer.SR = 0;
  timer.CR1 = Timer::CEN;
}

}  // namespace

void start_microseconds() {
  stm32::rcc().APB1ENR |= Rcc::TIM5EN;
  (void)stm32::rcc().APB1ENR;
  count_microseconds(stm32::tim5(), 0);
}

uint32_t micros() { return stm32::tim5().CNT; }

void start_tick(uint32_t period_micros) {
  stm32::rcc().APB1ENR |= Rcc::TIM3EN;
  (void)stm32::rcc().APB1ENR;
  count_microseconds(stm32::tim3(), period_micros);
  stm32::tim3().DIER = Timer::UIE;
  stm32::enable(stm32::TIM3, kTickPriority);
}

void acknowledge_tick() { stm32::tim3().SR = ~Timer::UIF; }

}  // namespace bioscara::timers
