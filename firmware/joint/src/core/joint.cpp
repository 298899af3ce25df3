#include "joint.h"

#include <math.h>

namespace bioscara {

namespace {

// Limits until the host sets others: those of the original firmware, in full steps.
constexpr float kDefaultVelocity = 800.0F * 256.0F;
constexpr float kDefaultAcceleration = 10000.0F * 256.0F;
// Largest change of angle within a tick: a slip of a pole, and the travel at the speed limit
// [counts].
constexpr float kPlausible = 700.0F;
constexpr int kBadMost = 1000;
// A version 1 host can do no more than poll, ten times a second.
constexpr uint32_t kPollMillis = 250;
// A setpoint may be as far away as the joint can travel at the limit within this time.
constexpr float kReachSeconds = 0.1F;
constexpr float kReachDegrees = 5.0F;
// Slower than this the motor only corrects its place [microsteps/s].
constexpr float kCreep = 2.0F * kStepsPerRpm;
// ... and no farther than this from it [microsteps].
constexpr float kNear = 32.0F;

constexpr uint8_t kPositionReached = 0x20;
constexpr uint8_t kVelocityReached = 0x10;
constexpr uint8_t kStandstill = 0x08;
constexpr uint8_t kStall = 0x04;

}  // namespace

Joint::Joint(Hal& hal, const Configuration& configuration)
    : hal_(hal),
      configuration_(configuration),
      wire_(hal, configuration),
      motion_(hal),
      encoder_(hal),
      max_velocity_(kDefaultVelocity),
      acceleration_(kDefaultAcceleration),
      deceleration_(kDefaultAcceleration),
      stop_deceleration_(kDefaultAcceleration) {}

void Joint::boot() {
  hal_.driver_enable(false);
  wire_.boot();
  motion_.driver().setup();
  // After a power-up it takes some milliseconds: the tick asks again.
  if (!encoder_.setup()) starting_ = kEncoderStart;
  zero_counts_ = encoder_.counts();
  filter_.reset(0.0F);
  publish();
}

void Joint::tick() {
  began_ = hal_.micros();
  sense();
  Command command;
  while (wire_.take(command)) execute(command);
  supervise();
  act();
  motion_.driver().finish();
  publish();
  indicate();
  leave();
  hal_.feed_watchdog();
}

// True once there is a first angle. Until then the joint is BUSY, and no fault is evaluated.
bool Joint::start_encoder() {
  if (encoder_.setup()) {
    starting_ = 0;
  } else if (--starting_ == 0) {
    bad_samples_ = kBadSamples;
    latch(Fault::ENCODER, 0.0F);
  }
  return starting_ == 0;
}

void Joint::sense() {
  motion_.driver().poll();
  if (starting_ != 0 && !start_encoder()) return;
  const float reach = kPlausible + 1.5F * max_velocity_ * kTickSeconds / kStepsPerCount;
  bool good = encoder_.sample();
  if (good && fabsf(static_cast<float>(encoder_.change())) > reach) {
    // An implausible angle read twice in a row is the encoder's position; how the rotor got there
    // is unknown.
    if (bad_samples_ == 0)
      encoder_.reject();
    else
      encoder_.rebase();
    good = false;
  }
  bad_samples_ = good ? 0 : bad_samples_ < kBadMost ? bad_samples_ + 1 : kBadMost;
  if (bad_samples_ == kBadSamples) {
    homed_ = checked_ = false;
    latch(Fault::ENCODER, static_cast<float>(encoder_.change()) * kStepsPerCount / kStepsPerDegree);
  }
  encoder_steps_ = static_cast<float>(encoder_.counts() - zero_counts_) * kStepsPerCount;
  filter_.update(encoder_steps_);
  error_ = powered_ ? motion_.position() - encoder_steps_ : 0.0F;
  load_angle_.update(error_);
}

float Joint::reference() const {
  if (state_ == JointState::TRACKING) return tracker_.position();
  if (state_ == JointState::HOLDING) return goal_;
  return powered_ ? motion_.position() - correction_ : encoder_steps_;
}

bool Joint::sequence() const {
  return state_ == JointState::HOMING || state_ == JointState::ORIENTATION ||
         state_ == JointState::MOVING_TO_END;
}

// The field of an open power stage turns on until its ramp ends; the rotor could not follow it.
bool Joint::running_down() const {
  return !powered_ && fabsf(motion_.velocity()) > kCreep;
}

bool Joint::underway() const {
  return sequence() || state_ == JointState::POSITION || state_ == JointState::VELOCITY ||
         state_ == JointState::TRACKING;
}

void Joint::supervise() {
  const Supervisor::Finding driver =
      driver_fault(motion_.driver().take_gstat(), motion_.driver().drv_status());
  if (driver.fault != Fault::NONE && powered_) cut(driver.fault, driver.data);
  if (driver.fault == Fault::DRIVER_RESET) {
    motion_.driver().begin_setup();
    checked_ = directed_ = false;  // Where the field stands is no longer known.
  } else if (!motion_.driver().ready()) {
    motion_.driver().continue_setup();
  }
  if (motion_.driver().take_jump() && powered_) {
    checked_ = false;
    harm(Fault::DRIVER, 0.0F);
  }
  if (powered_ && !sequence()) {
    const Supervisor::Finding finding =
        supervisor_.check(motion_, error_, bad_samples_ == 0 ? encoder_.change() : 1);
    if (finding.fault == Fault::RUNAWAY) {
      cut(finding.fault, finding.data);
    } else if (finding.fault != Fault::NONE && state_ != JointState::STOPPING &&
               state_ != JointState::FAULTED) {
      harm(finding.fault, finding.data);
    }
  }
  watch_silence();
}

// Stops for this fault, or switches off for the driver's that caused it: a motor without supply
// stalls before the driver is polled again.
void Joint::harm(Fault fault, float data) {
  const Supervisor::Finding cause = driver_fault(motion_.driver().read_gstat(), 0);
  if (cause.fault != Fault::NONE) {
    cut(cause.fault, cause.data);
  } else {
    stalled_ = fault == Fault::STALL;
    latch(fault, data);
  }
}

void Joint::watch_silence() {
  const bool stopping = state_ == JointState::STOPPING;
  if (!underway() && !stopping) return;
  // A stop needs no setpoints, only a host that polls.
  const bool polled = stopping || (alone_ && !wire_.armed());
  const uint32_t since = polled ? wire_.last_frame() : fed_;
  const uint32_t silence = (hal_.micros() - since) / 1000U;
  const uint32_t allowed = polled && !wire_.armed() ? kPollMillis : wire_.watchdog_ms();
  // A frame may arrive after this tick began.
  if (silence <= allowed || silence > 0x7FFFFFFFU / 1000U) return;
  if (stopping) {
    // The limit it stops with may be near zero.
    stop_deceleration_ = fmaxf(stop_deceleration_, configuration_.braking);
    return;
  }
  // A joint at rest still makes the small corrections that keep it at its place.
  const bool creeping = fabsf(motion_.velocity()) < kCreep;
  bool resting = creeping && !sequence();
  if (state_ == JointState::POSITION)
    resting = resting && fabsf(motion_.position() - goal_ - correction_) <= kNear;
  else if (state_ == JointState::TRACKING)
    resting = resting && tracker_.velocity() == 0.0F;
  else
    resting = resting && motion_.standing();
  if (resting)
    hold();
  else
    latch(Fault::SETPOINT_LOST, static_cast<float>(silence));
}

void Joint::act() {
  switch (state_) {
    case JointState::DISABLED:
      break;
    case JointState::HOLDING:
      if (enabled_) correct();
      break;
    case JointState::FAULTED:
      // No position correction here: a joint that is pushed away is not driven back. And nothing moves
      // where the place of the rotor in its field is not known.
      if (powered_ && checked_) motion_.go(goal_, max_velocity_, acceleration_, deceleration_);
      break;
    case JointState::POSITION:
      if (alone_ && there())
        hold();
      else
        correct();
      break;
    case JointState::VELOCITY:
      motion_.run(clamp(run_velocity_, -max_velocity_, max_velocity_), acceleration_,
                  deceleration_);
      break;
    case JointState::TRACKING:
      tracker_.advance();
      if (tracker_.velocity() == 0.0F && motion_.standing())
        settle(tracker_.position());
      else
        lead();
      motion_.follow(tracker_.position() + correction_, tracker_.velocity(), max_velocity_,
                     acceleration_);
      break;
    case JointState::HOMING:
    case JointState::MOVING_TO_END:
      run_homing();
      break;
    case JointState::ORIENTATION:
      run_orientation();
      break;
    case JointState::STOPPING:
      run_stopping();
      break;
  }
}

void Joint::publish() {
  Status status;
  const float degrees = encoder_steps_ / kStepsPerDegree;
  status.position_deg = degrees;
  status.velocity_rpm = filter_.speed() / kStepsPerRpm;
  status.driver_rpm = motion_.velocity() / kStepsPerRpm;
  status.error_steps = error_;
  status.reference_deg = reference() / kStepsPerDegree;
  status.max_velocity_rpm = max_velocity_ / kStepsPerRpm;
  status.reach_deg = max_velocity_ * kReachSeconds / kStepsPerDegree + kReachDegrees;
  status.load_percent = powered_ ? supervisor_.load_percent(error_) : 0;
  status.state = state_;
  status.fault = fault_;
  status.fault_data = fault_data_;
  status.warnings =
      encoder_.autocalibrates() ? static_cast<uint8_t>(Warnings::AUTOCALIBRATION) : uint8_t{0};
  status.slow_setup = !powered_ || !checked_;
  status.motor_bits = static_cast<uint8_t>(
      (motion_.arrived() ? kPositionReached : 0) |
      (fabsf(motion_.velocity() - run_velocity_) < kVelocityLsb * 2.0F ? kVelocityReached : 0) |
      (motion_.standing() ? kStandstill : 0) | (stalled_ ? kStall : 0));
  status.flags = static_cast<uint8_t>(
      (stalled_ ? mask(Flags::STALL) : 0) |
      (sequence() || running_down() || starting() ? mask(Flags::BUSY) : 0) |
      (homed_ ? 0 : mask(Flags::NOTHOMED)) | (enabled_ ? 0 : mask(Flags::NOTENABLED)) |
      (fault_ != Fault::NONE ? mask(Flags::FAULT) : 0));
  wire_.publish(status);
}

void Joint::indicate() {
  indicator_.advance(hal_, fault_ != Fault::NONE ? Indication::FAULT
                           : enabled_            ? Indication::ENABLED
                                                 : Indication::DISABLED);
}

}  // namespace bioscara
