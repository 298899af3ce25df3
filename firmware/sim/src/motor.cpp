#include "motor.h"

#include <algorithm>
#include <cmath>

namespace bioscara::sim {

namespace {

constexpr double kPolePairs = 50.0;
// Supply [V], resistance [ohm] and inductance [H] of a phase.
constexpr double kVoltage = 24.0;
constexpr double kResistance = 1.65;
constexpr double kInductance = 3.2e-3;
// Offset of the current comparators [A]: a torque once in an electrical period. Seen from the
// turning field it also changes the rotor's stiffness once in a period, which makes the rotor swing
// where the period is half that of its swing.
constexpr double kOffset = 0.081;
// Harmonics of the flux: torque ripple at twice the electrical frequency, as a share of the peak,
// and detent torque at four times [N m]; its sign ends the rotor's swing at 30 rad/s when the speed
// falls.
constexpr double kRipple2 = 0.02;
constexpr double kDetent = -3e-3;
// Eddy currents weaken the field that makes them: the drag of the iron ends its rise here [rad/s].
constexpr double kDragKnee = 40.0;
// Noise of the torque under chopped current, as a share of its peak (rms of a step).
constexpr double kNoise = 0.05;
constexpr double kRootOfTwelve = 3.4641;

// sin(2 pi x) by its own polynomial; the error is below 1.1e-3, far below that of the model.
double sine(double x) {
  x -= static_cast<double>(static_cast<std::int64_t>(x < 0.0 ? x - 0.5 : x + 0.5));
  const double y = x * (8.0 - 16.0 * std::fabs(x));
  return y * (0.775 + 0.225 * std::fabs(y));
}

}  // namespace

double Motor::noise() {
  random_ = random_ * 1664525U + 1013904223U;
  return static_cast<double>(random_ >> 8) / 16777216.0 - 0.5;
}

void Motor::drive(double& current, double wanted, double emf) {
  const double used = kResistance * current + emf;
  const double needed = used + (wanted - current) * (kInductance / kStep);
  const double voltage = std::clamp(needed, -kVoltage, kVoltage);
  current += (voltage - used) * (kStep / kInductance);
}

double Motor::torque(const Supply& supply, double turns, double speed) {
  const double drag = -parameters_.drag * speed / (1.0 + std::fabs(speed) / kDragKnee);
  const double before_a = current_a_, before_b = current_b_;
  if (supply.current == 0.0 && !supply.shorted) {
    current_a_ = current_b_ = 0.0;
    settled_ = before_a == 0.0 && before_b == 0.0;
    return drag;
  }
  const double angle = kPolePairs * turns;
  const double s = sine(angle), c = sine(angle + 0.25);
  const double k = parameters_.torque_constant;
  const double emf_a = -k * speed * s, emf_b = k * speed * c;
  if (supply.shorted) {
    current_a_ -= (kResistance * current_a_ + emf_a) * (kStep / kInductance);
    current_b_ -= (kResistance * current_b_ + emf_b) * (kStep / kInductance);
  } else {
    const double field = supply.field / 1024.0;
    drive(current_a_, supply.current * sine(field + 0.25) - kOffset, emf_a);
    drive(current_b_, supply.current * sine(field), emf_b);
  }
  settled_ = !supply.chopped && current_a_ == before_a && current_b_ == before_b;
  const double peak = k * supply.current;
  const double s2 = 2.0 * s * c, c2 = 1.0 - 2.0 * s * s;
  const double unsteady = supply.chopped ? kNoise * kRootOfTwelve * noise() : 0.0;
  return k * (current_b_ * c - current_a_ * s) +
         peak * (kRipple2 * s2 + unsteady) + kDetent * 2.0 * s2 * c2 + drag;
}

}  // namespace bioscara::sim
