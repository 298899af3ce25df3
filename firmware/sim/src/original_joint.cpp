#include "original_joint.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace bioscara::sim {

namespace {

// The library's timer: 54484 clocks of 84 MHz [0.1 us].
constexpr double kSamplePeriod = 54484.0 / 84e6 * kSecond;
// From latching XACTUAL until its correction takes effect: two SPI datagrams [s].
constexpr float kRewriteDelay = 48e-6F;
// Position error that the closed loop corrects [microsteps].
constexpr std::int32_t kControlThreshold = 15;
constexpr double kMicrostepsPerDegree = 51200.0 / 360.0;
constexpr double kFullStepsPerDegree = 200.0 / 360.0;

constexpr Time kLoop = 10 * kMillisecond;
constexpr Time kPoll = kMillisecond;
// The orientation check waits in a loop of register reads of 47 us; once a step of the ramp here.
constexpr Time kCheckPoll = 512;
constexpr Time kHomeWait = kSecond / 2;
constexpr Time kDeadman = 50 * kMillisecond;

constexpr float kStallJump = 100.0F;
constexpr float kStallShare = 0.1F;
constexpr float kStallMoving = 90.0F;
constexpr float kMovingSlowest = 12.0F, kMovingFastest = 450.0F;  // [rad/s]
constexpr float kRadPerSecondPerRpm = 0.10471976F;

// Defaults set at start: full steps per second (squared), degrees of the orientation check.
constexpr float kStartAcceleration = 100.0F;
constexpr float kStartVelocity = 10.0F;
constexpr float kStartCheck = 1.0F;

// Handler times. Measured, but for those that follow from their SPI datagrams (docs/simulation.md).
constexpr Time micros(double value) { return static_cast<Time>(value * 10.0); }
constexpr Time kShort = micros(5.2), kPing = micros(4.0), kStallGuard = micros(6.0);
constexpr Time kMoveToAngle = micros(353.0), kMoveSteps = micros(351.0), kStop = micros(50.0), kSetRpm = kStop;
constexpr Time kOneSetting = micros(34.0), kTwoSettings = 2 * kOneSetting;
constexpr Time kBrake = micros(102.0), kSetUp = micros(34.0 + 34.0 + 351.0);

}  // namespace

OriginalJoint::OriginalJoint(Hal& hal, Time now)
    : driver_(hal), encoder_(hal), next_sample_(static_cast<double>(now)), next_loop_(now) {
  driver_.setup();
  driver_.set_max_acceleration(kStartAcceleration);
  driver_.set_max_velocity(kStartVelocity);
  encoder_.setup();
  encoder_.set_home();
  next_loop_ += start_orientation(kStartCheck);
}

Time OriginalJoint::run(Time now) {
  if (next_loop_ <= now) {
    const Time wait = phase_ == Phase::LOOP ? pass(now) : continue_phase(now);
    next_loop_ += wait;
  }
  return std::min(run_without_loop(now), next_loop_);
}

Time OriginalJoint::run_without_loop(Time now) {
  if (next_sample_ <= static_cast<double>(now)) {
    sample();
    next_sample_ += kSamplePeriod;
  }
  return static_cast<Time>(std::ceil(next_sample_));
}

void OriginalJoint::sample() {
  encoder_.sample();
  if (!closed_loop_) return;
  const OriginalDriver::Ramp ramp = driver_.ramp();
  error_ = ramp.position - encoder_.microsteps();
  // The ramp goes on during the transfer of the correction, which is late by that much.
  if (std::abs(error_) >= kControlThreshold)
    driver_.rewrite_position(encoder_.microsteps() - to_integer(ramp.velocity * kRewriteDelay));
}

// The main loop.

Time OriginalJoint::pass(Time now) {
  if (stall_found()) {
    stalled_ = true;
    stall_filter_ = stall_last_ = 0.0F;
    driver_.begin_stop();
    phase_ = Phase::STALL_STOP;
    return kPoll;
  }
  return run_pending(now);
}

bool OriginalJoint::stall_found() {
  if (!detecting_ || stalled_) return false;
  auto error = static_cast<float>(std::abs(error_));
  // A step of the error counts as a disturbed SPI transfer, for as long as it lasts.
  if (error - stall_last_ > kStallJump) error = stall_last_;
  stall_last_ = error;
  stall_filter_ = (1.0F - kStallShare) * stall_filter_ + kStallShare * error;
  const float speed = std::fabs(encoder_.rpm()) * kRadPerSecondPerRpm;
  const bool moving = kMovingSlowest <= speed && speed <= kMovingFastest;
  return stall_filter_ > static_cast<float>(stall_threshold_) + (moving ? kStallMoving : 0.0F);
}

