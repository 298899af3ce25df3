// Each bit of what travels between controller and chips, flipped once: a law over whole tables.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <vector>

#include "bench.h"
#include "client.h"
#include "testing.h"

using namespace bioscara;
using bench::Bench;
using client::has;
using client::Host;
using sim::Tle5012bChip;
using sim::Tmc5130Chip;

namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr int kMod1 = 0x06, kMode2 = 0x08, kOffsetX = 0x0A, kSynchronism = 0x0C, kTcoY = 0x0F;
// The model's autocalibration adds 1 to OFFX with each access.
constexpr int kAdapted = 100;

// How the encoder's chip is found by a boot.
enum class Found { AFTER_POWER_UP, AFTER_THE_ORIGINAL_FIRMWARE, SET_UP };

void prepare(Tle5012bChip& chip, Found found, bool refuses) {
  if (found == Found::SET_UP) return;
  chip.power_up();
  std::uint16_t original = 0x0800;
  if (found == Found::AFTER_THE_ORIGINAL_FIRMWARE) chip.exchange(0x5081, &original, 1);
  if (refuses) chip.refuse(kTcoY);
}

std::uint8_t warnings(Host<Bench>& host) { return host.send(Register::WARNINGS, {}, 1)[0]; }

// Whether the chip's settings are those of another one, but for what autocalibration changes.
bool alike(const Tle5012bChip& chip, const Tle5012bChip& other, bool refuses) {
  for (int address = kMod1; address <= kTcoY; ++address) {
    const int value = chip.setting(address), expected = other.setting(address);
    const bool adapted = address >= kOffsetX && address <= kSynchronism;
    if (adapted && std::abs(value - expected) > kAdapted) return false;
    // CRC_PAR depends on the adapted ones.
    const int bits = adapted ? 0 : address == kTcoY && !refuses ? 0xFF00 : 0xFFFF;
    if (((value ^ expected) & bits) != 0) return false;
  }
  return true;
}

}  // namespace

TEST(each_bit_of_the_encoders_start_may_arrive_flipped) {
  for (bool refuses : {false, true}) {
    for (Found found : {Found::AFTER_POWER_UP, Found::AFTER_THE_ORIGINAL_FIRMWARE, Found::SET_UP}) {
      if (refuses && found == Found::SET_UP) continue;
      std::vector<std::size_t> accesses;
      Bench sound(1);
      prepare(sound.encoder(), found, refuses);
      sound.flip_encoder([&](std::uint16_t, std::size_t words) {
        accesses.push_back(words);
        return flips::kNone;
      });
      sound.boot(ResetCause::POWER_ON);
      CHECK(sound.encoder().setting(kMode2) == (refuses ? 0x0801 : 0x0800));
      int runs = 0;
      for (std::size_t access = 0; access < accesses.size(); ++access) {
        for (int bit = 0; bit < flips::encoder_bits(accesses[access]); ++bit, ++runs) {
          Bench bench(1);
          bench.stand(true);
          prepare(bench.encoder(), found, refuses);
          std::size_t number = 0;
          bench.flip_encoder([&](std::uint16_t, std::size_t) { return number++ == access ? bit : flips::kNone; });
          bench.boot(ResetCause::POWER_ON);
          bench.run(0.03);
          Host host(bench, 1);
          const bool good = !has(host.flags(), Flags::BUSY) && host.fault() == Fault::NONE &&
                            warnings(host) == (refuses ? 1 : 0) &&
                            alike(bench.encoder(), sound.encoder(), refuses);
          if (!good) std::printf("     found %d, access %zu, bit %d\n", static_cast<int>(found), access, bit);
          CHECK(good);
        }
      }
      std::printf("     %d bits\n", runs);
    }
  }
}

namespace {

// A joint that turns, or rests enabled.
struct Enabled {
  explicit Enabled(double rate) : bench(3), host(bench, 3), speed(rate) {
    bench.mechanics().remove_stops();
    host.arm_session();
    enable();
  }
  void enable() {
    host.keep(0.5);
    host.clear_fault();
    host.enable();
    run(300);
  }
  void run(int ticks) {
    for (int tick = 0; tick < ticks; ++tick) {
      if (bench.datagrams() > renewed + 60) {
        host.turn(speed);
        renewed = bench.datagrams();
      }
      bench.tick();
    }
  }
  Bench bench;
  Host<Bench> host;
  const double speed;
  long renewed = 0;
};

}  // namespace

