// The hardware at the pins of one joint's controller: both chips, motor, mechanics. For a
// controller that is emulated outside.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "board.h"

namespace bioscara::sim {

class Plant {
 public:
  Plant(int joint, std::uint32_t seed) : board_(joint, seed, Firmware::ELSEWHERE) {}

  double now() const { return static_cast<double>(now_) / kSecond; }
  // Lets time pass up to this many seconds since the beginning.
  void advance(double until) {
    const auto time = static_cast<Time>(std::llround(until * kSecond));
    if (time < now_) throw std::invalid_argument("time cannot run backwards");
    board_.advance(now_ = time);
  }

  // The driver is selected: the bytes that it shifts out.
  std::array<std::uint8_t, 5> driver_answer() {
    std::uint8_t received[5];
    board_.driver().answer(received);
    return {received[0], received[1], received[2], received[3], received[4]};
  }
  // ... and deselected after these bytes.
  void driver_accept(const std::uint8_t (&sent)[5]) { board_.driver().accept(sent); }

  void encoder_exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) {
    board_.wires().encoder_exchange(command, words, count);
  }

  // The driver's enable pin.
  void enable(bool on) { board_.wires().driver_enable(on); }

  Board& board() { return board_; }

 private:
  Board board_;
  Time now_ = 0;
};

}  // namespace bioscara::sim
