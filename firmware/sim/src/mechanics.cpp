#include "mechanics.h"

#include <algorithm>
#include <cmath>

namespace bioscara::sim {

namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kRotorInertia = 5.5e-6;
// Damping ratio of a load that swings behind its belt.
constexpr double kCouplingRatio = 0.1;
// Change of the rotor's speed per torque in a step [rad/s per N m].
constexpr double kRotorGain = kStep / kRotorInertia;
constexpr double kWallRatio = 0.4;
constexpr double kFar = 1e9;

// Friction can stop a motion within the step but never turn it round.
double rub(double speed, double limit) {
  return speed > limit ? speed - limit : speed < -limit ? speed + limit : 0.0;
}

// How far arms differ (docs/simulation.md).
constexpr double kFrictionTolerance = 0.1;
constexpr double kInertiaTolerance = 0.05;
constexpr double kCouplingTolerance = 0.1;

}  // namespace

JointParameters parameters_of(int joint) {
  constexpr double kScrew = -kTwoPi / 0.004;
  constexpr double kMass = 4.0;  // Mass lifted by J2 [kg].
  constexpr double kRotor = 0.0072;
  switch (joint) {
    case 1:
      return {"j1", 35.0,  -3.04647, 3.04647, 0.6, 0.31 / (35.0 * 35.0), 0.007, 1e-3,
              kRotor, 0.186, 0.0,    16.0};
    case 2:
      return {"j2", kScrew, -0.0016, 0.338, 0.11, kMass / (kScrew * kScrew), 0.039, 1.6e-3,
              kRotor, 0.0, -9.81 * kMass / kScrew, 1.2};
    case 3:
      return {"j3", 24.0,  -2.62672, 2.62672, -0.9, 0.05 / (24.0 * 24.0), 0.002, 1.3e-4,
              kRotor, 0.3, 0.0,      10.0};
    default:
      return {"j4", 12.0,  -3.01069, 3.01069, 0.4, 0.002 / (12.0 * 12.0), 0.001, 0.0,
              kRotor, 0.3, 0.0,      5.0};
  }
}

JointParameters parameters_of(int joint, Spread& spread) {
  JointParameters made = parameters_of(joint);
  const double rubbing = spread.factor(kFrictionTolerance);
  made.load_friction *= rubbing;
  made.load_viscosity *= rubbing;
  made.rotor_friction *= spread.factor(kFrictionTolerance);
  made.load_inertia *= spread.factor(kInertiaTolerance);
  made.coupling *= spread.factor(kCouplingTolerance);
  return made;
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
  load_gain_ = kStep / parameters.load_inertia;
  rigid_gain_ = kStep / (kRotorInertia + parameters.load_inertia);
  set_position(parameters.initial);
}

void Mechanics::set_position(double position) {
  const double before = load_;
  load_ = rotor_ = parameters_.reduction * position;
  jumped_ += load_ - before;
  rotor_ += slip_;
  load_speed_ = rotor_speed_ = 0.0;
}

double Mechanics::load_inertia() const {
  const double rotor = parameters_.coupling == 0.0 ? kRotorInertia : 0.0;
  return (parameters_.load_inertia + rotor) * parameters_.reduction * parameters_.reduction;
}

double Mechanics::rotor_turns() const { return rotor_ * (1.0 / kTwoPi); }

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
  jumped_ += motor;
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

void Mechanics::step(double motor) {
  const double rotor_rub = parameters_.rotor_friction * kRotorGain;
  if (!belt_on_) {
    rotor_speed_ = rub(rotor_speed_ + motor * kRotorGain, rotor_rub);
    rotor_ += rotor_speed_ * kStep;
    return;
  }
  const double outside = wall_torque() + parameters_.gravity + push_ + contact_ -
                         parameters_.load_viscosity * load_speed_;
  const double rubbing = friction_factor_ * parameters_.load_friction;
  if (parameters_.coupling == 0.0) {
    rotor_speed_ = rub(rotor_speed_ + (motor + outside) * rigid_gain_,
                       (rubbing + parameters_.rotor_friction) * rigid_gain_);
    load_speed_ = rotor_speed_;
  } else {
    const double twist = rotor_ - slip_ - load_;
    const double through = parameters_.coupling * twist +
                           coupling_damping_ * (rotor_speed_ - load_speed_);
    rotor_speed_ = rub(rotor_speed_ + (motor - through) * kRotorGain, rotor_rub);
    load_speed_ = rub(load_speed_ + (through + outside) * load_gain_, rubbing * load_gain_);
  }
  rotor_ += rotor_speed_ * kStep;
  load_ += load_speed_ * kStep;
}

}  // namespace bioscara::sim
