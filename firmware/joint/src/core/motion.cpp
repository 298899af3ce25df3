#include "motion.h"

#include <math.h>

namespace bioscara {

namespace {

// How far ahead a running motor's target is set, beyond its braking distance [s].
constexpr float kAhead = 0.05F;
// Following: gain on the position error [1/s], braking margin [s], slowest approach [steps/s].
constexpr float kGain = 60.0F;
constexpr float kMargin = 0.003F;
constexpr float kCreep = 200.0F;
// The driver may accelerate a little harder than the reference, so that it can catch up.
constexpr float kReserve = 1.15F;
// Share of the acceleration that may go into catching up.
constexpr float kCatchUp = 0.5F;
// Half of the range of the driver's counter, 20000 turns.
constexpr float kFarthest = 1e9F;

int32_t rounded(float position) {
  return static_cast<int32_t>(lroundf(clamp(position, -kFarthest, kFarthest)));
}

// How far ahead a target must be to hold this speed until it is renewed.
float reach(float speed, float deceleration) {
  return speed * speed / (2.0F * deceleration) + speed * kAhead;
}

}  // namespace

void Motion::aim(float target) {
  goal_ = target_ = rounded(target);
  driver_.set_target(target_);
}

// A ramp that was disturbed while it braked stops where it should, a little harder.
float Motion::braking(float target, float deceleration) const {
  const float left = target - position(), speed = velocity();
  if (!driver_.disturbed() || left * speed <= 0.0F) return deceleration;
  const float needed = speed * speed / (2.0F * fabsf(left));
  return needed > deceleration && needed < kReserve * deceleration ? needed : deceleration;
}

void Motion::go(float target, float speed, float acceleration, float deceleration) {
  driver_.set_acceleration(acceleration, braking(target, deceleration));
  const float ahead = reach(fmaxf(speed, fabsf(velocity())), deceleration);
  // The target last: it returns the value of the speed's datagram.
  driver_.set_speed(speed);
  aim(clamp(target, position() - ahead, position() + ahead));
  goal_ = rounded(target);
}

void Motion::run(float velocity, float acceleration, float deceleration) {
  if (velocity == 0.0F) {
    stop(deceleration);
    return;
  }
  driver_.set_acceleration(acceleration, deceleration);
  const float fastest = fmaxf(fabsf(velocity), fabsf(this->velocity()));
  driver_.set_speed(velocity);
  aim(position() + copysignf(reach(fastest, deceleration), velocity));
}

void Motion::follow(float position, float velocity, float limit, float acceleration) {
  const float strength = fminf(acceleration * kReserve, kHardDeceleration);
  driver_.set_acceleration(strength, strength);
  const float error = position - this->position();
  // Far from the reference the excess speed is limited to one that can still be braked in time.
  const float excess =
      fminf(kGain * fabsf(error), sqrtf(2.0F * kCatchUp * acceleration * fabsf(error)));
  const float wanted = velocity + copysignf(excess, error);
  // Target at which the driver's own braking ramp passes the reference at speed.
  const float lead = velocity * fabsf(velocity) / (2.0F * strength) + velocity * kMargin;
  driver_.set_speed(clamp(fabsf(wanted), kCreep, limit * 1.1F + kCreep));
  aim(position + lead);
}

void Motion::stop(float deceleration) {
  driver_.set_acceleration(deceleration, deceleration);
  driver_.set_speed(0.0F);
  if (standing()) {
    goal_ = target_ = driver_.position();
    driver_.set_target(target_);
  }
}

void Motion::rename(float position) {
  goal_ = target_ = rounded(position);
  driver_.set_position(target_);
}

}  // namespace bioscara
