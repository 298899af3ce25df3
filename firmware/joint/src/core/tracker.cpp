#include "tracker.h"

namespace bioscara {

namespace {

constexpr float kShortest = 0.002F;
constexpr float kLongest = 0.1F;
// How fast the measured interval follows the arrivals.
constexpr float kSmoothing = 0.125F;

}  // namespace

void Tracker::start(float position, float velocity) {
  position_ = goal_ = c0_ = position;
  velocity_ = goal_velocity_ = c1_ = velocity;
  c2_ = c3_ = 0.0F;
  time_ = 0.0F;
  interval_ = kFirstInterval;
  known_ = false;
}

void Tracker::setpoint(float position, float velocity, uint32_t micros) {
  if (known_) {
    const float gap = static_cast<float>(micros - arrival_) * 1e-6F;
    const bool jump = gap > 2.0F * interval_ || gap < 0.5F * interval_;
    interval_ += (jump ? 1.0F : kSmoothing) * (gap - interval_);
    interval_ = clamp(interval_, kShortest, kLongest);
  }
  known_ = true;
  arrival_ = micros;
  goal_ = position;
  goal_velocity_ = velocity;
  // Hermite: from the present reference to the setpoint within one interval.
  const float t = interval_;
  const float way = goal_ - position_;
  c0_ = position_;
  c1_ = velocity_;
  c2_ = (3.0F * way - (2.0F * velocity_ + goal_velocity_) * t) / (t * t);
  c3_ = (-2.0F * way + (velocity_ + goal_velocity_) * t) / (t * t * t);
  time_ = 0.0F;
}

void Tracker::advance() {
  time_ += kTickSeconds;
  if (known_ && time_ < interval_) {
    const float t = time_;
    position_ = c0_ + t * (c1_ + t * (c2_ + t * c3_));
    velocity_ = c1_ + t * (2.0F * c2_ + 3.0F * t * c3_);
  } else {
    const float late = known_ ? time_ - interval_ : 0.0F;
    position_ = goal_ + goal_velocity_ * late;
    velocity_ = goal_velocity_;
  }
}

}  // namespace bioscara
