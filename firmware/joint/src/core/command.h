// A checked command in transit from the I2C interrupt to the control tick.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "../generated/registers.h"

namespace bioscara {

struct Command {
  Register code = Register::NONE;
  // Arrived in a version 2 frame.
  bool checked = false;
  // When it arrived.
  uint32_t micros = 0;
  // The payload, by type: bytes, a number, and TRACK's velocity [rpm].
  uint8_t bytes[4] = {};
  int32_t whole = 0;
  float number = 0.0F;
  float velocity = 0.0F;
};

// Written by the interrupt, read by the tick under the board's lock.
class CommandQueue {
 public:
  bool takes(const Command& command) const { return size_ < kCapacity || supersedes(command); }
  // The bytes in use only.
  void push(const Command& command) {
    if (!supersedes(command)) ++size_;
    slots_[last()] = command;
  }
  bool pop(Command& command) {
    if (size_ == 0) return false;
    command = slots_[first_];
    first_ = (first_ + 1) % kCapacity;
    --size_;
    return true;
  }
  bool empty() const { return size_ == 0; }

 private:
  // A setpoint that still waits in the queue is replaced by the next one.
  bool supersedes(const Command& command) const {
    return command.code == Register::TRACK && size_ > 0 &&
           slots_[last()].code == Register::TRACK;
  }
  size_t last() const { return (first_ + size_ - 1) % kCapacity; }

  // At 400 kHz the shortest transaction takes 0.12 ms, so no tick meets more.
  static constexpr size_t kCapacity = 12;
  Command slots_[kCapacity];
  size_t first_ = 0;
  size_t size_ = 0;
};

}  // namespace bioscara
