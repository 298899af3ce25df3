// A joint as existing arms are flashed: its observed behaviour, defects included.
// docs/simulation.md lists the modelled parts and the omitted ones.
#pragma once

#include <cstddef>
#include <cstdint>

#include "../../joint/src/core/hal.h"
#include "original_driver.h"
#include "original_encoder.h"
#include "virtual_time.h"

namespace bioscara::sim {

class OriginalJoint {
 public:
  static constexpr std::size_t kAnswerMax = 5;

  OriginalJoint(Hal& hal, Time now);

  // Executes everything that is due; returns when something is due again.
  Time run(Time now);
  // The same for the main loop stuck in its current operation; the library's timer goes on.
  Time run_without_loop(Time now);

  // False while it starts: the address acknowledges, but nothing answers a read.
  bool listening() const { return listening_; }

  // I2C interrupt. Writing only stores; reading executes, with the clock held low until it is done.
  void receive(const std::uint8_t* data, std::size_t size);
  struct Answer {
    std::uint8_t bytes[kAnswerMax];
    std::size_t size;
    Time duration;
  };
  Answer request(Time now);
  // Field counter minus encoder at the closed loop's last sample [microsteps].
  std::int32_t error() const { return error_; }

 private:
  // The operation that the main loop is in the middle of.
  enum class Phase : std::uint8_t {
    LOOP,
    STALL_STOP,
    HOME_STOP,
    HOME_WAIT,
    HOME_SEEK,
    HOME_END,
    ORIENTATION,
  };

  void sample();
  Time pass(Time now);
  Time run_pending(Time now);
  Time end_pass(Time now);
  bool stall_found();
  Time continue_phase(Time now);
  Time seek();
  Time start_orientation(float degrees);
  Time step_orientation(Time now);
  Time finish_setup(Time now);

  Time execute();
  void set_up();
  void move_to_angle(float degrees);
  Time defer();
  float payload_float() const;
  void answer_float(float value);
  std::uint8_t flags() const;

  OriginalDriver driver_;
  OriginalEncoder encoder_;

  // The library's timer: encoder and closed loop.
  double next_sample_;
  std::int32_t error_ = 0;
  bool closed_loop_ = true;

  // The main loop.
  Time next_loop_;
  Phase phase_ = Phase::ORIENTATION;
  bool pending_ = false;
  bool listening_ = false;

  bool stalled_ = false;
  bool busy_ = false;
  bool homed_ = false;
  bool enabled_ = false;

  // The last frame; a short payload leaves the rest of the one before.
  std::uint8_t register_ = 0;
  std::uint8_t payload_[4] = {};
  std::size_t length_ = 0;
  Answer answer_ = {};

  int drive_percent_ = 0;
  float setpoint_rpm_ = 0.0F;
  Time last_request_ = 0;
  float home_offset_ = 0.0F;

  bool detecting_ = false;
  std::int32_t stall_threshold_ = 0;
  float stall_filter_ = 0.0F;
  float stall_last_ = 0.0F;

  // Direction, rpm, threshold [microsteps], current [%].
  std::uint8_t home_[4] = {};

  // The orientation check: to and fro until two results agree.
  std::int32_t orientation_steps_ = 0;
  std::int32_t orientation_start_ = 0;
  int orientation_last_ = 0;
  bool orientation_out_ = true;
  bool agree_ = false;
  bool closed_loop_before_ = true;
};

}  // namespace bioscara::sim
