// Checks that the encoder follows the driver. A stroke to take up the play, one that is measured,
// each of the angle asked for, and back. Where the first direction is blocked, the other is tried.
// The first check sets the driver's direction: a motor may be plugged in either way.
#pragma once

#include "motion.h"

namespace bioscara {

class Orientation {
 public:
  enum class Result { RUNNING, PASSED, FAILED };

  // `settle`: the rotor was without current and needs time to find its place. `known`: encoder and
  // field agreed before, so no stroke is needed where the rotor has found its field. `adapt`: the
  // driver's direction is not known yet; a rotor that turns the wrong way reverses it, once.
  void start(float angle_deg, bool settle, bool known, bool adapt);
  // One tick; `encoder` in steps.
  Result step(Motion& motion, float encoder);
  // The measured stroke as the encoder saw it [deg].
  float seen_deg() const { return seen_ / kStepsPerDegree; }

 private:
  enum class Step { SETTLE, TAKE_UP, MEASURE, HELD, REVERSE, RETURN };
  void go(Motion& motion) const;
  bool reached(Motion& motion);
  bool freed(Motion& motion, float encoder);
  bool blocked(Motion& motion, float encoder);
  void stroke(Motion& motion, float target);

  Step step_ = Step::SETTLE;
  float angle_ = 0.0F;
  float start_ = 0.0F;
  float target_ = 0.0F;
  float before_ = 0.0F;
  float seen_ = 0.0F;
  bool known_ = false;
  bool adapt_ = false;
  bool passed_ = false;
  bool second_ = false;
  bool freed_ = false;
  bool long_ = false;
  int ticks_ = 0;
  int still_ = 0;
  int held_ = 0;
};

}  // namespace bioscara
