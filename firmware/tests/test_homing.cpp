// Homing: anything but an end stop gives no home, and every homing ends.
#include <algorithm>

#include "bench.h"
#include "client.h"
#include "testing.h"

using namespace bioscara;
using bench::Bench;
using client::has;
using client::Host;
using client::packed;

namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kReduction = 12.0;
// The upper end stop of joint 4 [rad], and how far homing backs off [motor rad].
constexpr double kStop = 3.01069;
constexpr double kBackOff = 80.0 / kDegrees;

// Joint 4, enabled, some turns of its motor below the upper end stop.
struct Seeking {
  explicit Seeking(double position = 2.3) : host(bench, 4) {
    bench.mechanics().set_position(position);
    bench.boot(ResetCause::POWER_ON);
    host.arm_session();
    host.enable();
  }
  void start() { host.home(true, 11, 30, 10); }
  // Until the first touch is made and the motor backs off.
  void back_off() {
    start();
    while (bench.field_speed() > -1.0 && host.fault() == Fault::NONE) host.keep(0.01);
    CHECK(host.fault() == Fault::NONE);
  }
  // Away from the end stop, one radian of the joint.
  void retreat() {
    host.send(Register::MOVEANGLE, packed(static_cast<float>(-kDegrees * kReduction)));
    host.keep(1.5);
  }
  // So far of the motor from here [rad].
  void block(double motor) {
    bench.mechanics().add_obstacle(bench.position() + motor / kReduction, 1.0);
  }
  Bench bench = Bench(4);
  Host<Bench> host;
};

void expect_refused_home(Seeking& joint, Fault fault) {
  const std::uint8_t flags = joint.host.wait_until_idle();
  CHECK(joint.host.fault() == fault);
  CHECK(has(flags, Flags::NOTHOMED));
  CHECK(has(flags, Flags::NOTENABLED));
}

void expect_home(Seeking& joint, double stop) {
  const std::uint8_t flags = joint.host.wait_until_idle();
  CHECK(joint.host.fault() == Fault::NONE);
  CHECK(!has(flags, Flags::NOTHOMED));
  CHECK(!has(flags, Flags::NOTENABLED));
  // The motor has its own current again, 20 %.
  CHECK(joint.bench.driver().current_share(true) == 8.0 / 32.0);
  // Zero is the end stop; the joint rests 2 degrees of the motor inside it.
  CHECK(std::fabs(joint.host.degrees() / kDegrees / kReduction + stop - joint.bench.position()) <
        1e-2);
}

void recover(Seeking& joint) {
  joint.host.clear_fault();
  joint.bench.run(0.05);
  joint.host.enable();
}

}  // namespace

TEST(HZ10_the_zero_is_the_end_stop) {
  Seeking joint;
  joint.start();
  expect_home(joint, kStop);
  CHECK(joint.bench.rotor() < kStop * kReduction);
}

TEST(HZ10_every_sensitivity_finds_the_end_stop) {
  for (int sensitivity : {0, 255}) {
    Seeking joint;
    joint.host.home(true, 11, sensitivity, 10);
    expect_home(joint, kStop);
  }
}

TEST(HZ10_a_homing_that_is_broken_off_leaves_no_home_and_stops_at_once) {
  Seeking joint;
  joint.start();
  expect_home(joint, kStop);
  joint.host.send(Register::MOVETOEND, {1, 60, 30});
  CHECK(!has(joint.host.wait_until_idle(), Flags::NOTHOMED));
  joint.retreat();
  joint.start();
  CHECK(has(joint.host.bare(Register::PING, {}, 1).back(), Flags::NOTHOMED));
  joint.host.keep(0.8);
  CHECK(joint.bench.field_speed() > 9.0);
  // A deceleration limit near zero is not meant for it.
  joint.host.send(Register::SETMAXDECELERATION, packed(1.0F));
  joint.host.send(Register::STOP, {1});
  joint.host.keep(0.6);
  CHECK(std::fabs(joint.bench.field_speed()) < 0.02);
  CHECK(has(joint.host.flags(), Flags::NOTHOMED));
  CHECK(joint.bench.driver().current_share(true) == 8.0 / 32.0);
}

TEST(HZ10_a_motor_that_cannot_back_off_finds_no_home) {
  Seeking joint;
  joint.back_off();
  joint.block(-0.2 * kBackOff);
  expect_refused_home(joint, Fault::HOMING_OBSTRUCTED);
}

TEST(HZ10_a_second_touch_that_finds_nothing_ends_soon_after_the_first) {
  // The obstacle of the first touch is gone, the end stop is farther away than the back-off twice.
  Seeking joint;
  joint.bench.mechanics().add_obstacle(2.6, 1.0);
  joint.back_off();
  joint.bench.mechanics().clear_obstacles();
  expect_refused_home(joint, Fault::HOMING_DISAGREEMENT);
  const double beyond = joint.bench.rotor() - 2.6 * kReduction;
  CHECK(beyond > 2.0 * kBackOff - 0.2 && beyond < 2.0 * kBackOff + 0.4);
}

