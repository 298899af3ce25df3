// The uStepper S32 as the core sees it.
#pragma once

#include "../../src/core/hal.h"
#include "exceptions.h"
#include "i2c_target.h"
#include "identity.h"

namespace bioscara {

class Board final : public Hal {
 public:
  explicit Board(const I2cTarget& target) : target_(target) {}

  // Finds out which boot this is.
  void begin(uint32_t noise);

  uint32_t micros() override;
  void driver_exchange(const uint8_t (&sent)[5], uint8_t (&received)[5]) override;
  void encoder_exchange(uint16_t command, uint16_t* words, size_t count) override;
  void driver_enable(bool on) override;
  ResetCause reset_cause() override { return cause_; }
  uint16_t boot_id() override { return boot_id_; }
  void feed_watchdog() override;
  uint16_t bus_errors() override { return target_.errors(); }
  uint32_t image() override { return image_crc(); }
  ExceptionRecord exception() override { return exceptions::last(); }
  void indicate(bool lit) override;
  void enter_bootloader() override;
  void lock() override;
  void unlock() override;

 private:
  const I2cTarget& target_;
  ResetCause cause_ = ResetCause::UNKNOWN;
  uint16_t boot_id_ = 0;
};

}  // namespace bioscara
