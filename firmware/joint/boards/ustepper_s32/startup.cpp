// From reset to run(): vector table, the checks that come before everything else, memory.
#include <stddef.h>
#include <stdint.h>

#include "bootloader.h"
#include "exceptions.h"
#include "identity.h"
#include "main.h"
#include "pins.h"
#include "stm32f401.h"

// Set by the linker script.
extern "C" {
extern uint32_t stack_bottom[], stack_top[];
extern uint32_t data_start[], data_end[], data_load[];
extern uint32_t bss_start[], bss_end[];
extern void (*const init_array_start[])();
extern void (*const init_array_end[])();

[[noreturn]] void reset_handler();
void control_tick_handler();
void i2c_handler();
}

namespace {

using bioscara::bootloader::enter;
using stm32::Rcc;

using Handler = void (*)();

// Pattern that fills the stack: the deepest word with another value is its high-water mark.
constexpr uint32_t kPaint = 0xC5C5C5C5;

struct VectorTable {
  uint32_t* stack;
  Handler exceptions[15];
  Handler interrupts[stm32::kInterrupts];
};

constexpr VectorTable make_vectors() {
  VectorTable table{stack_top, {}, {}};
  // An unexpected exception or interrupt opens the power stage and resets; so does the NMI that
  // reports a stopped crystal.
  for (Handler& handler : table.exceptions) handler = fault_handler;
  for (Handler& handler : table.interrupts) handler = fault_handler;
  table.exceptions[0] = reset_handler;
  table.interrupts[stm32::TIM3] = control_tick_handler;
  table.interrupts[stm32::I2C1_EV] = i2c_handler;
  table.interrupts[stm32::I2C1_ER] = i2c_handler;
  return table;
}

// The ROM bootloader starts a new image by a jump, with its clocks and USB still on.
bool started_by_jump() {
  const Rcc& rcc = stm32::rcc();
  return (rcc.CFGR & Rcc::SWS) != 0 || (rcc.CR & Rcc::PLLON) != 0 || rcc.AHB2ENR != 0;
}

void enable_fpu() {
  stm32::cpacr() = stm32::cpacr() | 0xFU << 20;
  stm32::barrier();
}

void fill_memory() {
  const uint32_t* from = data_load;
  for (uint32_t* to = data_start; to < data_end;) *to++ = *from++;
  for (uint32_t* to = bss_start; to < bss_end;) *to++ = 0;
}

// Up to a little below the frame that runs this.
__attribute__((noinline)) void paint_stack() {
  constexpr size_t kOwnWords = 16;
  uint32_t* const end = static_cast<uint32_t*>(__builtin_frame_address(0)) - kOwnWords;
  for (volatile uint32_t* word = stack_bottom; word < end;) *word++ = kPaint;
}

}  // namespace

extern "C" {

__attribute__((section(".vectors"), used)) constexpr VectorTable kVectors = make_vectors();

void reset_handler() {
  bioscara::pins::open_power_stage();
  if (started_by_jump()) stm32::reset();
  if (bioscara::bootloader::requested() || !bioscara::image_intact()) enter();
  enable_fpu();
  const uint32_t noise = bioscara::power_up_noise();
  fill_memory();
  paint_stack();
  for (void (*const* constructor)() = init_array_start; constructor != init_array_end;)
    (*constructor++)();
  bioscara::run(noise);
}
}
