#include "arm.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bioscara::sim {

namespace {

// Start, two address bytes, register byte, restart and stop; the rest is nine bits a byte.
constexpr double kFrameBits = 30.0;
constexpr double kByteBits = 9.0;
// The bcm2835 adapter aborts on a clock stretched for this long [s].
constexpr double kStretchLimit = 0.035;

}  // namespace

Arm::Arm(std::uint32_t seed, Timing timing, const Firmwares& firmwares) : timing_(timing) {
  for (int joint = 1; joint <= kJoints; ++joint)
    boards_.push_back(std::make_unique<Board>(joint, seed, firmwares[static_cast<std::size_t>(joint - 1)]));
  run(0.05);  // All joints of our firmware have booted.
}

Arm::Arm(const Arm& other)
    : timing_(other.timing_) {
  assign(other);
}

void Arm::assign(const Arm& other) {
  unknown_ = other.unknown_;
  stretch_ = other.stretch_;
  now_ = other.now_;
  travel_ = other.travel_;
  velocity_ = other.velocity_;
  contact_ = other.contact_;
  std::vector<std::unique_ptr<Board>> boards;
  for (const auto& board : other.boards_) boards.push_back(board->copy());
  boards_ = std::move(boards);
}

void Arm::run(double seconds) {
  elapse(seconds);
  rethrow();
}

void Arm::elapse(double seconds) {
  const Time end = now_ + static_cast<Time>(std::llround(seconds * kSecond));
  while (world_.step) {
    const Time slice = (now_ / kSlice + 1) * kSlice;
    if (slice > end) break;
    advance(slice);
    step_world();
  }
  advance(end);
}

void Arm::advance(Time now) {
  now_ = now;
  for (auto& board : boards_) board->advance(now_);
}

void Arm::set_world(World world) {
  world_ = std::move(world);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const Mechanics& mechanics = std::as_const(*boards_[i]).mechanics();
    travel_[i] = mechanics.travel();
    velocity_[i] = mechanics.velocity();
    contact_[i] = mechanics.contact();
  }
}

void Arm::remove_world() {
  world_ = World{};
  for (auto& board : boards_) board->set_contact(0.0);
}

void Arm::step_world() {
  constexpr double kDuration = static_cast<double>(kSlice) / kSecond;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const Mechanics& mechanics = std::as_const(*boards_[i]).mechanics();
    const double moved = mechanics.travel() - travel_[i];
    const double velocity = moved / kDuration;
    // A torque in one slice changes the mean velocity of that slice and of the next, by half each.
    const double contact = (mechanics.contact() + contact_[i]) / 2.0;
    world_.position[i] = mechanics.position() - moved;
    world_.velocity[i] = velocity_[i];
    world_.drive[i] =
        mechanics.load_inertia() * (velocity - velocity_[i]) / kDuration - contact;
    travel_[i] = mechanics.travel();
    velocity_[i] = velocity;
    contact_[i] = mechanics.contact();
  }
  try {
    world_.step();
  } catch (...) {
    failure_ = std::current_exception();
    remove_world();
    return;
  }
  for (std::size_t i = 0; i < kJoints; ++i) boards_[i]->set_contact(world_.contact[i]);
}

void Arm::rethrow() {
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void Arm::pass(double seconds) {
  if (timing_.frequency > 0.0) elapse(seconds);
}

Board* Arm::find(std::uint8_t address) {
  for (auto& board : boards_)
    if (board->address() == address && board->answers()) return board.get();
  return nullptr;
}

void Arm::receive_version_1(Board& board, const std::uint8_t* written, std::size_t size) {
  unknown_ = true;
  for (const Definition& row : kDefinitions) {
    if (size == 0 || static_cast<std::uint8_t>(row.code) != written[0] || row.version != 1) continue;
    const std::size_t rest = size - 1;
    const bool read = row.direction == Direction::READ || row.direction == Direction::READ_WRITE;
    const bool write = row.direction != Direction::READ;
    unknown_ = !((read && rest == 0) || (write && rest == row.written) ||
                 (row.code == Register::SETUP && rest == 2));
  }
  constexpr std::uint8_t kPing[] = {static_cast<std::uint8_t>(Register::PING)};
  if (unknown_)
    board.receive(kPing, 1);
  else
    board.receive(written, size);
}

Outcome Arm::hold_clock() {
  pass(kStretchLimit);
  return Outcome::TIMEOUT;
}

Outcome Arm::transfer(std::uint8_t address, const std::uint8_t* written, std::size_t size,
                      std::uint8_t* read, std::size_t count) {
  const Outcome outcome = exchange(address, written, size, read, count);
  rethrow();
  return outcome;
}

Outcome Arm::exchange(std::uint8_t address, const std::uint8_t* written, std::size_t size,
                      std::uint8_t* read, std::size_t count) {
  const double bit = timing_.frequency > 0.0 ? 1.0 / timing_.frequency : 0.0;
  for (const auto& board : boards_)
    if (board->holds_clock()) return hold_clock();
  Board* board = find(address);
  if (board == nullptr) {
    pass(timing_.overhead + 11.0 * bit);
    return Outcome::NO_ACKNOWLEDGE;
  }
  const double payload = size > 0 ? static_cast<double>(size - 1) : 0.0;
  pass(timing_.overhead + (20.0 + kByteBits * payload) * bit);
  if (size > 0) {
    if (board->firmware() == Firmware::OURS_VERSION_1)
      receive_version_1(*board, written, size);
    else
      board->receive(written, size);
  }
  pass(std::min(stretch_, kStretchLimit));
  if (stretch_ > kStretchLimit) return Outcome::TIMEOUT;
  std::fill_n(read, count, std::uint8_t{0xFF});
  if (count > 0) {
    std::uint8_t answer[Joint::kAnswerMax];
    Time stretched = 0;
    std::size_t length = board->request(answer, count, stretched);
    pass(static_cast<double>(stretched) / kSecond);
    if (board->holds_clock()) return hold_clock();
    if (board->firmware() == Firmware::OURS_VERSION_1 && unknown_ && length == 2) {
      // The old firmware takes an unknown register for a blocking command.
      answer[0] = static_cast<std::uint8_t>(answer[1] | static_cast<std::uint8_t>(Flags::BUSY));
      length = 1;
    }
    std::copy_n(answer, std::min(length, count), read);
  }
  pass((kFrameBits - 20.0 + kByteBits * static_cast<double>(count)) * bit);
  return Outcome::OK;
}

}  // namespace bioscara::sim
