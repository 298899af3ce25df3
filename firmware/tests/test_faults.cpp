// Faults: silence, stalls, a broken encoder, a broken driver, a hung controller.
#include <algorithm>

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

// Seconds until the fault is latched, -1 if it is not; the host keeps feeding or not.
double time_to_fault(Host<Bench>& host, double limit, bool feed) {
  Bench& bench = host.world();
  const double begin = bench.now();
  for (long tick = 0; bench.now() - begin < limit; ++tick) {
    if (feed && tick % 20 == 0) host.send(Register::WATCHDOG, {60, 0});
    bench.tick();
    if (has(host.flags(), Flags::FAULT)) return bench.now() - begin;
  }
  return -1.0;
}

void expect_power_off(Host<Bench>& host, Fault fault) {
  Bench& bench = host.world();
  CHECK(host.fault() == fault);
  CHECK(!bench.stage_closed());
  CHECK(has(host.flags(), Flags::NOTENABLED));
}

// Recovery after the broken part is sound again.
void expect_recovery(Host<Bench>& host) {
  host.clear_fault();
  host.world().run(0.05);
  host.enable();
  CHECK(host.fault() == Fault::NONE);
  host.turn(5.0);
  host.keep(0.2);
  CHECK(std::fabs(host.world().field_speed() - 5.0) < 0.1);
}

struct Running {
  explicit Running(int joint, double speed, int percent = 20, std::uint8_t sensitivity = 6)
      : bench(joint), host(bench, joint) {
    bench.mechanics().remove_stops();
    host.arm_session();
    host.enable(percent, 120.0, 336.0, sensitivity);
    host.turn(speed);
    host.keep(0.3 + std::fabs(speed) / 336.0);
  }
  Bench bench;
  Host<Bench> host;
};

// The missing part of a driver: the supply of its power stage, or all of its supplies, and the level of its
// data line then.
enum class Failure { STAGE, LOW, HIGH };
constexpr Failure kFailures[] = {Failure::STAGE, Failure::LOW, Failure::HIGH};

void fail(Bench& bench, Failure kind, bool fails) {
  bench.driver().set_motor_power(!fails);
  if (kind == Failure::STAGE) return;
  bench.driver().power_up();
  bench.unplug_driver(fails ? std::optional<std::uint8_t>(kind == Failure::LOW ? 0x00 : 0xFF)
                            : std::nullopt);
}

}  // namespace

TEST(HZ04_silence_stops_a_version_1_session) {
  // Setpoints must be repeated; autonomous motions are kept alive by polling.
  Bench bench(4);
  Host host(bench, 4);
  host.enable_bare();
  host.bare(Register::SETRPM, packed(100.0F));
  bench.run(0.03);
  CHECK(bench.field_speed() > 0.0);
  bench.run(0.6);
  CHECK(bench.field_speed() == 0.0);
  CHECK(host.bare(Register::PING, {}, 1).back() == 0x0C);
  host.enable_bare();  // A version 1 host acknowledges by enabling.
  host.bare(Register::HOME, {1, 11, 30, 10});
  for (int poll = 0; poll < 10; ++poll) {
    bench.run(0.1);
    CHECK(has(host.bare(Register::PING, {}, 1).back(), Flags::BUSY));
  }
  CHECK(bench.field_speed() > 1.0);
  bench.run(1.2);
  CHECK(bench.field_speed() == 0.0);
  CHECK(!has(host.bare(Register::PING, {}, 1).back(), Flags::BUSY));
  CHECK(host.fault() == Fault::SETPOINT_LOST);
}

TEST(HZ05_polls_of_version_1_feed_no_setpoint) {
  for (Register code : {Register::SETRPM, Register::MOVETOANGLE, Register::RUNCONTINUOUS}) {
    Bench bench(4);
    bench.mechanics().remove_stops();
    Host host(bench, 4);
    host.enable_bare();
    host.bare(code, code == Register::RUNCONTINUOUS ? Bytes{1} : packed(9000.0F));
    bench.run(0.05);
    CHECK(bench.field_speed() > 1.0);
    for (int poll = 0; poll < 50; ++poll) {
      host.bare(Register::ANGLEMOVED, {}, 4);
      bench.run(0.01);
    }
    CHECK(bench.field_speed() == 0.0);
    CHECK(host.fault() == Fault::SETPOINT_LOST);
  }
}

TEST(HZ05_polls_of_an_armed_session_keep_no_motion_alive) {
  for (const auto& [code, payload] :
       {std::pair{Register::HOME, Bytes{1, 11, 30, 10}}, {Register::MOVETOEND, Bytes{1, 60, 30}},
        {Register::CHECKORIENTATION, packed(10.0F)}, {Register::MOVESTEPS, packed(500000)}}) {
    Bench bench(4);
    bench.mechanics().remove_stops();
    Host host(bench, 4);
    host.arm_session();
    host.enable();
    host.send(code, payload);
    for (int poll = 0; poll < 30; ++poll) {
      host.state();
      host.bare(Register::PING, {}, 1);
      bench.run(0.01);
    }
    CHECK(host.fault() == Fault::SETPOINT_LOST);
    CHECK(bench.field_speed() == 0.0);
  }
}

TEST(HZ05_junk_keeps_no_motion_of_version_1_alive) {
  Bench bench(4);
  bench.mechanics().remove_stops();
  Host host(bench, 4);
  host.enable_bare();
  host.bare(Register::HOME, {1, 11, 30, 10});
  for (int time = 0; time < 50; ++time) {
    host.exchange({0xAA, 1}, 1);
    host.exchange({static_cast<std::uint8_t>(Register::HOME), 1}, 1);
    bench.run(0.01);
  }
  CHECK(host.fault() == Fault::SETPOINT_LOST);
}

