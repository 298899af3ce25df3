// The joint as its board sees it: boot once, tick at a fixed rate, two I2C events.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "configuration.h"
#include "hal.h"
#include "homing.h"
#include "indicator.h"
#include "load_angle.h"
#include "motion.h"
#include "orientation.h"
#include "speed_filter.h"
#include "supervisor.h"
#include "tle5012b.h"
#include "tracker.h"
#include "wire.h"

namespace bioscara {

class Joint {
 public:
  // Period of the control tick.
  static constexpr uint32_t kTickMicros = 1000;
  // Longest answer: HELLO's payload, flags and trailer.
  static constexpr size_t kAnswerMax = Wire::kAnswerMax;

  Joint(Hal& hal, const Configuration& configuration);

  // Power-up: sets the chips up with the power stage open. Moves nothing.
  void boot();

  // One control period. The only place that talks SPI, drives the motor or feeds the watchdog.
  void tick();

  // I2C interrupt: the controller has written these bytes so far. May be called after each byte: a
  // possible whole frame is checked in advance, so that its end takes no time.
  void on_byte(const uint8_t* data, size_t size) { wire_.prepare(data, size); }

  // I2C interrupt: the controller wrote these bytes. Checks them, queues the command for the next
  // tick and arms the answer.
  void on_receive(const uint8_t* data, size_t size) { wire_.receive(data, size); }

  // I2C interrupt: the controller is about to end a frame of this size by a read. The first byte of
  // its answer, if it is known already: it can be sent before the frame is taken by on_receive().
  bool foretell(size_t size, uint8_t& first) const { return wire_.foretell(size, first); }

  // I2C interrupt: the controller reads. Copies out the armed answer and returns its size; the
  // board sends 0xFF for every byte beyond it. Executes nothing.
  size_t on_request(uint8_t (&answer)[kAnswerMax]) const { return wire_.request(answer); }

 private:
  // Ticks from boot within which the encoder must give its first angle; it takes 7 ms at most.
  static constexpr int kEncoderStart = 20;
  // From BOOTLOADER to the bootloader: its answer has been read long since.
  static constexpr int kLeaveTicks = 20;
  // Samples in a row without a sound angle after which the encoder counts as failed.
  static constexpr int kBadSamples = 2;

  // joint.cpp: the tick.
  void sense();
  bool start_encoder();
  void supervise();
  void watch_silence();
  void act();
  void publish();
  void indicate();

  // joint_commands.cpp: execution of commands.
  void execute(const Command& command);
  void set_up(const Command& command);
  bool driver_still_faulty();
  void set_current(const Command& command);
  void move(float target, bool alone);
  void track(const Command& command);
  void home(const Command& command);
  void check_orientation(const Command& command);
  void stop(bool hard);
  void disable();
  void leave();

  // joint_sequences.cpp: sequences of several ticks.
  void run_homing();
  void finish_homing();
  void run_orientation();
  void run_stopping();
  // Where the joint is meant to be [steps of the encoder].
  float reference() const;
  bool there() const;
  void correct();
  void settle(float goal);
  void lead();
  bool resynchronise();
  // The driver's or the encoder's position has a new origin.
  void renamed();
  void hold();
  void harm(Fault fault, float data);
  void latch(Fault fault, float data);
  void cut(Fault fault, float data);
  void apply_currents();
  void power(bool on);
  bool sequence() const;
  bool running_down() const;
  // A chip is not ready yet: after a power-up the encoder, after a reset of its own the driver.
  bool starting() const { return starting_ != 0 || !motion_.driver().ready(); }
  bool underway() const;

  Hal& hal_;
  const Configuration configuration_;
  Wire wire_;
  Motion motion_;
  Tle5012b encoder_;
  SpeedFilter filter_;
  LoadAngle load_angle_;
  Tracker tracker_;
  Supervisor supervisor_;
  Homing homing_;
  Orientation orientation_;
  Indicator indicator_;

  JointState state_ = JointState::DISABLED;
  bool enabled_ = false;
  bool homed_ = false;
  bool stalled_ = false;
  bool checked_ = false;
  // The driver's direction agrees with the encoder's, whichever way the motor is plugged in.
  bool directed_ = false;
  // The motor has current: its rotor should be with its field. That of shorted coils turns freely.
  bool powered_ = false;
  bool closed_loop_ = true;
  // The motion runs autonomously, with no setpoint to repeat.
  bool alone_ = false;
  Fault fault_ = Fault::NONE;
  float fault_data_ = 0.0F;

  uint8_t drive_percent_ = 0;
  uint8_t hold_percent_ = 0;
  BrakeMode brake_ = BrakeMode::FREEWHEEL;
  float max_velocity_;
  float acceleration_;
  float deceleration_;
  float threshold_ = 4.0F;
  float stop_deceleration_;

  int32_t zero_counts_ = 0;
  // Where an earlier homing of this boot found the end stop, and where a refused one did [counts].
  bool known_zero_ = false;
  int32_t other_zero_ = 0;
  bool other_known_ = false;
  int bad_samples_ = 0;
  // Ticks left for the encoder to start, or until the jump to the bootloader; 0 if neither is
  // pending.
  int starting_ = 0;
  int leaving_ = 0;
  float encoder_steps_ = 0.0F;
  float error_ = 0.0F;

  // Target position of the encoder, and the lead of the field that it needs.
  float goal_ = 0.0F;
  float correction_ = 0.0F;
  bool settling_ = false;
  // The rotor had lost the field at rest, which takes it back to its place.
  bool returning_ = false;
  float run_velocity_ = 0.0F;
  int still_ = 0;
  uint32_t fed_ = 0;
  // When the present tick began.
  uint32_t began_ = 0;
};

}  // namespace bioscara
