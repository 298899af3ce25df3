// Rotor, transmission and load of one joint, in motor angles.
#pragma once

#include <cstdint>

namespace bioscara::sim {

// docs/simulation.md gives source and reasoning for each number.
struct JointParameters {
  const char* name;
  // Motor angle per joint unit [rad/rad or rad/m], signed.
  double reduction;
  // End stops [rad or m].
  double lower, upper;
  double initial;
  // Load, seen from the motor [kg m^2]; friction there and at the rotor [N m].
  double load_inertia;
  double load_friction;
  double rotor_friction;
  // Coupling, seen from the motor [N m/rad], 0 where load and rotor are one; damping ratio.
  double coupling;
  // Torque of gravity [N m].
  double gravity;
  // End stops, seen from the motor [N m/rad].
  double stop_stiffness;
};

JointParameters parameters_of(int joint);

class Mechanics {
 public:
  explicit Mechanics(const JointParameters& parameters);

  // One step of `dt` [s] with this field [microsteps, microsteps/s] and peak torque [N m].
  void step(double dt, double field, double field_speed, double peak_torque, bool shorted);

  double rotor_turns() const;
  // What the joint does [rad or m, and per second].
  double position() const { return load_ / parameters_.reduction; }
  double velocity() const { return load_speed_ / parameters_.reduction; }
  void set_position(double position);

  // A wall at this joint position, in the way of whatever moves towards it from here. Soft walls
  // yield: stiffness as a share of an end stop's.
  void add_obstacle(double position, double stiffness_share);
  void clear_obstacles();
  // Moves the load against the motor by this much of the joint [rad or m].
  void slip(double distance);
  void set_friction_factor(double factor) { friction_factor_ = factor; }
  void remove_stops() { lower_ = -1e9, upper_ = 1e9; }
  // The hand of a person: torque on the joint [N m or N].
  void push(double force) { push_ = force / parameters_.reduction; }

  const JointParameters& parameters() const { return parameters_; }

 private:
  double wall_torque() const;

  const JointParameters parameters_;
  double lower_, upper_;
  double obstacle_low_, obstacle_high_, obstacle_share_ = 1.0;
  double rotor_ = 0.0, rotor_speed_ = 0.0;
  double load_ = 0.0, load_speed_ = 0.0;
  double slip_ = 0.0;
  double push_ = 0.0;
  double friction_factor_ = 1.0;
  double coupling_damping_ = 0.0;
  double wall_damping_ = 0.0;
};

}  // namespace bioscara::sim
