// Execution of each command, in the tick that takes it from the queue. The wire has checked its
// values and that it is allowed; conditions that may have changed since then are checked again
// here.
#include <math.h>

#include "joint.h"

namespace bioscara {

namespace {

constexpr float kOrientationDegrees = 1.0F;
// Error that counts as contact [steps] per unit of sensitivity, and its bounds: below is the
// encoder's own, above the rotor is close to slipping.
constexpr float kContactPerUnit = 2.5F;
constexpr float kContactLeast = 75.0F;
constexpr float kContactMost = 130.0F;

float contact_threshold(float sensitivity) {
  return clamp(kContactPerUnit * sensitivity, kContactLeast, kContactMost);
}

}  // namespace

void Joint::execute(const Command& command) {
  for (const Definition& row : kDefinitions) {
    if (row.code != command.code) continue;
    if (row.setpoint) fed_ = command.micros;
    if (row.motion && (!enabled_ || stalled_ || sequence())) return;
    // The joint may have been pushed away since it stalled.
    if (row.motion && state_ == JointState::FAULTED) resynchronise();
    break;
  }
  switch (command.code) {
    case Register::SETUP:
      set_up(command);
      break;
    case Register::SETRPM:
      state_ = JointState::VELOCITY;
      alone_ = false;
      run_velocity_ = command.number * kStepsPerRpm;
      correction_ = 0.0F;
      break;
    case Register::RUNCONTINUOUS:
      state_ = JointState::VELOCITY;
      alone_ = false;
      run_velocity_ = command.bytes[0] != 0 ? max_velocity_ : -max_velocity_;
      correction_ = 0.0F;
      break;
    case Register::MOVESTEPS:
      fed_ = command.micros;
      move(reference() + static_cast<float>(command.whole), true);
      break;
    case Register::MOVEANGLE:
      fed_ = command.micros;
      move(reference() + command.number * kStepsPerDegree, true);
      break;
    case Register::MOVETOANGLE:
      move(command.number * kStepsPerDegree, false);
      break;
    case Register::TRACK:
      track(command);
      break;
    case Register::SETCURRENT:
    case Register::SETHOLDCURRENT:
      set_current(command);
      break;
    case Register::SETMAXACCELERATION:
      acceleration_ = deceleration_ =
          clamp(command.number * kStepsPerDegree, kAccelerationLsb, kHardDeceleration);
      break;
    case Register::SETMAXDECELERATION:
      deceleration_ = clamp(command.number * kStepsPerDegree, kAccelerationLsb, kHardDeceleration);
      break;
    case Register::SETMAXVELOCITY:
      max_velocity_ = clamp(command.number * kStepsPerDegree, kVelocityLsb,
                            kVelocityLsb * static_cast<float>(kVelocityMax));
      break;
    case Register::ENABLESTALLGUARD:
      supervisor_.enable_stall(command.bytes[0]);
      stalled_ = false;
      break;
    case Register::DISABLESTALLGUARD:
      supervisor_.disable_stall();
      break;
    case Register::CLEARSTALL:
      stalled_ = false;
      break;
    case Register::SETBRAKEMODE:
      brake_ = static_cast<BrakeMode>(command.bytes[0]);
      motion_.driver().set_brake(brake_);
      if (state_ == JointState::DISABLED) apply_currents();
      break;
    case Register::ENABLEPID:
    case Register::ENABLECLOSEDLOOP:
      closed_loop_ = true;
      break;
    case Register::DISABLEPID:
      closed_loop_ = false;
      break;
    case Register::DISABLECLOSEDLOOP:
      closed_loop_ = false;
      disable();
      break;
    case Register::SETCONTROLTHRESHOLD:
      threshold_ = command.number;
      break;
    case Register::HOME:
    case Register::MOVETOEND:
      home(command);
      break;
    case Register::CHECKORIENTATION:
      check_orientation(command);
      break;
    case Register::STOP:
      stop(command.bytes[0] == 0);
      break;
    case Register::CLEARFAULT:
      if (command.bytes[0] == static_cast<uint8_t>(fault_) && !driver_still_faulty()) {
        fault_ = Fault::NONE;
        fault_data_ = 0.0F;
        stalled_ = false;
        if (state_ == JointState::FAULTED && powered_) {
          resynchronise();
          hold();
        } else if (state_ == JointState::FAULTED) {
          state_ = JointState::DISABLED;
        }
      }
      break;
    case Register::BOOTLOADER:
      leaving_ = kLeaveTicks;
      break;
    default:
      break;
  }
}

// Otherwise the missing supply is reported to a person only when the arm is enabled.
bool Joint::driver_still_faulty() {
  if (fault_ != Fault::DRIVER) return false;
  motion_.driver().read_gstat();  // Clears the bits of events that are over.
  return driver_fault(motion_.driver().read_gstat(), 0).fault != Fault::NONE;
}

void Joint::set_up(const Command& command) {
  if (sequence() || running_down() || starting() || (fault_ != Fault::NONE && wire_.armed())) return;
  fault_ = Fault::NONE;
  fault_data_ = 0.0F;
  stalled_ = false;
  supervisor_.disable_stall();
  supervisor_.reset();
  if (bad_samples_ >= kBadSamples) {
    latch(Fault::ENCODER, static_cast<float>(bad_samples_));
    return;
  }
  drive_percent_ = command.bytes[0];
  hold_percent_ = command.bytes[1];
  if (drive_percent_ == 0) {
    disable();
    return;
  }
  enabled_ = true;
  closed_loop_ = true;
  fed_ = command.micros;
  const bool settle = !powered_;
  apply_currents();
  motion_.driver().set_brake(brake_);
  power(true);
  if (!checked_ || settle) {
    correction_ = 0.0F;
    orientation_.start(kOrientationDegrees, settle, checked_, !directed_);
    checked_ = false;  // Until the homing has ended.
    state_ = JointState::ORIENTATION;
    alone_ = true;
  } else {
    stop(false);
  }
}

void Joint::set_current(const Command& command) {
  const uint8_t percent = command.bytes[0];
  (command.code == Register::SETCURRENT ? drive_percent_ : hold_percent_) = percent;
  if (percent == 0)
    disable();
  else
    apply_currents();
}

void Joint::move(float target, bool alone) {
  goal_ = target;
  state_ = JointState::POSITION;
  alone_ = alone;
}

void Joint::track(const Command& command) {
  if (state_ != JointState::TRACKING) tracker_.start(reference(), motion_.velocity());
  tracker_.setpoint(command.number * kStepsPerDegree,
                    clamp(command.velocity * kStepsPerRpm, -max_velocity_, max_velocity_),
                    command.micros, began_);
  state_ = JointState::TRACKING;
  alone_ = false;
}

void Joint::home(const Command& command) {
  correction_ = 0.0F;
  const bool twice = command.code == Register::HOME;
  const float sensitivity =
      twice ? static_cast<float>(command.bytes[2])
            : fabsf(static_cast<float>(static_cast<int8_t>(command.bytes[2])));
  homing_.start(configuration_, command.bytes[0] != 0, static_cast<float>(command.bytes[1]),
                contact_threshold(sensitivity), command.bytes[3], twice);
  homed_ = homed_ && !twice;
  state_ = twice ? JointState::HOMING : JointState::MOVING_TO_END;
  alone_ = true;
  fed_ = command.micros;
}

void Joint::check_orientation(const Command& command) {
  correction_ = 0.0F;
  orientation_.start(command.number, false, false, !directed_);
  state_ = JointState::ORIENTATION;
  alone_ = true;
  fed_ = command.micros;
}

void Joint::stop(bool hard) {
  if (!powered_) return;
  // The first check was aborted: the motor may turn in the wrong direction.
  enabled_ = enabled_ && checked_;
  stop_deceleration_ = hard ? kHardDeceleration : deceleration_;
  // The limit that the host has set may be near zero, or that of a slow motion: it ends neither a
  // motion that has an acceleration of its own, nor one whose host was lost.
  if (sequence()) {
    stop_deceleration_ = fmaxf(stop_deceleration_, kBriskDeceleration);
    apply_currents();
  }
  if (fault_ != Fault::NONE)
    stop_deceleration_ = fmaxf(stop_deceleration_, configuration_.braking);
  state_ = JointState::STOPPING;
  still_ = 0;
}

// To the bootloader, unless the joint was enabled again since it was asked for.
void Joint::leave() {
  if (leaving_ == 0 || --leaving_ != 0) return;
  if (enabled_ || (state_ != JointState::DISABLED && state_ != JointState::FAULTED)) return;
  power(false);
  // The driver keeps its settings there, and another reset would let go of the enable pin.
  motion_.driver().open_bridge();
  hal_.enter_bootloader();
}

void Joint::disable() {
  enabled_ = false;
  // Current goes off at standstill only: a motor without it does not brake.
  if (state_ != JointState::STOPPING) stop(false);
}

}  // namespace bioscara
