// The uStepper S32: STM32F401, TMC5130 on SPI2, TLE5012B on SPI3, I2C target on the default pins.
// Built by the Arduino IDE with the board package; nothing else includes it.
#pragma once

#ifdef ARDUINO

#include <Arduino.h>
#include <SPI.h>

#include "../core/hal.h"
#include "../core/joint.h"

namespace bioscara {

class UstepperS32 final : public Hal {
 public:
  // Pins, SPI and the controller's own watchdog; the power stage is opened before all else.
  void begin();
  void listen(uint8_t address, void (*receive)(int), void (*request)());
  void every(uint32_t micros, void (*tick)());

  // The two I2C interrupts.
  void receive(Joint& joint);
  void request(Joint& joint);

  uint32_t micros() override;
  void driver_exchange(const uint8_t (&sent)[5], uint8_t (&received)[5]) override;
  void encoder_exchange(uint16_t command, uint16_t* words, size_t count) override;
  void driver_enable(bool on) override;
  ResetCause reset_cause() override { return cause_; }
  uint16_t boot_id() override { return boot_id_; }
  void feed_watchdog() override;
  void lock() override;
  void unlock() override;

 private:
  ResetCause cause_ = ResetCause::UNKNOWN;
  uint16_t boot_id_ = 0;
};

}  // namespace bioscara

#endif
