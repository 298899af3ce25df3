// The stepper motor and the chopper that feeds it: coil currents, torque, drag.
#pragma once

#include <cstdint>

#include "virtual_time.h"

namespace bioscara::sim {

// Properties that differ from motor to motor; docs/simulation.md gives source and tolerance.
struct MotorParameters {
  // Peak torque per ampere of phase current, and back-EMF per rad/s [N m/A, V s/rad].
  double torque_constant = 0.19;
  // Drag of the magnet that turns in the iron, at low speed [N m s].
  double drag = 6.05e-4;
};

// How the driver feeds the coils during a step.
struct Supply {
  // Target position of the field [microsteps of 1/1024 electrical period].
  double field;
  // Amplitude of the requested phase currents [A]; 0 with an open bridge.
  double current;
  // The current is chopped, not voltage-controlled: it deviates from its target all the time.
  bool chopped;
  // Both coils shorted.
  bool shorted;
};

inline bool operator==(const Supply& one, const Supply& two) {
  return one.field == two.field && one.current == two.current && one.chopped == two.chopped &&
         one.shorted == two.shorted;
}

class Motor {
 public:
  Motor(const MotorParameters& parameters, std::uint32_t seed)
      : parameters_(parameters), random_(seed) {}

  // The torque on the rotor [N m] that stands at `turns` and turns at `speed` [rad/s], one step
  // later.
  double torque(const Supply& supply, double turns, double speed);
  // The last step changed neither current, and the torque was free of noise.
  bool settled() const { return settled_; }

 private:
  // Lets the chopper bring one phase current towards its target.
  static void drive(double& current, double wanted, double emf);
  double noise();

  const MotorParameters parameters_;
  double current_a_ = 0.0, current_b_ = 0.0;
  bool settled_ = false;
  std::uint32_t random_;
};

}  // namespace bioscara::sim
