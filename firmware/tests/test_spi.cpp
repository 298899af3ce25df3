// One damaged datagram between controller and driver: its bits are not checked by either chip.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
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
// Ticks of a run: 0.6 s of motion, and rest.
constexpr int kTicks = 900;
// Longest time above the commanded speed, and how far from the undamaged course [rad; m for j2].
constexpr int kFastMost = 3;
constexpr double kAwayMost[] = {10e-3, 0.1e-3, 10e-3, 10e-3};

enum class Mode { POSITION, TRACK, VELOCITY };

// Speed and acceleration of the motor [rad/s, rad/s2], and currents [%], as the arm configures them.
struct Setting {
  double speed, acceleration;
  int percent;
};
constexpr Setting kSettings[] = {{35.0, 70.0, 20}, {31.4, 314.0, 40}, {120.0, 336.0, 20}, {120.0, 360.0, 20}};

struct Course {
  std::vector<double> positions;
  std::vector<double> speeds;
  long datagrams = 0;
  bool fault = false;
};

// The motion, damaged or not; ends early with a fault.
template <typename Prepare>
Course move(int joint, Mode mode, Prepare prepare) {
  const Setting& setting = kSettings[joint - 1];
  Bench bench(joint);
  bench.mechanics().remove_stops();
  Host<Bench> host(bench, joint);
  host.arm_session();
  host.enable(setting.percent, setting.speed, setting.acceleration, joint == 2 ? 12 : 6);
  const double start = host.degrees();
  // A course of 0.6 s, its ends with the full acceleration.
  const double ramp = std::min(0.3, setting.speed / setting.acceleration);
  const double speed = setting.acceleration * ramp;
  const double way = speed * (0.6 - ramp);
  const auto place = [&](double time) {
    if (time < ramp) return 0.5 * setting.acceleration * time * time;
    if (time < 0.6 - ramp) return speed * (time - 0.5 * ramp);
    const double left = std::max(0.0, 0.6 - time);
    return way - 0.5 * setting.acceleration * left * left;
  };
  Course course;
  prepare(bench);
  const long first = bench.datagrams();
  for (int tick = 0; tick < kTicks && !course.fault; ++tick) {
    const double now = tick * 1e-3;
    if (tick % 20 == 0) {
      if (mode == Mode::POSITION) {
        host.send(Register::MOVETOANGLE, packed(static_cast<float>(start + way * kDegrees)));
      } else if (mode == Mode::VELOCITY) {
        host.turn(now < 0.3 ? 0.5 * speed : 0.0);
      } else {
        const double next = now + 0.02;
        const double rate = (place(next + 1e-4) - place(next - 1e-4)) / 2e-4;
        host.send(Register::TRACK,
                  setpoint(static_cast<float>(start + place(next) * kDegrees),
                           static_cast<float>(rate * 60.0 / 6.283185307179586)));
      }
    }
    bench.tick();
    course.positions.push_back(bench.position());
    course.speeds.push_back(std::fabs(bench.field_speed()));
    course.fault = has(host.flags(), Flags::FAULT);
  }
  course.datagrams = bench.datagrams() - first;
  return course;
}

struct Worst {
  double away = 0.0;
  int fast = 0;
  int faults = 0;
};

// Compares a damaged course with the undamaged one; false where it breaks the law.
bool holds(int joint, double limit, const Course& sound, const Course& damaged, Worst& worst, double share = 1.0) {
  worst.faults += damaged.fault ? 1 : 0;
  double away = 0.0;
  int fast = 0, longest = 0;
  for (std::size_t tick = 0; tick < damaged.positions.size(); ++tick) {
    fast = damaged.speeds[tick] > limit ? fast + 1 : 0;
    longest = std::max(longest, fast);
    away = std::max(away, std::fabs(damaged.positions[tick] - sound.positions[tick]));
  }
  worst.fast = std::max(worst.fast, longest);
  if (damaged.fault) return longest <= kFastMost;
  worst.away = std::max(worst.away, away);
  return longest <= kFastMost && away <= share * kAwayMost[joint - 1];
}

// A number of the environment, or this one.
unsigned number(const char* name, unsigned otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : static_cast<unsigned>(std::strtoul(text, nullptr, 10));
}

}  // namespace

TEST(a_damaged_datagram_at_any_moment_of_a_move_moves_no_joint_off_its_course) {
  const unsigned seed = number("BIOSCARA_SEED", 1), runs = number("BIOSCARA_SPI_RUNS", 120);
  std::printf("     seed %u\n", seed);
  std::mt19937 random(seed);
  for (int joint = 1; joint <= 4; ++joint) {
    for (Mode mode : {Mode::POSITION, Mode::TRACK, Mode::VELOCITY}) {
      const Course sound = move(joint, mode, [](Bench&) {});
      CHECK(!sound.fault);
      // TRACK may catch up.
      const double limit = kSettings[joint - 1].speed * (mode == Mode::TRACK ? 1.1 : 1.0) + 0.05;
      Worst worst;
      for (unsigned run = 0; run < runs; ++run) {
        // Mostly in motion: a third of the run is rest.
        const long datagram = static_cast<long>(random() % static_cast<unsigned long>(sound.datagrams));
        const bool sent = random() % 3 != 0;
        std::uint8_t original[5] = {};
        const unsigned kind = random() % 10, bit = random() % 40, noise = random();
        const auto spoil = [&](std::uint8_t(&bytes)[5]) {
          std::copy_n(bytes, 5, original);
          if (kind == 0) {
            std::fill_n(bytes, 5, std::uint8_t{0});
          } else if (kind == 1) {
            // A clock edge was lost.
            for (int i = 4; i >= 0; --i)
              bytes[i] = static_cast<std::uint8_t>(bytes[i] >> 1 | (i > 0 ? bytes[i - 1] << 7 : 0));
          } else if (kind == 2) {
            for (int i = 1; i < 5; ++i) bytes[i] = static_cast<std::uint8_t>(noise >> (8 * (i - 1)));
          } else {
            bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 0x80 >> bit % 8);
          }
        };
        const Course damaged =
            move(joint, mode, [&](Bench& bench) { bench.damage(datagram, sent, spoil); });
        if (!holds(joint, limit, sound, damaged, worst)) {
          std::printf("     j%d mode %d datagram %ld (%02x %02x%02x%02x%02x) %s kind %u bit %u noise %08x\n",
                      joint, static_cast<int>(mode), datagram, original[0], original[1], original[2],
                      original[3], original[4], sent ? "sent" : "received", kind, bit, noise);
          CHECK(false);
        }
      }
      std::printf("     j%d: at most %.3f %s away, %d ticks too fast; %d of %u ended with a fault\n", joint,
                  worst.away * 1e3, joint == 2 ? "mm" : "mrad", worst.fast, worst.faults, runs);
    }
  }
}

