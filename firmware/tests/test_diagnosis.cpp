// Diagnosis of a joint: its image, its last exception, captured errors, its light.
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "bench.h"
#include "client.h"
#include "testing.h"

using namespace bioscara;
using bench::Bench;
using client::Bytes;
using client::has;
using Host = client::Host<Bench>;

namespace {

std::uint16_t captured(Host& host) {
  return load<std::uint16_t>(host.send(Register::CAPTURE, {}, 2).data());
}

Bytes block(Host& host, std::uint8_t number) {
  return host.send(Register::CAPTUREBLOCK, {number}, 2 * kBlockSamples);
}

std::vector<int> all_errors(Host& host) {
  std::vector<int> errors;
  for (std::uint8_t number = 0; number <= kCaptureBlockMost; ++number) {
    const Bytes bytes = block(host, number);
    CHECK(!has(bytes.back(), Flags::REFUSED));
    for (std::size_t index = 0; index < kBlockSamples; ++index)
      errors.push_back(load<std::int16_t>(&bytes[2 * index]));
  }
  return errors;
}

// How long the light was lit, and how often it changed, in so many ticks.
struct Seen {
  int lit = 0;
  int changes = 0;
};
Seen watch(Bench& bench, int ticks, const std::function<void()>& each = [] {}) {
  Seen seen;
  const int before = bench.changes();
  for (int tick = 0; tick < ticks; ++tick) {
    each();
    bench.tick();
    seen.lit += bench.lit();
  }
  seen.changes = bench.changes() - before;
  return seen;
}

}  // namespace

TEST(a_joint_tells_the_checksum_of_its_image_and_its_last_exception) {
  Bench bench(4);
  Host host(bench, 4);
  CHECK(load<std::uint32_t>(host.send(Register::IMAGE, {}, 4).data()) == 0x1BADB002);
  CHECK(host.send(Register::EXCEPTION, {}, 10) == Bytes({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x0C}));
  bench.set_exception({3, 0x08001234, 0x00010000, 1});
  const Bytes told = host.send(Register::EXCEPTION, {}, 10);
  CHECK(told == Bytes({3, 0x34, 0x12, 0x00, 0x08, 0, 0, 1, 0, 1, 0x0C}));
  CHECK(host.hello()[9] == 0xFF);
}

TEST(a_capture_holds_the_error_of_each_tick_from_its_start_on) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  CHECK(captured(host) == 0);
  host.enable();
  host.turn(20.0);
  CHECK(!has(host.send(Register::CAPTURE, {0})[0], Flags::REFUSED));
  CHECK(captured(host) == 0);
  std::vector<double> truth;
  for (int tick = 0; tick < kCaptureSamples; ++tick) {
    // The tick samples before the chips move.
    const double lead = (bench.field() - bench.rotor()) / bench::kRadiansPerStep;
    // The origins of the two are whole electrical periods apart.
    truth.push_back(std::remainder(lead, 1024.0));
    if (tick % 20 == 0) host.turn(20.0 + 0.1 * tick);
    bench.tick();
    CHECK(captured(host) == tick + 1);
  }
  bench.run(0.1);
  CHECK(captured(host) == kCaptureSamples);
  const std::vector<int> errors = all_errors(host);
  // From tick to tick the encoder's own error hardly changes: it is one of its place.
  double largest = 0.0, worst = 0.0;
  for (std::size_t index = 1; index < kCaptureSamples; ++index) {
    const double change = truth[index] - truth[index - 1];
    largest = std::fmax(largest, std::fabs(change));
    worst = std::fmax(worst, std::fabs(change - (errors[index] - errors[index - 1])));
    CHECK(std::fabs(truth[index] - errors[index]) < 160.0);
  }
  std::printf("     captured changes within %.1f of %.1f microsteps\n", worst, largest);
  CHECK(largest > 60.0);
  CHECK(worst < 8.0);
  for (std::size_t index = kCaptureSamples; index < errors.size(); ++index) CHECK(errors[index] == 0);
}

TEST(a_block_is_refused_until_all_of_it_is_captured_and_then_stays_the_same) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  const auto refused = [&](std::uint8_t number) {
    const bool no = has(block(host, number).back(), Flags::REFUSED);
    if (no) CHECK(host.report().refusal == Refusal::OUT_OF_RANGE);
    return no;
  };
  CHECK(refused(0));
  host.enable();
  host.send(Register::CAPTURE, {0});
  CHECK(refused(0));
  for (int tick = 0; tick < 4; ++tick) bench.tick();
  CHECK(refused(0));
  bench.tick();
  CHECK(!refused(0));
  CHECK(refused(1));
  bench.run(0.25);
  CHECK(refused(kCaptureBlockMost));
  bench.tick();
  CHECK(!refused(kCaptureBlockMost));
  CHECK(refused(kCaptureBlockMost + 1));
  CHECK(refused(255));
  const Bytes first = block(host, 3);
  host.keep(0.3);
  Bytes again = block(host, 3);
  CHECK(Bytes(first.begin(), first.end() - 1) == Bytes(again.begin(), again.end() - 1));
  // A new capture replaces it at once, also for a frame that comes before the next tick.
  host.send(Register::CAPTURE, {0});
  CHECK(captured(host) == 0);
  CHECK(refused(3));
}

TEST(a_repeated_command_begins_no_second_capture) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  const Bytes frame = host.frame(Register::CAPTURE, {0}, host.next_sequence());
  host.raw(frame);
  for (int tick = 0; tick < 10; ++tick) bench.tick();
  host.raw(frame);
  bench.tick();
  CHECK(captured(host) == 11);
}

TEST(a_capture_saturates) {
  Capture capture;
  capture.begin();
  for (const float error : {40000.0F, -40000.0F, 32766.6F, -0.4F, 1.5F}) capture.add(error);
  const int expected[] = {32767, -32768, 32767, 0, 2};
  CHECK(capture.holds(0));
  for (std::size_t index = 0; index < kBlockSamples; ++index)
    CHECK(capture.error(0, index) == expected[index]);
}

TEST(the_light_shows_what_the_joint_does) {
  Bench bench(4);
  Host host(bench, 4);
  host.arm_session();
  // A flash of 50 ms every 2 s.
  Seen seen = watch(bench, 4000);
  CHECK(seen.lit == 100 && (seen.changes == 4 || seen.changes == 3));
  host.enable();
  const auto alive = [&] { host.send(Register::WATCHDOG, {60, 0}); };
  seen = watch(bench, 4000, alive);
  CHECK(seen.lit == 2000 && seen.changes == 8);
  // It loses its field.
  bench.mechanics().set_position(bench.position() + 0.2);
  watch(bench, 100, alive);
  CHECK(host.fault() != Fault::NONE);
  seen = watch(bench, 1000);
  CHECK(seen.lit == 500 && seen.changes == 10);
}
