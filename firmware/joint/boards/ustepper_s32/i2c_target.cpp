// The peripheral's rules (RM0368, section 18.3.2), and the order in which this file relies on them:
//
// - SR1 is read once per interrupt, first. All decisions are made on that one value.
// - BERR, ARLO, OVR and AF are cleared by writing 0 to them; ones leave the others alone.
// - RXNE is cleared by reading DR. It is served before STOPF and ADDR, as its byte belongs to the
//   transfer that they end.
// - STOPF is cleared by that read of SR1 and a write to CR1. It is served before ADDR, which may be
//   pending together with it: a STOP and the next transfer's address.
// - ADDR is cleared by that read of SR1 and a read of SR2, and SCL is held low until then; in a
//   read also until DR is written. SR2 is read for ADDR only, and DR is written at once after it.
// - TXE asks for the next byte of an answer. After the last one, for every byte that the controller
//   reads beyond it, 0xFF is sent, so that SCL is never held. TXE stays set after the controller's
//   NACK (AF), so the buffer interrupt is on between ADDR and the end of a transfer only.
// - A repeated START gives no STOPF: the next ADDR ends the frame before it. A read ends with AF,
//   after which there is no STOPF either.
// - BERR: a START or STOP inside a byte. The peripheral lets go of the lines and takes a START as
//   the beginning of the next transfer on its own. The frame is discarded, ADDR still served, and
//   the control tick resets the peripheral when the bus is free.
#include "i2c_target.h"

#include "clock.h"
#include "pins.h"