// The settings of a move are written in its first two ticks. A setpoint of j4 at full acceleration is not caught
// up with before it brakes: 4 ms are 40 mrad.
TEST(each_bit_of_an_address_in_the_first_datagrams_of_a_move_may_arrive_flipped) {
  constexpr long kFirst = 14;
  for (int joint : {3, 4}) {
    for (Mode mode : {Mode::POSITION, Mode::TRACK, Mode::VELOCITY}) {
      const Course sound = move(joint, mode, [](Bench&) {});
      const double limit = kSettings[joint - 1].speed * (mode == Mode::TRACK ? 1.1 : 1.0) + 0.05;
      Worst worst;
      for (long datagram = 0; datagram < kFirst; ++datagram) {
        for (int bit = 1; bit < 8; ++bit) {
          const auto spoil = [&](std::uint8_t(&bytes)[5]) { flips::flip(bytes, bit); };
          const Course damaged =
              move(joint, mode, [&](Bench& bench) { bench.damage(datagram, true, spoil); });
          const bool held = holds(joint, limit, sound, damaged, worst, joint == 4 && mode == Mode::TRACK ? 4.0 : 1.0);
          if (!held) std::printf("     j%d mode %d datagram %ld bit %d\n", joint, static_cast<int>(mode), datagram, bit);
          CHECK(held);
        }
      }
      std::printf("     j%d: at most %.3f mrad away, %d faults\n", joint, worst.away * 1e3, worst.faults);
    }
  }
}

namespace {

struct Turning {
  Turning() : bench(3), host(bench, 3) {
    bench.mechanics().remove_stops();
    host.arm_session();
    host.enable();
    host.turn(20.0);
    host.keep(0.2);
  }
  Bench bench;
  Host<Bench> host;
};

}  // namespace

TEST(a_read_that_arrives_as_a_write_and_a_status_that_one_answer_shows_change_nothing) {
  for (bool sent : {true, false}) {
    Turning joint;
    for (int time = 0; time < 20; ++time) {
      // The first datagram of a tick reads the position.
      joint.bench.damage(0, sent, [&](std::uint8_t(&bytes)[5]) {
        if (sent) CHECK(bytes[0] == 0x21);
        bytes[0] = static_cast<std::uint8_t>(bytes[0] ^ (sent ? 0x80 : 0x01));
      });
      joint.bench.tick();
      joint.host.turn(20.0);
      joint.bench.run(0.003);
    }
    CHECK(joint.host.fault() == Fault::NONE);
    CHECK(std::fabs(joint.bench.field_speed() - 20.0) < 0.1);
  }
}

TEST(a_position_counter_that_was_overwritten_stops_the_joint_which_is_checked_anew) {
  Turning joint;
  std::uint8_t answer[5];
  joint.bench.driver().exchange({0xA1, 0, 0, 0, 0}, answer);
  joint.host.keep(0.3);
  CHECK(joint.host.fault() == Fault::DRIVER);
  CHECK(joint.host.report().data == 0.0F);
  CHECK(joint.bench.field_speed() == 0.0);
  joint.host.clear_fault();
  const double field = joint.bench.field();
  joint.host.send(Register::SETUP, {20, 20, 0, 0});
  double most = 0.0;
  while (has(joint.host.flags(), Flags::BUSY)) {
    joint.host.keep(0.02);
    most = std::max(most, std::fabs(joint.bench.field() - field));
  }
  CHECK(most > 1.5 / kDegrees);
  joint.host.turn(20.0);
  joint.host.keep(0.2);
  CHECK(joint.host.fault() == Fault::NONE);
  CHECK(std::fabs(joint.bench.field_speed() - 20.0) < 0.1);
}

TEST(a_current_that_arrives_damaged_is_written_again_within_the_tick) {
  Turning joint;
  bool damaged = false;
  for (int number = 0; number < 8; ++number) {
    const auto percent = static_cast<std::uint8_t>(40 + 10 * (number % 2));
    joint.host.send(Register::SETCURRENT, {percent});
    joint.bench.damage(number, true, [&](std::uint8_t(&bytes)[5]) {
      if (bytes[0] != 0x90) return;
      bytes[3] = static_cast<std::uint8_t>(bytes[3] ^ 0x10);
      damaged = true;
    });
    joint.bench.tick();
    const int scale = (31 * percent + 99) / 100;
    CHECK(std::fabs(joint.bench.driver().current_share(true) - (scale + 1) / 32.0) < 1e-6);
    joint.host.turn(20.0);
  }
  CHECK(damaged);
}
