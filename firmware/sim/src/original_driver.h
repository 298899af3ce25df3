// The TMC5130 as the stepper library of existing arms drives it: units, casts and side effects.
#pragma once

#include <cstdint>

#include "../../joint/src/core/hal.h"

namespace bioscara::sim {

class OriginalDriver {
 public:
  explicit OriginalDriver(Hal& hal) : hal_(hal) {}

  // Writes all settings: 40 % current, coils shorted at standstill without hold current.
  void setup();

  // Position mode. Relative to XACTUAL, with the acceleration and speed set before.
  void move_steps(std::int32_t microsteps);
  // Velocity mode; 0 is its negative direction with VMAX 0.
  void set_rpm(float rpm);
  // Full steps per second (squared). VMAX is written at once, in every mode.
  void set_max_velocity(float velocity);
  void set_max_acceleration(float acceleration);

  // The hard stop that blocks the main loop: begin, wait for standstill, end in position mode with
  // VMAX 0.
  void begin_stop();
  void end_stop();

  void set_current(int percent);
  void set_hold_current(int percent);
  // 0 freewheel, 1 shorted coils, else hold with 25 %.
  void set_brake_mode(int mode);
  void reverse();

  // XACTUAL [microsteps] and the generator's speed [microsteps/s].
  struct Ramp {
    std::int32_t position;
    float velocity;
  };
  Ramp ramp();
  // The closed loop's correction: XACTUAL becomes this, and the target the last one commanded.
  void rewrite_position(std::int32_t position);
  // XACTUAL and XTARGET become 0; in position mode the distance between them stays.
  void set_home();
  bool position_reached();
  bool standing();

 private:
  std::uint32_t exchange(std::uint8_t address, std::uint32_t value);
  void write(std::uint8_t address, std::uint32_t value);
  std::uint32_t read(std::uint8_t address);
  void write_currents();

  Hal& hal_;
  std::uint32_t gconf_ = 0;
  std::uint32_t run_ = 0, hold_ = 0;
  // Registers of the next position move; AMAX and DMAX are one value.
  std::uint32_t acceleration_ = 0;
  std::uint32_t max_velocity_ = 0;
  std::int32_t target_ = 0;
  // Distance to the target at the last poll.
  std::int32_t off_ = 0;
  bool positioning_ = true;
};

// A float as the controller converts it to an integer: towards zero, NaN to 0, saturating.
std::int32_t to_integer(double value);

}  // namespace bioscara::sim