TEST(HZ05_settings_are_no_setpoints) {
  Running run(4, 20.0);
  for (int time = 0; time < 50; ++time) {
    run.host.send(Register::SETMAXVELOCITY, packed(2000.0F));
    run.host.send(Register::SETCONTROLTHRESHOLD, packed(20.0F));
    run.bench.run(0.01);
  }
  CHECK(run.host.fault() == Fault::SETPOINT_LOST);
}

TEST(silence_ends_the_slowest_motion_and_a_sequence_that_pauses) {
  const auto expect = [](const auto& start) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    host.enable();
    host.send(Register::SETMAXVELOCITY, packed(6.0F));
    start(host, static_cast<float>(host.degrees()));
    bench.run(0.3);
    CHECK(host.fault() == Fault::SETPOINT_LOST);
    CHECK(has(host.flags(), Flags::NOTENABLED));
  };
  using H = Host<Bench>;
  expect([](H& host, float) { host.send(Register::SETRPM, packed(1.0F)); });
  expect([](H& host, float here) { host.send(Register::MOVETOANGLE, packed(here + 90.0F)); });
  expect([](H& host, float here) {
    for (int step = 0; step < 10; ++step) {
      host.send(Register::TRACK, setpoint(here + 0.12F * static_cast<float>(step), 1.0F), 6);
      host.world().run(0.02);
    }
  });
  // A setpoint that the joint has not reached yet.
  expect([](H& host, float here) {
    host.send(Register::SETMAXVELOCITY, packed(360.0F));
    host.send(Register::TRACK, setpoint(here + 4.0F, 0.0F), 6);
    host.world().run(0.001);
    host.send(Register::TRACK, setpoint(here + 35.0F, 0.0F), 6);
  });
  expect([](H& host, float) { host.home(true, 11, 30, 10); });
}

TEST(a_command_that_meets_a_fault_within_its_tick_does_not_undo_it) {
  // The second bad sample is read in the tick that would execute the command.
  for (const auto& [code, payload] :
       {std::pair{Register::SETRPM, packed(100.0F)}, {Register::MOVESTEPS, packed(50000)},
        {Register::CLEARFAULT, Bytes{0}}, {Register::SETUP, Bytes{20, 20, 0, 0}}}) {
    Running run(4, 0.0);
    run.host.send(Register::STOP, {0});
    run.host.keep(0.2);
    const double field = run.bench.field();
    run.bench.encoder().corrupt(true);
    run.bench.tick();
    CHECK(!has(run.host.send(code, payload)[0], Flags::REFUSED));
    run.bench.tick();
    run.bench.encoder().corrupt(false);
    CHECK(run.host.fault() == Fault::ENCODER);
    run.bench.run(0.3);
    CHECK(std::fabs(run.bench.field() - field) < 0.05);
    CHECK(run.host.fault() == Fault::ENCODER);
    CHECK(has(run.host.flags(), Flags::NOTENABLED));
  }
}

TEST(a_command_that_arrives_while_a_tick_latches_a_stall_does_not_undo_it) {
  for (Register code : {Register::SETRPM, Register::SETUP}) {
    // The same run twice: the second time the command arrives in the tick that latched before.
    long stalls = -1;
    for (bool again : {false, true}) {
      const long late = again ? stalls : -1;
      Running run(4, 20.0);
      run.bench.mechanics().add_obstacle(run.bench.position() + 0.3, 1.0);
      bool arrived = false;
      for (long tick = 0; tick < 2000 && !has(run.host.flags(), Flags::STALL); ++tick) {
        if (tick % 20 == 0) run.host.turn(20.0);
        if (tick == late)
          run.bench.interrupt([&] {
            const Bytes payload =
                code == Register::SETUP ? Bytes{20, 20, 0, 0} : packed(200.0F);
            arrived = !has(run.host.send(code, payload)[0], Flags::REFUSED);
          });
        run.bench.tick();
        stalls = tick;
        if (arrived) break;
      }
      if (!again) continue;
      CHECK(arrived);
      run.bench.tick();
      CHECK(run.host.fault() == Fault::STALL);
      CHECK(run.host.state().state == JointState::STOPPING);
      CHECK(has(run.host.flags(), Flags::STALL));
    }
  }
}

TEST(a_stall_that_is_cleared_is_still_a_latched_fault) {
  Running run(4, 20.0);
  run.bench.mechanics().add_obstacle(run.bench.position() + 0.3, 1.0);
  CHECK(time_to_fault(run.host, 2.0, true) > 0.0);
  CHECK(has(run.host.turn(-5.0), Flags::REFUSED));
  run.host.keep(0.5);
  run.host.send(Register::CLEARSTALL, {0});
  CHECK(has(run.host.turn(-5.0), Flags::REFUSED));
  CHECK(run.host.report().refusal == Refusal::FAULT_LATCHED);
  CHECK(has(run.host.send(Register::SETUP, {20, 20, 0, 0})[0], Flags::REFUSED));
  CHECK(run.host.report().refusal == Refusal::FAULT_LATCHED);
  // A later fault does not take its place.
  run.bench.encoder().corrupt(true);
  run.bench.run(0.1);
  CHECK(run.host.fault() == Fault::STALL);
  CHECK(has(run.host.flags(), Flags::NOTENABLED));
}

