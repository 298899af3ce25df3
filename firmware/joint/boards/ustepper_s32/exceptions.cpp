#include "exceptions.h"

#include "pins.h"
#include "stm32f401.h"

namespace bioscara::exceptions {

namespace {

// Where the processor has stacked eight registers, the address of the instruction among them.
struct Frame {
  uint32_t r0, r1, r2, r3, r12, lr, pc, xpsr;
};
// A link register above this is no address of a call but marks a return from an exception.
constexpr uint32_t kExceptionReturn = 0xFFFFFF00;
constexpr uint32_t kVectorMask = 0x1FF;

// Outlives a reset without loss of power. `resets` counts resets since the exception, its own
// included; 0 where there was none.
struct Kept {
  uint32_t vector, address, status, resets, check;
};
__attribute__((section(".noinit"))) volatile Kept kept;
constexpr uint32_t kMark = 0x42534558;

// Whether the processor could stack its registers there.
bool stacked(uint32_t frame, uint32_t status) {
  return (status & stm32::Scb::STACKING_ERRORS) == 0 &&
         frame - stm32::kMemory <= stm32::kMemorySize - sizeof(Frame);
}

uint32_t check() { return kMark ^ kept.vector ^ kept.address ^ kept.status ^ kept.resets; }

void keep(uint32_t vector, uint32_t link, uint32_t frame) {
  const uint32_t status = stm32::scb().CFSR;
  kept.vector = vector & kVectorMask;
  if (link < kExceptionReturn)
    kept.address = link & ~1U;  // Called by the program itself.
  else
    kept.address = stacked(frame, status) ? stm32::at<const volatile Frame>(frame).pc : 0;
  kept.status = status;
  kept.resets = 1;
  kept.check = check();
}

}  // namespace

void count_start(bool powered_up) {
  if (powered_up || kept.check != check())
    kept.vector = kept.address = kept.status = kept.resets = 0;
  else if (kept.resets != 0 && kept.resets < 0xFF)
    kept.resets = kept.resets + 1;
  kept.check = check();
}

ExceptionRecord last() {
  return {static_cast<uint8_t>(kept.vector), kept.address, kept.status,
          static_cast<uint8_t>(kept.resets == 0 ? 0 : kept.resets - 1)};
}

}  // namespace bioscara::exceptions

extern "C" {

// The stack itself may be corrupt, so this begins a new one.
__attribute__((naked)) void fault_handler() {
  __asm volatile(
      "mrs r0, ipsr\n\t"
      "mov r1, lr\n\t"
      "mov r2, sp\n\t"
      "ldr r3, =stack_top\n\t"
      "mov sp, r3\n\t"
      "b open_and_reset");
}

__attribute__((used)) void open_and_reset(uint32_t vector, uint32_t link, uint32_t frame) {
  bioscara::pins::kDriverDisable.high();
  bioscara::exceptions::keep(vector, link, frame);
  stm32::reset();
}

// Called for a pure virtual call: a class without an implementation.
void __cxa_pure_virtual() { fault_handler(); }
}
