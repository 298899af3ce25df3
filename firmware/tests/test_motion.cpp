// Moving: commands are executed as given, within the limits, and motion ends when the host falls
// silent.
#include <algorithm>
#include <array>
#include <limits>
#include <random>

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
constexpr double kRpm = 9.549296585513721;

// The fastest and the hardest that the field turned while `body` ran a tick at a time.
struct Extremes {
  double speed = 0.0;
  double acceleration = 0.0;
};

class Meter {
 public:
  explicit Meter(Bench& bench) : bench_(bench), last_(bench.field_speed()) {}
  void run(double seconds) {
    for (double end = bench_.now() + seconds; bench_.now() < end - 1e-9;) {
      bench_.tick();
      const double speed = bench_.field_speed();
      extremes.speed = std::max(extremes.speed, std::fabs(speed));
      // Over ten ticks: a chip that steps every 51.2 us has 19 or 20 steps in one.
      speeds_[count_ % 10] = speed;
      ++count_;
      if (count_ > 10)
        extremes.acceleration =
            std::max(extremes.acceleration, std::fabs(speed - speeds_[count_ % 10]) / 9e-3);
    }
  }
  Extremes extremes;

 private:
  Bench& bench_;
  double last_;
  std::array<double, 10> speeds_{};
  long count_ = 0;
};

// A ramp as TRACK receives it: samples every `period`, each the place of one period later. Returns
// the largest distance between rotor and ramp once it is steady [motor rad].
double follow_ramp(Host<Bench>& host, double speed, double acceleration, double period,
                   double seconds) {
  Bench& bench = host.world();
  const double start = host.degrees() / kDegrees;
  const double begin = bench.now();
  const double run_up = speed / acceleration;
  const auto place = [&](double t) {
    return t < run_up ? 0.5 * acceleration * t * t : speed * (t - 0.5 * run_up);
  };
  const double rotor_at_start = bench.rotor();
  double worst = 0.0;
  for (double t = 0.0; t < seconds; t += period) {
    const double next = t + period;
    const double rate = next < run_up ? acceleration * next : speed;
    const Bytes answer =
        host.send(Register::TRACK, setpoint(static_cast<float>((start + place(next)) * kDegrees),
                                            static_cast<float>(rate * kRpm)),
                  6);
    if (has(answer.back(), Flags::REFUSED)) return 1e9;
    bench.run(period);
    if (t > run_up + 0.5)
      worst = std::max(worst, std::fabs(bench.rotor() - rotor_at_start -
                                        place(bench.now() - begin)));
  }
  return worst;
}

}  // namespace

TEST(TRACK_follows_the_ramp_of_the_benchmark_within_2_mrad) {
  Bench bench(1);
  Host host(bench, 1);
  host.arm_session();
  host.enable(20, 35.0, 1.57 * 35.0);
  const double worst = follow_ramp(host, 0.314 * 35.0, 1.57 * 35.0, 0.02, 2.0) / 35.0;
  std::printf("     steady error %.3f mrad of the joint\n", worst * 1e3);
  CHECK(worst < 1e-3);
  CHECK(host.fault() == Fault::NONE);
}

TEST(TRACK_follows_at_every_rate_and_through_the_resonance) {
  for (double period : {0.005, 0.01, 0.02, 0.04}) {
    Bench bench(1);
    Host host(bench, 1);
    host.arm_session();
    host.enable(20, 35.0, 70.0);
    const double worst = follow_ramp(host, 18.0, 40.0, period, 2.0) / 35.0;
    std::printf("     every %2.0f ms at 18 rad/s of the motor: %.3f mrad of the joint\n",
                period * 1e3, worst * 1e3);
    CHECK(worst < 2e-3);
    CHECK(host.fault() == Fault::NONE);
  }
}

