// The two SPI buses, polled: the control tick is their only user.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace bioscara::spi {

// SPI2 (driver) and SPI3 (encoder), both at 42 MHz / 16 = 2.625 MHz.
void set_up();

// One 5-byte datagram with the TMC5130: mode 3, 8-bit words.
void driver_exchange(const uint8_t (&sent)[5], uint8_t (&received)[5]);

// One access to the TLE5012B: mode 1, 16-bit words, one data line for both directions. A command
// with bit 15 set reads `count` words, another one writes them.
void encoder_exchange(uint16_t command, uint16_t* words, size_t count);

}  // namespace bioscara::spi
