// A joint that enters and leaves its firmware: an encoder that starts late, and the bootloader.
#include <cstdint>

#include "bench.h"
#include "client.h"
#include "testing.h"

using namespace bioscara;
using bench::Bench;
using client::Bytes;
using client::has;
using client::packed;
using Host = client::Host<Bench>;

namespace {

std::uint16_t boot_id(Host& host) { return load<std::uint16_t>(&host.hello()[6]); }

bool refused(Host& host, Register code, std::uint16_t boot) {
  return has(host.send(code, packed(boot))[0], Flags::REFUSED);
}

}  // namespace

TEST(an_encoder_that_starts_late_delays_the_joint_and_is_no_fault) {
  Bench bench(4);
  Host host(bench, 4);
  bench.encoder().corrupt(true);
  bench.boot(ResetCause::POWER_ON);
  host.arm_session();
  for (int tick = 0; tick < 15; ++tick) bench.tick();
  CHECK(has(host.flags(), Flags::BUSY));
  CHECK(has(host.send(Register::SETUP, {20, 20, 0, 0})[0], Flags::REFUSED));
  CHECK(host.report().refusal == Refusal::BUSY);
  bench.encoder().corrupt(false);
  bench.tick();
  CHECK(!has(host.flags(), Flags::BUSY));
  CHECK(host.fault() == Fault::NONE);
  CHECK(std::fabs(host.degrees()) < 0.1);
  host.enable();
  CHECK(!has(host.flags(), Flags::NOTENABLED));
}

TEST(an_encoder_that_never_starts_is_a_fault) {
  Bench bench(4);
  Host host(bench, 4);
  bench.encoder().corrupt(true);
  bench.boot(ResetCause::POWER_ON);
  for (int tick = 0; tick < 25; ++tick) bench.tick();
  CHECK(host.fault() == Fault::ENCODER);
  CHECK(!has(host.flags(), Flags::BUSY));
}

TEST(two_steps_lead_to_the_bootloader_and_its_answer_is_given_first) {
  Bench bench(2);
  Host host(bench, 2);
  host.arm_session();
  const std::uint16_t boot = boot_id(host);
  const Bytes disarmed = host.send(Register::DISARM, packed(boot));
  CHECK(!has(disarmed[0], Flags::REFUSED) && !has(disarmed[0], Flags::ARMED));
  CHECK(!refused(host, Register::BOOTLOADER, boot));
  bench.run(0.01);
  CHECK(!bench.left());
  bench.run(0.02);
  CHECK(bench.left() && !bench.stage_closed());
}

TEST(one_step_or_anything_between_the_two_does_not) {
  Bench bench(2);
  Host host(bench, 2);
  host.arm_session();
  const std::uint16_t boot = boot_id(host);
  CHECK(refused(host, Register::BOOTLOADER, boot));
  CHECK(host.report().refusal == Refusal::NOT_DISARMED);
  CHECK(!refused(host, Register::DISARM, boot));
  host.flags();
  CHECK(refused(host, Register::BOOTLOADER, boot));
  CHECK(!refused(host, Register::DISARM, boot));
  bench.run(2.1);
  CHECK(refused(host, Register::BOOTLOADER, boot));
  CHECK(refused(host, Register::DISARM, static_cast<std::uint16_t>(boot + 1)));
  CHECK(host.report().refusal == Refusal::WRONG_BOOT);
  bench.run(0.1);
  CHECK(!bench.left());
}

TEST(an_enabled_joint_keeps_its_session_and_its_firmware) {
  Bench bench(2);
  Host host(bench, 2);
  host.arm_session();
  const std::uint16_t boot = boot_id(host);
  host.enable();
  CHECK(refused(host, Register::DISARM, boot));
  CHECK(host.report().refusal == Refusal::ENABLED);
  CHECK(has(host.flags(), Flags::ARMED));
  // Disabled, it still comes to rest first.
  host.send(Register::DISABLECLOSEDLOOP, {0});
  bench.run(0.01);
  CHECK(refused(host, Register::DISARM, boot));
  CHECK(host.report().refusal == Refusal::BUSY);
  host.keep(0.2);
  CHECK(!refused(host, Register::DISARM, boot));
  CHECK(!refused(host, Register::BOOTLOADER, boot));
  bench.run(0.03);
  CHECK(bench.left() && !bench.stage_closed());
  // Its hold current would not flow either if the enable pin were let go.
  CHECK(bench.driver().current_share(true) == 0.0);
}

TEST(a_joint_that_is_enabled_again_in_time_stays) {
  Bench bench(2);
  Host host(bench, 2);
  host.arm_session();
  const std::uint16_t boot = boot_id(host);
  CHECK(!refused(host, Register::DISARM, boot));
  CHECK(!refused(host, Register::BOOTLOADER, boot));
  host.enable();
  CHECK(!bench.left());
}

TEST(errors_of_the_bus_can_be_read) {
  Bench bench(1);
  Host host(bench, 1);
  bench.set_bus_errors(513);
  CHECK(load<std::uint16_t>(host.send(Register::BUSERRORS, {}, 2).data()) == 513);
}
