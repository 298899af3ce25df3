// Random sessions of either version, with faults of the chips: for any commands, nothing moves
// before SETUP or faster than allowed, current that a fault cut stays off, and silence ends motion.
#include <algorithm>
#include <limits>

#include "bench.h"
#include "client.h"
#include "testing.h"

using namespace bioscara;
using bench::Bench;
using client::Bytes;
using client::has;
using client::Host;
using client::packed;
using client::setpoint;

namespace {

constexpr double kDegrees = 57.29577951308232;
// The default limit, and the fastest approach of a homing [motor rad/s].
constexpr double kDefaultSpeed = 800.0 / 200.0 * 6.283185307179586;
constexpr double kHomingSpeed = 38.0;

constexpr Register kCommands[] = {
    Register::SETUP, Register::SETUP, Register::SETUP, Register::SETRPM, Register::SETRPM,
    Register::MOVESTEPS, Register::MOVEANGLE, Register::MOVETOANGLE, Register::RUNCONTINUOUS,
    Register::SETCURRENT, Register::SETHOLDCURRENT, Register::SETMAXACCELERATION,
    Register::SETMAXDECELERATION, Register::SETMAXVELOCITY, Register::ENABLESTALLGUARD,
    Register::DISABLESTALLGUARD, Register::CLEARSTALL, Register::SETBRAKEMODE,
    Register::DISABLEPID, Register::ENABLECLOSEDLOOP, Register::DISABLECLOSEDLOOP,
    Register::SETCONTROLTHRESHOLD, Register::MOVETOEND, Register::STOP,
    Register::CHECKORIENTATION, Register::HOME, Register::TRACK, Register::TRACKLOAD,
    Register::WATCHDOG, Register::CLEARFAULT,
};

class Session {
 public:
  Session(int joint, std::uint32_t seed)
      // Every session meets the wrap of the clock.
      : state_(seed * 2654435761U + 1U), bench_(joint, 0U - below(8000000)), host_(bench_, joint) {
    if (below(2) == 0) bench_.mechanics().remove_stops();
    second_ = below(2) == 0;
    if (second_ && below(4) != 0) host_.arm_session();
    field_ = bench_.field();
  }

  void play() {
    for (std::uint32_t left = 5 + below(40); left > 0; --left) {
      command(kCommands[below(std::size(kCommands))]);
      if (below(12) == 0) break_something();
      const double time = below(3) == 0 ? between(0.05, 1.5) : between(0.001, 0.05);
      const double end = bench_.now() + time;
      for (const bool heard = below(2) == 0; bench_.now() < end;) {
        if (heard && second_) host_.send(Register::WATCHDOG, {60, 0});
        if (heard && !second_) host_.bare(Register::PING, {}, 1);
        run(20);
      }
      cut_ = host_.state().state == JointState::FAULTED && !bench_.stage_closed();
    }
    // From 120 rad/s at the 20 rad/s^2 that even the weakest current can do.
    run(8000);
    CHECK(!bench_.stage_closed() || std::fabs(bench_.field_speed()) < 0.5);
  }

 private:
  std::uint32_t below(std::size_t end) {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::uint32_t>((state_ >> 33) % end);
  }
  double between(double low, double high) {
    return low + (high - low) * below(1U << 20) / 1048576.0;
  }

  Bytes number(double usual) {
    const double extreme[] = {0.0, 1e7, -1e7, 1e30};
    return packed(static_cast<float>(below(8) != 0 ? usual : extreme[below(4)]));
  }

  Bytes payload(Register code) {
    const auto byte = [this](std::size_t end) { return static_cast<std::uint8_t>(below(end)); };
    switch (code) {
      case Register::SETUP:
        return {byte(101), byte(101), 0, 0};
      case Register::SETRPM:
        return number(between(-1500.0, 1500.0));
      case Register::MOVESTEPS:
        return packed(static_cast<std::int32_t>(between(-1e5, 1e5)));
      case Register::MOVEANGLE:
        return number(between(-1e3, 1e3));
      case Register::MOVETOANGLE:
        return number(host_.degrees() + between(-1e3, 1e3));
      case Register::SETMAXACCELERATION:
      case Register::SETMAXDECELERATION:
        return number(between(100.0, 20000.0));
      case Register::SETMAXVELOCITY:
        return packed(static_cast<float>(between(10.0, 120.0 * kDegrees)));
      case Register::SETCONTROLTHRESHOLD:
        return number(between(0.0, 100.0));
      case Register::CHECKORIENTATION:
        return packed(static_cast<float>(between(0.01, 10.0)));
      case Register::HOME:
        return {byte(2), byte(251), byte(256), byte(101)};
      case Register::MOVETOEND:
        return {byte(2), byte(251), byte(256)};
      case Register::TRACK:
      case Register::TRACKLOAD:
        return setpoint(static_cast<float>(host_.degrees() + between(-20.0, 20.0)),
                        static_cast<float>(between(-500.0, 500.0)));
      case Register::WATCHDOG:
        return {byte(201), 0};
      case Register::CLEARFAULT:
        return {static_cast<std::uint8_t>(host_.fault())};
      case Register::STOP:
      case Register::RUNCONTINUOUS:
        return {byte(2)};
      case Register::SETBRAKEMODE:
        return {byte(3)};
      default:
        return {byte(101)};
    }
  }

  void command(Register code) {
    if (!second_ && code > Register::HOMEOFFSET) return;
    const Bytes bytes = payload(code);
    if (code == Register::SETUP) engaged_ = true;
    if (code == Register::SETUP || code == Register::CLEARFAULT) cut_ = false;
    if (code == Register::SETMAXVELOCITY)
      speed_ = std::max(speed_, load<float>(bytes.data()) / kDegrees);
    second_ ? host_.send(code, bytes) : host_.bare(code, bytes);
  }

  void break_something() {
    const bool on = below(2) == 0;
    switch (below(5)) {
      case 0:
        bench_.encoder().jump(between(-0.5, 0.5));
        break;
      case 1:
        bench_.encoder().freeze(on);
        break;
      case 2:
        bench_.encoder().corrupt(on);
        break;
      case 3:
        bench_.driver().raise_overtemperature(on);
        break;
      default:
        bench_.driver().set_motor_power(on);
    }
  }

  void run(int ticks) {
    for (; ticks > 0; --ticks) {
      bench_.tick();
      const double speed = std::fabs(bench_.field_speed());
      fast_ = fast_ || (bench_.stage_closed() && speed > 1.16 * speed_ + 0.5);
      // After each fault or disabling the field goes back to the rotor, some degrees at most.
      early_ = early_ || (!engaged_ && std::fabs(bench_.field() - field_) > 0.2);
      reclosed_ = reclosed_ || (cut_ && bench_.stage_closed());
    }
    CHECK(!fast_);
    CHECK(!early_);
    CHECK(!reclosed_);
    fast_ = early_ = reclosed_ = false;
  }

  std::uint64_t state_;
  Bench bench_;
  Host<Bench> host_;
  bool second_ = false;
  bool engaged_ = false;
  bool cut_ = false;
  bool fast_ = false, early_ = false, reclosed_ = false;
  double speed_ = std::max(kDefaultSpeed, kHomingSpeed);
  double field_ = 0.0;
};

}  // namespace

TEST(whatever_is_commanded_limits_hold_and_silence_ends_motion) {
  for (std::uint32_t seed = 0; seed < 120; ++seed) {
    const int before = testing::failures();
    Session(static_cast<int>(1 + seed % 4), seed).play();
    if (testing::failures() != before) std::printf("  in session %u\n", seed);
  }
}
