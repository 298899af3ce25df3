#include "pins.h"

#include <initializer_list>

namespace bioscara::pins {

namespace {

using stm32::Gpio;
using stm32::gpioa;
using stm32::gpiob;
using stm32::gpioc;

constexpr uint32_t kInput = 0, kOutput = 1, kAlternate = 2;
// Slopes: 2 MHz for the bus, 25 MHz for the clocks of the chips.
constexpr uint32_t kSlow = 0, kMedium = 1;

void set_field(stm32::Word& word, unsigned position, unsigned width, uint32_t value) {
  const uint32_t mask = ((1UL << width) - 1) << position;
  word = (word & ~mask) | value << position;
}

void set_mode(Gpio& port, unsigned pin, uint32_t mode) { set_field(port.MODER, 2 * pin, 2, mode); }

void no_pull(Gpio& port, unsigned pin) { set_field(port.PUPDR, 2 * pin, 2, 0); }

void output(Gpio& port, unsigned pin, bool high) {
  port.BSRR = stm32::bit(high ? pin : pin + 16);
  no_pull(port, pin);
  set_mode(port, pin, kOutput);
}

void alternate(Gpio& port, unsigned pin, uint32_t function, uint32_t slope) {
  set_field(pin < 8 ? port.AFRL : port.AFRH, 4 * (pin % 8), 4, function);
  set_field(port.OSPEEDR, 2 * pin, 2, slope);
  no_pull(port, pin);
  set_mode(port, pin, kAlternate);
}

constexpr unsigned kScl = 8, kSda = 9, kEncoderData = 12;

}  // namespace

void open_power_stage() {
  stm32::rcc().AHB1ENR |= stm32::Rcc::GPIOAEN;
  (void)stm32::rcc().AHB1ENR;  // The clock is there two cycles later.
  output(gpioa(), kDriverDisable.pin, true);
}

void light_up() {
  stm32::rcc().AHB1ENR |= stm32::Rcc::GPIOCEN;
  (void)stm32::rcc().AHB1ENR;
  output(gpioc(), kLight.pin, true);
}

void set_up() {
  stm32::rcc().AHB1ENR |= stm32::Rcc::GPIOAEN | stm32::Rcc::GPIOBEN | stm32::Rcc::GPIOCEN;
  (void)stm32::rcc().AHB1ENR;
  output(gpiob(), kDriverSelect.pin, true);
  output(gpioa(), kEncoderSelect.pin, true);
  // The driver: SD_MODE low for its ramp generator, SPI_MODE high.
  output(gpioc(), 8, false);
  output(gpioc(), 1, true);
  output(gpioc(), kLight.pin, false);
  alternate(gpioa(), 8, 0, kMedium);  // MCO1
  for (unsigned pin : {13U, 14U, 15U}) alternate(gpiob(), pin, 5, kMedium);
  for (unsigned pin : {10U, 11U, kEncoderData}) alternate(gpioc(), pin, 6, kMedium);
  gpiob().OTYPER |= stm32::bit(kScl) | stm32::bit(kSda);
  alternate(gpiob(), kScl, 4, kSlow);
  alternate(gpiob(), kSda, 4, kSlow);
}

void drive_encoder_data() { set_mode(gpioc(), kEncoderData, kAlternate); }

void release_encoder_data() { set_mode(gpioc(), kEncoderData, kInput); }

bool i2c_clock_high() { return (gpiob().IDR & stm32::bit(kScl)) != 0; }

bool i2c_lines_high() {
  constexpr uint32_t lines = stm32::bit(kScl) | stm32::bit(kSda);
  return (gpiob().IDR & lines) == lines;
}

}  // namespace bioscara::pins
