#include "wire.h"

#include <math.h>

#include "bytes.h"
#include "version.h"

namespace bioscara {

namespace {

const Definition* find(uint8_t code) {
  for (const Definition& row : kDefinitions)
    if (static_cast<uint8_t>(row.code) == code && row.direction != Direction::NONE) return &row;
  return nullptr;
}

bool readable(const Definition& row) {
  return row.direction == Direction::READ || row.direction == Direction::READ_WRITE;
}

bool writable(const Definition& row) {
  return row.direction != Direction::READ;
}

void count(uint16_t& counter) {
  if (counter != 0xFFFF) ++counter;
}

// SETUP is documented with two bytes; hosts pad it to four.
constexpr size_t kShortSetup = 2;
constexpr size_t kTrailer = 2;

}  // namespace

void Wire::boot() { boot_id_ = hal_.boot_id(); }

void Wire::receive(const uint8_t* data, size_t size) {
  answer_size_ = 0;
  if (size == 0) return;  // An address probe.
  Frame frame;
  Refusal reason = parse(data, size, frame);
  bool repeated = false;
  if (reason == Refusal::NONE) {
    last_frame_ = hal_.micros();
    reason = order(frame, repeated);
  }
  if (repeated) {
    memcpy(answer_, kept_, kept_size_);
    answer_size_ = kept_size_;
    return;
  }
  if (reason == Refusal::NONE) reason = execute(frame);
  if (reason == Refusal::NONE)
    answer(frame);
  else
    refuse(data, size, frame, reason);
  // What repeats or damages a frame leaves its answer in memory.
  const bool intact = reason != Refusal::CRC && reason != Refusal::OLD_SEQUENCE;
  if (frame.checked && intact && frame.definition->code != Register::HELLO) {
    answered_ = frame.definition->code;
    memcpy(kept_, answer_, answer_size_);
    kept_size_ = answer_size_;
  }
}

size_t Wire::request(uint8_t (&answer)[kAnswerMax]) const {
  memcpy(answer, answer_, answer_size_);
  return answer_size_;
}

bool Wire::take(Command& command) {
  hal_.lock();
  const bool taken = queue_.pop(command);
  hal_.unlock();
  return taken;
}

void Wire::publish(const Status& status) {
  hal_.lock();
  status_ = status;
  if (queue_.empty()) flags_ = status.flags;
  hal_.unlock();
}

Refusal Wire::parse(const uint8_t* data, size_t size, Frame& frame) const {
  const Definition* row = find(data[0]);
  if (row == nullptr) return Refusal::UNKNOWN_REGISTER;
  frame.definition = row;
  frame.payload = data + 1;
  const size_t rest = size - 1;
  const bool first = row->version == 1;
  const bool short_setup = row->code == Register::SETUP && rest == kShortSetup;
  if (first && ((writable(*row) && rest == row->written) || short_setup)) {
    frame.size = rest;
    frame.writes = true;
  } else if (writable(*row) && rest == row->written + kTrailer) {
    frame.size = row->written;
    frame.writes = true;
    frame.checked = true;
  } else if (readable(*row) && ((first && rest == 0) || rest == kTrailer)) {
    frame.checked = rest == kTrailer;
  } else {
    const bool bare = rest == 0 || rest == kTrailer;
    return bare && !readable(*row) ? Refusal::DIRECTION : Refusal::LENGTH;
  }
  if (!frame.checked) return Refusal::NONE;
  frame.sequence = data[size - 2];
  const auto address = static_cast<uint8_t>(configuration_.address << 1);
  return crc8(crc8(0, &address, 1), data, size) == 0 ? Refusal::NONE : Refusal::CRC;
}

Refusal Wire::order(const Frame& frame, bool& repeated) {
  const Register code = frame.definition->code;
  if (!frame.checked || code == Register::HELLO || code == Register::ARM) return Refusal::NONE;
  const auto ahead = static_cast<int8_t>(frame.sequence - sequence_);
  if (ahead == 0 && answered_ == code) {
    repeated = true;
    return Refusal::NONE;
  }
  if (counting_ && ahead <= 0) return Refusal::OLD_SEQUENCE;
  sequence_ = frame.sequence;
  counting_ = true;
  return Refusal::NONE;
}

Refusal Wire::execute(const Frame& frame) {
  const Register code = frame.definition->code;
  if (!frame.writes) return Refusal::NONE;
  if (armed_ && !frame.checked && code != Register::STOP) return Refusal::TRAILER_REQUIRED;
  if (code == Register::ARM) return arm(frame);
  Command command;
  command.code = code;
  command.checked = frame.checked;
  command.micros = hal_.micros();
  Refusal reason = decode(frame, command);
  if (reason == Refusal::NONE) reason = permitted(frame, command);
  if (reason != Refusal::NONE) return reason;
  if (code == Register::HOMEOFFSET) {
    home_offset_ = command.number;
    return Refusal::NONE;
  }
  if (!queue_.push(command)) return Refusal::QUEUE_FULL;
  if (code == Register::WATCHDOG) watchdog_ms_ = static_cast<uint16_t>(command.whole);
  foresee(command);
  return Refusal::NONE;
}

Refusal Wire::arm(const Frame& frame) {
  if (load<uint16_t>(frame.payload) != boot_id_) return Refusal::WRONG_BOOT;
  const auto session = load<uint16_t>(frame.payload + 2);
  if (armed_ && session == session_) return Refusal::NONE;
  if (was_opened(session)) return Refusal::OLD_SEQUENCE;
  earlier_[sessions_++ % kSessionsKept] = session;
  armed_ = true;
  session_ = session;
  sequence_ = frame.sequence;
  counting_ = true;
  return Refusal::NONE;
}

bool Wire::was_opened(uint16_t session) const {
  for (size_t index = 0; index < sessions_ && index < kSessionsKept; ++index)
    if (earlier_[index] == session) return true;
  return false;
}

Refusal Wire::decode(const Frame& frame, Command& command) const {
  const uint8_t* bytes = frame.payload;
  memcpy(command.bytes, bytes, frame.size < 4 ? frame.size : 4);
  const uint8_t first = command.bytes[0];
  bool fits = true;
  switch (command.code) {
    case Register::SETUP:
      fits = first <= 100 && command.bytes[1] <= 100;
      break;
    case Register::SETCURRENT:
    case Register::SETHOLDCURRENT:
      fits = first <= 100;
      break;
    case Register::SETBRAKEMODE:
      fits = first <= static_cast<uint8_t>(BrakeMode::HARD_BRAKE);
      break;
    case Register::STOP:
    case Register::RUNCONTINUOUS:
      fits = first <= 1;
      break;
    case Register::HOME:
      fits = first <= 1 && command.bytes[1] >= 1 && command.bytes[1] <= 250 &&
             command.bytes[3] <= 100;
      break;
    case Register::MOVETOEND:
      fits = first <= 1 && command.bytes[1] >= 1 && command.bytes[1] <= 250;
      break;
    case Register::MOVESTEPS:
      command.whole = load<int32_t>(bytes);
      break;
    case Register::WATCHDOG:
      command.whole = load<uint16_t>(bytes);
      fits = command.whole >= 10 && command.whole <= 200;
      break;
    case Register::TRACK:
      command.number = load<float>(bytes);
      command.velocity = static_cast<float>(load<int16_t>(bytes + 4)) * kVelocityStepRpm;
      if (!isfinite(command.number)) return Refusal::NOT_FINITE;
      fits = fabsf(command.velocity) <= status_.max_velocity_rpm * 1.1F + 1.0F &&
             fabsf(command.number - status_.reference_deg) <= status_.reach_deg;
      break;
    case Register::SETRPM:
    case Register::MOVEANGLE:
    case Register::MOVETOANGLE:
    case Register::HOMEOFFSET:
      command.number = load<float>(bytes);
      if (!isfinite(command.number)) return Refusal::NOT_FINITE;
      // Beyond this the position counter of the driver would overflow.
      fits = fabsf(command.number) <= 1e7F;
      break;
    case Register::SETMAXACCELERATION:
    case Register::SETMAXDECELERATION:
    case Register::SETMAXVELOCITY:
    case Register::SETCONTROLTHRESHOLD:
      command.number = load<float>(bytes);
      if (!isfinite(command.number)) return Refusal::NOT_FINITE;
      fits = command.number >= 0.0F;
      break;
    case Register::CHECKORIENTATION:
      command.number = load<float>(bytes);
      if (!isfinite(command.number)) return Refusal::NOT_FINITE;
      fits = command.number > 0.0F && command.number <= 10.0F;
      break;
    case Register::CLEARFAULT:
      fits = first == static_cast<uint8_t>(status_.fault);
      break;
    default:
      break;
  }
  return fits ? Refusal::NONE : Refusal::OUT_OF_RANGE;
}

Refusal Wire::permitted(const Frame& frame, const Command& command) const {
  const bool latched = (flags_ & mask(Flags::FAULT)) != 0;
  if (command.code == Register::SETUP && armed_ && latched) return Refusal::FAULT_LATCHED;
  if (command.code == Register::SETUP && (flags_ & mask(Flags::BUSY)) != 0) return Refusal::BUSY;
  if (!frame.definition->motion) return Refusal::NONE;
  if (armed_ && latched) return Refusal::FAULT_LATCHED;
  if ((flags_ & mask(Flags::STALL)) != 0) return Refusal::STALLED;
  if ((flags_ & mask(Flags::NOTENABLED)) != 0) return Refusal::NOT_ENABLED;
  if ((flags_ & mask(Flags::BUSY)) != 0) return Refusal::BUSY;
  return Refusal::NONE;
}

void Wire::foresee(const Command& command) {
  switch (command.code) {
    case Register::SETUP:
      flags_ = static_cast<uint8_t>(flags_ & ~(Flags::NOTENABLED | Flags::STALL));
      if (!command.checked) flags_ = static_cast<uint8_t>(flags_ & ~mask(Flags::FAULT));
      if (status_.slow_setup) flags_ |= mask(Flags::BUSY);
      break;
    case Register::HOME:
      flags_ |= Flags::NOTHOMED | Flags::BUSY;
      break;
    case Register::CHECKORIENTATION:
    case Register::MOVETOEND:
      flags_ |= mask(Flags::BUSY);
      break;
    case Register::STOP:
      flags_ = static_cast<uint8_t>(flags_ & ~mask(Flags::BUSY));
      break;
    case Register::SETCURRENT:
    case Register::SETHOLDCURRENT:
      if (command.bytes[0] == 0) flags_ |= mask(Flags::NOTENABLED);
      break;
    case Register::DISABLECLOSEDLOOP:
      flags_ |= mask(Flags::NOTENABLED);
      break;
    case Register::ENABLESTALLGUARD:
    case Register::CLEARSTALL:
      flags_ = static_cast<uint8_t>(flags_ & ~mask(Flags::STALL));
      break;
    case Register::CLEARFAULT:
      flags_ = static_cast<uint8_t>(flags_ & ~(Flags::FAULT | Flags::STALL));
      break;
    default:
      break;
  }
}

size_t Wire::fill(Register code, uint8_t* bytes) const {
  uint8_t* at = bytes;
  switch (code) {
    case Register::PING:
      *at++ = 'O';
      break;
    case Register::GETDRIVERRPM:
      at += store(at, status_.driver_rpm);
      break;
    case Register::GETMOTORSTATE:
      *at++ = status_.motor_bits;
      break;
    case Register::ANGLEMOVED:
      at += store(at, status_.position_deg);
      break;
    case Register::GETPIDERROR:
      at += store(at, status_.error_steps);
      break;
    case Register::GETENCODERRPM:
      at += store(at, status_.velocity_rpm);
      break;
    case Register::HOMEOFFSET:
      at += store(at, home_offset_);
      break;
    case Register::HELLO:
      at += store(at, kMagic);
      *at++ = kProtocolVersion;
      *at++ = kFirmwareMajor;
      *at++ = kFirmwareMinor;
      *at++ = configuration_.joint;
      at += store(at, boot_id_);
      *at++ = static_cast<uint8_t>(hal_.reset_cause());
      *at++ = 0x0F;  // All four capabilities.
      break;
    case Register::TRACK:
      at += store(at, status_.position_deg);
      at += store(at, static_cast<int16_t>(
                          fmaxf(-32768.0F, fminf(32767.0F, roundf(status_.velocity_rpm /
                                                                  kVelocityStepRpm)))));
      break;
    case Register::STATE:
      at += store(at, status_.position_deg);
      at += store(at, status_.velocity_rpm);
      *at++ = static_cast<uint8_t>(status_.state);
      *at++ = status_.load_percent;
      break;
    case Register::FAULT:
      *at++ = static_cast<uint8_t>(status_.fault);
      at += store(at, status_.fault_data);
      *at++ = static_cast<uint8_t>(refusal_);
      at += store(at, crc_errors_);
      at += store(at, refusals_);
      break;
    case Register::WATCHDOG:
      at += store(at, watchdog_ms_);
      break;
    default:
      break;
  }
  return static_cast<size_t>(at - bytes);
}

void Wire::answer(const Frame& frame) {
  const bool payload = !frame.writes || frame.definition->direction == Direction::EXCHANGE;
  size_t size = payload ? fill(frame.definition->code, answer_) : 0;
  const uint8_t armed = armed_ ? mask(Flags::ARMED) : 0;
  if (frame.checked) {
    answer_[size++] = static_cast<uint8_t>(flags_ | armed);
    seal(size, frame.sequence);
  } else {
    answer_[size++] = flags_ & 0x0F;
    answer_size_ = size;
  }
}

void Wire::refuse(const uint8_t* data, size_t size, const Frame& frame, Refusal reason) {
  refusal_ = reason;
  count(refusals_);
  if (reason == Refusal::CRC) count(crc_errors_);
  // A frame with no known register may still be of version 2; its own trailer tells.
  const auto address = static_cast<uint8_t>(configuration_.address << 1);
  const bool trailed =
      frame.checked || (size >= 3 && crc8(crc8(0, &address, 1), data, size) == 0);
  const uint8_t armed = armed_ ? mask(Flags::ARMED) : 0;
  if (trailed) {
    answer_[0] = static_cast<uint8_t>(flags_ | armed | mask(Flags::REFUSED));
    seal(1, data[size - 2]);
  } else {
    answer_[0] = flags_ & 0x0F;
    answer_size_ = 1;
  }
}

void Wire::seal(size_t size, uint8_t sequence) {
  const auto address = static_cast<uint8_t>(configuration_.address << 1 | 1);
  answer_[size++] = sequence;
  answer_[size] = crc8(crc8(0, &address, 1), answer_, size);
  answer_size_ = size + 1;
}

}  // namespace bioscara