TEST(TRACK_comes_to_rest_where_it_is_told_and_stays) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  const float start = static_cast<float>(host.degrees());
  for (int step = 1; step <= 50; ++step) {
    const float x = static_cast<float>(step) / 50.0F;
    const float place = start + 400.0F * x * x * (3.0F - 2.0F * x);
    const float rate = 400.0F * 6.0F * x * (1.0F - x) / 6.0F;  // deg/s, in rpm, over one second
    CHECK(!has(host.send(Register::TRACK, setpoint(place, rate), 6).back(), Flags::REFUSED));
    bench.run(0.02);
  }
  bench.run(0.5);  // Silence at rest latches nothing.
  CHECK(host.fault() == Fault::NONE);
  CHECK(host.state().state == JointState::HOLDING);
  CHECK(std::fabs(host.degrees() - start - 400.0) < 0.3);
}

TEST(TRACK_bridges_a_lost_setpoint_and_bears_a_late_one) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  const float start = static_cast<float>(host.degrees());
  Meter meter(bench);
  double worst = 0.0;
  for (int step = 1; step <= 100; ++step) {
    const float v = std::min(20.0F, static_cast<float>(step));  // rpm
    static float place;
    place = step == 1 ? start : place;
    place += v * 6.0F * 0.02F;
    const bool lost = step == 60;
    const double late = step == 70 ? 0.008 : 0.0;
    meter.run(late);
    if (!lost) host.send(Register::TRACK, setpoint(place, v), 6);
    meter.run(0.02 - late);
    if (step > 40) worst = std::max(worst, std::fabs(host.degrees() - place));
  }
  CHECK(host.fault() == Fault::NONE);
  CHECK(worst < 3.0);
  CHECK(meter.extremes.speed < 40.0 / kRpm);
}

// Clocks of host and joint drift against each other, so each phase of the arrivals occurs. Next to a
// tick a few microseconds decide which one takes the setpoint, and 9 or 11 ticks are between two.
TEST(TRACK_does_not_shake_wherever_between_two_ticks_its_setpoints_arrive) {
  constexpr double kRate = 2.0e5, kCurve = 2.0e5;  // steps/s, steps/s^2
  const auto place = [](double t) { return kRate * t - 0.5 * kCurve * t * t; };
  std::mt19937 random(1);
  std::uniform_int_distribution<int> scatter(-20, 20);
  double worst = 0.0;
  for (long phase = 0; phase < 1000; phase += 50) {
    Tracker tracker;
    tracker.start(0.0F, static_cast<float>(kRate));
    long step = 0, arrival = 10000 + phase;
    for (long tick = 1000; tick < 150000; tick += 1000) {
      // A frame that arrives while the tick reads its sensors is still taken by it.
      if (arrival <= tick + 150) {
        const double next = 1e-6 * static_cast<double>(10000 * ++step);
        if (step != 8)  // One is lost.
          tracker.setpoint(static_cast<float>(place(next)),
                           static_cast<float>(kRate - kCurve * next),
                           static_cast<uint32_t>(arrival), static_cast<uint32_t>(tick));
        arrival = 10000 * (step + 1) + phase + scatter(random);
      }
      tracker.advance();
      // The first interval is not known; the next three make up for its error.
      if (step < 5) continue;
      const double now = 1e-6 * static_cast<double>(tick - 10000 - phase);
      worst = std::max(worst, std::fabs(tracker.velocity() - (kRate - kCurve * now)) / kRate);
    }
  }
  std::printf("     speed off by %.2f %% at most\n", worst * 100.0);
  CHECK(worst < 0.03);
}

