#include "arm.h"

#include <algorithm>
#include <cmath>

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
    : timing_(other.timing_), unknown_(other.unknown_), stretch_(other.stretch_), now_(other.now_) {
  for (const auto& board : other.boards_) boards_.push_back(board->copy());
}

void Arm::run(double seconds) {
  now_ += static_cast<Time>(std::llround(seconds * kSecond));
  for (auto& board : boards_) board->advance(now_);
}

void Arm::pass(double seconds) {
  if (timing_.frequency > 0.0) run(seconds);
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
