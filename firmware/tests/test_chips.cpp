// The two chips' drivers against answers that the simulated chips do not give.
#include <cstdint>
#include <map>

#include "../joint/src/core/supervisor.h"
#include "../joint/src/core/tle5012b.h"
#include "../sim/src/original_encoder.h"
#include "bench.h"
#include "client.h"
#include "testing.h"

using namespace bioscara;

namespace {

// An encoder whose next answer the test writes.
class Answers : public Hal {
 public:
  std::uint16_t angle = 0;
  std::uint16_t safety = 0xF000;
  bool damaged = false;
  // The error stays in the safety word until the status is read.
  bool latches = false;
  bool error = false;
  // A driver whose reset flag is cleared by reading, not by writing ones.
  bool reset_flag = false;
  int exchanges = 0;
  std::uint8_t asked = 0;
  // The last values of the driver's registers.
  std::map<int, std::uint32_t> written;

  std::uint32_t micros() override { return 0; }
  void driver_exchange(const std::uint8_t (&sent)[5], std::uint8_t (&received)[5]) override {
    constexpr std::uint8_t kGstat = 0x01;
    constexpr std::uint8_t kIoin = 0x04;
    received[1] = asked == kIoin ? 0x11 : 0;
    received[4] = asked == kGstat && reset_flag ? 1 : 0;
    if (asked == kGstat) reset_flag = false;
    asked = sent[0];
    if ((sent[0] & 0x80) != 0)
      written[sent[0] & 0x7F] = static_cast<std::uint32_t>(sent[1]) << 24 |
                                static_cast<std::uint32_t>(sent[2]) << 16 |
                                static_cast<std::uint32_t>(sent[3]) << 8 | sent[4];
  }
  void encoder_exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) override {
    const int address = command >> 4 & 0x3F;
    ++exchanges;
    if ((command & 0x8000) == 0) return;
    std::uint8_t crc = 0xFF;
    const auto add = [&crc](int byte) {
      crc = static_cast<std::uint8_t>(crc ^ byte);
      for (int bit = 0; bit < 8; ++bit)
        crc = static_cast<std::uint8_t>(crc & 0x80 ? (crc << 1) ^ 0x1D : crc << 1);
    };
    // Settings that are as they should be: MOD_1, SIL, MOD_2, and the checksum of those from MOD_2 on.
    constexpr std::uint16_t kSettings[] = {0, 0, 0x0800, 0, 0, 0, 0, 0, 0, 0x0050};
    add(command >> 8);
    add(command & 0xFF);
    for (std::size_t i = 0; i + 1 < count; ++i) {
      words[i] = address == 0x06 ? kSettings[i] : angle;
      add(words[i] >> 8);
      add(words[i] & 0xFF);
    }
    const int sound = error ? safety & ~0x4000 : safety;
    if (latches && address == 0) error = false;
    words[count - 1] = static_cast<std::uint16_t>(sound | (static_cast<std::uint8_t>(~crc) ^ damaged));
  }
  void driver_enable(bool) override {}
  ResetCause reset_cause() override { return ResetCause::POWER_ON; }
  std::uint16_t boot_id() override { return 1; }
  void feed_watchdog() override {}
  std::uint16_t bus_errors() override { return 0; }
  std::uint32_t image() override { return 0; }
  ExceptionRecord exception() override { return {}; }
  void indicate(bool) override {}
  void enter_bootloader() override {}
  void lock() override {}
  void unlock() override {}
};

}  // namespace

TEST(an_angle_counts_only_with_its_check_and_every_bit_of_health) {
  Answers chip;
  Tle5012b encoder(chip);
  CHECK(encoder.setup());
  chip.angle = 100;
  CHECK(encoder.sample());
  CHECK(encoder.counts() == -100);
  chip.angle = 200;
  // System error, interface error, angle not valid.
  for (int bit : {14, 13, 12}) {
    chip.safety = static_cast<std::uint16_t>(0xF000 & ~(1U << bit));
    CHECK(!encoder.sample());
  }
  chip.safety = 0xF000;
  chip.damaged = true;
  CHECK(!encoder.sample());
}

