// Four boards on one bus, in virtual time.
#pragma once

#include <array>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <vector>

#include "board.h"

namespace bioscara::sim {

enum class Outcome : std::uint8_t { OK, NO_ACKNOWLEDGE, TIMEOUT };

struct Timing {
  // 0 for a bus that takes no time.
  double frequency = 100e3;
  // Overhead of the host for each transaction [s].
  double overhead = 105e-6;
};

class Arm {
 public:
  static constexpr int kJoints = 4;
  // Time from one step of a world to the next: 20 steps of the mechanics.
  static constexpr Time kSlice = 10'240;

  // Bodies around the arm, which another simulator computes. It sees the joints as they were a
  // slice ago, with their mean velocity in the slice before that, and what changed it since. With
  // these it moves its own bodies, and its image of the arm, by that slice: the image is then where
  // the joints are. The torques or forces of bodies on the joints act during the next slice.
  struct World {
    // Of the joints, j1 first [rad or m, and per second; N m or N].
    double *position, *velocity, *drive;
    const double* contact;
    std::function<void()> step;
  };

  // The firmware flashed on each joint, j1 first.
  using Firmwares = std::array<Firmware, kJoints>;

  Arm(std::uint32_t seed, Timing timing, const Firmwares& firmwares);
  // Another arm in the same state, at the same time.
  Arm(const Arm& other);
  Arm& operator=(const Arm&) = delete;

  // Takes the state and the time of another arm, and keeps its own world.
  void assign(const Arm& other);

  double now() const { return static_cast<double>(now_) / kSecond; }
  // Throws the exception of a step of the world, once the time has passed; it then has no world.
  void run(double seconds);
  // A world that is stepped at each multiple of the slice from now on.
  void set_world(World world);
  void remove_world();

  // One transaction; time passes as it would on the bus, and it throws as run() does.
  Outcome transfer(std::uint8_t address, const std::uint8_t* written, std::size_t size,
                   std::uint8_t* read, std::size_t count);

  Board& board(int joint) { return *boards_.at(static_cast<std::size_t>(joint - 1)); }
  // The clock line held low by a joint for this long in each transaction [s].
  void set_stretch(double seconds) { stretch_ = seconds; }

 private:
  Outcome exchange(std::uint8_t address, const std::uint8_t* written, std::size_t size,
                   std::uint8_t* read, std::size_t count);
  void pass(double seconds);
  void elapse(double seconds);
  void advance(Time now);
  void step_world();
  void rethrow();
  // The adapter waits for the clock line in vain.
  Outcome hold_clock();
  Board* find(std::uint8_t address);
  // The part of a joint that only knows version 1.
  void receive_version_1(Board& board, const std::uint8_t* written, std::size_t size);

  std::vector<std::unique_ptr<Board>> boards_;
  Timing timing_;
  bool unknown_ = false;
  double stretch_ = 0.0;
  Time now_ = 0;
  World world_{};
  std::exception_ptr failure_;
  // The joints a slice ago, and torques or forces of contact in the slice before that.
  std::array<double, kJoints> travel_{}, velocity_{}, contact_{};
};

}  // namespace bioscara::sim