TEST(TRACK_refuses_a_setpoint_out_of_reach_and_moves_within_the_limits_to_one_in_reach) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable(20, 60.0, 100.0);
  const float start = static_cast<float>(host.degrees());
  const double before = bench.driver().field();
  const float reach = static_cast<float>(60.0 * 0.1 * kDegrees) + 5.0F;
  for (float far : {1.1F * reach, -1.1F * reach, 1e6F}) {
    CHECK(has(host.send(Register::TRACK, setpoint(start + far, 0.0F), 6)[0], Flags::REFUSED));
    CHECK(host.report().refusal == Refusal::OUT_OF_RANGE);
  }
  bench.run(0.1);
  // The position of the rotor may still be corrected.
  CHECK(std::fabs(bench.driver().field() - before) < 20.0);
  // The limit is 573 rpm; a setpoint may ask for a tenth more.
  const unsigned refusals = host.report().refusals;
  for (float rpm : {640.0F, -640.0F, 3000.0F, -3000.0F}) {
    CHECK(has(host.send(Register::TRACK, setpoint(start, rpm), 6)[0], Flags::REFUSED));
    CHECK(host.report().refusal == Refusal::OUT_OF_RANGE);
  }
  CHECK(host.report().refusals == refusals + 4);
  // A step within reach: never refused, but never harder or faster than allowed.
  Meter meter(bench);
  for (int time = 0; time < 60; ++time) {
    host.send(Register::TRACK, setpoint(start + 0.9F * reach, 0.0F), 6);
    meter.run(0.02);
  }
  CHECK(meter.extremes.speed < 60.0 * 1.12);
  CHECK(meter.extremes.acceleration < 100.0 * 1.2);
  CHECK(std::fabs(host.degrees() - start - 0.9 * reach) < 0.3);
}

TEST(a_speed_limit_beyond_the_drivers_own_does_not_widen_the_reach_of_a_setpoint) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  host.send(Register::SETMAXVELOCITY, packed(1e30F));
  bench.tick();
  // The driver's own limit is 614 rad/s.
  const float far = static_cast<float>(host.degrees()) + 3600.0F;
  CHECK(has(host.send(Register::TRACK, setpoint(far, 0.0F), 6)[0], Flags::REFUSED));
  CHECK(host.report().refusal == Refusal::OUT_OF_RANGE);
}

TEST(a_setpoint_that_a_lower_limit_meets_within_its_tick_obeys_that_limit) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  const float start = static_cast<float>(host.degrees());
  bench.tick();
  host.send(Register::SETMAXVELOCITY, packed(static_cast<float>(10.0 * kDegrees)));
  const Bytes answer =
      host.send(Register::TRACK, setpoint(start, static_cast<float>(100.0 * kRpm)), 6);
  CHECK(!has(answer.back(), Flags::REFUSED));
  bench.run(0.05);
  CHECK(bench.field_speed() < 11.1);
  // The controller hangs: at 10 rad/s the motor comes to rest at once, at 100 after 13 rad.
  const double field = bench.field();
  bench.hang(true);
  bench.run(3.0);
  CHECK(bench.field_speed() == 0.0);
  CHECK(std::fabs(bench.field() - field) < 1.0);
}

TEST(TRACK_does_not_catch_up_faster_than_its_limit_allows) {
  Bench bench(4);
  bench.mechanics().remove_stops();
  Host host(bench, 4);
  host.arm_session();
  host.enable(20, 20.0, 336.0);
  const float start = static_cast<float>(host.degrees());
  Meter meter(bench);
  for (int step = 1; step <= 20; ++step) {
    // Positions that need twice the limit.
    const float place = start + static_cast<float>(step * 0.02 * 40.0 * kDegrees);
    CHECK(!has(host.send(Register::TRACK, setpoint(place, static_cast<float>(20.0 * kRpm)), 6)
                   .back(),
               Flags::REFUSED));
    meter.run(0.02);
    if (host.fault() != Fault::NONE) break;
  }
  CHECK(meter.extremes.speed > 20.0);
  CHECK(meter.extremes.speed < 20.0 * 1.12);
}

TEST(limits_hold_in_every_mode) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable(20, 50.0, 200.0);
  bench.mechanics().remove_stops();
  Meter meter(bench);
  const auto feed = [&](Register code, const Bytes& payload, double seconds) {
    for (int time = 0; time < seconds / 0.02; ++time) {
      host.send(code, payload);
      meter.run(0.02);
    }
  };
  feed(Register::SETRPM, packed(5000.0F), 0.5);
  feed(Register::SETRPM, packed(-5000.0F), 0.5);
  feed(Register::RUNCONTINUOUS, {1}, 0.5);
  feed(Register::MOVETOANGLE, packed(3000.0F), 0.5);
  feed(Register::MOVETOANGLE, packed(-3000.0F), 0.5);
  CHECK(meter.extremes.speed < 50.0 * 1.01);
  CHECK(meter.extremes.speed > 50.0 * 0.98);
  CHECK(meter.extremes.acceleration < 200.0 * 1.03);
  CHECK(host.fault() == Fault::NONE);
}