// Source: the encoder of the UstepperS32 library, which existing arms run. Its MOD_2 is 0x0800, whose
// ANG_DIR (bit 3 in the data sheet of the TLE5012B) is 0, so the chip is not inverted; its sample()
// takes delta = old angle - new angle. All parameters of the arms were measured with that sign.
TEST(the_reported_angle_is_the_old_raw_angle_minus_the_new_one) {
  Answers chip;
  Tle5012b ours(chip);
  sim::OriginalEncoder original(chip);
  const std::uint16_t raw[] = {100, 90, 32760, 5, 16000, 100, 32000, 30000};
  chip.angle = raw[0];
  CHECK(ours.setup());
  original.set_home();
  int expected = 0;
  for (std::size_t i = 1; i < sizeof raw / sizeof raw[0]; ++i) {
    int delta = raw[i - 1] - raw[i];
    if (delta > 16384) delta -= 32768;
    if (delta < -16384) delta += 32768;
    expected += delta;
    chip.angle = raw[i];
    CHECK(ours.sample());
    original.sample();
    CHECK(ours.counts() == expected);
    CHECK(original.counts() == expected);
  }
}

TEST(an_error_that_the_encoder_remembers_spoils_one_sample) {
  Answers chip;
  Tle5012b encoder(chip);
  CHECK(encoder.setup());
  chip.latches = chip.error = true;
  CHECK(!encoder.sample());
  CHECK(encoder.sample());
}

TEST(a_reset_flag_is_cleared_by_writing_and_by_reading) {
  Answers chip;
  Tmc5130 driver(chip);
  chip.reset_flag = true;
  driver.setup();
  CHECK(chip.written.at(0x01) == 0x07);
  for (int poll = 0; poll < 40; ++poll) driver.poll();
  CHECK(driver.take_gstat() == 0);
}

TEST(every_bit_by_which_the_driver_reports_harm_is_a_fault) {
  const auto fault = [](std::uint8_t gstat, std::uint32_t status) {
    return driver_fault(gstat, status).fault;
  };
  CHECK(fault(0, 0) == Fault::NONE);
  // Temperature warning, open loads, standstill and stall detection switch nothing off.
  CHECK(fault(0, 1U << 26 | 3U << 29 | 1U << 31 | 1U << 24) == Fault::NONE);
  CHECK(fault(0x01, 0) == Fault::DRIVER_RESET);
  CHECK(fault(0x02, 0) == Fault::DRIVER);
  CHECK(fault(0x04, 0) == Fault::DRIVER);
  CHECK(fault(0, 1U << 25) == Fault::OVERTEMPERATURE);
  CHECK(fault(0, 1U << 27) == Fault::DRIVER);
  CHECK(fault(0, 1U << 28) == Fault::DRIVER);
}

TEST(what_the_driver_is_set_to_stays_within_its_registers) {
  constexpr int kCurrents = 0x10, kAmax = 0x26, kVmax = 0x27, kDmax = 0x28;
  Answers chip;
  Tmc5130 driver(chip);
  driver.setup();
  // No current and no speed until a command asks for them.
  CHECK(chip.written.at(kCurrents) == 0);
  CHECK(chip.written.at(kVmax) == 0);
  driver.set_acceleration(0.0F, 0.0F);
  CHECK(chip.written.at(kAmax) == 1 && chip.written.at(kDmax) == 1);
  driver.set_acceleration(1e30F, 1e30F);
  CHECK(chip.written.at(kAmax) == 0xFFFE && chip.written.at(kDmax) == 0xFFFE);
  driver.set_speed(1e30F);
  CHECK(chip.written.at(kVmax) == 0x7FFE00);
  driver.set_currents(255, 255);
  CHECK(chip.written.at(kCurrents) == (31U << 8 | 31U));
}

TEST(the_load_is_bounded_and_a_field_lost_for_one_tick_is_no_stall) {
  Answers chip;
  const Motion motion(chip);
  Supervisor supervisor;
  supervisor.enable_stall(0);
  CHECK(supervisor.load_percent(256.0F) == 50);
  CHECK(supervisor.load_percent(-1e6F) == 255);
  CHECK(supervisor.check(motion, 600.0F, 1).fault == Fault::NONE);
  CHECK(supervisor.check(motion, 0.0F, 1).fault == Fault::NONE);
  CHECK(supervisor.check(motion, 600.0F, 1).fault == Fault::NONE);
  CHECK(supervisor.check(motion, -600.0F, 1).fault == Fault::STALL);
}

