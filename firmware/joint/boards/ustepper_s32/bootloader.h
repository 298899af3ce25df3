// The bootloader in the microcontroller's ROM (USB DFU).
#pragma once

namespace bioscara::bootloader {

// Requests the bootloader and resets, so that it finds the controller in its power-up state,
// without the watchdog.
[[noreturn]] void request();

// Whether a request was made before this reset; reading clears it.
bool requested();

// Jumps to the bootloader, with the light on. Only from a start on which nothing but a pin has been
// set up; the power stage stays open, as the bootloader leaves that pin alone.
[[noreturn]] void enter();

}  // namespace bioscara::bootloader