TEST(a_stalled_joint_of_version_1_says_why_it_refuses) {
  Bench bench(4);
  bench.mechanics().remove_stops();
  Host host(bench, 4);
  host.enable();
  host.turn(20.0);
  host.keep(0.3);
  bench.mechanics().add_obstacle(bench.position() + 0.3, 1.0);
  CHECK(time_to_fault(host, 2.0, true) > 0.0);
  host.turn(-5.0);
  CHECK(host.report().refusal == Refusal::STALLED);
  CHECK(!has(host.send(Register::CLEARSTALL, {0})[0], Flags::STALL));
}

TEST(a_check_that_failed_is_made_again_with_strokes) {
  // CHECKORIENTATION of a joint that was checked before.
  Running run(4, 0.0);
  run.host.send(Register::STOP, {0});
  run.host.keep(0.3);
  run.bench.encoder().freeze(true);
  run.host.send(Register::CHECKORIENTATION, packed(2.0F));
  run.host.wait_until_idle();
  for (int time = 0; time < 2; ++time) {
    expect_power_off(run.host, Fault::ORIENTATION);
    run.host.clear_fault();
    run.bench.run(0.05);
    run.host.send(Register::SETUP, {20, 20, 0, 0});
    run.host.wait_until_idle();
  }
}

TEST(a_driver_that_restarted_is_checked_anew) {
  Running run(4, 0.0);
  run.host.send(Register::STOP, {0});
  run.host.keep(0.3);
  run.bench.driver().power_up();
  CHECK(time_to_fault(run.host, 0.5, true) > 0.0);
  CHECK(run.host.fault() == Fault::DRIVER_RESET);
  run.host.clear_fault();
  run.host.keep(0.3);
  const double field = run.bench.field();
  run.host.send(Register::SETUP, {20, 20, 0, 0});
  double most = 0.0;
  while (has(run.host.flags(), Flags::BUSY)) {
    run.host.keep(0.02);
    most = std::max(most, std::fabs(run.bench.field() - field));
  }
  CHECK(most > 1.5 / kDegrees);
  CHECK(run.host.fault() == Fault::NONE);
}

TEST(a_driver_that_fails_while_the_joint_is_disabled_is_no_fault) {
  for (const Failure kind : kFailures) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    fail(bench, kind, true);
    bench.run(0.5);
    CHECK(host.fault() == Fault::NONE);
    fail(bench, kind, false);
    bench.run(0.5);
    host.enable();
    host.wait_until_idle(2.0);
    CHECK(host.fault() == Fault::NONE);
    CHECK(!has(host.flags(), Flags::NOTENABLED));
  }
}

TEST(a_stop_that_is_followed_by_a_disabling_stays_as_hard) {
  Running run(4, 60.0);
  run.host.send(Register::SETMAXDECELERATION, packed(static_cast<float>(50.0 * kDegrees)));
  run.host.send(Register::STOP, {0});
  run.bench.tick();
  run.host.send(Register::SETCURRENT, {0});
  run.host.keep(0.2);
  CHECK(run.bench.field_speed() == 0.0);
}

TEST(SETUP_without_current_enables_nothing_and_any_SETUP_ends_stall_detection) {
  Running run(4, 0.0);
  run.host.send(Register::STOP, {0});
  run.host.keep(0.3);
  run.host.send(Register::SETUP, {20, 20, 0, 0});
  run.host.keep(0.2);
  run.host.turn(20.0);
  run.bench.mechanics().add_obstacle(run.bench.position() + 0.3, 1.0);
  CHECK(time_to_fault(run.host, 2.0, true) > 0.0);
  CHECK(run.host.fault() == Fault::FOLLOWING);
  CHECK(!has(run.host.flags(), Flags::STALL));
  run.host.keep(0.5);
  run.host.clear_fault();
  run.bench.run(0.05);
  run.host.send(Register::SETUP, {0, 20, 0, 0});
  run.host.keep(0.2);
  CHECK(has(run.host.flags(), Flags::NOTENABLED));
}

TEST(HZ05_the_same_setpoint_repeated_with_its_old_number_does_not_feed_it_either) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  const Bytes frame = host.frame(Register::SETRPM, packed(200.0F), host.next_sequence());
  for (int time = 0; time < 50; ++time) {
    host.exchange(frame, 3);
    bench.run(0.01);
  }
  CHECK(bench.field_speed() == 0.0);
  CHECK(host.fault() == Fault::SETPOINT_LOST);
}

TEST(the_watchdog_time_can_be_set) {
  for (int milliseconds : {10, 30, 200}) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    host.enable();
    host.send(Register::WATCHDOG, {static_cast<std::uint8_t>(milliseconds), 0});
    CHECK(host.send(Register::WATCHDOG, {}, 2)[0] == milliseconds);
    host.turn(20.0);
    const double time = time_to_fault(host, 0.5, false);
    CHECK(std::fabs(time * 1e3 - milliseconds) <= 3.0);
  }
}

TEST(silence_at_rest_latches_nothing) {
  Bench bench(1);
  Host host(bench, 1);
  host.arm_session();
  host.enable();
  bench.run(5.0);
  const float here = static_cast<float>(host.degrees());
  host.send(Register::MOVETOANGLE, packed(here));
  bench.run(1.0);
  host.send(Register::TRACK, setpoint(here, 0.0F), 6);
  bench.run(1.0);
  CHECK(host.fault() == Fault::NONE);
  CHECK(host.state().state == JointState::HOLDING);
}

