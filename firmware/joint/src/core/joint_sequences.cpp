// Sequences that take more than one tick, and their ends.
#include <math.h>

#include "joint.h"

namespace bioscara {

namespace {

// Ticks of standstill before a stop counts as ended: the rotor has swung out.
constexpr int kRest = 50;
// Homings of one boot must find the same end stop [counts]; 20 degrees of the motor.
constexpr int32_t kSameStop = 1820;
// Position correction: a share of the missing angle each tick, never more than the angle of full
// torque. With the average's lag it follows the load in 8 ms.
constexpr float kCorrectionGain = 0.3F;
constexpr float kCorrectionMost = 0.25F * kElectricalPeriod;
// A rotor at rest that is further away has lost the field; nearer, the correction pulls it back.
constexpr float kLost = 0.7F * kElectricalPeriod;

}  // namespace

void Joint::run_homing() {
  const Homing::Result result = homing_.step(motion_, encoder_steps_);
  if (result == Homing::Result::RUNNING) return;
  renamed();
  apply_currents();
  if (result == Homing::Result::FAILED)
    latch(homing_.fault(), homing_.data());
  else if (state_ == JointState::HOMING)
    finish_homing();
  else
    hold();
}

void Joint::finish_homing() {
  const int32_t zero =
      zero_counts_ + static_cast<int32_t>(lroundf(homing_.contact() / kStepsPerCount));
  // An obstacle feels like an end stop. The end stop found by an earlier homing distinguishes them;
  // a second homing that finds the new position again is accepted.
  const bool moved = known_zero_ && abs(zero - zero_counts_) > kSameStop;
  const bool again = other_known_ && abs(zero - other_zero_) <= kSameStop;
  if (moved && !again) {
    other_zero_ = zero;
    other_known_ = true;
    latch(Fault::HOMING_DISAGREEMENT, homing_.contact() / kStepsPerDegree);
    return;
  }
  const float shift = static_cast<float>(zero - zero_counts_) * kStepsPerCount;
  zero_counts_ = zero;
  known_zero_ = true;
  other_known_ = false;
  homed_ = true;
  filter_.shift(-shift);
  encoder_steps_ -= shift;
  motion_.rename(encoder_steps_);
  renamed();
  hold();
}

void Joint::run_orientation() {
  const Orientation::Result result = orientation_.step(motion_, encoder_steps_);
  if (result == Orientation::Result::RUNNING) return;
  renamed();
  if (result == Orientation::Result::PASSED) {
    checked_ = directed_ = true;
    hold();
  } else {
    checked_ = false;
    cut(Fault::ORIENTATION, orientation_.seen_deg());
  }
}

void Joint::run_stopping() {
  motion_.stop(stop_deceleration_);
  still_ = motion_.standing() ? still_ + 1 : 0;
  if (still_ < kRest) return;
  resynchronise();
  if ((fault_ == Fault::STALL || fault_ == Fault::FOLLOWING) && supervisor_.frozen()) {
    // Not a stalled rotor: the encoder stands still, so the position is not known either.
    fault_ = Fault::ENCODER;
    stalled_ = enabled_ = homed_ = checked_ = false;
  }
  hold();
  if (!enabled_ && fault_ == Fault::NONE) {
    state_ = JointState::DISABLED;
    apply_currents();
  } else if (fault_ != Fault::NONE) {
    state_ = JointState::FAULTED;
    apply_currents();
  }
}

// A rotor that lost the field stands whole electrical periods away from it; the encoder is right.
bool Joint::resynchronise() {
  const float periods = roundf((motion_.position() - encoder_steps_) / kElectricalPeriod);
  if (periods == 0.0F) return false;
  motion_.rename(motion_.position() - periods * kElectricalPeriod);
  renamed();
  return true;
}

void Joint::renamed() {
  error_ = motion_.position() - encoder_steps_;
  load_angle_.reset(error_);
}

void Joint::hold() {
  // The obstacle that stopped the joint may still press against it: the field goes back to the
  // rotor. Otherwise nothing moves, and the goal of a finished move stays unchanged.
  if (fault_ != Fault::NONE) {
    goal_ = encoder_steps_;
    correction_ = 0.0F;
  } else if (state_ != JointState::POSITION || !there()) {
    goal_ = motion_.position() - correction_;
  }
  run_velocity_ = 0.0F;
  alone_ = false;
  state_ = JointState::HOLDING;
}

bool Joint::there() const {
  return motion_.arrived() && motion_.position() == roundf(goal_ + correction_);
}

// At rest: from the threshold on, until it is half of that, so that noise moves nothing.
void Joint::settle(float goal) {
  const float off = goal - encoder_steps_;
  if (fabsf(off) >= threshold_) settling_ = true;
  if (fabsf(off) <= 0.5F * threshold_) settling_ = false;
  if (settling_) lead();
}

// In motion: the field leads the rotor by what friction and load need, so that the rotor and not
// the field arrives in time.
void Joint::lead() {
  if (!closed_loop_) return;
  const float missing = load_angle_.steps() - correction_;
  correction_ = clamp(correction_ + kCorrectionGain * missing, -kCorrectionMost, kCorrectionMost);
}

void Joint::correct() {
  if (there()) {
    const float error = error_;
    const bool lost = fabsf(error) > kLost && resynchronise();
    // Brought back once and lost again: something holds the rotor, or the encoder.
    if (lost && returning_) {
      latch(Fault::FOLLOWING, error);
      return;
    }
    const bool away = fabsf(goal_ - encoder_steps_) > kCorrectionMost;
    returning_ = lost || (returning_ && away);
    settle(goal_);
  } else if (state_ == JointState::POSITION) {
    lead();
  }
  motion_.go(goal_ + correction_, max_velocity_, acceleration_, deceleration_);
}

void Joint::latch(Fault fault, float data) {
  if (fault_ == Fault::NONE) {
    fault_ = fault;
    fault_data_ = data;
  }
  if (fault != Fault::STALL) enabled_ = false;
  stop(fault != Fault::SETPOINT_LOST);
}

void Joint::cut(Fault fault, float data) {
  power(false);
  if (fault_ == Fault::NONE) {
    fault_ = fault;
    fault_data_ = data;
  }
  enabled_ = false;
  checked_ = checked_ && fault != Fault::RUNAWAY;
  state_ = JointState::FAULTED;
  motion_.stop(kHardDeceleration);
}

void Joint::apply_currents() {
  // A fault that stops a joint leaves it at its place, with the hold current.
  const bool held = state_ == JointState::FAULTED && powered_ && hold_percent_ != 0;
  const bool at_rest = state_ == JointState::DISABLED || state_ == JointState::FAULTED;
  const bool released = at_rest && !enabled_ && !held;
  motion_.driver().set_currents(released ? 0 : drive_percent_, released ? 0 : hold_percent_);
  // Current that a fault cut stays off until SETUP, and a field that still turns would drag the rotor
  // along.
  if (!released || (state_ == JointState::FAULTED && !powered_) || running_down()) return;
  power(false);
  // Shorted coils need a closed power stage, a free rotor an open one.
  hal_.driver_enable(brake_ == BrakeMode::COOL_BRAKE);
}

void Joint::power(bool on) {
  // While the stage was open the rotor was free to turn.
  if (on && !powered_) {
    resynchronise();
    correction_ = 0.0F;
  }
  powered_ = on;
  hal_.driver_enable(on);
}

}  // namespace bioscara
