// Four boards on one bus, in virtual time.
#pragma once

#include <array>
#include <cstdint>
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

  // The firmware flashed on each joint, j1 first.
  using Firmwares = std::array<Firmware, kJoints>;

  Arm(std::uint32_t seed, Timing timing, const Firmwares& firmwares);
  // Another arm in the same state, at the same time.
  Arm(const Arm& other);
  Arm& operator=(const Arm&) = delete;

  double now() const { return static_cast<double>(now_) / kSecond; }
  void run(double seconds);

  // One transaction; time passes as it would on the bus.
  Outcome transfer(std::uint8_t address, const std::uint8_t* written, std::size_t size,
                   std::uint8_t* read, std::size_t count);

  Board& board(int joint) { return *boards_.at(static_cast<std::size_t>(joint - 1)); }
  // The clock line held low by a joint for this long in each transaction [s].
  void set_stretch(double seconds) { stretch_ = seconds; }

 private:
  void pass(double seconds);
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
};

}  // namespace bioscara::sim
