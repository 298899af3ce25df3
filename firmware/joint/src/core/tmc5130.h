// The motor driver, as SPI datagrams (TMC5130A data sheet, sections 4 and 6).
#pragma once

#include <stdint.h>

#include "hal.h"

namespace bioscara {

class Tmc5130 {
 public:
  explicit Tmc5130(Hal& hal);

  // Writes all settings; the motor stays without current.
  void setup();
  // The same in parts, one a tick, for a driver that has lost them; the currents come first.
  void begin_setup();
  void continue_setup();
  bool ready() const { return set_up_ == kReady; }
  // Turns the motor the other way for the same counts. At standstill only; the field may move to
  // another place of its period. Kept by the next setup().
  void reverse();
  // Switches the motor off in the chip itself, until the next setup().
  void open_bridge();

  // Reads position, speed and one of the status registers in turn: four datagrams.
  void poll();
  int32_t position() const { return position_; }
  int32_t velocity_register() const { return velocity_; }
  // The SPI status byte: bit 0 reset, bit 1 driver error, bit 3 standstill, 4 and 5 reached.
  uint8_t spi_status() const { return spi_status_; }
  uint32_t drv_status() const { return drv_status_; }
  // Reset, driver error and undervoltage bits since the last call. A chip that does not answer,
  // as without its supply, counts as one with undervoltage.
  uint8_t take_gstat();
  // Reads these bits now instead of with the next polls.
  uint8_t read_gstat();

  // Each writes only what changed.
  void set_target(int32_t position);
  void set_speed(float steps_per_second);
  void set_acceleration(float acceleration, float deceleration);
  void set_currents(uint8_t drive_percent, uint8_t hold_percent);
  void set_brake(BrakeMode mode);
  // Makes this the present position and the target. At standstill only.
  void set_position(int32_t position);

 private:
  static constexpr uint8_t kReady = 0xFF;

  uint32_t exchange(uint8_t address, uint32_t value);
  void write(uint8_t address, uint32_t value);
  void take(uint8_t status);

  Hal& hal_;
  int32_t position_ = 0;
  int32_t velocity_ = 0;
  uint32_t drv_status_ = 0;
  uint8_t gstat_ = 0;
  uint8_t spi_status_ = 0;
  uint16_t turn_ = 0;
  // The next setting to be written.
  uint8_t set_up_ = kReady;

  int32_t target_ = 0;
  uint32_t speed_ = 0;
  uint32_t acceleration_ = 0;
  uint32_t deceleration_ = 0;
  uint32_t gconf_;
  uint32_t currents_ = 0;
  uint32_t pwm_ = 0;
};

}  // namespace bioscara