Time OriginalJoint::run_pending(Time now) {
  if (!pending_) return end_pass(now);
  pending_ = false;
  switch (static_cast<Register>(register_)) {
    case Register::CHECKORIENTATION:
      return start_orientation(payload_float());
    case Register::HOME:
      std::memcpy(home_, payload_, sizeof home_);
      driver_.begin_stop();
      phase_ = Phase::HOME_STOP;
      return kPoll;
    default:
      break;  // Printed as unknown.
  }
  busy_ = false;
  return end_pass(now);
}

Time OriginalJoint::end_pass(Time now) {
  phase_ = Phase::LOOP;
  if (enabled_ && setpoint_rpm_ != 0.0F && now - last_request_ > kDeadman) {
    driver_.set_rpm(0.0F);
    enabled_ = false;
  }
  return kLoop;
}

Time OriginalJoint::continue_phase(Time now) {
  switch (phase_) {
    case Phase::STALL_STOP:
      if (!driver_.standing()) return kPoll;
      driver_.end_stop();
      return run_pending(now);
    case Phase::HOME_STOP:
      if (!driver_.standing()) return kPoll;
      driver_.end_stop();
      phase_ = Phase::HOME_WAIT;
      return kHomeWait;
    case Phase::HOME_WAIT:
      driver_.set_rpm(home_[0] != 0 ? home_[1] : -static_cast<float>(home_[1]));
      driver_.set_current(home_[3]);
      phase_ = Phase::HOME_SEEK;
      return kPoll;
    case Phase::HOME_SEEK:
      return seek();
    case Phase::HOME_END:
      if (!driver_.standing()) return kPoll;
      driver_.end_stop();
      driver_.set_current(drive_percent_);
      busy_ = false;
      return end_pass(now);
    default:
      return step_orientation(now);
  }
}

Time OriginalJoint::seek() {
  if (busy_ && std::abs(error_) <= home_[2]) return kPoll;
  if (busy_) {
    encoder_.set_home();
    driver_.set_home();
    error_ = 0;
    homed_ = true;
    stalled_ = false;
  }
  driver_.begin_stop();
  phase_ = Phase::HOME_END;
  return kPoll;
}

Time OriginalJoint::start_orientation(float degrees) {
  closed_loop_before_ = closed_loop_;
  closed_loop_ = false;
  orientation_steps_ = to_integer(std::round(degrees * kMicrostepsPerDegree));
  orientation_last_ = 0;
  orientation_out_ = true;
  orientation_start_ = encoder_.counts();
  phase_ = Phase::ORIENTATION;
  driver_.move_steps(orientation_steps_);
  return kCheckPoll;
}

// Waits for the target, also after other commands in between: STOP does not end it.
Time OriginalJoint::step_orientation(Time now) {
  if (!driver_.position_reached()) return kCheckPoll;
  bool agree = false;
  if (orientation_out_) {
    const bool along = (encoder_.counts() > orientation_start_) == (orientation_steps_ > 0);
    const int result = along ? 1 : -1;
    agree_ = result == orientation_last_;
    orientation_last_ = result;
  } else {
    agree = agree_;
    orientation_start_ = encoder_.counts();
  }
  if (!agree) {
    driver_.move_steps(orientation_out_ ? -orientation_steps_ : orientation_steps_);
    orientation_out_ = !orientation_out_;
    return kCheckPoll;
  }
  if (orientation_last_ < 0) driver_.reverse();
  closed_loop_ = closed_loop_before_;
  if (!listening_) return finish_setup(now);
  busy_ = false;
  return end_pass(now);
}

Time OriginalJoint::finish_setup(Time now) {
  closed_loop_ = true;
  driver_.begin_stop();
  driver_.end_stop();  // It stands.
  driver_.set_current(0);
  driver_.set_hold_current(0);
  driver_.set_brake_mode(0);
  listening_ = true;
  return end_pass(now);
}

// The I2C interrupt.

void OriginalJoint::receive(const std::uint8_t* data, std::size_t size) {
  if (!listening_ || size == 0) return;
  // Anything that waits for the main loop is dropped; BUSY stays as it is.
  pending_ = false;
  register_ = data[0];
  length_ = std::min(size - 1, sizeof payload_);
  std::memcpy(payload_, data + 1, length_);
}

