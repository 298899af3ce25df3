#include "bootloader.h"

#include "pins.h"
#include "stm32f401.h"

namespace bioscara::bootloader {

namespace {

constexpr uint32_t kRequest = 0xB007DF00;
// Outlives a reset without loss of power.
__attribute__((section(".noinit"))) volatile uint32_t request_mark;

}  // namespace

void request() {
  request_mark = kRequest;
  stm32::reset();
}

bool requested() {
  const bool asked = request_mark == kRequest;
  request_mark = 0;
  return asked;
}

void enter() {
  pins::light_up();
  stm32::rcc().APB2ENR |= stm32::Rcc::SYSCFGEN;
  (void)stm32::rcc().APB2ENR;
  stm32::syscfg().MEMRMP = stm32::Syscfg::SYSTEM_FLASH;
  stm32::barrier();
  // Its vector table: first the stack pointer, then the entry.
  const auto* table = &stm32::at<const stm32::Word>(stm32::kSystemMemory);
  const uint32_t stack = table[0];
  const uint32_t entry = table[1];
  __asm volatile(
      "msr msp, %0\n\t"
      "bx %1"
      :
      : "r"(stack), "r"(entry)
      : "memory");
  __builtin_unreachable();
}

}  // namespace bioscara::bootloader
