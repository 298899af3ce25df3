#include "clock.h"

#include "stm32f401.h"

namespace bioscara::clock {

namespace {

using stm32::Flash;
using stm32::Pwr;
using stm32::Rcc;

// 20 MHz / 10 * 168 / 4 = 84 MHz; / 7 = 48 MHz for USB, which is not used. P is coded 2, 4, 6, 8.
constexpr uint32_t kM = 10, kN = 168, kP = 4, kQ = 7;
constexpr uint32_t kPllSettings =
    kM | kN << 6 | (kP / 2 - 1) << 16 | Rcc::PLLSRC_HSE | kQ << 24;

// Polls before giving up: about 100 ms at the 16 MHz that run from reset; a crystal needs 2 ms.
constexpr uint32_t kPolls = 200000;

bool becomes(const stm32::Word& word, uint32_t mask, uint32_t value) {
  for (uint32_t poll = 0; poll < kPolls; ++poll)
    if ((word & mask) == value) return true;
  return false;
}

}  // namespace

bool start() {
  Rcc& rcc = stm32::rcc();
  rcc.APB1ENR |= Rcc::PWREN;
  (void)rcc.APB1ENR;
  stm32::pwr().CR = (stm32::pwr().CR & ~Pwr::VOS) | Pwr::VOS_SCALE2;
  rcc.CR |= Rcc::HSEON;
  if (!becomes(rcc.CR, Rcc::HSERDY, Rcc::HSERDY)) return false;
  rcc.PLLCFGR = kPllSettings;
  rcc.CR |= Rcc::PLLON;
  if (!becomes(rcc.CR, Rcc::PLLRDY, Rcc::PLLRDY)) return false;
  stm32::flash().ACR = Flash::LATENCY_2 | Flash::PRFTEN | Flash::ICEN | Flash::DCEN;
  (void)stm32::flash().ACR;
  // MCO1 = crystal / 2 = 10 MHz: without it the driver runs on a clock of its own.
  rcc.CFGR = Rcc::PPRE1_DIV2 | Rcc::MCO1_HSE | Rcc::MCO1PRE_DIV2;
  rcc.CFGR |= Rcc::SW_PLL;
  if (!becomes(rcc.CFGR, Rcc::SWS, Rcc::SWS_PLL)) return false;
  // A crystal that stops later raises the NMI, which opens the power stage and resets.
  rcc.CR |= Rcc::CSSON;
  return true;
}

}  // namespace bioscara::clock