TEST(a_fault_stops_with_the_hardest_deceleration_and_silence_with_the_joints_own_at_least) {
  for (bool silent : {true, false}) {
    Running run(4, 60.0);
    run.host.send(Register::SETMAXDECELERATION, packed(static_cast<float>(50.0 * kDegrees)));
    run.host.turn(60.0);
    run.bench.run(0.02);
    run.bench.encoder().corrupt(!silent);
    while (!has(run.host.flags(), Flags::FAULT)) run.bench.tick();
    const double begin = run.bench.now();
    while (run.bench.field_speed() > 0.0) run.bench.tick();
    // The driver's hardest is 365 rad/s^2, j4's own 360.
    const double time = run.bench.now() - begin;
    CHECK(std::fabs(time - (silent ? 60.0 / 360.0 : 60.0 / 365.0)) < 0.004);
  }
}

TEST(no_deceleration_limit_keeps_a_faulted_motor_turning) {
  Running run(4, 20.0);
  run.host.send(Register::SETMAXDECELERATION, packed(1.0F));
  CHECK(time_to_fault(run.host, 0.5, false) > 0.0);
  CHECK(run.host.fault() == Fault::SETPOINT_LOST);
  run.host.keep(1.1);  // At 20 rad/s^2, also if the host is back; then the field goes to the rotor.
  CHECK(std::fabs(run.bench.field_speed()) < 0.02);
}

TEST(an_encoder_fault_loses_the_home_and_the_check) {
  enum class Broken { CRC, JUMP, FROZEN };
  for (Broken how : {Broken::CRC, Broken::JUMP, Broken::FROZEN}) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    host.enable();
    host.home(true, 11, 30, 10);
    CHECK(!has(host.wait_until_idle(), Flags::NOTHOMED));
    host.send(Register::ENABLESTALLGUARD, {6});
    host.turn(-20.0);
    host.keep(0.1);
    if (how == Broken::CRC) bench.encoder().corrupt(true);
    if (how == Broken::JUMP) bench.encoder().jump(0.2);
    if (how == Broken::FROZEN) bench.encoder().freeze(true);
    CHECK(time_to_fault(host, 1.0, true) > 0.0);
    host.keep(0.6);
    // An encoder that stays frozen gives no sample that could be noticed later.
    bench.encoder().corrupt(false);
    bench.run(0.1);
    CHECK(host.fault() == Fault::ENCODER);
    CHECK(has(host.flags(), Flags::NOTHOMED));
    host.clear_fault();
    bench.run(0.05);
    // Current flows still, but the field's position relative to the rotor is checked anew.
    CHECK(bench.stage_closed());
    CHECK(has(host.send(Register::SETUP, {20, 20, 0, 0})[0], Flags::BUSY));
    bench.run(0.01);
    CHECK(host.state().state == JointState::ORIENTATION);
    const std::uint8_t flags = host.wait_until_idle();
    CHECK(has(flags, Flags::NOTHOMED));
    CHECK(has(flags, Flags::NOTENABLED) == (how == Broken::FROZEN));
  }
}

TEST(HZ12_the_first_fault_is_kept_with_its_number) {
  Running run(4, 20.0);
  run.bench.encoder().corrupt(true);
  run.bench.run(0.01);
  run.bench.driver().raise_overtemperature(true);
  run.bench.run(0.1);
  CHECK(run.host.fault() == Fault::ENCODER);
  CHECK(!run.bench.stage_closed());
}

TEST(HZ14_a_motor_that_runs_the_wrong_way_is_switched_off) {
  for (double speed : {3.0, 20.0}) {
    Running run(4, speed);
    run.host.send(Register::DISABLESTALLGUARD, {0});
    run.host.send(Register::STOP, {0});
    run.host.keep(0.4);
    run.bench.driver().reverse_coil(true);
    const double before = run.bench.rotor();
    run.host.turn(speed);
    const double time = time_to_fault(run.host, 0.5, true);
    CHECK(time > 0.0 && time < 0.06 + speed / 336.0);
    const Fault fault = run.host.fault();
    CHECK(fault == Fault::RUNAWAY || fault == Fault::FOLLOWING);
    if (fault == Fault::RUNAWAY) CHECK(!run.bench.stage_closed());
    run.bench.run(0.5);
    CHECK(std::fabs(run.bench.rotor() - before) < 2.0);
    if (fault != Fault::RUNAWAY) continue;
    // Enabled again it is checked first, with strokes; the direction was known before.
    run.host.clear_fault();
    run.host.wait_until_idle(1.0);
    run.host.send(Register::SETUP, {20, 20, 0, 0});
    run.host.wait_until_idle();
    expect_power_off(run.host, Fault::ORIENTATION);
  }
}

TEST(HZ16_a_controller_that_restarts_in_motion_leaves_no_motion) {
  Running run(4, 40.0);
  run.bench.boot(ResetCause::WATCHDOG);
  CHECK(!run.bench.stage_closed());
  run.bench.run(0.05);
  CHECK(run.bench.field_speed() == 0.0 || !run.bench.stage_closed());
  CHECK(run.host.hello()[8] == static_cast<std::uint8_t>(ResetCause::WATCHDOG));
  run.bench.run(1.0);
  CHECK(run.bench.field_speed() == 0.0);
  run.host.arm_session();
  run.host.enable();
  CHECK(run.host.fault() == Fault::NONE);
}

TEST(HZ16_the_ramp_of_an_earlier_boot_ends_at_once_and_does_not_come_back) {
  Running run(4, 40.0);
  run.host.send(Register::SETMAXACCELERATION, packed(100.0F));
  run.host.turn(40.0);
  run.bench.run(0.02);
  run.bench.boot(ResetCause::WATCHDOG);
  double least = 40.0;
  for (int tick = 0; tick < 150; ++tick) {
    run.bench.tick();
    least = std::min(least, run.bench.field_speed());
  }
  CHECK(least == 0.0);
  CHECK(run.bench.field_speed() == 0.0);
}