TEST(accelerations_are_clamped_and_do_not_wrap) {
  // In the original, 11637 steps/s^2 and more wrap to almost nothing.
  for (float degrees : {20946.0F, 21000.0F, 1e6F, 1e30F}) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    host.enable();
    host.send(Register::SETMAXACCELERATION, packed(degrees));
    host.turn(10.0);
    bench.run(0.035);  // 365 rad/s^2 need 27 ms.
    CHECK(bench.field_speed() > 9.9);
    // Its braking distance is known: it reaches full speed.
    host.turn(100.0);
    host.keep(0.4);
    CHECK(bench.field_speed() > 99.0);
  }
}

TEST(a_deceleration_limit_of_its_own) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable(20, 60.0, 300.0);
  host.send(Register::SETMAXDECELERATION, packed(static_cast<float>(50.0 * kDegrees)));
  host.turn(30.0);
  host.keep(0.2);
  CHECK(std::fabs(bench.field_speed() - 30.0) < 0.1);
  host.send(Register::STOP, {1});
  // A host that watches the stop; without one it becomes as hard as the joint allows.
  for (int poll = 0; poll < 15; ++poll) {
    host.state();
    bench.run(0.02);
  }
  CHECK(std::fabs(bench.field_speed() - 15.0) < 0.5);
  host.send(Register::STOP, {0});
  bench.run(0.06);
  CHECK(bench.field_speed() == 0.0);
}

TEST(a_speed_limit_starts_and_reverses_nothing) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  host.turn(-10.0);
  host.keep(0.2);
  host.send(Register::STOP, {0});
  host.keep(0.3);
  const double before = bench.driver().field();
  host.send(Register::SETMAXVELOCITY, packed(6000.0F));
  host.keep(0.2);
  CHECK(std::fabs(bench.driver().field() - before) < 64.0);
  host.turn(-40.0);
  host.keep(0.3);
  host.send(Register::SETMAXVELOCITY, packed(static_cast<float>(10.0 * kDegrees)));
  host.keep(0.3);
  CHECK(std::fabs(bench.field_speed() + 10.0) < 0.1);
}

TEST(every_register_that_the_original_only_names) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable(20, 40.0, 300.0);
  bench.run(0.3);
  const double start = host.degrees();
  CHECK(host.send(Register::GETMOTORSTATE, {}, 1)[0] == 0x38);  // reached, at speed 0, standing
  host.send(Register::RUNCONTINUOUS, {0});
  host.keep(0.3);
  host.send(Register::RUNCONTINUOUS, {0});
  CHECK(std::fabs(load<float>(host.send(Register::GETDRIVERRPM, {}, 4).data()) + 40.0 * kRpm) <
        1.0);
  CHECK(std::fabs(load<float>(host.send(Register::GETENCODERRPM, {}, 4).data()) + 40.0 * kRpm) <
        15.0);
  CHECK(host.send(Register::GETMOTORSTATE, {}, 1)[0] == 0x10);
  CHECK(std::fabs(load<float>(host.send(Register::GETPIDERROR, {}, 4).data())) < 300.0);
  host.send(Register::STOP, {0});
  host.keep(0.4);
  const double there = host.degrees();
  CHECK(there < start - 100.0);
  host.send(Register::MOVEANGLE, packed(90.0F));
  host.keep(0.8);
  CHECK(std::fabs(host.degrees() - there - 90.0) < 0.3);
  host.send(Register::MOVESTEPS, packed(std::int32_t{-12800}));
  host.keep(0.8);
  CHECK(std::fabs(host.degrees() - there) < 0.3);
  for (Register code : {Register::ENABLEPID, Register::DISABLEPID, Register::ENABLECLOSEDLOOP,
                        Register::DISABLESTALLGUARD, Register::CLEARSTALL})
    CHECK(!has(host.send(code, {0})[0], Flags::REFUSED));
  CHECK(!has(host.send(Register::SETCONTROLTHRESHOLD, packed(20.0F))[0], Flags::REFUSED));
  CHECK(has(host.send(Register::MOVETOEND, {1, 60, 30})[0], Flags::BUSY));
  const std::uint8_t flags = host.wait_until_idle();
  CHECK(host.fault() == Fault::NONE);
  CHECK(has(flags, Flags::NOTHOMED));
  CHECK(std::fabs(bench.position() - 3.01069) < 0.06);
  host.send(Register::DISABLECLOSEDLOOP, {0});
  bench.run(0.3);
  CHECK(has(host.flags(), Flags::NOTENABLED));
}

