#include "mechanics.h"

#include <algorithm>
#include <cmath>

namespace bioscara::sim {

namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kRotorInertia = 5.5e-6;
constexpr double kPolePairs = 50.0;
// Of the swing of the rotor about its field.
constexpr double kDampingRatio = 0.05;
// Torque ripple at one, two and four times the electrical frequency, as shares of the peak.
constexpr double kRipple1 = 0.08, kRipple2 = 0.04, kRipple4 = 0.03;
// Shorted coils brake with this much [N m s].
constexpr double kShortDamping = 4e-3;
constexpr double kCouplingRatio = 0.1;
constexpr double kWallRatio = 0.4;
constexpr double kFar = 1e9;

// sin(2 pi x) by its own polynomial; the error is below 2e-4, far below that of the model.
double sine(double x) {
  x -= std::nearbyint(x);
  const double y = x * (8.0 - 16.0 * std::fabs(x));
  return y * (0.775 + 0.225 * std::fabs(y));
}

// Friction can stop a motion within the step but never turn it round.
double rub(double speed, double limit) {
  return speed > limit ? speed - limit : speed < -limit ? speed + limit : 0.0;
}

}  // namespace

JointParameters parameters_of(int joint) {
  constexpr double kScrew = -kTwoPi / 0.004;
  switch (joint) {
    case 1:
      return {"j1", 35.0, -3.04647, 3.04647, 0.6, 0.5 / (35.0 * 35.0), 0.010, 0.004, 0.3, 0.0, 16.0};
    case 2:
      return {"j2", kScrew, -0.0016, 0.338, 0.11, 3.6e-6, 0.042, 0.004, 0.0, -39.2 / kScrew, 1.2};
    case 3:
      return {"j3", 24.0, -2.62672, 2.62672, -0.9, 0.05 / (24.0 * 24.0), 0.006, 0.003, 0.3, 0.0, 10.0};
    default:
      return {"j4", 12.0, -3.01069, 3.01069, 0.4, 0.002 / (12.0 * 12.0), 0.004, 0.003, 0.3, 0.0, 5.0};
  }
}

Mechanics::Mechanics(const JointParameters& parameters) : parameters_(parameters) {
  clear_obstacles();
  const double one = parameters.reduction * parameters.lower;
  const double two = parameters.reduction * parameters.upper;
  lower_ = std::min(one, two);
  upper_ = std::max(one, two);
  coupling_damping_ =
      2.0 * kCouplingRatio * std::sqrt(parameters.coupling * parameters.load_inertia);
  const double mass = parameters.load_inertia + (parameters.coupling == 0.0 ? kRotorInertia : 0.0);
  wall_damping_ = 2.0 * kWallRatio * std::sqrt(parameters.stop_stiffness * mass);
  set_position(parameters.initial);
}

void Mechanics::set_position(double position) {
  load_ = rotor_ = parameters_.reduction * position;
  rotor_ += slip_;
  load_speed_ = rotor_speed_ = 0.0;
}

double Mechanics::rotor_turns() const { return rotor_ / kTwoPi; }

void Mechanics::add_obstacle(double position, double stiffness_share) {
  const double place = parameters_.reduction * position;
  (place > load_ ? obstacle_high_ : obstacle_low_) = place;
  obstacle_share_ = stiffness_share;
}

void Mechanics::clear_obstacles() {
  obstacle_low_ = -kFar;
  obstacle_high_ = kFar;
}

void Mechanics::slip(double distance) {
  const double motor = parameters_.reduction * distance;
  slip_ -= motor;
  load_ += motor;
}

double Mechanics::wall_torque() const {
  double torque = 0.0;
  const auto press = [&](double depth, double share, double side) {
    const double force = share * (parameters_.stop_stiffness * depth -
                                  wall_damping_ * load_speed_ * side);
    if (force > 0.0) torque += side * force;
  };
  if (load_ < lower_) press(lower_ - load_, 1.0, 1.0);
  if (load_ > upper_) press(load_ - upper_, 1.0, -1.0);
  if (load_ < obstacle_low_) press(obstacle_low_ - load_, obstacle_share_, 1.0);
  if (load_ > obstacle_high_) press(load_ - obstacle_high_, obstacle_share_, -1.0);
  return torque;
}

void Mechanics::step(double dt, double field, double field_speed, double peak_torque,
                     bool shorted) {
  double motor = 0.0;
  if (peak_torque > 0.0) {
    const double electrical = kPolePairs * rotor_ / kTwoPi;
    const double lead = field / 1024.0 - electrical;
    const double stiffness = peak_torque * kPolePairs;
    const double damping = 2.0 * kDampingRatio * std::sqrt(stiffness * kRotorInertia);
    motor = peak_torque * (sine(lead) + kRipple1 * sine(electrical) +
                           kRipple2 * sine(2.0 * electrical) + kRipple4 * sine(4.0 * electrical)) +
            damping * (field_speed * kTwoPi / 51200.0 - rotor_speed_);
  } else if (shorted) {
    motor = -kShortDamping * rotor_speed_;
  }
  const double outside = wall_torque() + parameters_.gravity + push_;
  const double rubbing = friction_factor_ * parameters_.load_friction;
  if (parameters_.coupling == 0.0) {
    const double mass = kRotorInertia + parameters_.load_inertia;
    rotor_speed_ += (motor + outside) * dt / mass;
    rotor_speed_ = rub(rotor_speed_, (rubbing + parameters_.rotor_friction) * dt / mass);
    load_speed_ = rotor_speed_;
  } else {
    const double twist = rotor_ - slip_ - load_;
    const double through = parameters_.coupling * twist +
                           coupling_damping_ * (rotor_speed_ - load_speed_);
    rotor_speed_ += (motor - through) * dt / kRotorInertia;
    rotor_speed_ = rub(rotor_speed_, parameters_.rotor_friction * dt / kRotorInertia);
    load_speed_ += (through + outside) * dt / parameters_.load_inertia;
    load_speed_ = rub(load_speed_, rubbing * dt / parameters_.load_inertia);
  }
  rotor_ += rotor_speed_ * dt;
  load_ += load_speed_ * dt;
}

}  // namespace bioscara::sim