TEST(HZ16_a_controller_that_hangs_in_a_long_move_leaves_no_motion) {
  Running run(4, 20.0);
  run.host.send(Register::MOVETOANGLE, packed(static_cast<float>(run.host.degrees()) + 6000.0F));
  run.bench.run(0.05);
  const double field = run.bench.field();
  run.bench.hang(true);
  run.bench.run(3.0);
  CHECK(run.bench.field_speed() == 0.0);
  // 50 ms of the limit, 120 rad/s, and the braking distance from there.
  CHECK(run.bench.field() - field < 0.05 * 120.0 + 120.0 * 120.0 / (2.0 * 336.0) + 0.1);
}

TEST(a_jump_of_the_encoder_is_not_taken_for_motion) {
  Running run(4, 0.0);
  run.host.send(Register::STOP, {0});
  run.host.keep(0.3);
  const double before = run.host.degrees();
  run.bench.encoder().jump(0.2);
  run.host.keep(0.1);
  CHECK(run.host.fault() == Fault::ENCODER);
  CHECK(std::fabs(run.host.degrees() - before) < 1.0);
}

TEST(no_stall_is_seen_in_the_hardest_accelerations_that_are_allowed) {
  constexpr double kSpeed[] = {0.0, 35.0, 47.1, 120.0, 120.0};
  constexpr double kAcceleration[] = {0.0, 70.0, 314.0, 336.0, 360.0};
  for (int joint = 1; joint <= 4; ++joint) {
    Bench bench(joint);
    bench.mechanics().remove_stops();
    Host host(bench, joint);
    host.arm_session();
    host.enable(joint == 2 ? 40 : 20, kSpeed[joint], kAcceleration[joint], 0);
    for (int turn = 0; turn < 6; ++turn) {
      for (int cycle = 0; cycle < 60; ++cycle) {
        host.turn(turn % 2 == 0 ? kSpeed[joint] : -kSpeed[joint]);
        bench.run(0.02);
      }
    }
    CHECK(host.fault() == Fault::NONE);
  }
}

TEST(without_stall_detection_the_following_error_stops_the_joint) {
  Running run(4, 20.0);
  run.host.send(Register::DISABLESTALLGUARD, {0});
  run.bench.mechanics().add_obstacle(run.bench.position() + 0.3, 1.0);
  const double time = time_to_fault(run.host, 2.0, true);
  CHECK(time > 0.0);
  CHECK(run.host.fault() == Fault::FOLLOWING);
  run.host.keep(0.5);
  CHECK(run.bench.field_speed() == 0.0);
  CHECK(has(run.host.flags(), Flags::NOTENABLED));
}

TEST(one_bad_sample_of_the_encoder_is_dropped_two_stop_the_joint) {
  for (bool jump : {false, true}) {
    Running run(4, 20.0);
    const auto bad = [&](int ticks) {
      run.host.turn(20.0);
      if (!jump) run.bench.encoder().corrupt(true);
      if (jump) run.bench.encoder().jump(0.2);
      for (int tick = 0; tick < ticks; ++tick) run.bench.tick();
      if (!jump) run.bench.encoder().corrupt(false);
      if (jump && ticks == 1) run.bench.encoder().jump(-0.2);
      run.bench.tick();
    };
    bad(1);
    run.host.keep(0.1);
    CHECK(run.host.fault() == Fault::NONE);
    bad(2);
    CHECK(run.host.fault() == Fault::ENCODER);
    CHECK(has(run.host.flags(), Flags::NOTHOMED));
    CHECK(has(run.host.flags(), Flags::NOTENABLED));
    run.bench.run(0.5);
    CHECK(run.bench.field_speed() == 0.0);
    expect_recovery(run.host);
  }
}

TEST(an_encoder_that_stays_broken_cannot_be_enabled) {
  Running run(4, 20.0);
  run.bench.encoder().corrupt(true);
  run.bench.run(0.5);
  CHECK(run.host.fault() == Fault::ENCODER);
  run.host.clear_fault();
  run.bench.run(0.05);
  run.host.send(Register::SETUP, {20, 20, 0, 0});
  run.bench.run(0.05);
  CHECK(run.host.fault() == Fault::ENCODER);
  CHECK(has(run.host.flags(), Flags::NOTENABLED));
  run.bench.encoder().corrupt(false);
  run.bench.run(0.01);
  expect_recovery(run.host);
}

TEST(an_encoder_frozen_under_command_is_told_from_a_stall) {
  for (double speed : {1.0, 6.0, 20.0, 60.0}) {
    for (bool watched : {true, false}) {
      Running run(4, speed);
      if (!watched) run.host.send(Register::DISABLESTALLGUARD, {0});
      run.bench.encoder().freeze(true);
      CHECK(time_to_fault(run.host, 4.0, true) > 0.0);
      run.host.keep(0.6);
      CHECK(run.host.fault() == Fault::ENCODER);
      CHECK(!has(run.host.flags(), Flags::STALL));
      CHECK(has(run.host.flags(), Flags::NOTHOMED));
      CHECK(has(run.host.flags(), Flags::NOTENABLED));
      CHECK(run.bench.field_speed() == 0.0);
      run.bench.encoder().freeze(false);
      run.bench.run(0.1);
      expect_recovery(run.host);
    }
  }
}

