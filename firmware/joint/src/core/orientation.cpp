#include "orientation.h"

#include <math.h>

namespace bioscara {

namespace {

constexpr int kSettle = 150;
constexpr int kPause = 60;
constexpr int kTimeout = 2000;
constexpr float kSpeed = 4000.0F;
constexpr float kAcceleration = 80000.0F;
constexpr float kTolerance = 0.3F;

constexpr float kQuarter = 0.25F * kElectricalPeriod;
// A rotor that is further behind for so many ticks, more than half a swing of it, is held.
constexpr int kHeld = 5;

// Friction can hold the rotor opposite to its field, where a stroke pulls it free.
bool found(const Motion& motion, float encoder) {
  return fabsf(motion.position() - encoder) < kQuarter;
}

}  // namespace

void Orientation::start(float angle_deg, bool settle, bool known, bool adapt) {
  step_ = Step::SETTLE;
  angle_ = angle_deg * kStepsPerDegree;
  seen_ = 0.0F;
  known_ = known;
  adapt_ = adapt;
  passed_ = second_ = false;
  // A long stroke does not have to pull the rotor free: where it is held, the stroke ends.
  long_ = freed_ = angle_ > kQuarter;
  ticks_ = settle ? 0 : kSettle;
  still_ = 0;
}

void Orientation::stroke(Motion& motion, float target) {
  target_ = target;
  go(motion);
  ticks_ = still_ = held_ = 0;
}

void Orientation::go(Motion& motion) const {
  motion.go(target_, kSpeed, kAcceleration, kAcceleration);
}

bool Orientation::reached(Motion& motion) {
  go(motion);
  still_ = motion.arrived() ? still_ + 1 : 0;
  return still_ >= kPause;
}

// The result of a stroke that pulled the rotor free is meaningless; now it is with its field, so
// take up the play.
bool Orientation::freed(Motion& motion, float encoder) {
  if (freed_ || found(motion, encoder)) return false;
  freed_ = true;
  motion.rename(encoder);
  step_ = Step::TAKE_UP;
  stroke(motion, encoder + angle_);
  return true;
}

// Near an end stop the rotor cannot follow a long stroke. Before it loses the field, that goes back.
bool Orientation::blocked(Motion& motion, float encoder) {
  held_ = long_ && !found(motion, encoder) ? held_ + 1 : 0;
  if (held_ < kHeld) return false;
  motion.stop(kHardDeceleration);
  step_ = Step::HELD;
  return true;
}

Orientation::Result Orientation::step(Motion& motion, float encoder) {
  if (++ticks_ > kTimeout) return Result::FAILED;
  switch (step_) {
    case Step::SETTLE:
      motion.stop(kHardDeceleration);
      if (!motion.standing() || ticks_ < kSettle) return Result::RUNNING;
      if (known_ && found(motion, encoder)) return Result::PASSED;
      // Before a long stroke the place of the rotor in its field is known: it shows where it is held.
      if (!long_ || !found(motion, encoder)) motion.rename(encoder);
      start_ = motion.position();
      step_ = Step::TAKE_UP;
      stroke(motion, start_ + angle_);
      return Result::RUNNING;
    case Step::TAKE_UP:
      if (blocked(motion, encoder)) return Result::RUNNING;
      if (!reached(motion) || freed(motion, encoder)) return Result::RUNNING;
      // By now the rotor is with its field.
      if (!found(motion, encoder)) motion.rename(encoder);
      before_ = encoder;
      step_ = Step::MEASURE;
      stroke(motion, motion.position() + angle_);
      return Result::RUNNING;
    case Step::MEASURE: {
      if (blocked(motion, encoder)) return Result::RUNNING;
      if (!reached(motion) || freed(motion, encoder)) return Result::RUNNING;
      seen_ = encoder - before_;
      const float share = seen_ / angle_;
      passed_ = fabsf(share - 1.0F) <= kTolerance;
      if (adapt_ && fabsf(share + 1.0F) <= kTolerance) {
        motion.driver().reverse();
        adapt_ = freed_ = false;
        ticks_ = 0;
        step_ = Step::REVERSE;
        return Result::RUNNING;
      }
      // Reversed direction: no second try, every further step only does harm.
      if (share < -kTolerance) return Result::FAILED;
      step_ = Step::RETURN;
      stroke(motion, start_);
      return Result::RUNNING;
    }
    case Step::HELD:
      motion.stop(kHardDeceleration);
      if (!motion.standing()) return Result::RUNNING;
      // The spring of a belt may have turned it back by an electrical period.
      motion.rename(encoder + remainderf(motion.position() - encoder, kElectricalPeriod));
      step_ = Step::RETURN;
      stroke(motion, start_);
      return Result::RUNNING;
    case Step::REVERSE:
      // The rotor may have followed the field to another place.
      if (ticks_ < kSettle) return Result::RUNNING;
      motion.rename(encoder);
      step_ = Step::TAKE_UP;
      stroke(motion, encoder + angle_);
      return Result::RUNNING;
    case Step::RETURN:
      if (!reached(motion)) return Result::RUNNING;
      if (passed_) return Result::PASSED;
      if (second_) return Result::FAILED;
      second_ = true;
      angle_ = -angle_;
      step_ = Step::TAKE_UP;
      stroke(motion, start_ + angle_);
      return Result::RUNNING;
  }
  return Result::FAILED;
}

}  // namespace bioscara
