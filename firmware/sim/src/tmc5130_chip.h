// A TMC5130A as its SPI pins and its motor see it (data sheet revision 1.18).
#pragma once

#include <cstdint>

namespace bioscara::sim {

class Tmc5130Chip {
 public:
  // 512 clocks of 10 MHz: how often the ramp generator updates its velocity.
  static constexpr double kRampPeriod = 51.2e-6;

  Tmc5130Chip() { power_up(); }

  // Registers as after power-up; GSTAT says so.
  void power_up();
  void exchange(const std::uint8_t (&sent)[5], std::uint8_t (&received)[5]);
  // Its two halves: the bytes shifted out once the chip is selected, and the effect of deselecting
  // it.
  void answer(std::uint8_t (&received)[5]);
  void accept(const std::uint8_t (&sent)[5]);

  // One period of the ramp generator.
  void step();

  // A register as it was written, or after a reset.
  std::uint32_t setting(std::uint8_t address) const { return registers_[address]; }
  // Where the field stands [microsteps], and how it turns [microsteps/s].
  double field() const { return phase_; }
  double field_speed() const { return velocity_ * kVelocity; }
  // Current in the coils as a share of full scale, 0 when the bridge is open.
  double current_share(bool enabled) const;
  // Whether the current is chopped (spreadCycle) and not set by a voltage (stealthChop).
  bool chops() const;
  // Coils shorted by the freewheel setting.
  bool brakes() const;
  bool standing() const { return velocity_ == 0.0; }

  // VS, the supply of the power stage. Logic and registers are on 5 V: without VS the chip answers
  // as ever and reports undervoltage of its charge pump (uv_cp).
  void set_motor_power(bool on);
  void raise_overtemperature(bool on) { overtemperature_ = on; }
  // Reverses one coil: the field turns against the counter.
  void reverse_coil(bool on) { direction_ = on ? -1.0 : 1.0; }

 private:
  static constexpr double kVelocity = 1e7 / 16777216.0;
  static constexpr double kAcceleration = 1e14 / 2199023255552.0;

  std::uint32_t read(std::uint8_t address);
  void write(std::uint8_t address, std::uint32_t value);
  void ramp_to(double target, double rate);
  void speed_up(double target);
  double allowed_speed(double distance) const;
  void position_mode();
  void limit_commutation();
  std::uint8_t status() const;
  // GCONF's shaft bit, and a coil connected the wrong way round.
  double shaft() const { return registers_[0] & 0x10 ? -direction_ : direction_; }
  std::int32_t xtarget() const { return static_cast<std::int32_t>(registers_[0x2D]); }

  std::uint32_t registers_[128] = {};
  // The last datagram: the register that it named, and for a write the value that it carried, which
  // the next datagram returns.
  std::uint8_t asked_ = 0;
  bool wrote_ = false;
  std::uint32_t written_ = 0;
  double position_ = 0.0;  // XACTUAL with its fraction
  double velocity_ = 0.0;  // VACTUAL in its unit
  double phase_ = 0.0;
  double standstill_ = 0.0;
  // Periods since a ramp reversed, while TZEROWAIT has not passed.
  std::uint32_t waited_ = 0;
  double direction_ = 1.0;
  std::uint8_t gstat_ = 0;
  bool motor_power_ = true;
  bool overtemperature_ = false;
};

}  // namespace bioscara::sim
