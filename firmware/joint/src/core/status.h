// Status that the control tick reports to the wire; exchanged under the board's lock.
#pragma once

#include <stdint.h>

#include "../generated/registers.h"

namespace bioscara {

constexpr uint8_t operator|(Flags a, Flags b) {
  return static_cast<uint8_t>(static_cast<uint8_t>(a) | static_cast<uint8_t>(b));
}
constexpr uint8_t mask(Flags flag) { return static_cast<uint8_t>(flag); }

struct Status {
  float position_deg = 0.0F;
  float velocity_rpm = 0.0F;
  float driver_rpm = 0.0F;
  float error_steps = 0.0F;
  // Position from which the next setpoint is measured, and its largest distance from there.
  float reference_deg = 0.0F;
  float reach_deg = 0.0F;
  float max_velocity_rpm = 0.0F;
  uint8_t flags = Flags::NOTHOMED | Flags::NOTENABLED;
  uint8_t motor_bits = 0;
  uint8_t load_percent = 0;
  JointState state = JointState::DISABLED;
  Fault fault = Fault::NONE;
  float fault_data = 0.0F;
  uint8_t warnings = 0;
  // The next SETUP shows BUSY first: the rotor has to settle, and to be checked after a boot.
  bool slow_setup = true;
};

}  // namespace bioscara
