// Feels the end stop: the field moves on, the rotor does not, and the error between them grows
// beyond what running freely needs.
#pragma once

#include <math.h>

#include "units.h"

namespace bioscara {

class Touch {
 public:
  // Contact counts from this growth of the error [steps], in this direction of motion. A slow
  // touch measures its baseline once: a soft belt makes the torque rise so gently that a baseline
  // that follows would swallow it.
  // `follow`: share of the error by which the baseline of a fast touch moves each tick.
  void start(float threshold, float direction, float error, bool slow, float follow = kFollow) {
    slow_ = slow;
    follow_ = follow;
    begun_ = false;
    threshold_ = threshold;
    direction_ = direction;
    baseline_ = error;
    ticks_ = 0;
    above_ = 0;
  }

  // One tick. While the motor accelerates its own inertia holds the rotor back, so until then
  // only an error near pull-out counts.
  bool update(float encoder, float error, bool at_speed) {
    const float growth = (error - baseline_) * direction_;
    note(encoder, growth);
    ticks_ = at_speed ? ticks_ + 1 : 0;
    const bool settled = ticks_ > (slow_ ? kMeasured : kBlanking);
    const float limit = settled ? threshold_ : fmaxf(threshold_, kPullOut);
    above_ = growth > limit ? above_ + 1 : 0;
    // From the moment of full speed until contact counts, whatever it is belongs to running freely.
    const bool follows = !settled ? ticks_ > (slow_ ? kMeasured / 2 : 0)
                                  : !slow_ && fabsf(growth) < 0.5F * threshold_;
    if (follows) baseline_ += (slow_ ? kFollow : follow_) * (error - baseline_);
    return above_ >= 2;
  }

  // Where the resistance began [steps]: the belt gives way before the threshold is reached, so the
  // torques at a quarter of it and at contact are drawn back to none.
  float onset() const {
    const float rise = last_torque_ - first_torque_;
    if (!begun_ || rise < 0.05F) return last_;
    return first_ - first_torque_ * (last_ - first_) / rise;
  }

 private:
  void note(float encoder, float growth) {
    const float angle = clamp(growth, 0.0F, 0.25F * kElectricalPeriod);
    last_ = encoder;
    last_torque_ = sinf(angle * (6.2831853F / kElectricalPeriod));
    if (growth < 0.25F * threshold_) {
      begun_ = false;
    } else if (!begun_) {
      begun_ = true;
      first_ = last_;
      first_torque_ = last_torque_;
    }
  }

  static constexpr int kBlanking = 150;
  // The baseline follows friction and the encoder's error over a turn, not a contact.
  static constexpr float kFollow = 0.02F;
  static constexpr int kMeasured = 300;
  static constexpr float kPullOut = 400.0F;

  float threshold_ = 0.0F;
  float follow_ = kFollow;
  float direction_ = 1.0F;
  float baseline_ = 0.0F;
  int ticks_ = 0;
  int above_ = 0;
  bool slow_ = false;
  bool begun_ = false;
  float first_ = 0.0F, first_torque_ = 0.0F;
  float last_ = 0.0F, last_torque_ = 0.0F;
};

}  // namespace bioscara
