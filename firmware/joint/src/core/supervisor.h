// Watches the motor while it has current: is the rotor with the field, is the encoder sound.
#pragma once

#include <stdint.h>

#include "../generated/registers.h"
#include "motion.h"

namespace bioscara {

class Supervisor {
 public:
  struct Finding {
    Fault fault = Fault::NONE;
    float data = 0.0F;
  };

  // Beyond half an electrical period the rotor has lost the field; sensitivity adds to that.
  void enable_stall(uint8_t sensitivity) {
    stall_limit_ = 0.5F * kElectricalPeriod + 32.0F * static_cast<float>(sensitivity);
    stall_on_ = true;
  }
  void disable_stall() { stall_on_ = false; }
  uint8_t load_percent(float error) const;

  void reset() { lost_ = against_ = same_ = 0; }

  // One tick of a motor that should be with its field. `error` is field minus rotor.
  Finding check(const Motion& motion, float error, int32_t encoder_change);

  // Whether the encoder has not changed at all while the field moved on.
  bool frozen() const { return same_ >= kFrozen; }

 private:
  static constexpr int kFrozen = 25;

  bool stall_on_ = false;
  float stall_limit_ = 0.5F * kElectricalPeriod;
  int lost_ = 0;
  int against_ = 0;
  int same_ = 0;
};

// The bits of the driver's status words that require switching off.
Supervisor::Finding driver_fault(uint8_t gstat, uint32_t drv_status);

}  // namespace bioscara
