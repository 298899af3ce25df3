// The firmware of one joint: everything happens in the control tick and the I2C interrupt.
#include "main.h"

#include "../../src/core/joint.h"
#include "board.h"
#include "bootloader.h"
#include "clock.h"
#include "i2c_target.h"
#include "pins.h"
#include "spi.h"
#include "stm32f401.h"
#include "timers.h"
#include "watchdog.h"

static_assert(BIOSCARA_JOINT >= 1 && BIOSCARA_JOINT <= 4, "BIOSCARA_JOINT: a joint is 1 to 4");

namespace bioscara {

namespace {

constexpr Configuration kConfiguration = configuration_of(BIOSCARA_JOINT);

I2cTarget target;
Board board(target);
Joint joint(board, kConfiguration);

}  // namespace

void run(uint32_t noise) {
  // With the crystal dead the power stage stays open; another start may find it alive.
  if (!clock::start()) stm32::reset();
  pins::set_up();
  spi::set_up();
  timers::start_microseconds();
  board.begin(noise);
  watchdog::start();
  joint.boot();
  target.listen(kConfiguration.address, joint);
  timers::start_tick(Joint::kTickMicros);
  for (;;) __asm volatile("wfi");
}

}  // namespace bioscara

extern "C" {

void control_tick_handler() {
  bioscara::timers::acknowledge_tick();
  bioscara::joint.tick();
  bioscara::target.supervise();
}

void i2c_handler() { bioscara::target.interrupt(); }
}