TEST(position_is_corrected_at_rest_and_only_when_asked_for) {
  for (bool corrected : {true, false}) {
    Bench bench(4);
    Host host(bench, 4);
    host.arm_session();
    host.enable();
    if (!corrected) host.send(Register::DISABLEPID, {0});
    const float start = static_cast<float>(host.degrees());
    // A load that turns the rotor away from its field.
    bench.mechanics().push(0.03 * 12.0);
    for (int time = 0; time < 100; ++time) {
      host.send(Register::MOVETOANGLE, packed(start + 90.0F));
      bench.run(0.02);
    }
    const double off = std::fabs(host.degrees() - start - 90.0);
    if (corrected) CHECK(off < 20.0 / 142.2);  // threshold 15 microsteps and some noise
    if (!corrected) CHECK(off > 20.0 / 142.2);
  }
}

TEST(the_field_is_known_also_where_friction_held_the_rotor_opposite_to_it) {
  const auto error_after_a_move = [](Host<Bench>& host) {
    double sum = 0.0;
    for (float way : {30.0F, -30.0F}) {
      host.send(Register::MOVEANGLE, packed(way));
      host.keep(0.6);
    }
    for (int time = 0; time < 5; ++time) {
      host.keep(0.05);
      sum += load<float>(host.send(Register::GETPIDERROR, {}, 4).data());
    }
    return std::fabs(sum / 5.0);
  };
  for (int joint : {1, 2}) {
    const double turn = 6.283185307179586 / bioscara::sim::parameters_of(joint).reduction;
    for (int share = 46; share <= 54; ++share) {
      Bench bench(joint);
      // So many hundredths of an electrical period, of which a turn has 50.
      bench.mechanics().set_position(0.1 + turn * share / 5000.0);
      bench.boot(ResetCause::POWER_ON);
      Host host(bench, joint);
      const auto enable = [&] { host.enable(joint == 2 ? 40 : 20, 35.0, 70.0); };
      host.arm_session();
      enable();
      CHECK(error_after_a_move(host) < 150.0);
      host.send(Register::SETHOLDCURRENT, {0});
      host.keep(0.5);
      CHECK(!bench.stage_closed());
      const double place = bench.position();
      for (int step = 1; step <= 100; ++step) {
        bench.mechanics().set_position(place + 1e-2 * step * turn * share / 5000.0);
        bench.tick();
      }
      enable();
      CHECK(error_after_a_move(host) < 150.0);
      CHECK(host.fault() == Fault::NONE);
    }
  }
}