TEST(a_driver_without_supply_is_a_fault_and_not_a_silent_recovery) {
  for (const Failure kind : kFailures) {
    Running run(4, 20.0);
    fail(run.bench, kind, true);
    const double time = time_to_fault(run.host, 0.5, true);
    CHECK(time > 0.0 && time < 0.04);
    expect_power_off(run.host, Fault::DRIVER);
    // Still off: it cannot be enabled. On again: nothing moves autonomously.
    run.host.clear_fault();
    run.host.wait_until_idle(1.0);  // The field of the open stage runs down.
    run.host.enable();
    expect_power_off(run.host, Fault::DRIVER);
    fail(run.bench, kind, false);
    const double place = run.bench.field();
    run.host.keep(0.5);
    CHECK(run.bench.field() == place);
    CHECK(!run.bench.stage_closed());
    expect_recovery(run.host);
  }
}

TEST(a_driver_without_supply_is_noticed_at_rest_too) {
  for (const Failure kind : kFailures) {
    Running run(4, 0.0);
    fail(run.bench, kind, true);
    run.host.keep(0.1);
    expect_power_off(run.host, Fault::DRIVER);
    // Undervoltage alone: the driver has not reset.
    CHECK(run.host.report().data == 4.0F);
    fail(run.bench, kind, false);
    run.host.keep(0.1);
    expect_power_off(run.host, Fault::DRIVER);
  }
}

TEST(a_driver_that_restarts_is_off_within_the_tick_and_set_up_in_the_next_ones) {
  Running run(4, 20.0);
  run.bench.driver().power_up();
  run.bench.tick();
  CHECK(!run.bench.stage_closed());
  run.bench.tick();
  CHECK(has(run.host.flags(), Flags::BUSY));
  CHECK(run.host.fault() == Fault::DRIVER_RESET);
  run.bench.run(0.01);
  CHECK(!has(run.host.flags(), Flags::BUSY));
  // A datagram takes 16 us of the tick's 1 ms.
  std::printf("     %d datagrams at most\n", run.bench.worst_exchanges());
  CHECK(run.bench.worst_exchanges() <= 16);
  run.host.clear_fault();
  expect_recovery(run.host);
}

TEST(a_driver_that_restarts_or_overheats_is_switched_off) {
  for (bool heat : {false, true}) {
    Running run(4, 20.0);
    if (heat)
      run.bench.driver().raise_overtemperature(true);
    else
      run.bench.driver().power_up();
    CHECK(time_to_fault(run.host, 0.5, true) < 0.04);
    const Fault fault = run.host.fault();
    CHECK(fault == (heat ? Fault::OVERTEMPERATURE : Fault::DRIVER_RESET));
    run.bench.run(0.05);
    CHECK(!run.bench.stage_closed());
    run.bench.driver().raise_overtemperature(false);
    run.bench.run(0.05);
    expect_recovery(run.host);
  }
}

TEST(what_a_fault_cut_stays_cut_until_SETUP) {
  Running run(4, 20.0);
  run.bench.driver().raise_overtemperature(true);
  CHECK(time_to_fault(run.host, 0.5, true) > 0.0);
  run.bench.driver().raise_overtemperature(false);
  run.host.keep(0.1);
  for (Register code : {Register::SETCURRENT, Register::SETHOLDCURRENT}) {
    run.host.send(code, {30});
    run.bench.run(0.02);
    expect_power_off(run.host, Fault::OVERTEMPERATURE);
  }
  expect_recovery(run.host);
}

TEST(a_motor_is_not_engaged_while_the_field_of_its_open_stage_still_turns) {
  Running run(3, 100.0);
  run.bench.driver().set_motor_power(false);
  CHECK(time_to_fault(run.host, 0.5, true) > 0.0);
  run.bench.driver().set_motor_power(true);
  run.host.keep(0.03);
  run.host.clear_fault();
  run.bench.run(0.01);
  CHECK(run.bench.field_speed() > 50.0);
  CHECK(has(run.host.send(Register::SETUP, {20, 20, 0, 0})[0], Flags::REFUSED));
  CHECK(run.host.report().refusal == Refusal::BUSY);
  run.host.wait_until_idle(1.0);
  CHECK(run.bench.field_speed() < 0.3);
  CHECK(!run.bench.stage_closed());
  run.bench.run(0.5);  // The rotor coasts.
  const double rotor = run.bench.rotor();
  run.host.enable();
  // To its place in the field, half an electrical period away at most, and the check.
  CHECK(std::fabs(run.bench.rotor() - rotor) < 5.0 / kDegrees);
  expect_recovery(run.host);
}

TEST(the_field_of_an_open_stage_runs_down_before_a_brake_closes_it) {
  Running run(3, 100.0);
  run.bench.driver().set_motor_power(false);
  CHECK(time_to_fault(run.host, 0.5, true) > 0.0);
  run.bench.driver().set_motor_power(true);
  run.host.keep(0.03);
  run.host.clear_fault();
  run.bench.run(0.01);
  CHECK(run.host.fault() == Fault::NONE);
  CHECK(run.bench.field_speed() > 50.0);
  run.host.send(Register::SETBRAKEMODE, {1});
  bool closed = false;
  while (run.bench.field_speed() > 0.1) {
    run.bench.tick();
    closed = closed || run.bench.stage_closed();
  }
  CHECK(!closed);
  run.host.send(Register::SETBRAKEMODE, {1});
  run.bench.run(0.01);
  CHECK(run.bench.stage_closed());
}

TEST(a_check_that_was_broken_off_enables_nothing) {
  for (bool known : {false, true}) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    // A joint that knows its field only lets the rotor settle.
    for (double wait : known ? std::vector{0.0, 0.1} : std::vector{0.0, 0.1, 0.2, 0.3}) {
      if (known) {
        host.enable();
        host.send(Register::SETHOLDCURRENT, {0});
        host.keep(0.2);
        CHECK(!bench.stage_closed());
      }
      host.send(Register::SETUP, {20, 20, 0, 0});
      bench.run(wait);
      host.send(Register::STOP, {0});
      host.keep(0.2);
      CHECK(has(host.flags(), Flags::NOTENABLED));
      CHECK(has(host.turn(5.0), Flags::REFUSED));
    }
    expect_recovery(host);
  }
}

