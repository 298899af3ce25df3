// The joint as its board sees it: boot once, tick at a fixed rate, two I2C events.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "configuration.h"
#include "hal.h"

namespace bioscara {

class Joint {
 public:
  // Period of the control tick.
  static constexpr uint32_t kTickMicros = 1000;
  // Longest answer: HELLO's payload, flags and trailer.
  static constexpr size_t kAnswerMax = 13;

  Joint(Hal& hal, const Configuration& configuration);

  // Power-up: sets the chips up with the power stage open. Moves nothing.
  void boot();

  // One control period. The only place that talks SPI, drives the motor or feeds the watchdog.
  void tick();

  // I2C interrupt: the controller wrote these bytes. Checks them, queues the command for the next
  // tick and arms the answer.
  void on_receive(const uint8_t* data, size_t size);

  // I2C interrupt: the controller reads. Copies out the armed answer and returns its size; the
  // board sends 0xFF for every byte beyond it. Executes nothing.
  size_t on_request(uint8_t (&answer)[kAnswerMax]);
};

}  // namespace bioscara
