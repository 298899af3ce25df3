// Detects the end stop: the field moves on, the rotor does not, and the lead of the field grows
// against its earlier value at the same place of the electrical period.
#pragma once

#include "units.h"

namespace bioscara {

class Touch {
 public:
  // Contact counts from this growth of the lead [steps], in this direction of motion.
  void start(float threshold, float direction, float field, float encoder) {
    threshold_ = threshold;
    direction_ = direction;
    first_lead_ = (field - encoder) * direction_;
    count_ = ticks_ = above_ = near_ = 0;
  }

  // One tick. While the motor accelerates its own inertia holds the rotor back, so until then
  // only a lead near pull-out counts.
  bool update(float field, float encoder, bool at_speed) {
    const float lead = (field - encoder) * direction_;
    const float place = encoder * direction_;
    near_ = lead - first_lead_ > kPullOut ? near_ + 1 : 0;
    if (near_ >= 2) return true;
    if (!at_speed) {
      count_ = ticks_ = above_ = 0;
      return false;
    }
    ++ticks_;
    if (count_ == 0) next_ = place;
    for (int i = 0; i < kSamples && place >= next_; ++i) {
      leads_[count_++ % kSamples] = lead;
      next_ += kSpacing;
    }
    if (count_ < kSamples) return false;
    const float since = 1.0F - (next_ - place) / kSpacing;
    const float before = usual(1);
    growth_ = lead - before - since * (usual(0) - before);
    place_ = place;
    above_ = growth_ > threshold_ ? above_ + 1 : 0;
    return ticks_ > kBlanking && above_ >= kFelt;
  }

  // Where the resistance began [steps]. Behind a belt or an elastic stop the torque rises in
  // proportion to the travel, so a straight line through the measured samples leads back to zero
  // torque.
  float onset(float encoder) const {
    if (count_ < kSamples) return encoder;
    float x = 0.0F;
    float y = torque(growth_);
    const float floor = kFloor * y;
    float n = 0.0F, sum_x = 0.0F, sum_y = 0.0F, sum_xx = 0.0F, sum_xy = 0.0F;
    for (int back = 1; back <= kPeriod && y > floor; ++back) {
      n += 1.0F;
      sum_x += x;
      sum_y += y;
      sum_xx += x * x;
      sum_xy += x * y;
      x = next_ - static_cast<float>(back) * kSpacing - place_;
      y = torque(lead(back) - usual(back));
    }
    const float slope = (n * sum_xy - sum_x * sum_y) / (n * sum_xx - sum_x * sum_x);
    // A single point gives no line.
    if (!(slope > kSlopeLeast)) return encoder;
    return (place_ + (sum_x - sum_y / slope) / n) * direction_;
  }

 private:
  // The sample taken this many samples ago, 1 being the latest.
  float lead(int back) const { return leads_[(count_ - back) % kSamples]; }

  // The lead expected here in free running: ripple and detent repeat each period, and the encoder's
  // own error over a turn goes on as it did between the periods before.
  float usual(int back) const {
    return lead(back + 2 * kPeriod) + mean(2 * kPeriod) - mean(4 * kPeriod);
  }

  float mean(int back) const {
    float sum = 0.0F;
    for (int i = 1; i <= kPeriod; ++i) sum += lead(back + i);
    return sum / kPeriod;
  }

  // Share of the full torque: the sine, by its power series, whose next term is less than half of
  // the last bit up to a quarter of a turn. The C libraries of board and simulation have sines that
  // differ in their last bit.
  static float torque(float growth) {
    const float angle =
        clamp(growth, 0.0F, 0.25F * kElectricalPeriod) * (6.2831853F / kElectricalPeriod);
    const float square = angle * angle;
    float series = 1.0F;
    for (float order = 11.0F; order > 1.0F; order -= 2.0F)
      series = 1.0F - series * square / (order * (order - 1.0F));
    return angle * series;
  }

  // At least so long at speed, until a load has swung out behind its belt [ticks].
  static constexpr int kBlanking = 150;
  // Ticks in a row that must show the contact.
  static constexpr int kFelt = 3;
  static constexpr float kPullOut = 400.0F;
  // Samples over an electrical period, and the travel of the rotor between two.
  static constexpr int kPeriod = 16;
  static constexpr float kSpacing = kElectricalPeriod / kPeriod;
  static constexpr int kSamples = 5 * kPeriod;
  // Less than this share of the last torque is noise; a rise of less than this per step, no stop.
  static constexpr float kFloor = 0.15F;
  static constexpr float kSlopeLeast = 1e-4F;

  // The lead of the field, each time the rotor has moved on by kSpacing.
  float leads_[kSamples] = {};
  int count_ = 0;
  float next_ = 0.0F;
  float threshold_ = 0.0F;
  float direction_ = 1.0F;
  float first_lead_ = 0.0F;
  float place_ = 0.0F, growth_ = 0.0F;
  int ticks_ = 0;
  int above_ = 0, near_ = 0;
};

}  // namespace bioscara