TEST(a_faulted_joint_that_is_pushed_away_does_not_come_back_by_itself) {
  Running run(4, 20.0);
  run.bench.run(1.0);  // Silence: stopped and latched, with the current on.
  CHECK(run.host.fault() == Fault::SETPOINT_LOST);
  for (bool cleared : {false, true}) {
    if (cleared) run.host.clear_fault();
    run.host.keep(0.05);
    const double field = run.bench.field();
    const double rotor = run.bench.rotor();
    run.bench.mechanics().push(0.2 * 12.0);
    while (run.bench.rotor() < rotor + 6.0) run.bench.tick();
    run.bench.mechanics().push(0.0);
    run.host.keep(1.0);
    CHECK(run.bench.rotor() > rotor + 5.0);
    // Less than half an electrical period: to the rotor, not back.
    CHECK(std::fabs(run.bench.field() - field) < 0.0629);
  }
  expect_recovery(run.host);
}

TEST(a_joint_that_a_fault_disabled_corrects_nothing) {
  Running run(4, 20.0);
  run.bench.run(1.0);
  run.host.clear_fault();
  run.host.keep(0.05);
  CHECK(run.host.state().state == JointState::HOLDING);
  const double field = run.bench.field();
  run.bench.mechanics().push(0.03 * 12.0);
  run.host.keep(1.0);
  CHECK(run.host.fault() == Fault::NONE);
  CHECK(run.bench.field() == field);
}

TEST(a_current_energises_no_motor_that_is_not_enabled) {
  for (Register code : {Register::SETHOLDCURRENT, Register::SETCURRENT}) {
    for (std::uint8_t brake : {0, 1, 2}) {
      for (bool before : {false, true}) {
        Bench bench(4);
        Host host(bench, 4);
        host.arm_session();
        if (before) {
          host.enable();
          // Each of the two disables; the other current stays unchanged.
          host.send(code == Register::SETCURRENT ? Register::SETHOLDCURRENT : Register::SETCURRENT, {0});
          host.keep(0.2);
        }
        host.send(Register::SETBRAKEMODE, {brake});
        host.send(code, {30});
        host.keep(0.6);
        CHECK(has(host.flags(), Flags::NOTENABLED));
        CHECK(bench.stage_closed() == (brake == 1));
        CHECK(bench.driver().current_share(bench.stage_closed()) <= 1.0 / 32.0);
        // It is moved by hand.
        const double rotor = bench.rotor();
        bench.mechanics().push(0.05 * 12.0);
        for (int tick = 0; tick < 2000 && bench.rotor() < rotor + 1.0; ++tick) bench.tick();
        CHECK(bench.rotor() > rotor + 1.0);
        CHECK(host.fault() == Fault::NONE);
      }
    }
  }
}

TEST(a_braked_joint_that_is_pushed_latches_nothing_and_knows_its_position) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  host.send(Register::SETBRAKEMODE, {1});
  const double zero = host.degrees() - bench.rotor() * kDegrees;
  host.send(Register::SETHOLDCURRENT, {0});
  host.keep(0.6);
  CHECK(bench.stage_closed());
  for (double force : {0.1, -0.1}) {
    bench.mechanics().push(force * 12.0);
    host.keep(1.0);
    bench.mechanics().push(0.0);
    host.keep(0.3);
    CHECK(host.fault() == Fault::NONE);
    CHECK(host.state().load_percent == 0);
    CHECK(host.state().state == JointState::DISABLED);
    CHECK(std::fabs(host.degrees() - bench.rotor() * kDegrees - zero) < 2.0);
    CHECK(bench.stage_closed());
  }
  const double rotor = bench.rotor();
  CHECK(has(host.send(Register::SETUP, {20, 20, 0, 0})[0], Flags::BUSY));
  host.wait_until_idle();
  CHECK(host.fault() == Fault::NONE);
  CHECK(!has(host.flags(), Flags::NOTENABLED));
  CHECK(std::fabs(bench.rotor() - rotor) < 5.0 / kDegrees);
  host.turn(5.0);
  host.keep(0.2);
  CHECK(std::fabs(bench.field_speed() - 5.0) < 0.1);
}

TEST(a_field_whose_rotor_is_not_known_stays_where_it_stands) {
  // An encoder that fails in motion, a first check that silence ends, and a position counter of the
  // driver that jumped.
  enum class Lost { ENCODER, CHECK, COUNTER };
  for (Lost how : {Lost::ENCODER, Lost::CHECK, Lost::COUNTER}) {
    for (double when = 0.0; when < 0.1; when += 0.02) {
      Bench bench(4);
      bench.mechanics().remove_stops();
      bench.driver().reverse_coil(how == Lost::CHECK);
      Host host(bench, 4);
      host.arm_session();
      if (how == Lost::CHECK) {
        // Within its first strokes, before the direction is set.
        host.send(Register::SETUP, {20, 20, 0, 0});
        host.keep(0.2 + when);
      } else {
        host.enable();
        host.turn(20.0);
        host.keep(0.3 + 0.01 * when);
      }
      if (how == Lost::ENCODER) bench.encoder().corrupt(true);
      if (how == Lost::COUNTER)
        bench.damage(2, true, [](std::uint8_t(&sent)[5]) {
          sent[0] = 0x80 | 0x21;  // XACTUAL
          sent[2] ^= 0x01;
        });
      CHECK(time_to_fault(host, 1.0, how != Lost::CHECK) > 0.0);
      while (bench.field_speed() != 0.0) bench.tick();
      const double field = bench.field();
      host.keep(0.5);
      CHECK(std::fabs(bench.field() - field) < 1e-9);
      bench.encoder().corrupt(false);
      host.clear_fault();
      host.keep(0.5);
      CHECK(std::fabs(bench.field() - field) < 1e-9);
      CHECK(has(host.flags(), Flags::NOTENABLED));
    }
  }
}

