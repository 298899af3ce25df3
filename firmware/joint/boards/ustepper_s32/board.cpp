#include "board.h"

#include "bootloader.h"
#include "pins.h"
#include "spi.h"
#include "timers.h"
#include "watchdog.h"

namespace bioscara {

void Board::begin(uint32_t noise) {
  cause_ = read_reset_cause();
  exceptions::count_start(cause_ == ResetCause::POWER_ON);
  boot_id_ = next_boot_id(noise);
}

uint32_t Board::micros() { return timers::micros(); }

void Board::driver_exchange(const uint8_t (&sent)[5], uint8_t (&received)[5]) {
  spi::driver_exchange(sent, received);
}

void Board::encoder_exchange(uint16_t command, uint16_t* words, size_t count) {
  spi::encoder_exchange(command, words, count);
}

void Board::driver_enable(bool on) {
  if (on)
    pins::kDriverDisable.low();
  else
    pins::kDriverDisable.high();
}

void Board::feed_watchdog() { watchdog::feed(); }

void Board::indicate(bool lit) {
  if (lit)
    pins::kLight.high();
  else
    pins::kLight.low();
}

void Board::enter_bootloader() { bootloader::request(); }

// The tick takes no lock inside another one, and the interrupt none at all.
void Board::lock() { stm32::set_base_priority(I2cTarget::kPriority); }

void Board::unlock() { stm32::set_base_priority(0); }

}  // namespace bioscara
