// One joint on simulated chips with a board that counts: SPI of a tick and of an interrupt, feeds
// of the watchdog. A transaction takes no time; the chips can be stopped and broken one by one.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "../joint/src/core/joint.h"
#include "../sim/src/mechanics.h"
#include "../sim/src/motor.h"
#include "../sim/src/tle5012b_chip.h"
#include "../sim/src/tmc5130_chip.h"
#include "flips.h"

namespace bench {

using bioscara::Configuration;
using bioscara::Joint;
using bioscara::ResetCause;

constexpr double kRadiansPerStep = 6.283185307179586 / 51200.0;

class Bench final : private bioscara::Hal {
 public:
  explicit Bench(int joint, std::uint32_t first_micros = 0)
      : configuration_(bioscara::configuration_of(static_cast<std::uint8_t>(joint))),
        spread_(0, joint),
        mechanics_(bioscara::sim::parameters_of(joint, spread_)),
        motor_(bioscara::sim::MotorParameters{}, 1),
        encoder_(spread_),
        first_micros_(first_micros) {
    boot(ResetCause::POWER_ON);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  // The controller restarts; the chips go on as they are.
  void boot(ResetCause cause) {
    cause_ = cause;
    ++boot_id_;
    joint_.emplace(static_cast<bioscara::Hal&>(*this), configuration_);
    joint_->boot();
    exchanges_ = 0;
  }

  double now() const { return static_cast<double>(time_) * 1e-3; }

  // In whole ticks.
  void run(double seconds) {
    for (long end = time_ + std::lround(seconds * 1e3); time_ < end;) tick();
  }

  void tick() {
    ++time_;
    if (!hung_) {
      exchanges_ = 0;
      sensed_ = false;
      joint_->tick();
      worst_ = std::max(worst_, exchanges_);
    }
    pass(static_cast<double>(time_) * 1e-3);
  }

  // Lets motor and mechanics go on.
  void pass(double until) {
    if (stands_) return;
    while (ramp_ < until) {
      ramp_ += bioscara::sim::Tmc5130Chip::kRampPeriod;
      if (!clock_stopped_) driver_.step();
      const bioscara::sim::Supply supply{driver_.field(),
                                         kFullCurrent * driver_.current_share(enabled_),
                                         driver_.chops(), enabled_ && driver_.brakes()};
      mechanics_.step(
          motor_.torque(supply, mechanics_.rotor_turns(), mechanics_.rotor_speed()));
    }
  }

  void transfer(std::uint8_t, const std::uint8_t* written, std::size_t size, std::uint8_t* read,
                std::size_t count) {
    interrupt_ = true;
    for (std::size_t bytes = 1; early_ && bytes <= size; ++bytes) joint_->on_byte(written, bytes);
    std::uint8_t first = 0;
    const bool known = joint_->foretell(size, first);
    if (size > 0) joint_->on_receive(written, size);
    std::uint8_t answer[Joint::kAnswerMax];
    const std::size_t length = joint_->on_request(answer);
    foretold_ += known && length > 0 && first == answer[0] ? 1 : 0;
    mistaken_ += known && (length == 0 || first != answer[0]) ? 1 : 0;
    interrupt_ = false;
    std::fill_n(read, count, std::uint8_t{0xFF});
    std::copy_n(answer, std::min(length, count), read);
  }

  // Whether frames are checked byte by byte as they arrive, as on the board.
  void judge_early(bool on) { early_ = on; }

  // A write of no bytes.
  void probe() { joint_->on_receive(nullptr, 0); }

  // Called once, at the next datagram by which a tick moves the motor: a frame may arrive while a
  // tick runs.
  void interrupt(std::function<void()> handler) { handler_ = std::move(handler); }

  // Damage of one datagram with the driver, counted from now on: of the bytes as they arrive at the
  // driver, or of its answer as it arrives at the controller.
  using Damage = std::function<void(std::uint8_t (&)[5])>;
  void damage(long datagram, bool sent, Damage change) {
    damaged_ = datagrams_ + datagram;
    damages_sent_ = sent;
    damage_ = std::move(change);
  }
  long datagrams() const { return datagrams_; }
  // Returns the bit to flip of each datagram with the driver, and of each access to the encoder, of
  // which it gets the command and the number of words.
  void flip_driver(std::function<int(const std::uint8_t (&)[5])> which) { flip_driver_ = std::move(which); }
  void flip_encoder(std::function<int(std::uint16_t, std::size_t)> which) { flip_encoder_ = std::move(which); }

  // True state of motor and joint [rad, rad/s of the motor; joint units].
  double rotor() const { return mechanics_.rotor_turns() * 6.283185307179586; }
  double field() const { return driver_.field() * kRadiansPerStep; }
  double field_speed() const { return driver_.field_speed() * kRadiansPerStep; }
  double position() const { return mechanics_.position(); }
  bool stage_closed() const { return enabled_; }

  int worst_exchanges() const { return worst_; }
  // First bytes of answers that were known before the frame was taken, and those that were wrong.
  int foretold() const { return foretold_; }
  int mistaken() const { return mistaken_; }
  int interrupt_exchanges() const { return interrupt_exchanges_; }
  long feeds() const { return feeds_; }
  const Configuration& configuration() const { return configuration_; }

  void hang(bool on) { hung_ = on; }
  void set_bus_errors(std::uint16_t count) { bus_errors_ = count; }
  void set_exception(const bioscara::ExceptionRecord& record) { exception_ = record; }
  // The light, and how often it was set.
  bool lit() const { return lit_; }
  int changes() const { return changes_; }
  // The joint has gone to its bootloader.
  bool left() const { return left_; }
  void stop_clock(bool on) { clock_stopped_ = on; }
  // Motor and mechanics are not computed: for a joint that does not move, in a seventh of the time.
  void stand(bool on) { stands_ = on; }
  // No driver chip is there: level of its data line that the controller reads instead.
  void unplug_driver(std::optional<std::uint8_t> level) { unplugged_ = level; }
  bioscara::sim::Mechanics& mechanics() { return mechanics_; }
  bioscara::sim::Tmc5130Chip& driver() { return driver_; }
  bioscara::sim::Tle5012bChip& encoder() { return encoder_; }

 private:
  // Amplitude of the phase currents [A], as in the simulation: 1.48 A rms.
  static constexpr double kFullCurrent = 1.48 * 1.41421356;
  static constexpr double kCommanding = 150e-6;

  std::uint32_t micros() override {
    return first_micros_ + static_cast<std::uint32_t>(time_ * 1000);
  }
  void driver_exchange(const std::uint8_t (&sent)[5], std::uint8_t (&received)[5]) override {
    ++(interrupt_ ? interrupt_exchanges_ : exchanges_);
    const bool damaged = damage_ && datagrams_ == damaged_;
    ++datagrams_;
    std::uint8_t arriving[5];
    std::copy_n(sent, 5, arriving);
    if (damaged && damages_sent_) damage_(arriving);
    if (unplugged_)
      std::fill_n(received, 5, *unplugged_);
    else
      flips::exchange(driver_, arriving, received, flip_driver_ ? flip_driver_(sent) : flips::kNone);
    if (damaged && !damages_sent_) damage_(received);
    if (handler_ && sensed_ && (sent[0] & 0x80) != 0) std::exchange(handler_, nullptr)();
  }
  void encoder_exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) override {
    if (interrupt_) ++interrupt_exchanges_;
    random_ = random_ * 1664525U + 1013904223U;
    encoder_.set_noise(static_cast<double>(random_ >> 8) / 16777216.0 - 0.5);
    encoder_.latch(mechanics_.rotor_turns());
    flips::exchange(encoder_, command, words, count, flip_encoder_ ? flip_encoder_(command, count) : flips::kNone);
    // As long as it takes on the board from reading the driver to commanding it.
    if (!sensed_) pass(static_cast<double>(time_ - 1) * 1e-3 + kCommanding);
    sensed_ = true;
  }
  void driver_enable(bool on) override { enabled_ = on; }
  ResetCause reset_cause() override { return cause_; }
  std::uint16_t boot_id() override { return boot_id_; }
  void feed_watchdog() override { ++feeds_; }
  std::uint16_t bus_errors() override { return bus_errors_; }
  std::uint32_t image() override { return 0x1BADB002; }
  bioscara::ExceptionRecord exception() override { return exception_; }
  void indicate(bool lit) override {
    lit_ = lit;
    ++changes_;
  }
  void enter_bootloader() override { left_ = true; }
  void lock() override {}
  void unlock() override {}

