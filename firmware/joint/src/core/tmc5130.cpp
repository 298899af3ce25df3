#include "tmc5130.h"

#include <math.h>
#include <stdlib.h>

#include "units.h"

namespace bioscara {

namespace {

enum : uint8_t {
  GCONF = 0x00,
  GSTAT = 0x01,
  IOIN = 0x04,
  IHOLD_IRUN = 0x10,
  TPOWERDOWN = 0x11,
  TPWMTHRS = 0x13,
  TCOOLTHRS = 0x14,
  THIGH = 0x15,
  RAMPMODE = 0x20,
  XACTUAL = 0x21,
  VACTUAL = 0x22,
  VSTART = 0x23,
  A1 = 0x24,
  V1 = 0x25,
  AMAX = 0x26,
  VMAX = 0x27,
  DMAX = 0x28,
  D1 = 0x2A,
  VSTOP = 0x2B,
  TZEROWAIT = 0x2C,
  XTARGET = 0x2D,
  VDCMIN = 0x33,
  SW_MODE = 0x34,
  MSLUT = 0x60,  // Eight.
  MSLUTSEL = 0x68,
  MSLUTSTART = 0x69,
  CHOPCONF = 0x6C,
  COOLCONF = 0x6D,
  DCCTRL = 0x6E,
  DRV_STATUS = 0x6F,
  PWMCONF = 0x70,
  ENCM_CTRL = 0x72,
};

constexpr uint8_t kWrite = 0x80;
// Current scaled from the reference input, and stealthChop below TPWMTHRS.
constexpr uint32_t kGconf = 0x05;
constexpr uint32_t kShaft = 0x10;
constexpr uint32_t kTpwmthrs = 5000;
// TBL 2, HSTRT 4, TOFF 2: the settings the arm was measured with.
constexpr uint32_t kChopconf = 0x00010042;
// With this field 0 the bridge is off, independent of the enable pin.
constexpr uint32_t kToff = 0x0F;
// Reset value; bits 20 and 21 are the freewheel field.
constexpr uint32_t kPwmconf = 0x00050480;
constexpr uint32_t kFreewheel = 1U << 20;
constexpr uint32_t kShortCoils = 2U << 20;
constexpr uint8_t kUndervoltage = 0x04;
// Reset values (TMC5130A data sheet, microstep table): a sine in MSLUT, MSLUTSEL and MSLUTSTART.
constexpr uint32_t kSine[] = {0xAAAAB554, 0x4A9554AA, 0x24492929, 0x10104222,
                              0xFBFFFFFF, 0xB5BB777D, 0x49295556, 0x00404222};
constexpr uint32_t kWaves = 0xFFFF8056;
constexpr uint32_t kSineStart = 0x00F70000;
// A chip that does not answer leaves the line low or high. Only a position reads all ones, as -1.
constexpr uint32_t kHigh = 0xFFFFFFFF;
// The acceleration phases A1 and D1 are off while V1 is 0, but must not be 0 themselves.
constexpr uint32_t kFirstPhase = 600;
constexpr uint32_t kStopSpeed = 10;

struct Setting {
  uint8_t address;
  uint32_t initial;
};
// In the order of the set-up. First those that decide about current and motion: the power stage is
// open, so a ramp that an earlier boot left running ends at once.
constexpr Setting kTable[] = {
    {GCONF, kGconf},    {IHOLD_IRUN, 0},         {PWMCONF, kPwmconf | kFreewheel},
    {VMAX, 0},          {CHOPCONF, kChopconf},   {TPWMTHRS, kTpwmthrs},
    {TPOWERDOWN, 10},   {VSTART, 0},             {A1, kFirstPhase},
    {V1, 0},            {D1, kFirstPhase},       {VSTOP, kStopSpeed},
    {TZEROWAIT, 0},     {AMAX, kAccelerationMax}, {DMAX, kAccelerationMax},
    {MSLUTSEL, kWaves},
    // Those that keep their reset value: coolStep, dcStep and reference switches off, and a sine.
    {MSLUT, kSine[0]},      {MSLUT + 1, kSine[1]},    {MSLUT + 2, kSine[2]},
    {MSLUT + 3, kSine[3]},  {MSLUT + 4, kSine[4]},    {MSLUT + 5, kSine[5]},
    {MSLUT + 6, kSine[6]},  {MSLUT + 7, kSine[7]},    {MSLUTSTART, kSineStart},
    {TCOOLTHRS, 0},         {THIGH, 0},               {VDCMIN, 0},
    {SW_MODE, 0},           {COOLCONF, 0},            {DCCTRL, 0},
    {ENCM_CTRL, 0},
    {RAMPMODE, 0},          {XTARGET, 0},
};
constexpr size_t kCount = sizeof(kTable) / sizeof(kTable[0]);
// Written at once by begin_setup(), and by each continue_setup().
constexpr size_t kFirst = 4;
constexpr size_t kAtOnce = 4;

constexpr size_t setting_of(uint8_t address) {
  size_t setting = 0;
  while (setting < kCount && kTable[setting].address != address) ++setting;
  return setting;
}
constexpr size_t kGconfSetting = setting_of(GCONF), kCurrents = setting_of(IHOLD_IRUN),
                 kPwm = setting_of(PWMCONF), kSpeed = setting_of(VMAX),
                 kAcceleration = setting_of(AMAX), kDeceleration = setting_of(DMAX),
                 kChopper = setting_of(CHOPCONF), kTarget = setting_of(XTARGET),
                 kFirstAtReset = setting_of(MSLUT), kLastAtReset = setting_of(ENCM_CTRL);

// Registers read in turn: those that report, and the settings that can be read. CHOPCONF comes next after a
// setting that is written again: a damaged address of four of these switches the bridge off by it.
struct Readable {
  uint8_t address;
  size_t setting = setting_of(address);  // kCount for those that report.
};
constexpr Readable kAsked[] = {{GSTAT}, {CHOPCONF}, {DRV_STATUS}, {RAMPMODE},
                               {GSTAT}, {XTARGET},  {DRV_STATUS}, {IOIN},
                               {GSTAT}, {GCONF},    {DRV_STATUS}, {RAMPMODE},
                               {GSTAT}, {XTARGET},  {DRV_STATUS}, {IOIN}};
// Settings that cannot be read, written again in turn: one every few ticks. Those that keep their reset
// value share one place, before the currents, which a damaged address of theirs may switch off.
constexpr size_t kAtReset = kCount;
constexpr size_t kAgain[] = {setting_of(VSTART),   kSpeed,
                             setting_of(V1),       kAcceleration,
                             kDeceleration,        setting_of(TZEROWAIT),
                             kPwm,                 setting_of(A1),
                             setting_of(D1),       setting_of(VSTOP),
                             setting_of(TPWMTHRS), setting_of(MSLUTSEL),
                             kAtReset,             setting_of(TPOWERDOWN),
                             kCurrents};
constexpr uint16_t kTicksBetween = 16;
// Those of them that change while a joint works.
constexpr uint32_t kTwice =
    1U << kCurrents | 1U << kPwm | 1U << kSpeed | 1U << kAcceleration | 1U << kDeceleration;
// The ramp's, as they are written after it has left its course; then a pause of so many ticks.
constexpr size_t kRamp[] = {setting_of(RAMPMODE),  setting_of(VSTART), setting_of(V1),
                            setting_of(TZEROWAIT), kAcceleration,      kDeceleration,
                            setting_of(VDCMIN),    kSpeed,             kTarget};
constexpr uint8_t kCalm = 8;
template <typename T, size_t size>
constexpr size_t count(const T (&)[size]) { return size; }

// A counter may move by its speed, by the change of that speed, and by this much that neither says
// [steps]; a speed by the hardest acceleration and this much [1 of VACTUAL].
constexpr float kCounterLeast = 16.0F;
constexpr float kLate = 0.1F;
constexpr float kSpeedLeast = 64.0F;
// Share of a tick's change of speed that may be missing.
constexpr float kMissing = 0.35F;
// The deviations are added up, with this share of the sum before, and may reach this share of a tick's change.
constexpr float kForgetting = 0.75F;
constexpr float kDrift = 0.5F;
// Distance from the target at which a ramp ends at any moment [steps].
constexpr float kEnd = 32.0F;
// Change of VACTUAL in a second for 1 of AMAX: f / 2^17.
constexpr float kRamping = 1e7F / 131072.0F;

// A position is written again so often.
constexpr int kAttempts = 3;

uint32_t to_register(float value, float lsb, uint32_t limit) {
  const float steps = fabsf(value) / lsb;
  return steps >= static_cast<float>(limit) ? limit : static_cast<uint32_t>(steps + 0.5F);
}

// 31 is the full scale; the driver adds one, so 0 still is 1/32.
uint32_t current_scale(uint8_t percent) {
  const uint32_t scale = (31U * percent + 99U) / 100U;
  return scale > 31U ? 31U : scale;
}

// Its highest byte is the version, 0x11.
bool silent(uint32_t ioin) { return ioin >> 24 == 0 || ioin == kHigh; }

}  // namespace

uint32_t Tmc5130::exchange(uint8_t address, uint32_t value) {
  const uint8_t sent[5] = {address, static_cast<uint8_t>(value >> 24),
                           static_cast<uint8_t>(value >> 16), static_cast<uint8_t>(value >> 8),
                           static_cast<uint8_t>(value)};
  uint8_t received[5] = {};
  hal_.driver_exchange(sent, received);
  // Every datagram reports a reset and an error: at once, where GSTAT is read every fourth tick.
  const uint8_t before = spi_status_;
  spi_status_ = received[0];
  if (spi_status_ != 0xFF && before != 0xFF) gstat_ |= spi_status_ & before & 0x03;
  const uint32_t answer = static_cast<uint32_t>(received[1]) << 24 |
                          static_cast<uint32_t>(received[2]) << 16 |
                          static_cast<uint32_t>(received[3]) << 8 | received[4];
  if (wrote_ != kNone && answer != written_) damaged_ = wrote_;
  if (asking_) reported_ = answer;
  asking_ = false;
  wrote_ = kNone;
  return answer;
}

void Tmc5130::write(size_t setting) {
  exchange(kTable[setting].address | kWrite, values_[setting]);
  wrote_ = setting;
  written_ = values_[setting];
}

void Tmc5130::set(size_t setting, uint32_t value) {
  if (value == values_[setting]) return;
  values_[setting] = value;
  write(setting);
  if (setting <= kDeceleration && (kTwice >> setting & 1U) != 0) changed_ |= 1U << setting;
}

void Tmc5130::setup() {
  begin_setup();
  while (!ready()) continue_setup();
}

void Tmc5130::begin_setup() {
  const uint32_t shaft = values_[kGconfSetting] & kShaft;
  for (size_t setting = 0; setting < kCount; ++setting) values_[setting] = kTable[setting].initial;
  values_[kGconfSetting] |= shaft;
  // Some revisions clear these bits when ones are written, others when they are read.
  exchange(GSTAT | kWrite, 0x07);
  exchange(GSTAT, 0);
  gstat_ = spi_status_ = 0;
  changed_ = 0;
  for (set_up_ = 0; set_up_ < kFirst; ++set_up_) write(set_up_);
}

void Tmc5130::continue_setup() {
  for (size_t written = 0; written < kAtOnce && set_up_ < kCount; ++written, ++set_up_) {
    if (set_up_ == kTarget) {
      exchange(XACTUAL, 0);
      position_ = static_cast<int32_t>(exchange(XACTUAL, 0));
      velocity_ = 0;
      read_at_ = hal_.micros();
      values_[kTarget] = static_cast<uint32_t>(position_);
    }
    write(set_up_);
  }
}

void Tmc5130::reverse() { set(kGconfSetting, values_[kGconfSetting] ^ kShaft); }

void Tmc5130::open_bridge() { set(kChopper, kChopconf & ~kToff); }

// Pipelined: each datagram returns the value that the previous one requested. A damaged bit can turn
// a read into a write: so each carries the value that its register has.
void Tmc5130::poll() {
  const uint32_t now = hal_.micros();
  const uint32_t elapsed = now - read_at_;
  const float seconds = static_cast<float>(elapsed) * 1e-6F;
  const float moved = static_cast<float>(velocity_) * kVelocityLsb * seconds;
  exchange(XACTUAL, static_cast<uint32_t>(position_ + static_cast<int32_t>(moved)));
  const auto counter = static_cast<int32_t>(exchange(VACTUAL, 0));
  take_status();
  if (!doubted_) ++turn_;
  asked_ = turn_ % count(kAsked);
  const Readable& asked = kAsked[asked_];
  wanted_ = asked.setting < kCount ? values_[asked.setting] : 0;
  const uint32_t raw = exchange(asked.address, wanted_);
  take_velocity(static_cast<int32_t>(raw << 8) >> 8, seconds);  // 24 bits, signed
  take_position(counter, moved, seconds);
  read_at_ = now;
  asking_ = true;
  if (!ready()) return;
  if (turn_ % kTicksBetween == 0)
    write_again();
  else if (changed_ != 0)
    write_twice();
}

// A speed that follows a setpoint changes in each tick: it comes after the accelerations.
void Tmc5130::write_twice() {
  size_t setting = kDeceleration;
  while ((changed_ >> setting & 1U) == 0) --setting;
  changed_ &= ~(1U << setting);
  write(setting);
}

void Tmc5130::write_again() {
  constexpr size_t kShared = kLastAtReset - kFirstAtReset + 1;
  const size_t place = turn_ / kTicksBetween, round = place / count(kAgain);
  const size_t setting = kAgain[place % count(kAgain)];
  write(setting == kAtReset ? kFirstAtReset + round % kShared : setting);
}

// A position that one answer alone shows is a damaged answer. One that the next answer confirms is
// the counter's: something has written it.
void Tmc5130::take_position(int32_t counter, float moved, float seconds) {
  const auto change = static_cast<int32_t>(static_cast<uint32_t>(counter) - static_cast<uint32_t>(position_));
  const float allowed = kCounterLeast + kLate * fabsf(moved) + kHardDeceleration * seconds * seconds;
  const bool odd = fabsf(static_cast<float>(change) - moved) > allowed;
  if (odd && !odd_position_) {
    position_ += static_cast<int32_t>(lroundf(moved));
  } else {
    jumped_ = jumped_ || odd;
    position_ = counter;
  }
  odd_position_ = odd && !odd_position_;
}

void Tmc5130::take_velocity(int32_t velocity, float seconds) {
  constexpr float kHardest = 1.1F * kHardDeceleration / kVelocityLsb;
  const float allowed = kSpeedLeast + kHardest * seconds;
  const bool odd = fabsf(static_cast<float>(velocity - velocity_)) > allowed;
  if (!odd || odd_velocity_) {
    if (calm_ != 0) --calm_;
    if (calm_ != 0 || !ready()) {
      drift_ = 0.0F;
    } else {
      strayed_ = strays(velocity, seconds);

    }
    velocity_ = velocity;
  }
  if (velocity_ == 0) disturbed_ = false;
  odd_velocity_ = odd && !odd_velocity_;
}

// Whether the speed strays from the one that the ramp's settings give, after this time from the last
// position and speed. A change of them takes effect within the tick, so a part of its change may
// be missing, once.
bool Tmc5130::strays(int32_t velocity, float seconds) {
  if (velocity == 0 && velocity_ == 0 && static_cast<uint32_t>(position_) == values_[kTarget]) {
    drift_ = 0.0F;
    return false;
  }
  const float up = static_cast<float>(values_[kAcceleration]) * kRamping * seconds;
  const float down = static_cast<float>(values_[kDeceleration]) * kRamping * seconds;
  const float braking = static_cast<float>(values_[kDeceleration]) * kAccelerationLsb;
  const auto most = static_cast<float>(values_[kSpeed]);
  const auto way = static_cast<float>(static_cast<int32_t>(values_[kTarget]) - position_);
  const float direction = way < 0.0F ? -1.0F : 1.0F;
  const float before = static_cast<float>(velocity_) * direction;
  const float after = static_cast<float>(velocity) * direction;
  float off;
  if (fabsf(way) <= kEnd) {
    // It ends at any moment, or has passed: only a speed that is too high is wrong.
    const float fastest = sqrtf(2.0F * braking * (fabsf(way) + kEnd)) / kVelocityLsb;
    off = larger(0.0F, fabsf(after) - larger(fastest, fabsf(before) - down));
  } else if (before < 0.0F) {
    off = after - smaller(before + down, up);
  } else {
    const float left = larger(fabsf(way) - before * kVelocityLsb * seconds, 0.0F);
    const float wanted = smaller(most, sqrtf(2.0F * braking * left) / kVelocityLsb);
    off = after - (before > wanted ? larger(wanted, before - down) : smaller(wanted, before + up));
  }
  const float beyond = larger(0.0F, fabsf(off) - kSpeedLeast) / larger(up, down);
  drift_ = kForgetting * drift_ + copysignf(beyond, off);
  return beyond > kMissing || fabsf(drift_) > kDrift;
}

// The answer to the last tick's question.
void Tmc5130::take_status() {
  const uint32_t status = reported_;
  const uint8_t asked = kAsked[asked_].address;
  const bool mute = (status == kHigh && asked != XTARGET) || (asked == IOIN && silent(status));
  const bool trouble = mute || (asked == GSTAT && (status & kUndervoltage) != 0);
  if (trouble && doubted_) gstat_ |= kUndervoltage;
  doubted_ = trouble && !doubted_;
  if (mute) return;
  if (const size_t setting = kAsked[asked_].setting; setting < kCount) {
    if (ready() && status != wanted_) damaged_ = setting;
  } else if (asked == DRV_STATUS) {
    drv_status_ = status & last_drv_status_;
    last_drv_status_ = status;
  } else if (asked == GSTAT && (status & 0x07) != 0) {
    clear_ = status & 0x07;  // It has just been read: see begin_setup().
  }
}

void Tmc5130::finish() {
  if (clear_ != 0) exchange(GSTAT | kWrite, clear_);
  clear_ = 0;
  if (wrote_ != kNone) exchange(XACTUAL, static_cast<uint32_t>(position_));
  const size_t damaged = damaged_;
  damaged_ = kNone;
  // Those that a set-up has yet to write are not damaged.
  if (damaged < set_up_) {
    disturbed_ = true;
    write(damaged);
  }
  if (!strayed_) return;
  strayed_ = false;
  disturbed_ = true;
  calm_ = kCalm;
  for (const size_t setting : kRamp) write(setting);
}

uint8_t Tmc5130::read_gstat() {
  exchange(IOIN, 0);
  const uint32_t ioin = exchange(GSTAT, 0);
  const auto status = static_cast<uint8_t>(exchange(XACTUAL, static_cast<uint32_t>(position_)) & 0x07);
  if (silent(ioin)) return kUndervoltage;
  if (status != 0) {
    gstat_ |= status;
    exchange(GSTAT | kWrite, status);
  }
  return status;
}

uint8_t Tmc5130::take_gstat() {
  const uint8_t bits = gstat_;
  gstat_ = 0;
  return bits;
}

bool Tmc5130::take_jump() {
  const bool jumped = jumped_;
  jumped_ = false;
  return jumped;
}

void Tmc5130::set_target(int32_t position) { set(kTarget, static_cast<uint32_t>(position)); }

void Tmc5130::set_speed(float steps_per_second) {
  set(kSpeed, to_register(steps_per_second, kVelocityLsb, kVelocityMax));
}

void Tmc5130::set_acceleration(float acceleration, float deceleration) {
  // Zero would stop the ramp permanently, and DMAX = 0 is forbidden in positioning.
  const uint32_t up = to_register(acceleration, kAccelerationLsb, kAccelerationMax);
  const uint32_t down = to_register(deceleration, kAccelerationLsb, kAccelerationMax);
  set(kAcceleration, up == 0 ? 1 : up);
  set(kDeceleration, down == 0 ? 1 : down);
}

void Tmc5130::set_currents(uint8_t drive_percent, uint8_t hold_percent) {
  set(kCurrents, current_scale(drive_percent) << 8 | current_scale(hold_percent));
}

void Tmc5130::set_brake(BrakeMode mode) {
  set(kPwm, kPwmconf | (mode == BrakeMode::FREEWHEEL    ? kFreewheel
                        : mode == BrakeMode::COOL_BRAKE ? kShortCoils
                                                        : 0U));
}

void Tmc5130::set_position(int32_t position) {
  position_ = position;
  odd_position_ = false;
  values_[kTarget] = static_cast<uint32_t>(position);
  // The second one returns the value of the first.
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    damaged_ = kNone;
    exchange(XACTUAL | kWrite, static_cast<uint32_t>(position));
    wrote_ = kCounter;
    written_ = static_cast<uint32_t>(position);
    write(kTarget);
    if (damaged_ != kCounter) break;
  }
}

}  // namespace bioscara
