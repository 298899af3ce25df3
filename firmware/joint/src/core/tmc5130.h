// The motor driver, as SPI datagrams (TMC5130A data sheet, sections 4 and 6).
//
// A datagram has no check. The driver returns the value of a write with the next datagram, which is
// compared, and a damaged setting is written again. A damaged address is not seen in that value: so
// the speed of each tick is compared with the one that the settings give, and those of the ramp are
// written again where it differs; the position has to continue its course; and the settings are
// read, or where that is not possible written once more in the next tick, and again in turn. A damaged address may also name a
// register that needs no other value than that of its reset: these are settings, too.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "hal.h"

namespace bioscara {

class Tmc5130 {
 public:
  explicit Tmc5130(Hal& hal) : hal_(hal) {}

  // Writes all settings; the motor stays without current.
  void setup();
  // The same in parts, one a tick, for a driver that has lost them; the currents come first.
  void begin_setup();
  void continue_setup();
  bool ready() const { return set_up_ == kSettings; }
  // Turns the motor the other way for the same counts. At standstill only; the field may move to
  // another place of its period. Kept by the next setup().
  void reverse();
  // Switches the motor off in the chip itself, until the next setup().
  void open_bridge();

  // Begins a tick: reads position and speed and asks for one of the other registers in turn. Three
  // datagrams, four in every kTicksBetween-th tick and in those after a change.
  void poll();
  // Ends it: with one more where something was written, which returns that value, and writes a damaged
  // setting again.
  void finish();
  int32_t position() const { return position_; }
  int32_t velocity_register() const { return velocity_; }
  uint32_t drv_status() const { return drv_status_; }
  // Reset, driver error and undervoltage bits since the last call. A chip that does not answer,
  // as without its supply, counts as one with undervoltage.
  uint8_t take_gstat();
  // Reads these bits now instead of with the next polls.
  uint8_t read_gstat();
  // True once after the position counter has jumped: where the field stands is no longer known.
  bool take_jump();
  // Damage was repaired since the ramp began: it may be late to brake.
  bool disturbed() const { return disturbed_; }

  // Each writes only what changed.
  void set_target(int32_t position);
  void set_speed(float steps_per_second);
  void set_acceleration(float acceleration, float deceleration);
  void set_currents(uint8_t drive_percent, uint8_t hold_percent);
  void set_brake(BrakeMode mode);
  // Makes this the present position and the target. At standstill only.
  void set_position(int32_t position);

 private:
  static constexpr size_t kSettings = 34;
  // In place of a setting's number: the position counter, and none.
  static constexpr size_t kCounter = kSettings, kNone = kSettings + 1;

  uint32_t exchange(uint8_t address, uint32_t value);
  void write(size_t setting);
  void write_again();
  void write_twice();
  void set(size_t setting, uint32_t value);
  void take_position(int32_t counter, float moved, float seconds);
  void take_velocity(int32_t velocity, float seconds);
  bool strays(int32_t velocity, float seconds);
  void take_status();

  Hal& hal_;
  int32_t position_ = 0;
  int32_t velocity_ = 0;
  // When position and speed were read.
  uint32_t read_at_ = 0;
  // They did not continue their course: believed when that is so twice in a row.
  bool odd_position_ = false;
  bool odd_velocity_ = false;
  bool jumped_ = false;
  bool disturbed_ = false;
  // Ticks until the settings of the ramp may be written again, and that they have to be.
  uint8_t calm_ = 0;
  bool strayed_ = false;
  float drift_ = 0.0F;

  uint32_t drv_status_ = 0;
  uint32_t last_drv_status_ = 0;
  uint8_t gstat_ = 0;
  // The status byte of the last datagram: bit 0 reset, bit 1 driver error.
  uint8_t spi_status_ = 0;
  // The last answer looked like one of a driver in trouble; asked for once more.
  bool doubted_ = false;
  uint16_t turn_ = 0;

  // The setting that the last datagram wrote, with its value; what poll() asked for, with the value of
  // a setting, and the answer; and a setting that was damaged.
  size_t wrote_ = kNone;
  uint32_t written_ = 0;
  size_t asked_ = 0;
  uint32_t wanted_ = 0;
  bool asking_ = false;
  uint32_t reported_ = 0;
  // Bits of GSTAT to be cleared.
  uint32_t clear_ = 0;
  size_t damaged_ = kNone;
  // Settings, by their bits, to be written once more: those that changed and cannot be read.
  uint32_t changed_ = 0;

  // The next setting that a set-up has to write, and the values of all.
  size_t set_up_ = kSettings;
  uint32_t values_[kSettings] = {};
};

}  // namespace bioscara
