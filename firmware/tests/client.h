// A host for the tests: frames of both versions to one joint of a simulated arm.
#pragma once

#include <cstring>
#include <initializer_list>
#include <vector>

#include "../joint/src/core/bytes.h"
#include "../sim/src/arm.h"

namespace client {

using bioscara::Flags;
using bioscara::Register;
using bioscara::sim::Arm;
using Bytes = std::vector<std::uint8_t>;

inline Bytes with(std::initializer_list<int> head, float number) {
  Bytes bytes;
  for (int byte : head) bytes.push_back(static_cast<std::uint8_t>(byte));
  bytes.resize(bytes.size() + 4);
  std::memcpy(bytes.data() + bytes.size() - 4, &number, 4);
  return bytes;
}

class Host {
 public:
  Host(Arm& arm, int joint) : arm_(arm), joint_(joint) {}

  std::uint8_t address() const { return static_cast<std::uint8_t>(0x10 + joint_); }

  // Version 1; the answer with its flags last.
  Bytes bare(const Bytes& frame, std::size_t payload = 0) {
    Bytes answer(payload + 1);
    arm_.transfer(address(), frame.data(), frame.size(), answer.data(), answer.size());
    return answer;
  }

  // Version 2 with the next sequence number; the answer without its trailer.
  Bytes send(Register code, const Bytes& payload = {}, std::size_t read = 0) {
    return raw(frame(code, payload, ++sequence_), read);
  }

  Bytes frame(Register code, const Bytes& payload, std::uint8_t sequence) const {
    Bytes bytes{static_cast<std::uint8_t>(code)};
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    bytes.push_back(sequence);
    const auto start = static_cast<std::uint8_t>(address() << 1);
    bytes.push_back(
        bioscara::crc8(bioscara::crc8(0, &start, 1), bytes.data(), bytes.size()));
    return bytes;
  }

  Bytes raw(const Bytes& frame, std::size_t read = 0) {
    Bytes answer(read + 3);
    arm_.transfer(address(), frame.data(), frame.size(), answer.data(), answer.size());
    answer.resize(read + 1);
    return answer;
  }

  void arm_session() {
    const Bytes hello = send(Register::HELLO, {}, 10);
    send(Register::ARM, {hello[6], hello[7], 1, 0});
  }

  void enable(int percent = 20) {
    const auto share = static_cast<std::uint8_t>(percent);
    send(Register::SETUP, {share, share, 0, 0});
    wait_until_idle();
  }

  // As a host of version 1 does it: it can only poll.
  void enable_bare(int percent = 20) {
    const auto share = static_cast<std::uint8_t>(percent);
    bare(Register::SETUP, {share, share, 0, 0});
    do world_.run(0.02);
    while (has(bare(Register::PING, {}, 1).back(), Flags::BUSY));
  }

  // Feeds the watchdog meanwhile, as a host does.
  std::uint8_t wait_until_idle(double limit = 100.0) {
    const double end = arm_.now() + limit;
    std::uint8_t flags = 0;
    do {
      arm_.run(0.02);
      flags = send(Register::WATCHDOG, {60, 0})[0];
    } while ((flags & static_cast<std::uint8_t>(Flags::BUSY)) != 0 && arm_.now() < end);
    return flags;
  }

  std::uint8_t flags() { return send(Register::STATE, {}, 10)[10]; }
  bioscara::Fault fault() { return static_cast<bioscara::Fault>(send(Register::FAULT, {}, 10)[0]); }
  bioscara::sim::Board& board() { return arm_.board(joint_); }
  std::uint8_t sequence() const { return sequence_; }

 private:
  Arm& arm_;
  int joint_;
  std::uint8_t sequence_ = 100;
};

}  // namespace client
