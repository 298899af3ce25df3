#include "board.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

namespace bioscara::sim {

namespace {

constexpr Time kRamp = 512;
constexpr Time kTick = Joint::kTickMicros * 10;
constexpr Time kWatchdog = kSecond / 10;
// From reset until the firmware listens: that of the flashed image, in emulation.
constexpr Time kBoot = 120'000;
constexpr Time kNever = std::numeric_limits<Time>::max();
// Amplitude of the phase currents at full scale: 1.48 A rms.
constexpr double kFullCurrent = 1.48 * 1.41421356;
// How far motors differ (docs/simulation.md).
constexpr double kTorqueTolerance = 0.03;
constexpr double kDragTolerance = 0.1;

MotorParameters motor_of(Spread& spread) {
  MotorParameters made;
  made.torque_constant *= spread.factor(kTorqueTolerance);
  made.drag *= spread.factor(kDragTolerance);
  return made;
}

// A firmware that was copied refers to the wires of the board that it was copied from.
template <typename Copied>
void rewire(std::optional<Copied>& firmware, const Hal* from, const Hal* to) {
  static_assert(std::is_trivially_copyable_v<Copied>);
  if (!firmware) return;
  auto* bytes = reinterpret_cast<unsigned char*>(&*firmware);
  for (std::size_t at = 0; at + sizeof from <= sizeof(Copied); at += alignof(const Hal*))
    if (std::memcmp(bytes + at, &from, sizeof from) == 0) std::memcpy(bytes + at, &to, sizeof to);
}

}  // namespace

Board::Board(int joint, std::uint32_t seed, Firmware firmware)
    : configuration_(configuration_of(static_cast<std::uint8_t>(joint))),
      firmware_(firmware),
      spread_(seed, joint),
      mechanics_(parameters_of(joint, spread_)),
      motor_(motor_of(spread_), spread_.seed()),
      encoder_(spread_),
      random_(seed * 2654435761U + static_cast<std::uint32_t>(joint) * 40503U + 1U),
      boot_id_(static_cast<std::uint16_t>(random_ >> 16)) {
  start();
}

std::unique_ptr<Board> Board::copy() const {
  std::unique_ptr<Board> made(new Board(*this));
  rewire(made->joint_, this, made.get());
  rewire(made->original_, this, made.get());
  return made;
}

double Board::noise() {
  random_ = random_ * 1664525U + 1013904223U;
  return static_cast<double>(random_ >> 8) / 16777216.0 - 0.5;
}

void Board::start() {
  running_ = false;
  enabled_ = false;
  hung_ = false;
  holds_clock_ = false;
  starts_ = firmware_ == Firmware::ELSEWHERE ? kNever : now_ + kBoot;
}

void Board::reset(ResetCause cause) {
  // The supply's supervisor acts before the controller's own detector: a dip shows as PIN.
  cause_ = cause == ResetCause::BROWN_OUT ? ResetCause::PIN : cause;
  ++boot_id_;
  if (cause == ResetCause::BROWN_OUT || cause == ResetCause::POWER_ON) {
    driver_.power_up();
    encoder_.power_up();
  }
  start();
}

void Board::set_power(bool on) {
  if (on && !powered_) {
    powered_ = true;
    reset(ResetCause::POWER_ON);
  } else if (!on) {
    powered_ = running_ = enabled_ = holds_clock_ = false;
  }
}

void Board::set_motor_power(bool on) { driver_.set_motor_power(on); }

void Board::advance(Time now) {
  while (next_step_ <= now) {
    if (powered_ && !running_ && next_step_ >= starts_) {
      now_ = next_step_;
      if (firmware_ == Firmware::ORIGINAL) {
        original_.emplace(static_cast<Hal&>(*this), now_);
      } else {
        joint_.emplace(static_cast<Hal&>(*this), configuration_);
        joint_->boot();
      }
      running_ = true;
      fed_ = next_tick_ = now_;
    }
    if (running_ && next_tick_ <= next_step_) {
      now_ = next_tick_;
      if (firmware_ == Firmware::ORIGINAL) {
        run_original();
      } else {
        if (!hung_) joint_->tick();
        next_tick_ += kTick;
        if (watchdog_on_ && now_ - fed_ > kWatchdog) reset(ResetCause::WATCHDOG);
      }
    }
    now_ = next_step_;
    driver_.step();
    const Supply supply{driver_.field(), kFullCurrent * driver_.current_share(enabled_),
                        driver_.chops(), enabled_ && driver_.brakes()};
    if (!settled_ || !(supply == supply_)) step(supply);
    next_step_ += kRamp;
  }
  now_ = now;
}

void Board::step(const Supply& supply) {
  const bool stood = mechanics_.stands();
  mechanics_.step(
      motor_.torque(supply, mechanics_.rotor_turns(), mechanics_.rotor_speed()));
  settled_ = stood && mechanics_.stands() && motor_.settled();
  supply_ = supply;
}

void Board::run_original() {
  if (holds_clock_)
    next_tick_ = now_ + kSecond;
  else
    next_tick_ = hung_ ? original_->run_without_loop(now_) : original_->run(now_);
}

void Board::receive(const std::uint8_t* data, std::size_t size) {
  if (firmware_ == Firmware::ORIGINAL)
    original_->receive(data, size);
  else
    joint_->on_receive(data, size);
}

std::size_t Board::request(std::uint8_t (&answer)[Joint::kAnswerMax], std::size_t count,
                           Time& duration) {
  duration = 0;
  if (firmware_ != Firmware::ORIGINAL) return joint_->on_request(answer);
  if (!original_->listening()) {
    holds_clock_ = true;
    return 0;
  }
  const OriginalJoint::Answer own = original_->request(now_);
  duration = own.duration;
  holds_clock_ = count > own.size;
  std::copy_n(own.bytes, own.size, answer);
  return own.size;
}

double Board::load_angle() const {
  return driver_.field() - mechanics_.rotor_turns() * 51200.0;
}

std::uint32_t Board::micros() { return static_cast<std::uint32_t>(now_ / 10); }

// The joint does not answer until its power is cycled.
void Board::enter_bootloader() {
  running_ = enabled_ = false;
  starts_ = kNever;
}

void Board::driver_exchange(const std::uint8_t (&sent)[5], std::uint8_t (&received)[5]) {
  driver_.exchange(sent, received);
}

void Board::encoder_exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) {
  encoder_.set_noise(noise());
  encoder_.latch(mechanics_.rotor_turns());
  encoder_.exchange(command, words, count);
}

}  // namespace bioscara::sim