TEST(a_motor_may_be_plugged_in_either_way) {
  for (int joint : {1, 2, 3, 4}) {
    for (bool turned : {false, true}) {
      Bench bench(joint);
      bench.driver().reverse_coil(turned);
      Host host(bench, joint);
      host.arm_session();
      const double first = bench.rotor();
      host.enable(40);
      CHECK(host.fault() == Fault::NONE);
      // Without current it may have stood as far as an electrical period from its field.
      CHECK(std::fabs(bench.rotor() - first) < 7.2 / kDegrees);
      // The driver restarts: its new settings keep the direction.
      bench.driver().power_up();
      bench.run(0.1);
      CHECK(host.fault() == Fault::DRIVER_RESET);
      host.clear_fault();
      bench.run(0.4);
      double before = bench.rotor(), farthest = 0.0;
      host.send(Register::SETUP, {40, 40, 0, 0});
      while (has(host.flags(), Flags::BUSY)) {
        host.keep(0.02);
        farthest = std::max(farthest, before - bench.rotor());
      }
      CHECK(host.fault() == Fault::NONE);
      CHECK(farthest < 1.5 / kDegrees);
      before = bench.rotor();
      host.send(Register::MOVEANGLE, packed(20.0F));
      host.keep(1.0);
      CHECK(std::fabs((bench.rotor() - before) * kDegrees - 20.0) < 0.5);
      // A direction that changes later is a fault, and nothing adapts to it.
      bench.driver().reverse_coil(!turned);
      host.send(Register::CHECKORIENTATION, packed(1.0F));
      for (int time = 0; time < 3; ++time) {
        host.wait_until_idle();
        CHECK(host.fault() == Fault::ORIENTATION);
        CHECK(!bench.stage_closed());
        host.clear_fault();
        bench.run(0.4);
        host.send(Register::SETUP, {40, 40, 0, 0});
      }
    }
  }
}

TEST(a_long_check_beside_an_end_stop_takes_the_free_side) {
  for (int joint = 1; joint <= 4; ++joint) {
    const auto& limits = bioscara::sim::parameters_of(joint);
    for (bool upper : {true, false}) {
      // So far away from the end stop [deg of the motor].
      for (double beside : {0.5, 4.0, 9.0, 12.0, 17.0, 21.0}) {
        for (float angle : {2.5F, 5.0F, 10.0F}) {
          Bench bench(joint);
          const double motor = (upper ? -1.0 : 1.0) * beside / kDegrees;
          bench.mechanics().set_position((upper ? limits.upper : limits.lower) +
                                         motor / std::fabs(limits.reduction));
          bench.boot(ResetCause::POWER_ON);
          Host host(bench, joint);
          host.arm_session();
          host.enable(joint == 2 ? 40 : 20);
          CHECK(host.fault() == Fault::NONE);
          const double rotor = bench.rotor();
          const double begin = bench.now();
          host.send(Register::CHECKORIENTATION, packed(angle));
          // The rotor never loses the field, which 704 microsteps are beyond.
          int most = 0;
          for (int tick = 0; has(host.flags(), Flags::BUSY); ++tick) {
            if (tick % 20 == 0) host.send(Register::WATCHDOG, {60, 0});
            bench.tick();
            most = std::max<int>(most, host.state().load_percent);
          }
          CHECK(most <= 60);
          CHECK(bench.now() - begin < 4.5);
          host.keep(0.3);
          if (host.fault() != Fault::NONE || std::fabs(bench.rotor() - rotor) > 1.0 / kDegrees) std::printf("j%d upper %d beside %g angle %g: fault %d %g moved %g\n", joint, upper, beside, double(angle), int(host.fault()), double(host.report().data), (bench.rotor() - rotor) * kDegrees);
          CHECK(host.fault() == Fault::NONE);
          CHECK(!has(host.flags(), Flags::NOTENABLED));
          CHECK(std::fabs(bench.rotor() - rotor) < 1.0 / kDegrees);
        }
      }
    }
  }
}

TEST(a_lift_that_rubs_passes_its_check_wherever_it_stands) {
  const double turn = 6.283185307179586 / bioscara::sim::parameters_of(2).reduction;
  for (int share = 0; share < 100; share += 3) {
    Bench bench(2);
    bench.mechanics().set_friction_factor(2.5);
    bench.mechanics().set_position(0.1 + turn * share / 5000.0);
    bench.boot(ResetCause::POWER_ON);
    Host host(bench, 2);
    host.arm_session();
    host.enable(40, 35.0, 70.0);
    CHECK(host.fault() == Fault::NONE);
    CHECK(!has(host.flags(), Flags::NOTENABLED));
  }
}