  const Configuration configuration_;
  bioscara::sim::Spread spread_;
  bioscara::sim::Mechanics mechanics_;
  bioscara::sim::Motor motor_;
  bioscara::sim::Tmc5130Chip driver_;
  bioscara::sim::Tle5012bChip encoder_;
  std::optional<Joint> joint_;
  std::function<void()> handler_;
  std::uint32_t first_micros_;
  std::uint32_t random_ = 12345;
  std::uint16_t boot_id_ = 700;
  ResetCause cause_ = ResetCause::POWER_ON;
  // Nothing known pulls the pin to "closed" after a reset: assume the worst.
  bool enabled_ = true;
  bool hung_ = false;
  bool left_ = false;
  bool lit_ = false;
  int changes_ = 0;
  bioscara::ExceptionRecord exception_;
  bool early_ = true;
  std::uint16_t bus_errors_ = 0;
  bool clock_stopped_ = false;
  bool stands_ = false;
  Damage damage_;
  std::function<int(const std::uint8_t (&)[5])> flip_driver_;
  std::function<int(std::uint16_t, std::size_t)> flip_encoder_;
  bool damages_sent_ = false;
  long datagrams_ = 0, damaged_ = 0;
  std::optional<std::uint8_t> unplugged_;
  bool interrupt_ = false;
  bool sensed_ = false;
  long time_ = 0;
  double ramp_ = 0.0;
  int exchanges_ = 0;
  int worst_ = 0;
  int interrupt_exchanges_ = 0;
  int foretold_ = 0;
  int mistaken_ = 0;
  long feeds_ = 0;
};

}  // namespace bench
