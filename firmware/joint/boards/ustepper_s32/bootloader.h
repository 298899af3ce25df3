// The bootloader in the microcontroller's ROM (USB DFU).
#pragma once

namespace bioscara::bootloader {

// Asks for the bootloader and resets, so that it finds the controller as after power-up, without
// the watchdog.
[[noreturn]] void request();

// Whether the reset before this start asked for it; asks only once.
bool requested();

// Jumps to it. Only from a start on which nothing but a pin has been set up; the power stage stays
// open, as the bootloader leaves that pin alone.
[[noreturn]] void enter();

}  // namespace bioscara::bootloader
