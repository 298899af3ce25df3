// Finds the end stop: fast approach, back off, slow second touch, compare, move clear.
#pragma once

#include "../generated/registers.h"
#include "configuration.h"
#include "motion.h"
#include "touch.h"

namespace bioscara {

class Homing {
 public:
  enum class Result { RUNNING, TOUCHED, FAILED };

  // `twice` is false for MOVETOEND: one touch, at the commanded speed and the current in force.
  void start(const Configuration& configuration, bool positive, float rpm, float threshold,
             uint8_t current_percent, bool twice);
  // One tick; `encoder` in steps.
  Result step(Motion& motion, float encoder);

  // After TOUCHED: where [steps].
  float contact() const { return contact_; }
  // After FAILED: why, and the number that goes with it.
  Fault fault() const { return fault_; }
  float data() const { return data_; }

 private:
  enum class Step { BEGIN, SETTLE, APPROACH, HALT, BACK_OFF, PAUSE, TOUCH, HALT_AGAIN, CLEAR };
  Result fail(Fault fault, float data);
  Result approach(Motion& motion, float encoder);
  Result touch(Motion& motion, float encoder);
  bool waited(int ticks) { return ++wait_ >= ticks; }

  Configuration configuration_ = configuration_of(1);
  Step step_ = Step::BEGIN;
  Touch touch_;
  float direction_ = 1.0F;
  float speed_ = 0.0F;
  float threshold_ = 0.0F;
  uint8_t current_percent_ = 0;
  bool twice_ = true;
  float start_ = 0.0F;
  float first_ = 0.0F;
  float contact_ = 0.0F;
  float pressed_ = 0.0F;
  float retreat_ = 0.0F;
  float clear_ = 0.0F;
  int wait_ = 0;
  uint32_t ticks_ = 0;
  Fault fault_ = Fault::NONE;
  float data_ = 0.0F;
};

}  // namespace bioscara