TEST(silence_brakes_no_slower_than_the_images_own_limit) {
  constexpr double kBraking = 360.0;  // [rad/s^2]
  const Bytes far = packed(9000.0F);
  for (bool armed : {true, false}) {
    for (const auto& [code, payload] :
         {std::pair{Register::SETRPM, packed(191.0F)}, {Register::MOVETOANGLE, far},
          {Register::MOVEANGLE, far}, {Register::MOVESTEPS, packed(1000000)},
          {Register::RUNCONTINUOUS, Bytes{1}}}) {
      for (Register limit : {Register::SETMAXACCELERATION, Register::SETMAXDECELERATION}) {
        // A host that returns stops the joint once more, by its own limit, and polls.
        for (bool returns : {false, true}) {
          Bench bench(4);
          bench.mechanics().remove_stops();
          Host host(bench, 4);
          if (armed) host.arm_session();
          host.enable();
          host.send(Register::SETMAXVELOCITY, packed(static_cast<float>(20.0 * kDegrees)));
          host.send(code, payload);
          for (int time = 0; time < 10; ++time) {
            bench.run(0.02);
            if (code == Register::SETRPM || code == Register::MOVETOANGLE ||
                code == Register::RUNCONTINUOUS)
              host.send(code, payload);
            else
              host.send(Register::WATCHDOG, {60, 0});
          }
          CHECK(std::fabs(bench.field_speed() - 20.0) < 0.2);
          host.send(limit, packed(1.0F));
          // A version 1 host that polls keeps a move alive that needs no setpoints, for longer.
          const bool alone = code == Register::MOVEANGLE || code == Register::MOVESTEPS;
          bench.run(!armed && alone ? 0.252 : 0.062);
          const double last = bench.field_speed();
          const double begin = bench.now();
          while (bench.now() - begin < 20.0 / kBraking + 0.15) {
            bench.run(0.05);
            if (!returns) continue;
            host.send(Register::STOP, {1});
            host.send(Register::WATCHDOG, {200, 0});
          }
          CHECK(last > 10.0);
          CHECK(std::fabs(bench.field_speed()) < 0.05);  // It goes to its rotor.
          CHECK(host.fault() == Fault::SETPOINT_LOST);
        }
      }
    }
  }
}

TEST(silence_ends_a_stop_that_would_last_for_ever) {
  for (bool armed : {true, false}) {
    Bench bench(4);
    bench.mechanics().remove_stops();
    Host host(bench, 4);
    if (armed) host.arm_session();
    host.enable();
    host.turn(20.0);
    host.keep(0.2);
    host.send(Register::SETMAXDECELERATION, packed(1.0F));
    host.send(Register::STOP, {1});
    for (int poll = 0; poll < 10; ++poll) {
      if (armed) host.send(Register::WATCHDOG, {200, 0});
      bench.run(0.1);
      CHECK(host.state().state == JointState::STOPPING);
    }
    CHECK(bench.field_speed() > 19.0);
    bench.run(1.5);
    CHECK(std::fabs(bench.field_speed()) < 0.01);
    CHECK(host.fault() == Fault::NONE);
  }
}

TEST(a_field_at_rest_does_not_chase_an_encoder_that_stands_still) {
  for (double way = 0.1; way < 0.4; way += 0.02) {
    Bench bench(4);
    Host host(bench, 4);
    host.enable_bare();
    bench.encoder().freeze(true);
    host.bare(Register::CHECKORIENTATION, packed(10.0F));
    while (bench.field_speed() == 0.0) bench.tick();
    bench.run(way);
    host.bare(Register::STOP, {0});
    bench.run(3.0);
    const double field = bench.field();
    bench.run(2.0);
    CHECK(std::fabs(bench.field() - field) < 0.01);
  }
}

TEST(a_stalled_joint_that_was_pushed_away_turns_again_once_its_stall_is_cleared) {
  for (Register code : {Register::ENABLESTALLGUARD, Register::CLEARSTALL}) {
    Bench bench(4);
    bench.mechanics().remove_stops();
    Host host(bench, 4);
    const auto stalled = [&] { return has(host.bare(Register::PING, {}, 1).back(), Flags::STALL); };
    const auto turn = [&] { host.bare(Register::SETRPM, packed(20.0F)); };
    host.enable_bare();
    host.bare(Register::ENABLESTALLGUARD, {6});
    turn();
    bench.mechanics().push(-0.12 * 12.0);
    for (int tick = 0; tick < 1000 && !stalled(); ++tick) bench.tick();
    CHECK(stalled());
    bench.mechanics().push(0.0);
    bench.run(0.5);
    const double rotor = bench.rotor();
    bench.mechanics().push(0.13 * 12.0);
    while (bench.rotor() < rotor + 1.0) bench.tick();
    bench.mechanics().push(0.0);
    bench.run(0.5);
    host.bare(code, {6});
    bench.run(0.01);
    for (int cycle = 0; cycle < 10; ++cycle) {
      turn();
      bench.run(0.02);
    }
    CHECK(!stalled());
    CHECK(std::fabs(bench.field_speed() - 20.0 / 9.5493) < 0.05);
  }
}
