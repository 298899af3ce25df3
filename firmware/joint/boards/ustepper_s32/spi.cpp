#include "spi.h"

#include "pins.h"
#include "stm32f401.h"

namespace bioscara::spi {

namespace {

using stm32::Rcc;
using stm32::Spi;

constexpr uint32_t kController = Spi::MSTR | Spi::SSM | Spi::SSI | Spi::BR_DIV16;
constexpr uint16_t kRead = 0x8000;

// Deselected long enough for either chip: the driver asks for two of its clocks, 210 ns, the
// encoder for 600 ns; and 105 ns from selection to the first clock.
constexpr unsigned kDeselectedLoops = 20;
constexpr unsigned kSelectedLoops = 5;

// Three cycles of 84 MHz each, 36 ns.
inline void wait(unsigned loops) {
  __asm volatile(
      "1: subs %0, #1\n\t"
      "bne 1b"
      : "+l"(loops)
      :
      : "cc");
}

uint32_t transfer(Spi& bus, uint32_t word) {
  while ((bus.SR & Spi::TXE) == 0) {
  }
  bus.DR = word;
  while ((bus.SR & Spi::RXNE) == 0) {
  }
  return bus.DR;
}

void finish(const Spi& bus) {
  while ((bus.SR & Spi::BSY) != 0) {
  }
}

}  // namespace

void set_up() {
  stm32::rcc().APB1ENR |= Rcc::SPI2EN | Rcc::SPI3EN;
  (void)stm32::rcc().APB1ENR;
  stm32::spi2().CR1 = kController | Spi::CPOL | Spi::CPHA;
  stm32::spi2().CR1 |= Spi::SPE;
  stm32::spi3().CR1 = kController | Spi::CPHA | Spi::DFF;
  stm32::spi3().CR1 |= Spi::SPE;
}

void driver_exchange(const uint8_t (&sent)[5], uint8_t (&received)[5]) {
  wait(kDeselectedLoops);
  pins::kDriverSelect.low();
  for (size_t i = 0; i < 5; ++i)
    received[i] = static_cast<uint8_t>(transfer(stm32::spi2(), sent[i]));
  finish(stm32::spi2());
  pins::kDriverSelect.high();
}

void encoder_exchange(uint16_t command, uint16_t* words, size_t count) {
  const bool reads = (command & kRead) != 0;
  Spi& bus = stm32::spi3();
  wait(kDeselectedLoops);
  pins::kEncoderSelect.low();
  wait(kSelectedLoops);
  transfer(bus, command);
  finish(bus);
  if (reads) pins::release_encoder_data();
  // The chip turns round within 130 ns.
  wait(kSelectedLoops);
  for (size_t i = 0; i < count; ++i) {
    const auto word = static_cast<uint16_t>(transfer(bus, reads ? 0xFFFF : words[i]));
    if (reads) words[i] = word;
  }
  finish(bus);
  // After a write the chip has a safety word, which is not read.
  if (!reads) pins::release_encoder_data();
  wait(kSelectedLoops);
  pins::kEncoderSelect.high();
  pins::drive_encoder_data();
}

}  // namespace bioscara::spi