OriginalJoint::Answer OriginalJoint::request(Time now) {
  answer_.size = 0;
  answer_.duration = execute();
  answer_.bytes[answer_.size++] = flags();
  last_request_ = now;
  return answer_;
}

std::uint8_t OriginalJoint::flags() const {
  const auto bit = [](bool set, Flags flag) {
    return set ? static_cast<std::uint8_t>(flag) : std::uint8_t{0};
  };
  return static_cast<std::uint8_t>(bit(stalled_, Flags::STALL) | bit(busy_, Flags::BUSY) |
                                   bit(!homed_, Flags::NOTHOMED) |
                                   bit(!enabled_, Flags::NOTENABLED));
}

float OriginalJoint::payload_float() const {
  float value = 0.0F;
  std::memcpy(&value, payload_, sizeof value);
  return value;
}

void OriginalJoint::answer_float(float value) {
  std::memcpy(answer_.bytes, &value, sizeof value);
  answer_.size = sizeof value;
}

Time OriginalJoint::execute() {
  switch (static_cast<Register>(register_)) {
    case Register::PING:
      answer_.bytes[answer_.size++] = 'O';
      return kPing;
    case Register::GETDRIVERRPM:
      return kShort;  // Known by name only: the answer is the flags alone.
    case Register::ANGLEMOVED:
      answer_float(encoder_.angle_deg());
      return kShort;
    case Register::GETENCODERRPM:
      answer_float(encoder_.rpm());
      return kShort;
    case Register::HOMEOFFSET:
      if (length_ == 0)
        answer_float(home_offset_);
      else
        home_offset_ = payload_float();
      return kShort;
    case Register::SETUP:
      set_up();
      return kSetUp;
    case Register::SETRPM:
      setpoint_rpm_ = payload_float();
      if (!stalled_) driver_.set_rpm(setpoint_rpm_);
      return kSetRpm;
    case Register::MOVESTEPS: {
      std::int32_t steps = 0;
      std::memcpy(&steps, payload_, sizeof steps);
      driver_.move_steps(steps);
      return kMoveSteps;
    }
    case Register::MOVETOANGLE:
      if (!stalled_) move_to_angle(payload_float());
      return kMoveToAngle;
    case Register::SETCURRENT:
      drive_percent_ = payload_[0];
      driver_.set_current(drive_percent_);
      if (drive_percent_ == 0) enabled_ = false;
      return kOneSetting;
    case Register::SETHOLDCURRENT:
      driver_.set_hold_current(payload_[0]);
      if (payload_[0] == 0) enabled_ = false;
      return kOneSetting;
    case Register::SETMAXACCELERATION:
      driver_.set_max_acceleration(static_cast<float>(payload_float() * kFullStepsPerDegree));
      return kTwoSettings;
    case Register::SETMAXVELOCITY:
      driver_.set_max_velocity(static_cast<float>(payload_float() * kFullStepsPerDegree));
      return kOneSetting;
    case Register::ENABLESTALLGUARD:
      stall_threshold_ = 10 * payload_[0];
      stalled_ = false;
      detecting_ = true;
      return kStallGuard;
    case Register::SETBRAKEMODE:
      driver_.set_brake_mode(payload_[0]);
      return kBrake;
    case Register::DISABLECLOSEDLOOP:
      closed_loop_ = closed_loop_before_ = false;
      enabled_ = false;
      return kShort;
    case Register::STOP:
      // The setpoint that the deadman watches stays.
      driver_.set_rpm(0.0F);
      busy_ = false;
      return kStop;
    case Register::HOME:
      homed_ = false;
      return defer();
    default:
      return defer();
  }
}

void OriginalJoint::set_up() {
  drive_percent_ = payload_[0];
  driver_.set_current(drive_percent_);
  driver_.set_hold_current(payload_[1]);
  driver_.move_steps(0);
  enabled_ = true;
  stalled_ = false;
  detecting_ = false;
  setpoint_rpm_ = 0.0F;
}

void OriginalJoint::move_to_angle(float degrees) {
  // Relative to XACTUAL, which the closed loop keeps near the encoder.
  const double steps = (degrees - encoder_.angle_deg()) * kMicrostepsPerDegree;
  driver_.move_steps(to_integer(std::round(steps)));
}

Time OriginalJoint::defer() {
  pending_ = true;
  busy_ = true;
  return kShort;
}

}  // namespace bioscara::sim