TEST(HZ10_two_touches_that_differ_give_no_home) {
  for (double motor : {-0.4, 0.4}) {
    Seeking joint;
    joint.bench.mechanics().add_obstacle(2.6, 1.0);
    joint.back_off();
    joint.host.keep(0.25);
    joint.bench.mechanics().add_obstacle(2.6 + motor / kReduction, 1.0);
    expect_refused_home(joint, Fault::HOMING_DISAGREEMENT);
  }
}

TEST(HZ10_a_homing_that_cannot_end_is_given_up_in_time) {
  // The driver's clock stands still: no travel, no touch.
  Seeking joint;
  const double begin = joint.bench.now();
  joint.start();
  joint.host.keep(0.1);
  joint.bench.stop_clock(true);
  while (joint.host.fault() == Fault::NONE && joint.bench.now() < begin + 30.0)
    joint.host.keep(0.02);
  const client::FaultReport report = joint.host.report();
  CHECK(report.fault == Fault::HOMING_TIMEOUT);
  // 1.2 times the range at 95 rpm, and 10 s for the touches.
  const double allowed = 1.2 * 2.0 * kStop * kReduction / (95.0 / 9.549296585513721) + 10.0;
  CHECK(std::fabs(report.data - allowed) < 0.1);
  CHECK(std::fabs(joint.bench.now() - begin - allowed) < 0.1);
  joint.bench.stop_clock(false);
  expect_refused_home(joint, Fault::HOMING_TIMEOUT);
}

TEST(HZ10_an_obstacle_where_an_earlier_homing_found_none_gives_no_home) {
  Seeking joint;
  joint.start();
  expect_home(joint, kStop);
  // Also after a homing between the two that found the end stop again.
  for (int time = 0; time < 2; ++time) {
    joint.retreat();
    joint.bench.mechanics().add_obstacle(2.6, 1.0);
    joint.start();
    expect_refused_home(joint, Fault::HOMING_DISAGREEMENT);
    joint.bench.mechanics().clear_obstacles();
    recover(joint);
    joint.start();
    expect_home(joint, kStop);
  }
}

TEST(HZ10_a_new_end_stop_is_believed_when_a_second_homing_finds_it_again) {
  Seeking joint;
  joint.start();
  expect_home(joint, kStop);
  for (double place : {2.6, 2.2}) {
    joint.retreat();
    joint.bench.mechanics().clear_obstacles();
    joint.bench.mechanics().add_obstacle(place, 1.0);
    joint.start();
    expect_refused_home(joint, Fault::HOMING_DISAGREEMENT);
    recover(joint);
  }
  joint.retreat();
  joint.start();
  expect_home(joint, 2.2);
}

TEST(a_move_to_the_end_stop_ends_beside_it_without_pressing) {
  for (int joint = 1; joint <= 4; ++joint) {
    const double reduction = bioscara::sim::parameters_of(joint).reduction;
    for (bool positive : {true, false}) {
      for (int rpm : {5, 20, 60}) {
        for (int sensitivity : {0, 30, 127}) {
          Bench bench(joint);
          // Two turns of the motor in front of the end stop.
          const auto& limits = bench.mechanics().parameters();
          const double stop = positive == (reduction > 0.0) ? limits.upper : limits.lower;
          const double way = (positive ? 2.0 : -2.0) * 6.283185307179586;
          bench.mechanics().set_position(stop - way / reduction);
          bench.boot(ResetCause::POWER_ON);
          Host host(bench, joint);
          host.arm_session();
          host.enable(joint == 2 ? 40 : 20);
          const double rotor = bench.rotor();
          host.send(Register::MOVETOEND, {positive, static_cast<std::uint8_t>(rpm),
                                          static_cast<std::uint8_t>(sensitivity)});
          host.wait_until_idle();
          host.keep(1.0);
          CHECK(host.fault() == Fault::NONE);
          CHECK(!has(host.flags(), Flags::NOTENABLED) && has(host.flags(), Flags::NOTHOMED));
          CHECK(host.state().state == JointState::HOLDING);
          // The field is with its rotor, but for friction and the weight of the lift.
          CHECK(host.state().load_percent <= (joint == 2 ? 15 : 8));
          // At the end stop, or where the torque rose unseen 80 degrees from it.
          const double beside = std::fabs(way) - std::fabs(bench.rotor() - rotor);
          CHECK(beside > -0.2 && beside < 1.5);
        }
      }
    }
  }
}
