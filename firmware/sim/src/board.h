// One joint's board: the firmware on its controller, both chips, the motor and its load.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "../../joint/src/core/joint.h"
#include "mechanics.h"
#include "motor.h"
#include "original_joint.h"
#include "spread.h"
#include "tle5012b_chip.h"
#include "tmc5130_chip.h"
#include "virtual_time.h"

namespace bioscara::sim {

// Firmware flashed on the controller.
enum class Firmware : std::uint8_t {
  OURS,
  // Ours, for a host that knows version 1 only: frames of version 2 are unknown to it.
  OURS_VERSION_1,
  ORIGINAL,
  // None here: an emulated controller drives the chips (plant.h).
  ELSEWHERE,
};

class Board final : private Hal {
 public:
  Board(int joint, std::uint32_t seed, Firmware firmware);
  Board& operator=(const Board&) = delete;

  // Another board in the same state, whose firmware drives its own chips.
  std::unique_ptr<Board> copy() const;

  // Lets time pass up to `now`.
  void advance(Time now);

  // The controller's I2C peripheral.
  bool answers() const { return powered_ && running_; }
  std::uint8_t address() const { return configuration_.address; }
  Firmware firmware() const { return firmware_; }
  void receive(const std::uint8_t* data, std::size_t size);
  // The answer to a read of `count` bytes; `duration` is how long the clock is held during the
  // read.
  std::size_t request(std::uint8_t (&answer)[Joint::kAnswerMax], std::size_t count,
                      Time& duration);
  // The controller holds the clock low indefinitely, as an original joint does when more is read
  // than it answers: its interrupt never ends, and nothing else of its firmware runs.
  bool holds_clock() const { return holds_clock_; }

  // Faults.
  void reset(ResetCause cause);
  void set_power(bool on);
  void set_motor_power(bool on);
  // The firmware's loop is stopped; the I2C interrupt still answers.
  void hang(bool on) { hung_ = on; }
  // The controller's own watchdog, which a debugger can switch off.
  void set_watchdog(bool on) { watchdog_on_ = on; }

  // For changes from outside, after which a joint at rest has to be computed again.
  Mechanics& mechanics() {
    settled_ = false;
    return mechanics_;
  }
  const Mechanics& mechanics() const { return mechanics_; }
  // Of a world around the arm, at each of its steps: a joint at rest that nothing new touches stays
  // at rest.
  void set_contact(double force) {
    if (force != mechanics_.contact()) mechanics().set_contact(force);
  }
  Tmc5130Chip& driver() { return driver_; }
  Tle5012bChip& encoder() { return encoder_; }
  // Interface of an external controller.
  Hal& wires() { return *this; }
  bool has_torque() const { return driver_.current_share(enabled_) > 0.0; }
  double load_angle() const;
  // The error that the original firmware's closed loop sampled last [microsteps]; 0 for ours.
  double position_error() const { return original_ ? original_->error() : 0.0; }

 private:
  Board(const Board&) = default;
  std::uint32_t micros() override;
  void driver_exchange(const std::uint8_t (&sent)[5], std::uint8_t (&received)[5]) override;
  void encoder_exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) override;
  void driver_enable(bool on) override { enabled_ = on; }
  ResetCause reset_cause() override { return cause_; }
  std::uint16_t boot_id() override { return boot_id_; }
  void feed_watchdog() override { fed_ = now_; }
  std::uint16_t bus_errors() override { return 0; }
  // No image, no processor and no light are simulated.
  std::uint32_t image() override { return 0; }
  ExceptionRecord exception() override { return {}; }
  void indicate(bool) override {}
  void enter_bootloader() override;
  void lock() override {}
  void unlock() override {}
  void start();
  void run_original();
  // One step of motor and mechanics.
  void step(const Supply& supply);
  double noise();

  const Configuration configuration_;
  const Firmware firmware_;
  Spread spread_;
  Mechanics mechanics_;
  Motor motor_;
  Tmc5130Chip driver_;
  Tle5012bChip encoder_;
  // That of the last step. Where this step changed nothing, another one with it would not either:
  // a joint at rest is not computed again.
  Supply supply_{};
  bool settled_ = false;
  std::optional<Joint> joint_;
  std::optional<OriginalJoint> original_;
  Time now_ = 0;
  Time next_step_ = 0;
  Time next_tick_ = 0;
  Time starts_ = 0;
  Time fed_ = 0;
  std::uint32_t random_;
  std::uint16_t boot_id_;
  ResetCause cause_ = ResetCause::POWER_ON;
  bool enabled_ = false;
  bool powered_ = true;
  bool running_ = false;
  bool hung_ = false;
  bool holds_clock_ = false;
  bool watchdog_on_ = true;
};

}  // namespace bioscara::sim