// The flipped bit makes another address of that of MOD_2 or TCO_Y, whose setting then takes no more writes.
TEST(a_setting_of_the_encoder_that_is_not_restored_is_a_fault) {
  constexpr struct {
    int written, bit, reached;
  } kStrayed[] = {{kMode2, 11, 0x09}, {kMode2, 10, kOffsetX}, {kMode2, 9, kSynchronism},
                  {kTcoY, 11, 0x0E},  {kTcoY, 10, 0x0D},      {kTcoY, 9, 0x0B}};
  for (bool moving : {false, true}) {
    for (const auto& strayed : kStrayed) {
      Enabled joint(moving ? 20.0 : 0.0);
      Bench& bench = joint.bench;
      Host<Bench>& host = joint.host;
      Tle5012bChip& chip = bench.encoder();
      const int before = chip.setting(strayed.reached);
      bool flipped = false;
      bench.flip_encoder([&](std::uint16_t command, std::size_t) {
        if (flipped) chip.refuse(strayed.reached);
        if (flipped || command != (0x5001 | strayed.written << 4)) return flips::kNone;
        flipped = true;
        return strayed.bit;
      });
      chip.power_up();
      if (!moving) bench.boot(ResetCause::POWER_ON);
      joint.run(30);
      CHECK(chip.setting(strayed.reached) != before);
      host.arm_session();
      host.keep(0.5);
      CHECK(host.fault() == Fault::ENCODER);
      CHECK(warnings(host) == 0);
      host.clear_fault();
      host.send(Register::SETUP, {20, 20, 0, 0});
      bench.run(0.01);
      CHECK(host.fault() == Fault::ENCODER);
      CHECK(has(host.flags(), Flags::NOTENABLED));
    }
  }
}

TEST(writes_to_the_encoder_that_arrive_damaged_in_other_ways_are_no_refusal) {
  Bench bench(1);
  bench.encoder().power_up();
  int writes = 0;
  bench.flip_encoder([&](std::uint16_t command, std::size_t) {
    const bool mode = command == (0x5001 | kMode2 << 4);
    return mode && writes < 3 ? 20 + writes++ : flips::kNone;
  });
  bench.boot(ResetCause::POWER_ON);
  bench.run(0.03);
  Host host(bench, 1);
  CHECK(writes == 3);
  CHECK(warnings(host) == 0);
  CHECK(host.fault() == Fault::NONE);
  CHECK(bench.encoder().setting(kMode2) == 0x0800);
}

TEST(each_bit_of_an_angle_and_of_a_setup_in_motion_or_at_rest_may_arrive_flipped) {
  for (double speed : {20.0, 0.0}) {
    Enabled joint(speed);
    Bench& bench = joint.bench;
    Bench sound(3);
    const double offset = joint.host.degrees() / kDegrees - bench.rotor();
    for (bool reset : {false, true}) {
      std::vector<std::size_t> accesses;
      if (reset) bench.encoder().power_up();
      bench.flip_encoder([&](std::uint16_t, std::size_t words) {
        accesses.push_back(words);
        return flips::kNone;
      });
      // The first one shows the reset.
      joint.run(2);
      for (std::size_t access = 0; access < accesses.size(); ++access) {
        for (int bit = 0; bit < flips::encoder_bits(accesses[access]); ++bit) {
          if (reset) bench.encoder().power_up();
          std::size_t number = 0;
          bench.flip_encoder([&](std::uint16_t, std::size_t) { return number++ == access ? bit : flips::kNone; });
          joint.run(6);
          const double away = joint.host.degrees() / kDegrees - bench.rotor() - offset;
          // The angle's own error, and the travel since the last sample.
          const bool good = joint.host.fault() == Fault::NONE && std::fabs(away) < 0.06 &&
                            warnings(joint.host) == 0 && alike(bench.encoder(), sound.encoder(), false);
          if (!good) std::printf("     %g rad/s, reset %d, access %zu, bit %d: %g\n", speed, reset, access, bit, away);
          CHECK(good);
        }
      }
      std::printf("     %g rad/s: %zu accesses\n", speed, accesses.size());
    }
  }
}