namespace bioscara {

namespace {

using stm32::I2c;

// A transfer in which nothing happens for this many ticks is over: the controller has gone. The
// longest pause within a sound one is the time a controller takes to start the read.
constexpr uint8_t kStillMost = 4;
// Outside of its own transfers a joint judges a clock that stands still only after this many ticks in
// a row: a joint with its original firmware holds it for 353 us in one command, and up to three
// of them do so one after the other.
constexpr uint8_t kStuckTicks = 4;
// Samples the clock line for about 12 us in all: longer than a period at 100 kHz.
constexpr unsigned kLooks = 100;
// More interrupts in a row that find nothing to do are a storm.
constexpr uint8_t kIdleInterruptsMost = 8;

constexpr uint32_t kErrors = I2c::BERR | I2c::ARLO | I2c::OVR;
constexpr uint32_t kClearable = kErrors | I2c::AF;
constexpr uint32_t kEvents = I2c::ITERREN | I2c::ITEVTEN;
constexpr uint8_t kFiller = 0xFF;

// Whether a transfer is going on, with whichever joint.
bool clock_moves() {
  const bool first = pins::i2c_clock_high();
  for (unsigned look = 0; look < kLooks; ++look)
    if (pins::i2c_clock_high() != first) return true;
  return false;
}

}  // namespace

void I2cTarget::listen(uint8_t address, Joint& joint) {
  joint_ = &joint;
  address_ = address;
  stm32::rcc().APB1ENR |= stm32::Rcc::I2C1EN;
  (void)stm32::rcc().APB1ENR;
  start_peripheral();
  stm32::enable(stm32::I2C1_EV, kPriority);
  stm32::enable(stm32::I2C1_ER, kPriority);
}

void I2cTarget::start_peripheral() {
  I2c& bus = stm32::i2c1();
  bus.CR1 = I2c::SWRST;
  bus.CR1 = 0;
  bus.CR2 = kEvents | clock::kApb1Megahertz;
  bus.OAR1 = I2c::OAR1_ALWAYS | static_cast<uint32_t>(address_) << 1;
  bus.CR1 = I2c::PE;
  // ACK sticks only once the peripheral is on.
  bus.CR1 = I2c::PE | I2c::ACK;
}

void I2cTarget::restart_peripheral() {
  discard();
  suspect_ = false;
  start_peripheral();
}

void I2cTarget::count() {
  if (errors_ != 0xFFFF) errors_ = static_cast<uint16_t>(errors_ + 1);
}

void I2cTarget::take(uint8_t byte) {
  if (phase_ != Phase::RECEIVING) return;
  if (received_ == kFrameMost) return;
  frame_[received_++] = byte;
  joint_->on_byte(frame_, received_);
}

// The end of a write: its bytes are a frame.
void I2cTarget::finish() {
  if (phase_ == Phase::RECEIVING) {
    joint_->on_receive(frame_, received_);
    suspect_ = false;
  }
  phase_ = Phase::IDLE;
}

// The transfer is discarded. A late read must not get the answer to an earlier frame.
void I2cTarget::discard() {
  stm32::i2c1().CR2 = kEvents | clock::kApb1Megahertz;
  if (phase_ == Phase::RECEIVING) joint_->on_receive(frame_, 0);
  phase_ = Phase::IDLE;
}

void I2cTarget::begin_receiving() {
  finish();
  received_ = 0;
  phase_ = Phase::RECEIVING;
}

// SCL is low until DR is written: the first byte goes there before the frame is taken.
void I2cTarget::begin_sending() {
  uint8_t first = 0;
  const bool known = phase_ == Phase::RECEIVING && joint_->foretell(received_, first);
  if (known) stm32::i2c1().DR = first;
  finish();
  answer_size_ = joint_->on_request(answer_);
  sent_ = known ? 1 : 0;
  phase_ = Phase::SENDING;
  if (!known) send_next();
}

void I2cTarget::send_next() {
  stm32::i2c1().DR = sent_ < answer_size_ ? answer_[sent_] : kFiller;
  ++sent_;
}

void I2cTarget::interrupt() {
  I2c& bus = stm32::i2c1();
  const uint32_t status = bus.SR1;
  bool served = false;
  events_ = static_cast<uint8_t>(events_ + 1);
  if ((status & kErrors) != 0) {
    bus.SR1 = ~(status & kErrors) & kClearable;
    count();
    discard();
    suspect_ = served = true;
  }
  if ((status & I2c::AF) != 0) {
    // The controller has ended its read.
    bus.SR1 = ~I2c::AF & kClearable;
    bus.CR2 = kEvents | clock::kApb1Megahertz;
    phase_ = Phase::IDLE;
    served = true;
  }
  if ((status & I2c::RXNE) != 0) {
    take(static_cast<uint8_t>(bus.DR));
    served = true;
  }
  if ((status & I2c::STOPF) != 0) {
    bus.CR1 = I2c::PE | I2c::ACK;
    bus.CR2 = kEvents | clock::kApb1Megahertz;
    finish();
    served = true;
  }
  if ((status & I2c::ADDR) != 0) {
    if ((bus.SR2 & I2c::TRA) != 0)
      begin_sending();
    else
      begin_receiving();
    bus.CR2 = kEvents | I2c::ITBUFEN | clock::kApb1Megahertz;
    served = true;
  } else if (phase_ == Phase::SENDING && (status & I2c::TXE) != 0) {
    send_next();
    served = true;
  }
  idle_interrupts_ = served ? 0 : static_cast<uint8_t>(idle_interrupts_ + 1);
  if (idle_interrupts_ == kIdleInterruptsMost) {
    idle_interrupts_ = 0;
    count();
    restart_peripheral();
  }
}

// Whether the peripheral is in order outside a transfer. SR2 may be read here without a check of
// ADDR: while ADDR is pending the clock is low, and from both lines high to the next ADDR it takes
// 2 us.
bool I2cTarget::at_rest() {
  const stm32::Masked masked(kPriority);
  if (phase_ != Phase::IDLE || suspect_ || !pins::i2c_lines_high()) return false;
  if ((stm32::i2c1().SR2 & I2c::BUSY) != 0) return false;
  stuck_ = false;
  stood_ = 0;
  return true;
}

void I2cTarget::supervise() {
  // Read once: an interrupt between two reads would count as seen, and its transfer as idle.
  const uint8_t events = events_;
  still_ = events == seen_ ? static_cast<uint8_t>(still_ + 1) : 0;
  if (still_ == 0) stood_ = 0;
  seen_ = events;
  const bool over = still_ >= kStillMost;
  if (over) still_ = 0;
  if (over ? at_rest() : !suspect_) return;
  const bool moves = clock_moves();
  const stm32::Masked masked(kPriority);
  if (events_ != seen_) return;
  const bool own = phase_ != Phase::IDLE;
  // After an error the reset waits until no transfer is running, at most kStillMost ticks
  // without an event. Transfers with other joints need no reset.
  if (over ? moves && !own && !suspect_ : moves || own) {
    stood_ = 0;
    return;
  }
  if (!own && !suspect_ && stood_ < kStuckTicks - 1) {
    ++stood_;
    still_ = kStillMost - 1;  // The next tick looks again.
    return;
  }
  if (!suspect_ && !stuck_) count();
  stuck_ = !own;
  restart_peripheral();
}

}  // namespace bioscara
