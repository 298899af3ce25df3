// The functions that a board must provide: the complete list. The core calls nothing else.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "../generated/registers.h"

namespace bioscara {

// An exception of the processor that restarted the controller.
struct ExceptionRecord {
  // Number of its vector.
  uint8_t vector = 0;
  // Of the instruction; 0 where the stack was unusable.
  uint32_t address = 0;
  // CFSR of the Cortex-M4.
  uint32_t status = 0;
  // Starts since then; 1 for the present one, 0 where there was no exception.
  uint8_t starts = 0;
};

class Hal {
 public:
  // Free-running microseconds; wraps around.
  virtual uint32_t micros() = 0;

  // One 5-byte SPI datagram with the TMC5130. `received` holds the status byte and the value
  // that the previous datagram asked for.
  virtual void driver_exchange(const uint8_t (&sent)[5], uint8_t (&received)[5]) = 0;

  // One TLE5012B access: sends `command`, then reads `count` 16-bit words (the safety word, where
  // asked for, included). For a write command sends `words` instead.
  virtual void encoder_exchange(uint16_t command, uint16_t* words, size_t count) = 0;

  // The driver's enable pin: false opens the power stage regardless of the driver's registers.
  virtual void driver_enable(bool on) = 0;

  virtual ResetCause reset_cause() = 0;

  // A number that differs between boots, also between a brown-out and the boot before it.
  virtual uint16_t boot_id() = 0;

  // Feeds the controller's own watchdog (about 100 ms); only the control tick calls it.
  virtual void feed_watchdog() = 0;

  // Errors of the bus that the I2C target met since boot.
  virtual uint16_t bus_errors() = 0;

  // CRC-32 of the image that runs, as sealed; 0 for none.
  virtual uint32_t image() = 0;

  // The last exception since power came up.
  virtual ExceptionRecord exception() = 0;

  // The light that shows the state of the joint.
  virtual void indicate(bool lit) = 0;

  // Leaves this firmware for the bootloader, with the power stage open. Returns in simulation only.
  virtual void enter_bootloader() = 0;

  // Exclude the I2C interrupt for the few instructions in which both sides touch the same data.
  virtual void lock() = 0;
  virtual void unlock() = 0;

 protected:
  ~Hal() = default;
};

}  // namespace bioscara
