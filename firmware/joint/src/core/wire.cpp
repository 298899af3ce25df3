#include "wire.h"

#include <math.h>

#include "bytes.h"
#include "version.h"

namespace bioscara {

namespace {

// Position of each code's row in the table; 0 is NONE, which is no register.
struct RowIndex {
  uint8_t rows[256];
};
constexpr RowIndex make_index() {
  RowIndex index{};
  uint8_t position = 0;
  for (const Definition& row : kDefinitions) index.rows[static_cast<uint8_t>(row.code)] = position++;
  return index;
}
constexpr RowIndex kIndex = make_index();
static_assert(kDefinitions[0].code == Register::NONE, "what is not in the table finds row 0");

const Definition* find(uint8_t code) {
  const uint8_t row = kIndex.rows[code];
  return row == 0 ? nullptr : &kDefinitions[row];
}

bool readable(const Definition& row) {
  return row.direction == Direction::READ || row.direction == Direction::READ_WRITE;
}

bool writable(const Definition& row) {
  return row.direction != Direction::READ;
}

template <typename T>
bool within(const Range<T>& range, T value) {
  return value >= range.lower && value <= range.upper;
}

void count(uint16_t& counter) {
  if (counter != 0xFFFF) ++counter;
}

// SETUP is documented with two bytes; hosts pad it to four.
constexpr size_t kShortSetup = 2;
constexpr size_t kTrailer = 2;
// No version 2 frame of any firmware is longer: the clock is held while a frame is checked.
constexpr size_t kLongest = 16;

// Executed in the interrupt: no command for the tick.
bool immediate(Register code) {
  return code == Register::HOMEOFFSET || code == Register::CAPTURE ||
         code == Register::CAPTUREBLOCK;
}

// So long after the last frame of version 2 a host of version 1 may move a joint without session.
constexpr uint32_t kTrailedMicros = 10000000;

// BOOTLOADER must follow DISARM within this time.
constexpr uint32_t kDisarmedMicros = 2000000;

}  // namespace

void Wire::boot() { boot_id_ = hal_.boot_id(); }

void Wire::prepare(const uint8_t* data, size_t size) {
  judged_ = 0;
  Frame frame;
  if (parse(data, size, frame) != Refusal::NONE) return;
  judge(data, size, verdict_);
  judged_ = size;
}

void Wire::receive(const uint8_t* data, size_t size) {
  if (size == 0) {  // An address probe.
    answer_.size = 0;
  } else {
    if (judged_ != size) judge(data, size, verdict_);
    apply(verdict_);
  }
  judged_ = 0;
}

bool Wire::foretell(size_t size, uint8_t& first) const {
  if (size == 0 || judged_ != size) return false;
  first = verdict_.answer.bytes[0];
  return true;
}

size_t Wire::request(uint8_t (&answer)[kAnswerMax]) const {
  memcpy(answer, answer_.bytes, kAnswerMax);
  return answer_.size;
}

bool Wire::take(Command& command) {
  hal_.lock();
  const bool taken = queue_.pop(command);
  hal_.unlock();
  return taken;
}

void Wire::publish(const Status& status) {
  const auto other = static_cast<uint8_t>(1 - current_);
  statuses_[other] = status;
  capture_.add(status.error_steps);
  // Before the microseconds wrap.
  if (trailed_ && hal_.micros() - trailed_at_ > kTrailedMicros) trailed_ = false;
  hal_.lock();
  current_ = other;
  if (queue_.empty()) flags_ = status.flags;
  hal_.unlock();
}

void Wire::judge(const uint8_t* data, size_t size, Verdict& verdict) const {
  verdict.frame = Frame();
  verdict.repeated = false;
  verdict.reason = parse(data, size, verdict.frame);
  verdict.intact = verdict.reason == Refusal::NONE;
  const Frame& frame = verdict.frame;
  if (verdict.intact) verdict.reason = order(frame, verdict.repeated);
  if (verdict.repeated) {
    verdict.answer = kept_;
    return;
  }
  if (verdict.reason == Refusal::NONE && frame.writes)
    verdict.reason = examine(frame, verdict.command);
  if (verdict.reason != Refusal::NONE)
    refuse(data, size, frame, verdict.answer);
  else
    answer(frame, frame.writes ? foresee(verdict.command) : flags_, verdict.answer);
}

void Wire::apply(const Verdict& verdict) {
  const Frame& frame = verdict.frame;
  answer_ = verdict.answer;
  const bool trailed = verdict.intact && frame.checked;
  if (verdict.intact) last_frame_ = hal_.micros();
  if (trailed) {
    trailed_ = true;
    trailed_at_ = last_frame_;
  }
  if (verdict.repeated) return;
  const bool fresh = trailed && verdict.reason != Refusal::OLD_SEQUENCE;
  const Register code = trailed ? frame.definition->code : Register::NONE;
  if (fresh && code != Register::HELLO && code != Register::ARM) {
    sequence_ = frame.sequence;
    counting_ = true;
  }
  if (verdict.intact && code != Register::DISARM) disarmed_ = false;
  if (verdict.reason != Refusal::NONE) {
    refusal_ = verdict.reason;
    count(refusals_);
    if (verdict.reason == Refusal::CRC) count(crc_errors_);
  } else if (frame.writes) {
    execute(frame, verdict.command);
  }
  // A repeated or damaged frame leaves its answer in memory.
  if (fresh && code != Register::HELLO) {
    answered_ = code;
    kept_ = answer_;
  }
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

Refusal Wire::order(const Frame& frame, bool& repeated) const {
  const Register code = frame.definition->code;
  if (!frame.checked || code == Register::HELLO || code == Register::ARM) return Refusal::NONE;
  const auto ahead = static_cast<int8_t>(frame.sequence - sequence_);
  repeated = ahead == 0 && answered_ == code;
  return !repeated && counting_ && ahead <= 0 ? Refusal::OLD_SEQUENCE : Refusal::NONE;
}

Refusal Wire::examine(const Frame& frame, Command& command) const {
  const Register code = frame.definition->code;
  command = Command();
  // They differ in the answer only.
  command.code = code == Register::TRACKLOAD ? Register::TRACK : code;
  command.checked = frame.checked;
  const bool moves = frame.definition->motion || code == Register::SETUP;
  if (!frame.checked && code != Register::STOP && (armed_ || (trailed_ && moves)))
    return Refusal::TRAILER_REQUIRED;
  if (code == Register::ARM) return may_arm(frame);
  if (code == Register::DISARM || code == Register::BOOTLOADER) return may_leave(frame);
  Refusal reason = decode(frame, command);
  if (reason == Refusal::NONE) reason = permitted(frame, command);
  if (reason == Refusal::NONE && !immediate(code) && !queue_.takes(command))
    reason = Refusal::QUEUE_FULL;
  return reason;
}

void Wire::execute(const Frame& frame, const Command& command) {
  switch (command.code) {
    case Register::ARM:
      arm(frame);
      return;
    case Register::DISARM:
      armed_ = trailed_ = false;
      disarmed_ = true;
      disarmed_at_ = hal_.micros();
      return;
    case Register::HOMEOFFSET:
      home_offset_ = command.number;
      return;
    case Register::CAPTURE:
      capture_.begin();
      return;
    case Register::CAPTUREBLOCK:
      return;
    case Register::WATCHDOG:
      watchdog_ms_ = static_cast<uint16_t>(command.whole);
      break;
    default:
      break;
  }
  flags_ = foresee(command);
  Command arrived = command;
  arrived.micros = hal_.micros();
  queue_.push(arrived);
}

Refusal Wire::may_arm(const Frame& frame) const {
  if (load<uint16_t>(frame.payload) != boot_id_) return Refusal::WRONG_BOOT;
  const auto session = load<uint16_t>(frame.payload + 2);
  const bool open = armed_ && session == session_;
  return !open && was_opened(session) ? Refusal::OLD_SEQUENCE : Refusal::NONE;
}

void Wire::arm(const Frame& frame) {
  const auto session = load<uint16_t>(frame.payload + 2);
  if (armed_ && session == session_) return;
  earlier_[sessions_++ % kSessionsKept] = session;
  armed_ = true;
  session_ = session;
  sequence_ = frame.sequence;
  counting_ = true;
}

// Both steps to the bootloader: only for a joint that neither moves nor is about to.
Refusal Wire::may_leave(const Frame& frame) const {
  if (load<uint16_t>(frame.payload) != boot_id_) return Refusal::WRONG_BOOT;
  if ((flags_ & mask(Flags::NOTENABLED)) == 0) return Refusal::ENABLED;
  const JointState state = status().state;
  const bool rests = state == JointState::DISABLED || state == JointState::FAULTED;
  if (!rests || (flags_ & mask(Flags::BUSY)) != 0) return Refusal::BUSY;
  if (frame.definition->code == Register::DISARM) return Refusal::NONE;
  const bool disarmed = disarmed_ && hal_.micros() - disarmed_at_ <= kDisarmedMicros;
  return disarmed ? Refusal::NONE : Refusal::NOT_DISARMED;
}

bool Wire::was_opened(uint16_t session) const {
  for (size_t index = 0; index < sessions_ && index < kSessionsKept; ++index)
    if (earlier_[index] == session) return true;
  return false;
}

Refusal Wire::decode(const Frame& frame, Command& command) const {
  const uint8_t* bytes = frame.payload;
  const Definition& row = *frame.definition;
  bool fits = true;
  switch (row.kind) {
    case Kind::F32:
      command.number = load<float>(bytes);
      if (!isfinite(command.number)) return Refusal::NOT_FINITE;
      fits = within(kNumberRanges[row.range], command.number);
      break;
    case Kind::I32:
      command.whole = load<int32_t>(bytes);
      fits = within(kNumberRanges[row.range], static_cast<float>(command.whole));
      break;
    case Kind::U16:
      command.whole = load<uint16_t>(bytes);
      fits = within(kNumberRanges[row.range], static_cast<float>(command.whole));
      break;
    default:
      for (size_t at = 0; fits && at < frame.size; ++at) {
        command.bytes[at] = bytes[at];
        fits = within(kByteRanges[row.range + at], bytes[at]);
      }
      break;
  }
  if (command.code == Register::TRACK) {
    command.velocity = static_cast<float>(load<int16_t>(bytes + 4)) * kVelocityStepRpm;
    fits = fabsf(command.velocity) <= status().max_velocity_rpm * 1.1F + 1.0F &&
           fabsf(command.number - status().reference_deg) <= status().reach_deg;
  } else if (command.code == Register::CLEARFAULT) {
    fits = bytes[0] == static_cast<uint8_t>(status().fault);
  } else if (command.code == Register::CAPTUREBLOCK) {
    fits = capture_.holds(bytes[0]);
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

uint8_t Wire::foresee(const Command& command) const {
  uint8_t flags = flags_;
  switch (command.code) {
    case Register::SETUP:
      flags = static_cast<uint8_t>(flags & ~(Flags::NOTENABLED | Flags::STALL));
      if (!command.checked) flags = static_cast<uint8_t>(flags & ~mask(Flags::FAULT));
      if (status().slow_setup) flags |= mask(Flags::BUSY);
      break;
    case Register::HOME:
      flags |= Flags::NOTHOMED | Flags::BUSY;
      break;
    case Register::CHECKORIENTATION:
    case Register::MOVETOEND:
      flags |= mask(Flags::BUSY);
      break;
    case Register::STOP:
      flags = static_cast<uint8_t>(flags & ~mask(Flags::BUSY));
      break;
    case Register::SETCURRENT:
    case Register::SETHOLDCURRENT:
      if (command.bytes[0] == 0) flags |= mask(Flags::NOTENABLED);
      break;
    case Register::DISABLECLOSEDLOOP:
      flags |= mask(Flags::NOTENABLED);
      break;
    case Register::ENABLESTALLGUARD:
    case Register::CLEARSTALL:
      flags = static_cast<uint8_t>(flags & ~mask(Flags::STALL));
      break;
    case Register::CLEARFAULT:
      flags = static_cast<uint8_t>(flags & ~(Flags::FAULT | Flags::STALL));
      break;
    default:
      break;
  }
  return flags;
}

size_t Wire::fill(const Frame& frame, uint8_t* bytes) const {
  const Register code = frame.definition->code;
  uint8_t* at = bytes;
  switch (code) {
    case Register::PING:
      *at++ = 'O';
      break;
    case Register::GETDRIVERRPM:
      at += store(at, status().driver_rpm);
      break;
    case Register::GETMOTORSTATE:
      *at++ = status().motor_bits;
      break;
    case Register::ANGLEMOVED:
      at += store(at, status().position_deg);
      break;
    case Register::GETPIDERROR:
      at += store(at, status().error_steps);
      break;
    case Register::GETENCODERRPM:
      at += store(at, status().velocity_rpm);
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
      *at++ = 0xFF;  // All eight capabilities.
      break;
    case Register::TRACK:
    case Register::TRACKLOAD:
      at += store(at, status().position_deg);
      at += store(at, static_cast<int16_t>(
                          fmaxf(-32768.0F, fminf(32767.0F, roundf(status().velocity_rpm /
                                                                  kVelocityStepRpm)))));
      if (code == Register::TRACKLOAD) *at++ = status().load_percent;
      break;
    case Register::STATE:
      at += store(at, status().position_deg);
      at += store(at, status().velocity_rpm);
      *at++ = static_cast<uint8_t>(status().state);
      *at++ = status().load_percent;
      break;
    case Register::FAULT:
      *at++ = static_cast<uint8_t>(status().fault);
      at += store(at, status().fault_data);
      *at++ = static_cast<uint8_t>(refusal_);
      at += store(at, crc_errors_);
      at += store(at, refusals_);
      break;
    case Register::WATCHDOG:
      at += store(at, watchdog_ms_);
      break;
    case Register::BUSERRORS:
      at += store(at, hal_.bus_errors());
      break;
    case Register::IMAGE:
      at += store(at, hal_.image());
      break;
    case Register::EXCEPTION: {
      const ExceptionRecord last = hal_.exception();
      *at++ = last.vector;
      at += store(at, last.address);
      at += store(at, last.status);
      *at++ = last.starts;
      break;
    }
    case Register::WARNINGS:
      *at++ = status().warnings;
      break;
    case Register::CAPTURE:
      at += store(at, capture_.captured());
      break;
    case Register::CAPTUREBLOCK:
      for (size_t index = 0; index < kBlockSamples; ++index)
        at += store(at, capture_.error(frame.payload[0], index));
      break;
    default:
      break;
  }
  return static_cast<size_t>(at - bytes);
}

void Wire::answer(const Frame& frame, uint8_t flags, Answer& answer) const {
  const Register code = frame.definition->code;
  const bool payload = !frame.writes || frame.definition->direction == Direction::EXCHANGE;
  answer.size = payload ? fill(frame, answer.bytes) : 0;
  if (!frame.checked) {
    answer.bytes[answer.size++] = flags & 0x0F;
    return;
  }
  const bool armed = code == Register::ARM || (armed_ && code != Register::DISARM);
  answer.bytes[answer.size++] = static_cast<uint8_t>(flags | (armed ? mask(Flags::ARMED) : 0));
  seal(answer, frame.sequence);
}

void Wire::refuse(const uint8_t* data, size_t size, const Frame& frame, Answer& answer) const {
  // A frame with no known register may still be of version 2; its own trailer decides.
  const auto address = static_cast<uint8_t>(configuration_.address << 1);
  const bool trailed =
      frame.checked ||
      (size >= 3 && size <= kLongest && crc8(crc8(0, &address, 1), data, size) == 0);
  const uint8_t armed = armed_ ? mask(Flags::ARMED) : 0;
  answer.size = 1;
  answer.bytes[0] = flags_ & 0x0F;
  if (!trailed) return;
  answer.bytes[0] = static_cast<uint8_t>(flags_ | armed | mask(Flags::REFUSED));
  seal(answer, data[size - 2]);
}

void Wire::seal(Answer& answer, uint8_t sequence) const {
  const auto address = static_cast<uint8_t>(configuration_.address << 1 | 1);
  answer.bytes[answer.size++] = sequence;
  answer.bytes[answer.size] = crc8(crc8(0, &address, 1), answer.bytes, answer.size);
  ++answer.size;
}

}  // namespace bioscara
