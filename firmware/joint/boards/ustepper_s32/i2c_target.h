// I2C1 as a target: bytes in, bytes out, and a recovery from every state of the bus.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "../../src/core/joint.h"
#include "stm32f401.h"

namespace bioscara {

class I2cTarget {
 public:
  // Longest frame that is kept; bytes beyond it are dropped: such a frame is
  // too long for every register anyway.
  static constexpr size_t kFrameMost = 32;
  // Of both interrupts: above the control tick, and equal so that they do not nest.
  static constexpr uint8_t kPriority = 1;

  // Starts to answer at this 7-bit address. `joint` gets every frame and gives the answers.
  void listen(uint8_t address, Joint& joint);

  // Both interrupts of the peripheral, which never nest.
  void interrupt();

  // Every millisecond, from the control tick: resets the peripheral where a transfer stands still
  // or an error has been seen.
  void supervise();

  // Bus errors and transfers given up since boot; saturates.
  uint16_t errors() const { return errors_; }

 private:
  enum class Phase : uint8_t { IDLE, RECEIVING, SENDING };

  void start_peripheral();
  void restart_peripheral();
  void take(uint8_t byte);
  void finish();
  void discard();
  void begin_receiving();
  void begin_sending();
  void send_next();
  void count();
  bool at_rest();

  Joint* joint_ = nullptr;
  uint8_t address_ = 0;
  volatile Phase phase_ = Phase::IDLE;
  // An error was seen and no sound transfer since: reset when the bus is free.
  volatile bool suspect_ = false;
  volatile uint16_t errors_ = 0;
  // Counts interrupts, so that the tick notices new ones.
  volatile uint8_t events_ = 0;
  // Interrupts in a row that found nothing to do.
  uint8_t idle_interrupts_ = 0;

  // The tick's own: the last value of `events_`, for how many ticks, in how many of them in a row the
  // clock stood still, and whether the bus has hung since that was counted.
  uint8_t seen_ = 0;
  uint8_t still_ = 0;
  uint8_t stood_ = 0;
  bool stuck_ = false;

  uint8_t frame_[kFrameMost] = {};
  size_t received_ = 0;
  uint8_t answer_[Joint::kAnswerMax] = {};
  size_t answer_size_ = 0;
  size_t sent_ = 0;
};

}  // namespace bioscara
