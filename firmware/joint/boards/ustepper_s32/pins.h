// The board's wiring (schematic, rev 1.1): which signal is on which pin, and their first levels.
#pragma once

#include "stm32f401.h"

namespace bioscara::pins {

// One output pin.
struct Output {
  stm32::Gpio& (*port)();
  unsigned pin;
  void high() const { port().BSRR = stm32::bit(pin); }
  void low() const { port().BSRR = stm32::bit(pin + 16); }
};

// PA1, the driver's enable input: low closes the power stage.
constexpr Output kDriverDisable{stm32::gpioa, 1};
constexpr Output kDriverSelect{stm32::gpiob, 12};
constexpr Output kEncoderSelect{stm32::gpioa, 15};
// LED D2. Its active level is in none of our references: high is taken to light it.
constexpr Output kLight{stm32::gpioc, 4};

// The first thing after a reset: the pin floats until this has run. The latch is set high before
// the pin becomes an output.
void open_power_stage();

// Steady light, also before set_up().
void light_up();

// All others: MCO1, both SPI buses, the driver's mode pins, the I2C target's lines.
void set_up();

// The encoder's one data line: PC12 drives it for a command and is an input while the chip answers.
void drive_encoder_data();
void release_encoder_data();

// The I2C bus at this moment.
bool i2c_clock_high();
bool i2c_lines_high();

}  // namespace bioscara::pins
