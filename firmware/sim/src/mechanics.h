// Rotor, transmission and load of one joint, in motor angles.
#pragma once

#include "spread.h"
#include "virtual_time.h"

namespace bioscara::sim {

// docs/simulation.md gives source and reasoning for each number.
struct JointParameters {
  const char* name;
  // Motor angle per joint unit [rad/rad or rad/m], signed.
  double reduction;
  // End stops [rad or m].
  double lower, upper;
  double initial;
  // Load, seen from the motor [kg m^2]; its friction [N m], and its viscous part [N m s].
  double load_inertia;
  double load_friction;
  double load_viscosity;
  // Friction of the rotor [N m].
  double rotor_friction;
  // Coupling, seen from the motor [N m/rad], 0 where load and rotor are one.
  double coupling;
  // Torque of gravity [N m].
  double gravity;
  // End stops, seen from the motor [N m/rad].
  double stop_stiffness;
};

// Nominal numbers of the joint, and those of one arm, each within its tolerance.
JointParameters parameters_of(int joint);
JointParameters parameters_of(int joint, Spread& spread);

class Mechanics {
 public:
  explicit Mechanics(const JointParameters& parameters);

  // One step with this torque of the motor on its rotor [N m].
  void step(double motor);

  double rotor_turns() const;
  double rotor_speed() const { return rotor_speed_; }
  bool stands() const { return rotor_speed_ == 0.0 && load_speed_ == 0.0; }
  // Position and velocity of the joint [rad or m, and per second].
  double position() const { return load_ / parameters_.reduction; }
  double velocity() const { return load_speed_ / parameters_.reduction; }
  void set_position(double position);

  // A wall at this joint position, which blocks any motion towards it from here. Soft walls yield:
  // stiffness as a share of an end stop's.
  void add_obstacle(double position, double stiffness_share);
  void clear_obstacles();
  // Moves the load against the motor by this much of the joint [rad or m].
  void slip(double distance);
  void set_friction_factor(double factor) { friction_factor_ = factor; }
  // The motor turns alone.
  void take_off_belt() { belt_on_ = false; }
  void remove_stops() { lower_ = -1e9, upper_ = 1e9; }
  // Torque or force applied to the joint by hand [N m or N].
  void push(double force) { push_ = force / parameters_.reduction; }
  // The same from bodies that touch the arm.
  void set_contact(double force) { contact_ = force / parameters_.reduction; }
  double contact() const { return contact_ * parameters_.reduction; }
  // How far it has moved, without jumps such as those of set_position [rad or m].
  double travel() const { return (load_ - jumped_) / parameters_.reduction; }
  // What torques or forces accelerate, with the rotor where it is one with the load [kg m^2 or kg].
  double load_inertia() const;

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
  double contact_ = 0.0;
  double jumped_ = 0.0;
  double friction_factor_ = 1.0;
  bool belt_on_ = true;
  double coupling_damping_ = 0.0;
  // Change of speed per torque in a step: of the load, of load and rotor in one [rad/s per N m].
  double load_gain_ = 0.0, rigid_gain_ = 0.0;
  double wall_damping_ = 0.0;
};

}  // namespace bioscara::sim
