// Frames in, answers out: the whole I2C side. Runs in the interrupt and touches no SPI.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "capture.h"
#include "command.h"
#include "configuration.h"
#include "hal.h"
#include "status.h"

namespace bioscara {

class Wire {
 public:
  static constexpr size_t kAnswerMax = 13;
  static constexpr uint16_t kWatchdogDefault = 60;
  static constexpr size_t kSessionsKept = 32;

  Wire(Hal& hal, const Configuration& configuration) : hal_(hal), configuration_(configuration) {}

  // Forgets the session and reads the boot id; call before the bus can reach the joint.
  void boot();

  // Interrupt side. prepare() checks a frame that may be whole but changes nothing; receive()
  // executes it, at once if it is the frame checked last.
  void prepare(const uint8_t* data, size_t size);
  void receive(const uint8_t* data, size_t size);
  // The first byte of the answer that receive() of so many bytes will arm; false where the frame
  // was not checked yet.
  bool foretell(size_t size, uint8_t& first) const;
  size_t request(uint8_t (&answer)[kAnswerMax]) const;

  // Tick side.
  bool take(Command& command);
  void publish(const Status& status);
  uint16_t watchdog_ms() const { return watchdog_ms_; }
  bool armed() const { return armed_; }
  // When the last intact frame arrived.
  uint32_t last_frame() const { return last_frame_; }

 private:
  struct Frame {
    const Definition* definition = nullptr;
    const uint8_t* payload = nullptr;
    size_t size = 0;
    bool checked = false;
    bool writes = false;
    uint8_t sequence = 0;
  };
  struct Answer {
    uint8_t bytes[kAnswerMax] = {};
    size_t size = 0;
  };
  // The verdict on a frame, before any of it is executed.
  struct Verdict {
    Frame frame;
    // Bytes arrived as they were sent: a known register, a length of its own, the right CRC.
    bool intact = false;
    bool repeated = false;
    Refusal reason = Refusal::NONE;
    Command command;
    Answer answer;
  };

  const Status& status() const { return statuses_[current_]; }

  void judge(const uint8_t* data, size_t size, Verdict& verdict) const;
  Refusal parse(const uint8_t* data, size_t size, Frame& frame) const;
  Refusal order(const Frame& frame, bool& repeated) const;
  Refusal examine(const Frame& frame, Command& command) const;
  Refusal may_arm(const Frame& frame) const;
  Refusal may_leave(const Frame& frame) const;
  bool was_opened(uint16_t session) const;
  Refusal decode(const Frame& frame, Command& command) const;
  Refusal permitted(const Frame& frame, const Command& command) const;
  uint8_t foresee(const Command& command) const;
  void answer(const Frame& frame, uint8_t flags, Answer& answer) const;
  void refuse(const uint8_t* data, size_t size, const Frame& frame, Answer& answer) const;
  size_t fill(const Frame& frame, uint8_t* bytes) const;
  void seal(Answer& answer, uint8_t sequence) const;

  void apply(const Verdict& verdict);
  void execute(const Frame& frame, const Command& command);
  void arm(const Frame& frame);

  Hal& hal_;
  const Configuration configuration_;
  CommandQueue queue_;
  Capture capture_;
  // The tick writes the one that the interrupt does not read.
  Status statuses_[2];
  volatile uint8_t current_ = 0;
  // The flags as they will be once the queued commands have run.
  uint8_t flags_ = Flags::NOTHOMED | Flags::NOTENABLED;

  Answer answer_;
  // The last verdict, and the size of its frame; 0 if there is none.
  Verdict verdict_;
  size_t judged_ = 0;

  uint16_t boot_id_ = 0;
  uint16_t session_ = 0;
  // The last sessions of this boot, a ring: a late copy of their ARM opens nothing.
  uint16_t earlier_[kSessionsKept] = {};
  size_t sessions_ = 0;
  bool armed_ = false;
  // DISARM was the last frame, and when.
  bool disarmed_ = false;
  uint32_t disarmed_at_ = 0;
  // An intact frame of version 2 arrived in the last seconds, and when the last one did.
  bool trailed_ = false;
  uint32_t trailed_at_ = 0;
  bool counting_ = false;
  uint8_t sequence_ = 0;
  Register answered_ = Register::NONE;
  Answer kept_;

  uint16_t watchdog_ms_ = kWatchdogDefault;
  float home_offset_ = 0.0F;
  uint32_t last_frame_ = 0;
  Refusal refusal_ = Refusal::NONE;
  uint16_t crc_errors_ = 0;
  uint16_t refusals_ = 0;
};

}  // namespace bioscara
