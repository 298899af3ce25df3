// The independent watchdog: resets the controller when the control tick stops. It runs on the LSI,
// which spreads from 17 to 47 kHz, so its nominal 100 ms are 68 to 188 ms.
#pragma once

#include "stm32f401.h"

namespace bioscara::watchdog {

// Cannot be stopped again but by a reset.
inline void start() {
  using stm32::Iwdg;
  // 32 kHz / 16 / 200 = 10 Hz.
  constexpr uint32_t kReload = 200;
  stm32::iwdg().KR = Iwdg::START;
  stm32::iwdg().KR = Iwdg::UNLOCK;
  stm32::iwdg().PR = Iwdg::PR_DIV16;
  stm32::iwdg().RLR = kReload - 1;
  while (stm32::iwdg().SR != 0) {
  }
  stm32::iwdg().KR = Iwdg::RELOAD;
}

inline void feed() { stm32::iwdg().KR = stm32::Iwdg::RELOAD; }

}  // namespace bioscara::watchdog
