#include "tracker.h"

#include <math.h>

namespace bioscara {

namespace {

constexpr float kShortest = 0.002F;
constexpr float kLongest = 0.1F;
// How fast the measured interval follows the arrivals.
constexpr float kSmoothing = 0.125F;

bool alike(float one, float other) { return one < 1.5F * other && other < 1.5F * one; }

}  // namespace

void Tracker::start(float position, float velocity) {
  position_ = goal_ = c0_ = position;
  velocity_ = goal_velocity_ = c1_ = velocity;
  c2_ = c3_ = 0.0F;
  time_ = duration_ = 0.0F;
  interval_ = kFirstInterval;
  gap_ = 0.0F;
  known_ = false;
}

void Tracker::setpoint(float position, float velocity, uint32_t arrival, uint32_t tick) {
  if (known_) {
    const float gap = static_cast<float>(arrival - arrival_) * 1e-6F;
    // One gap alone that is longer or shorter is a setpoint that was lost or late.
    const bool usual = alike(gap, interval_);
    if (gap_ == 0.0F || (!usual && alike(gap, gap_)))
      interval_ = gap;
    else if (usual)
      interval_ += kSmoothing * (gap - interval_);
    interval_ = clamp(interval_, kShortest, kLongest);
    gap_ = gap;
  }
  known_ = true;
  arrival_ = arrival;
  goal_ = position;
  goal_velocity_ = velocity;
  // Hermite: from the present reference, which is that of the tick before, to the setpoint. The
  // end counts from the arrival and not from the tick: setpoints that arrive next to a tick fall
  // before it or after it by chance, and a millisecond more or less would shake the joint. A frame
  // may also arrive after the tick began: the difference is signed.
  const float age = static_cast<float>(static_cast<int32_t>(tick - arrival)) * 1e-6F;
  duration_ = fmaxf(interval_ + kTickSeconds - age, kTickSeconds);
  const float t = duration_;
  const float way = goal_ - position_;
  c0_ = position_;
  c1_ = velocity_;
  c2_ = (3.0F * way - (2.0F * velocity_ + goal_velocity_) * t) / (t * t);
  c3_ = (-2.0F * way + (velocity_ + goal_velocity_) * t) / (t * t * t);
  time_ = 0.0F;
}

void Tracker::advance() {
  time_ += kTickSeconds;
  if (known_ && time_ < duration_) {
    const float t = time_;
    position_ = c0_ + t * (c1_ + t * (c2_ + t * c3_));
    velocity_ = c1_ + t * (2.0F * c2_ + 3.0F * t * c3_);
  } else {
    const float late = known_ ? time_ - duration_ : 0.0F;
    position_ = goal_ + goal_velocity_ * late;
    velocity_ = goal_velocity_;
  }
}

}  // namespace bioscara