namespace {

constexpr int kMode2 = 0x08, kTcoY = 0x0F;

bool fits_its_checksum(const sim::Tle5012bChip& chip) {
  std::uint8_t crc = 0xFF;
  for (int byte = 0; byte < 15; ++byte) {
    const int word = chip.setting(0x08 + byte / 2);
    crc = static_cast<std::uint8_t>(crc ^ (byte % 2 == 0 ? word >> 8 : word & 0xFF));
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint8_t>(crc & 0x80 ? (crc << 1) ^ 0x1D : crc << 1);
  }
  return (chip.setting(kTcoY) & 0xFF) == static_cast<std::uint8_t>(~crc);
}

// The encoder of a bench's board, which the original firmware may have set up before.
class Encoder final : public Answers {
 public:
  void encoder_exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) override {
    ++exchanges;
    chip.exchange(command, words, count);
  }
  sim::Spread spread{0, 1};
  sim::Tle5012bChip chip{spread};
};

}  // namespace

TEST(the_encoder_works_without_autocalibration_and_with_the_checksum_of_its_settings) {
  for (bool original : {false, true}) {
    Encoder board;
    CHECK(board.chip.setting(kMode2) == 0x0801);
    if (original) {
      sim::OriginalEncoder before(board);
      before.setup();
      before.set_home();
      CHECK(board.chip.setting(kMode2) == 0x0800);
      CHECK(!fits_its_checksum(board.chip));
    }
    for (int boot = 0; boot < 2; ++boot) {
      Tle5012b encoder(board);
      CHECK(encoder.setup());
      CHECK(board.chip.setting(kMode2) == 0x0800);
      CHECK(board.chip.setting(kTcoY) >> 8 == 0x17);
      CHECK(fits_its_checksum(board.chip));
      for (int sample = 0; sample < 50; ++sample) {
        CHECK(encoder.sample());
        // A supply dip: all is as after power-up, and set up again by one sample.
        if (sample == 20) board.chip.power_up();
      }
      CHECK(board.chip.setting(kMode2) == 0x0800);
      CHECK(fits_its_checksum(board.chip));
      board.exchanges = 0;
      for (int sample = 0; sample < 50; ++sample) encoder.sample();
      CHECK(board.exchanges == 50);
    }
  }
}

TEST(an_encoder_that_takes_no_mode_or_no_checksum_keeps_its_autocalibration) {
  for (int address : {kMode2, kTcoY}) {
    Encoder board;
    board.chip.refuse(address);
    Tle5012b encoder(board);
    CHECK(encoder.setup());
    CHECK(encoder.autocalibrates());
    CHECK(board.chip.setting(kMode2) == 0x0801);
    for (int sample = 0; sample < 50; ++sample) {
      CHECK(encoder.sample());
      if (sample == 20) board.chip.power_up();
    }
    CHECK(board.chip.setting(kMode2) == 0x0801);
  }
}

TEST(a_chip_that_always_reports_a_reset_is_set_up_once) {
  Answers chip;
  chip.safety = 0x7000;
  Tle5012b encoder(chip);
  CHECK(encoder.setup());
  chip.exchanges = 0;
  for (int sample = 0; sample < 50; ++sample) CHECK(encoder.sample());
  CHECK(chip.exchanges == 50);
}

TEST(a_supply_dip_of_the_encoder_is_no_fault_of_the_joint) {
  bench::Bench bench(4);
  bench.mechanics().remove_stops();
  client::Host host(bench, 4);
  host.arm_session();
  host.enable();
  host.turn(20.0);
  host.keep(0.2);
  bench.encoder().power_up();
  host.turn(20.0);
  host.keep(0.05);
  CHECK(host.fault() == Fault::NONE);
  CHECK(bench.encoder().setting(kMode2) == 0x0800);
  CHECK(fits_its_checksum(bench.encoder()));
}
