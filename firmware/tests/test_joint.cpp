// The core on simulated chips, run here under the address and undefined-behaviour sanitizers.
// tests/firmware has the hazards and motions, through the same bytes, from Python.
#include <cmath>
#include <limits>

#include "client.h"
#include "testing.h"

using namespace bioscara;
using client::Bytes;
using client::Host;
using client::with;
using sim::Arm;
using sim::Timing;

namespace {

constexpr Timing kBus{100e3, 105e-6};
constexpr double kMicrostep = 1.0;

bool has(std::uint8_t flags, Flags flag) { return (flags & static_cast<std::uint8_t>(flag)) != 0; }

}  // namespace

TEST(nothing_moves_at_boot) {
  Arm arm(1, kBus, false);
  for (int joint = 1; joint <= Arm::kJoints; ++joint) {
    const double before = arm.board(joint).driver().field();
    CHECK(!arm.board(joint).has_torque());
    arm.run(1.0);
    CHECK(arm.board(joint).driver().field() == before);
  }
}

TEST(the_whole_arm_homes) {
  Arm arm(2, kBus, false);
  const double begin = arm.now();
  const std::uint8_t directions[] = {0, 0, 0, 1, 1};
  const std::uint8_t speeds[] = {0, 10, 45, 11, 11};
  const std::uint8_t sensitivities[] = {0, 30, 50, 25, 30};
  const std::uint8_t currents[] = {0, 15, 30, 10, 10};
  for (int joint : {2, 1, 4, 3}) {
    Host host(arm, joint);
    host.arm_session();
    host.enable(joint == 2 ? 40 : 20);
    host.send(Register::HOME,
              {directions[joint], speeds[joint], sensitivities[joint], currents[joint]});
    const std::uint8_t flags = host.wait_until_idle();
    CHECK(!has(flags, Flags::NOTHOMED));
    CHECK(!has(flags, Flags::NOTENABLED));
  }
  CHECK(arm.now() - begin < 120.0);
}

TEST(every_length_of_every_register_is_survived) {
  Arm arm(3, Timing{0.0, 0.0}, false);
  Host host(arm, 1);
  host.arm_session();
  host.enable();
  const double before = host.board().driver().field();
  for (int code = 0; code < 256; ++code) {
    for (std::size_t size = 1; size <= 32; ++size) {
      Bytes frame(size, 0x5A);
      frame[0] = static_cast<std::uint8_t>(code);
      if (static_cast<Register>(code) == Register::STOP) continue;
      Bytes answer(14);
      arm.transfer(host.address(), frame.data(), frame.size(), answer.data(), answer.size());
    }
    arm.run(0.002);
  }
  arm.run(0.1);
  CHECK(std::fabs(host.board().driver().field() - before) < kMicrostep);
}

TEST(numbers_that_are_not_finite_are_refused) {
  Arm arm(4, kBus, false);
  Host host(arm, 1);
  host.arm_session();
  host.enable();
  const double before = host.board().driver().field();
  for (float number : {std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity()}) {
    for (Register code : {Register::SETRPM, Register::MOVETOANGLE, Register::MOVEANGLE,
                          Register::SETMAXVELOCITY, Register::SETMAXACCELERATION,
                          Register::CHECKORIENTATION, Register::HOMEOFFSET}) {
      CHECK(has(host.send(code, with({}, number))[0], Flags::REFUSED));
    }
    Bytes track = with({}, number);
    track.push_back(0);
    track.push_back(0);
    CHECK(has(host.send(Register::TRACK, track, 6)[0], Flags::REFUSED));
  }
  arm.run(0.2);
  CHECK(std::fabs(host.board().driver().field() - before) < kMicrostep);
}

TEST(silence_stops_a_running_motor) {
  Arm arm(5, kBus, false);
  Host host(arm, 4);
  host.arm_session();
  host.enable();
  host.send(Register::SETRPM, with({}, 60.0F));
  arm.run(0.05);
  CHECK(host.board().driver().field_speed() > 0.0);
  arm.run(0.5);
  CHECK(host.board().driver().field_speed() == 0.0);
  CHECK(host.fault() == Fault::SETPOINT_LOST);
  CHECK(has(host.flags(), Flags::NOTENABLED));
}

TEST(accelerations_are_clamped_and_do_not_wrap) {
  Arm arm(6, kBus, false);
  Host host(arm, 4);
  host.arm_session();
  host.enable();
  host.send(Register::SETMAXVELOCITY, with({}, 1200.0F));
  host.send(Register::SETMAXACCELERATION, with({}, 1e9F));
  host.send(Register::SETRPM, with({}, 100.0F));
  arm.run(0.03);
  // 100 rpm within 30 ms: the wrapped value of the original would still be near standstill.
  CHECK(host.board().driver().field_speed() > 80.0 * 51200.0 / 60.0);
}
