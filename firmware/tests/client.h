// A host for the tests: frames of both versions to one joint, of a simulated arm or on the bench.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <vector>

#include "../joint/src/core/bytes.h"
#include "../joint/src/core/status.h"

namespace client {

using bioscara::Fault;
using bioscara::Flags;
using bioscara::JointState;
using bioscara::Refusal;
using bioscara::Register;
using Bytes = std::vector<std::uint8_t>;

inline bool has(std::uint8_t flags, Flags flag) {
  return (flags & static_cast<std::uint8_t>(flag)) != 0;
}

template <typename T>
Bytes packed(T value) {
  Bytes bytes(sizeof(T));
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

inline Bytes setpoint(float degrees, float rpm) {
  Bytes bytes = packed(degrees);
  const Bytes speed = packed(static_cast<std::int16_t>(std::lround(rpm * 10.0F)));
  bytes.insert(bytes.end(), speed.begin(), speed.end());
  return bytes;
}

struct FaultReport {
  Fault fault;
  float data;
  Refusal refusal;
  std::uint16_t crc_errors;
  std::uint16_t refusals;
};

struct State {
  float degrees;
  float rpm;
  JointState state;
  std::uint8_t load_percent;
  std::uint8_t flags;
};

template <typename World>
class Host {
 public:
  Host(World& world, int joint) : world_(world), joint_(joint) {}

  std::uint8_t address() const { return static_cast<std::uint8_t>(0x10 + joint_); }

  // Version 1; the answer with its flags last.
  Bytes bare(Register code, const Bytes& payload = {}, std::size_t read = 0) {
    Bytes frame{static_cast<std::uint8_t>(code)};
    frame.insert(frame.end(), payload.begin(), payload.end());
    return exchange(frame, read + 1);
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
    bytes.push_back(bioscara::crc8(bioscara::crc8(0, &start, 1), bytes.data(), bytes.size()));
    return bytes;
  }

  Bytes raw(const Bytes& frame, std::size_t read = 0) {
    Bytes answer = exchange(frame, read + 3);
    answer.resize(read + 1);
    return answer;
  }

  // Exactly these bytes.
  Bytes exchange(const Bytes& frame, std::size_t read) {
    Bytes answer(read);
    world_.transfer(address(), frame.data(), frame.size(), answer.data(), read);
    return answer;
  }

  Bytes hello() { return raw(frame(Register::HELLO, {}, sequence_), 10); }

  void arm_session() {
    const Bytes answer = hello();
    send(Register::ARM, {answer[6], answer[7], 1, 0});
  }

  // Armed, checked, engaged, watched for stalls, with the limits of the arm [motor rad].
  void enable(int percent = 20, double speed = 120.0, double acceleration = 336.0,
              std::uint8_t sensitivity = 6) {
    constexpr double kDegrees = 57.29577951308232;
    const auto share = static_cast<std::uint8_t>(percent);
    send(Register::SETUP, {share, share, 0, 0});
    wait_until_idle();
    send(Register::ENABLESTALLGUARD, {sensitivity});
    send(Register::SETMAXACCELERATION, packed(static_cast<float>(acceleration * kDegrees)));
    send(Register::SETMAXVELOCITY, packed(static_cast<float>(speed * kDegrees)));
  }

  // As a host of version 1, which can only poll.
  void enable_bare(int percent = 20) {
    const auto share = static_cast<std::uint8_t>(percent);
    bare(Register::SETUP, {share, share, 0, 0});
    for (int poll = 0; poll < 200; ++poll) {
      world_.run(0.02);
      if (!has(bare(Register::PING, {}, 1).back(), Flags::BUSY)) return;
    }
  }

  // Feeds the watchdog while it waits, as a host does.
  std::uint8_t keep(double seconds) {
    std::uint8_t answer = 0;
    // A bench runs in whole ticks.
    for (double end = world_.now() + seconds; world_.now() < end - 5e-4;) {
      answer = send(Register::WATCHDOG, {60, 0})[0];
      world_.run(std::min(0.02, end - world_.now()));
    }
    return answer;
  }

  std::uint8_t wait_until_idle(double limit = 100.0) {
    std::uint8_t flags = 0;
    double end = world_.now() + limit;
    do {
      world_.run(0.02);
      flags = send(Register::WATCHDOG, {60, 0})[0];
    } while (has(flags, Flags::BUSY) && world_.now() < end);
    return flags;
  }

  void home(bool positive, int rpm, int sensitivity, int percent) {
    send(Register::HOME, {static_cast<std::uint8_t>(positive), static_cast<std::uint8_t>(rpm),
                          static_cast<std::uint8_t>(sensitivity),
                          static_cast<std::uint8_t>(percent)});
  }

  // Motor speed [rad/s].
  std::uint8_t turn(double speed) {
    return send(Register::SETRPM, packed(static_cast<float>(speed * 9.549296585513721)))[0];
  }

  State state() {
    const Bytes bytes = send(Register::STATE, {}, 10);
    return {bioscara::load<float>(&bytes[0]), bioscara::load<float>(&bytes[4]),
            static_cast<JointState>(bytes[8]), bytes[9], bytes[10]};
  }
  std::uint8_t flags() { return state().flags; }
  FaultReport report() {
    const Bytes bytes = send(Register::FAULT, {}, 10);
    return {static_cast<Fault>(bytes[0]), bioscara::load<float>(&bytes[1]),
            static_cast<Refusal>(bytes[5]), bioscara::load<std::uint16_t>(&bytes[6]),
            bioscara::load<std::uint16_t>(&bytes[8])};
  }
  Fault fault() { return report().fault; }
  void clear_fault() { send(Register::CLEARFAULT, {static_cast<std::uint8_t>(fault())}); }
  double degrees() { return bioscara::load<float>(send(Register::ANGLEMOVED, {}, 4).data()); }

  World& world() { return world_; }
  std::uint8_t sequence() const { return sequence_; }
  std::uint8_t next_sequence() { return ++sequence_; }

 private:
  World& world_;
  int joint_;
  std::uint8_t sequence_ = 100;
};

}  // namespace client