namespace {

// The registers of the driver that can be written and act on motor or ramp: their reset value, or none
// where the firmware chooses one (TMC5130A data sheet, section 6, and TMC5130.h of the
// maker's TMC-API). Left out are SLAVECONF and OUTPUT, of the serial interface; X_COMPARE, of a
// pin; ENCMODE, X_ENC and ENC_CONST, of a counter that drives nothing.
struct Value {
  bool chosen = true;
  std::uint32_t at_reset = 0;
};
constexpr Value at_reset(std::uint32_t value) { return {false, value}; }
const std::map<int, Value> kWritable = {
    {0x00, {}},
    {0x10, {}},
    {0x11, {}},
    {0x13, {}},
    {0x14, at_reset(0)},  // TCOOLTHRS
    {0x15, at_reset(0)},  // THIGH
    {0x20, {}},
    {0x21, {}},
    {0x23, {}},
    {0x24, {}},
    {0x25, {}},
    {0x26, {}},
    {0x27, {}},
    {0x28, {}},
    {0x2A, {}},
    {0x2B, {}},
    {0x2C, {}},
    {0x2D, {}},
    {0x33, at_reset(0)},  // VDCMIN
    {0x34, at_reset(0)},  // SW_MODE
    {0x60, at_reset(0xAAAAB554)},
    {0x61, at_reset(0x4A9554AA)},
    {0x62, at_reset(0x24492929)},
    {0x63, at_reset(0x10104222)},
    {0x64, at_reset(0xFBFFFFFF)},
    {0x65, at_reset(0xB5BB777D)},
    {0x66, at_reset(0x49295556)},
    {0x67, at_reset(0x00404222)},
    {0x68, at_reset(0xFFFF8056)},
    {0x69, at_reset(0x00F70000)},  // MSLUTSTART
    {0x6C, {}},
    {0x6D, at_reset(0)},  // COOLCONF
    {0x6E, at_reset(0)},  // DCCTRL
    {0x70, {}},
    {0x72, at_reset(0)}};  // ENCM_CTRL
constexpr int kXactual = 0x21, kXtarget = 0x2D;

}  // namespace

// The position is checked by its course. Written and read are those of one round, in which nothing moves.
TEST(each_register_that_a_flipped_bit_of_an_address_reaches_is_restored_in_turn) {
  std::set<int> written;
  std::map<int, std::uint32_t> again;
  std::set<int> read;
  Enabled joint(20.0);
  joint.bench.flip_driver([&](const std::uint8_t(&sent)[5]) {
    const int address = sent[0] & 0x7F;
    if (sent[0] == address) {
      read.insert(address);
    } else {
      written.insert(address);
      again[address] = static_cast<std::uint32_t>(sent[1]) << 24 | static_cast<std::uint32_t>(sent[2]) << 16 |
                       static_cast<std::uint32_t>(sent[3]) << 8 | sent[4];
    }
    return flips::kNone;
  });
  joint.bench.boot(ResetCause::PIN);
  joint.host.arm_session();
  joint.enable();
  joint.bench.driver().power_up();
  joint.host.keep(0.2);
  read.clear();
  again.clear();
  joint.host.keep(1e-3 * flips::kRound);
  int reached = 0;
  for (int address : written) {
    for (int bit = 1; bit < 0x80; bit <<= 1) {
      const auto found = kWritable.find(address ^ bit);
      if (found == kWritable.end()) continue;
      ++reached;
      const auto& [other, value] = *found;
      const bool restored = value.chosen ? again.count(other) + read.count(other) != 0
                                         : again.count(other) != 0 && again[other] == value.at_reset;
      if (!restored) std::printf("     %02x of %02x\n", other, address);
      CHECK(restored);
    }
  }
  std::printf("     %d registers written, %d addresses reached\n", static_cast<int>(written.size()), reached);
}

