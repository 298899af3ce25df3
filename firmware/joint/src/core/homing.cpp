#include "homing.h"

#include <math.h>

namespace bioscara {

namespace {

constexpr float kAcceleration = kBriskDeceleration;
// Speed of the second touch: slow enough for the field to halt before the rotor's pull-out, fast
// enough to wind up a soft belt within 150 ms.
constexpr float kTouchSpeed = 17.0F * kStepsPerRpm;
// The back-off is long enough for the second touch to reach a steady speed and to measure its
// free-running lead.
constexpr float kBackOff = 80.0F * kStepsPerDegree;
constexpr float kBackOffSpeed = 30.0F * kStepsPerRpm;
// The two touches may differ by this much; the first is made with the speed of the approach.
constexpr float kAgreement = 10.0F * kStepsPerDegree;
// Final rest position: inside the limits by more than the check of the orientation turns.
constexpr float kClear = 2.0F * kStepsPerDegree;
constexpr int kPause = 200;

}  // namespace

void Homing::start(const Configuration& configuration, bool positive, float rpm, float threshold,
                   uint8_t current_percent, bool twice) {
  configuration_ = configuration;
  direction_ = positive ? 1.0F : -1.0F;
  speed_ = (twice ? fmaxf(configuration.homing_rpm, rpm) : rpm) * kStepsPerRpm;
  threshold_ = threshold;
  current_percent_ = current_percent;
  twice_ = twice;
  step_ = Step::BEGIN;
  wait_ = 0;
  ticks_ = 0;
  fault_ = Fault::NONE;
}

Homing::Result Homing::fail(Fault fault, float data) {
  fault_ = fault;
  data_ = data;
  return Result::FAILED;
}

Homing::Result Homing::step(Motion& motion, float encoder) {
  const float seconds = static_cast<float>(++ticks_) * kTickSeconds;
  const float allowed =
      kTimeMargin * configuration_.range_deg * kStepsPerDegree / speed_ + kTouchSeconds;
  if (seconds > allowed) return fail(Fault::HOMING_TIMEOUT, seconds);
  switch (step_) {
    case Step::BEGIN:
      // A motion underway ends with the current that it had.
      motion.stop(kHardDeceleration);
      if (!motion.standing()) return Result::RUNNING;
      if (twice_) motion.driver().set_currents(current_percent_, current_percent_);
      step_ = Step::SETTLE;
      return Result::RUNNING;
    case Step::SETTLE:
      // The changed current moves the rotor a little; wait, then start from where it is.
      if (!waited(kPause)) return Result::RUNNING;
      motion.rename(encoder);
      start_ = encoder;
      touch_.start(threshold_, direction_, encoder, encoder);
      step_ = Step::APPROACH;
      return Result::RUNNING;
    case Step::APPROACH:
      return approach(motion, encoder);
    case Step::HALT:
      motion.stop(kHardDeceleration);
      if (!motion.standing()) return Result::RUNNING;
      // A slipped rotor is whole electrical periods behind; the field presses by the remainder
      // only.
      motion.rename(encoder + remainderf(motion.position() - encoder, kElectricalPeriod));
      retreat_ = twice_ ? encoder : contact_ - direction_ * clear_;
      wait_ = 0;
      step_ = twice_ ? Step::BACK_OFF : Step::CLEAR;
      return Result::RUNNING;
    case Step::BACK_OFF: {
      motion.go(retreat_ - direction_ * kBackOff, kBackOffSpeed, kAcceleration,
                kAcceleration);
      if (!motion.arrived()) return Result::RUNNING;
      const float moved = (retreat_ - encoder) * direction_;
      if (moved < 0.5F * kBackOff) return fail(Fault::HOMING_OBSTRUCTED, moved / kStepsPerDegree);
      step_ = Step::PAUSE;
      return Result::RUNNING;
    }
    case Step::PAUSE:
      if (!waited(kPause)) return Result::RUNNING;
      wait_ = 0;
      touch_.start(threshold_, direction_, motion.position(), encoder);
      step_ = Step::TOUCH;
      return Result::RUNNING;
    case Step::TOUCH:
      return touch(motion, encoder);
    case Step::HALT_AGAIN:
      motion.stop(kHardDeceleration);
      if (!motion.standing()) return Result::RUNNING;
      // The field stands ahead of the rotor and presses; bring it back to where the rotor is, and
      // both away from the end stop.
      retreat_ = motion.position() - pressed_ - direction_ * kClear;
      step_ = Step::CLEAR;
      return Result::RUNNING;
    case Step::CLEAR:
      motion.go(retreat_, kBackOffSpeed, kAcceleration, kAcceleration);
      if (!motion.arrived() || !waited(kPause)) return Result::RUNNING;
      return Result::TOUCHED;
  }
  return fail(Fault::INTERNAL, static_cast<float>(__LINE__));
}

Homing::Result Homing::approach(Motion& motion, float encoder) {
  const float travel = (motion.position() - start_) * direction_ / kStepsPerDegree;
  if (travel > kTravelMargin * configuration_.range_deg)
    return fail(Fault::HOMING_TRAVEL, travel);
  motion.run(direction_ * speed_, kAcceleration, kAcceleration);
  const bool at_speed = fabsf(motion.velocity()) > 0.98F * speed_;
  if (!touch_.update(motion.position(), encoder, at_speed)) return Result::RUNNING;
  first_ = encoder;
  contact_ = touch_.onset(encoder);
  // Where the rise of the torque was not seen, a belt may be wound up by as much as homing backs off.
  clear_ = contact_ == encoder ? kBackOff : kClear;
  wait_ = 0;
  step_ = Step::HALT;
  return Result::RUNNING;
}

Homing::Result Homing::touch(Motion& motion, float encoder) {
  const float beyond = (encoder - first_) * direction_;
  if (beyond > 2.0F * kBackOff) return fail(Fault::HOMING_DISAGREEMENT, beyond / kStepsPerDegree);
  motion.run(direction_ * kTouchSpeed, kAcceleration, kAcceleration);
  const bool at_speed = fabsf(motion.velocity()) > 0.98F * kTouchSpeed;
  if (!touch_.update(motion.position(), encoder, at_speed)) return Result::RUNNING;
  contact_ = touch_.onset(encoder);
  pressed_ = motion.position() - contact_;
  const float apart = encoder - first_;
  if (fabsf(apart) > kAgreement)
    return fail(Fault::HOMING_DISAGREEMENT, apart / kStepsPerDegree);
  step_ = Step::HALT_AGAIN;
  return Result::RUNNING;
}

}  // namespace bioscara