TEST(a_disabled_joint_moves_for_nobody) {
  Bench bench(4);
  Host host(bench, 4);
  const double before = bench.driver().field();
  for (const bool armed : {false, true}) {
    if (armed) host.arm_session();
    for (const auto& [code, payload] :
         {std::pair{Register::SETRPM, packed(60.0F)}, {Register::MOVESTEPS, packed(400)},
          {Register::MOVEANGLE, packed(10.0F)}, {Register::MOVETOANGLE, packed(10.0F)},
          {Register::RUNCONTINUOUS, Bytes{1}}, {Register::MOVETOEND, Bytes{1, 20, 30}},
          {Register::CHECKORIENTATION, packed(5.0F)}, {Register::HOME, Bytes{1, 11, 30, 10}},
          {Register::TRACK, setpoint(0.0F, 0.0F)}}) {
      CHECK(has(host.send(code, payload)[0], Flags::REFUSED));
      CHECK(host.report().refusal == Refusal::NOT_ENABLED);
      bench.run(0.02);
    }
  }
  CHECK(bench.driver().field() == before);
  CHECK(!bench.stage_closed());
}

TEST(a_command_that_runs_by_itself_ends_the_motion_before_it) {
  for (const auto& [code, payload] :
       {std::pair{Register::CHECKORIENTATION, packed(1.0F)},
        {Register::MOVETOEND, Bytes{1, 11, 30}},
        {Register::HOME, Bytes{1, 11, 30, 10}}}) {
    Bench bench(3);
    bench.mechanics().remove_stops();
    Host host(bench, 3);
    host.arm_session();
    host.enable();
    host.turn(100.0);
    host.keep(0.5);
    const double start = bench.rotor();
    const double lead = bench.field() - start;
    host.send(code, payload);
    host.keep(0.5);
    // At 336 rad/s^2 it needs 15 rad to stop.
    CHECK(bench.rotor() - start < 18.0);
    CHECK(std::fabs(bench.field() - bench.rotor() - lead) < 0.1);
    host.keep(0.8);
    CHECK(host.fault() == Fault::NONE);
    const bool ended = !has(host.flags(), Flags::BUSY);
    CHECK(ended == (code == Register::CHECKORIENTATION));
  }
}

TEST(current_goes_off_at_standstill_only) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  host.turn(40.0);
  host.keep(0.3);
  CHECK(has(host.send(Register::SETHOLDCURRENT, {0})[0], Flags::NOTENABLED));
  host.send(Register::SETCURRENT, {0});
  bench.tick();
  while (bench.field_speed() != 0.0) {
    CHECK(bench.stage_closed());
    CHECK(bench.driver().current_share(true) > 2.0 / 32.0);
    bench.tick();
  }
  bench.run(0.2);
  CHECK(!bench.stage_closed());
  CHECK(host.state().state == JointState::DISABLED);
}

TEST(the_clock_may_wrap) {
  // The microseconds overflow half a second after the start of the motion.
  Bench bench(4, 0U - 3000000U);
  bench.mechanics().remove_stops();
  Host host(bench, 4);
  host.arm_session();
  host.enable();
  while (bench.now() < 4.0) {
    host.turn(10.0);
    bench.run(0.02);
  }
  CHECK(host.fault() == Fault::NONE);
  CHECK(std::fabs(bench.field_speed() - 10.0) < 0.1);
  CHECK(std::fabs(follow_ramp(host, 10.0, 336.0, 0.02, 0.1)) < 1e8);
}

TEST(a_tick_needs_no_more_SPI_than_the_README_says) {
  int worst = 0;
  for (int joint = 1; joint <= 4; ++joint) {
    Bench bench(joint);
    Host host(bench, joint);
    host.arm_session();
    host.enable(40);
    host.turn(10.0);
    host.keep(0.1);
    follow_ramp(host, 10.0, 100.0, 0.02, 0.3);
    host.send(Register::STOP, {0});
    host.keep(0.2);
    host.home(joint > 2, 20, 30, 20);
    host.keep(20.0);
    host.send(Register::SETBRAKEMODE, {1});
    host.send(Register::SETHOLDCURRENT, {0});
    host.keep(0.5);
    worst = std::max(worst, bench.worst_exchanges());
  }
  std::printf("     %d datagrams at most\n", worst);
  CHECK(worst <= 12);
}