namespace {

// The registers of the driver in which two chips differ, but for position and target.
std::vector<int> differing(const Tmc5130Chip& chip, const Tmc5130Chip& other) {
  std::vector<int> found;
  for (const auto& [address, value] : kWritable) {
    const auto number = static_cast<std::uint8_t>(address);
    const bool place = address == kXactual || address == kXtarget;
    if (!place && chip.setting(number) != other.setting(number)) found.push_back(address);
  }
  return found;
}

}  // namespace

TEST(each_bit_of_the_drivers_start_may_arrive_flipped) {
  Bench sound(1);
  sound.stand(true);
  sound.driver().power_up();
  const long before = sound.datagrams();
  sound.boot(ResetCause::POWER_ON);
  const long datagrams = sound.datagrams() - before;
  sound.tick();
  CHECK(!differing(sound.driver(), Tmc5130Chip()).empty());
  int slow = 0;
  for (long datagram = 0; datagram < datagrams; ++datagram) {
    for (int bit = 0; bit < flips::kDatagram; ++bit) {
      Bench bench(1);
      bench.stand(true);
      bench.driver().power_up();
      long number = 0;
      bench.flip_driver([&](const std::uint8_t(&)[5]) { return number++ == datagram ? bit : flips::kNone; });
      bench.boot(ResetCause::POWER_ON);
      int ticks = 0;
      while (ticks++ < flips::kRound && !differing(bench.driver(), sound.driver()).empty()) bench.tick();
      slow += ticks > 3 ? 1 : 0;
      Host host(bench, 1);
      const bool good = ticks < flips::kRound && host.fault() == Fault::NONE;
      if (!good) std::printf("     datagram %ld, bit %d\n", datagram, bit);
      CHECK(good);
    }
  }
  std::printf("     %ld bits, %d of them restored in turn\n", datagrams * flips::kDatagram, slow);
}

// Farther than this from its course [rad of the motor], or above its speed for longer than this, a joint
// has to report a fault within so many ticks.
TEST(each_bit_of_each_datagram_of_a_joint_that_turns_or_rests_may_arrive_flipped) {
  constexpr double kAway = 0.24;
  constexpr int kFast = 3, kWatched = 40, kFaults = 20;
  for (double speed : {20.0, 0.0}) {
    Enabled joint(speed);
    const Tmc5130Chip sound = joint.bench.driver();
    flips::Each each;
    joint.bench.flip_driver([&](const std::uint8_t(&sent)[5]) {
      const auto found = kWritable.find(sent[0] & 0x7F);
      // Those that keep their reset value come once in a round.
      const bool rare = found != kWritable.end() && !found->second.chosen && (sent[0] & 0x80) != 0;
      return each.next(sent, rare ? 8 : flips::kDatagram);
    });
    int watched = 0, fast = 0, faults = 0;
    long ticks = 0;
    double from = joint.bench.rotor(), away = 0.0, most = 0.0;
    while (!each.done() && faults <= kFaults) {
      joint.run(1);
      ++ticks;
      ++watched;
      away = std::fabs(joint.bench.rotor() - from - speed * 1e-3 * watched);
      fast = std::fabs(joint.bench.field_speed()) > speed + 0.5 ? fast + 1 : 0;
      if (has(joint.host.flags(), Flags::FAULT)) {
        ++faults;
        joint.enable();
        watched = kWatched;
      } else {
        most = std::max(most, away);
        if (away > kAway || fast > kFast) {
          std::printf("     %g rad/s, %02x, bit %d: %.3f rad away, %d ticks too fast\n", speed, each.last(),
                      each.last_bit(), away, fast);
          CHECK(false);
          watched = kWatched;
        }
      }
      if (watched < kWatched) continue;
      from = joint.bench.rotor();
      watched = fast = 0;
      each.go_on();
    }
    CHECK(faults <= kFaults);
    CHECK(differing(joint.bench.driver(), sound).empty());
    std::printf("     %g rad/s: %zu kinds, %ld ticks, at most %.3f rad away, %d faults\n", speed, each.kinds(), ticks,
                most, faults);
  }
}
