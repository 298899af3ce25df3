// This boot: its number and why it happened.
#include "identity.h"
#include "stm32f401.h"

extern "C" {
extern const uint32_t noise_start[], noise_end[];
}

namespace bioscara {

namespace {

using stm32::Adc;
using stm32::AdcCommon;
using stm32::Rcc;

// Not set up at start: its content outlives a reset without loss of power.
struct BootRecord {
  uint32_t mark;
  uint16_t boot;
  uint16_t inverse;
};
__attribute__((section(".noinit"))) BootRecord record;
constexpr uint32_t kMark = 0x42534A32;

constexpr uint32_t kPrime = 16777619;  // FNV-1a

uint32_t mix(uint32_t hash, uint32_t word) { return (hash ^ word) * kPrime; }

// The lowest bits of the temperature sensor and the reference voltage: a few bits of noise.
uint32_t converter_noise(uint32_t hash) {
  constexpr uint32_t kReference = 17, kTemperature = 18;
  constexpr unsigned kSamples = 16;
  constexpr unsigned kPolls = 1000;
  stm32::rcc().APB2ENR |= Rcc::ADC1EN;
  (void)stm32::rcc().APB2ENR;
  stm32::adc_common().CCR = AdcCommon::ADCPRE_DIV4 | AdcCommon::TSVREFE;
  Adc& adc = stm32::adc1();
  adc.CR2 = Adc::ADON;
  for (unsigned sample = 0; sample < kSamples; ++sample) {
    adc.SQR3 = sample % 2 == 0 ? kReference : kTemperature;
    adc.CR2 = Adc::ADON | Adc::SWSTART;
    for (unsigned poll = 0; poll < kPolls && (adc.SR & Adc::EOC) == 0; ++poll) {
    }
    hash = mix(hash, adc.DR);
  }
  adc.CR2 = 0;
  stm32::rcc().APB2ENR &= ~Rcc::ADC1EN;
  return hash;
}

// Boots since the backup domain lost power: it holds out longer than the memory in a short dip.
uint32_t count_boots() {
  stm32::rcc().APB1ENR |= Rcc::PWREN;
  (void)stm32::rcc().APB1ENR;
  stm32::pwr().CR |= stm32::Pwr::DBP;
  const uint32_t count = stm32::backup().BKP0R + 1;
  stm32::backup().BKP0R = count;
  stm32::pwr().CR &= ~stm32::Pwr::DBP;
  return count;
}

}  // namespace

uint32_t power_up_noise() {
  uint32_t hash = 2166136261;
  for (const uint32_t* word = noise_start; word < noise_end; ++word)
    hash = mix(hash, *const_cast<const volatile uint32_t*>(word));
  return hash;
}

// Where memory kept its content, the next number after the last boot's: it differs for certain.
//
// After a loss of power it is drawn from four sources, so that two boots are the same with a chance
// of 1 in 65536 as long as one of them differs:
// - what static memory holds at power-up: some percent of its cells fall at random, so hundreds of
//   bits in 4 KiB; the same again only after a dip so short that the record above survives too;
// - the converter's internal channels: temperature and supply, a few bits;
// - the backup registers' counter: differs from the boot before where its domain kept its power;
// - the unique id: never changes, but differs between two boards on one bus.
uint16_t next_boot_id(uint32_t noise) {
  const uint32_t boots = count_boots();
  const bool kept = record.mark == kMark && record.inverse == static_cast<uint16_t>(~record.boot);
  if (kept) {
    record.boot = static_cast<uint16_t>(record.boot + 1);
  } else {
    uint32_t hash = mix(converter_noise(noise), boots);
    for (int word = 0; word < 3; ++word) hash = mix(hash, stm32::unique_id()[word]);
    record.boot = static_cast<uint16_t>(hash >> 16 ^ hash);
  }
  record.mark = kMark;
  record.inverse = static_cast<uint16_t>(~record.boot);
  return record.boot;
}

// The reset causes that the flags distinguish. A power-up from an unpowered state sets PORRSTF. The
// board's supply supervisor pulls NRST below 2.9 V, before the controller's own brown-out reset: a
// dip of the 3.3 V shows as PIN, as do the reset button and a debugger. PINRSTF is set with every
// other cause, so it comes last.
ResetCause read_reset_cause() {
  const uint32_t flags = stm32::rcc().CSR;
  stm32::rcc().CSR |= Rcc::RMVF;
  if ((flags & Rcc::PORRSTF) != 0) return ResetCause::POWER_ON;
  if ((flags & (Rcc::IWDGRSTF | Rcc::WWDGRSTF)) != 0) return ResetCause::WATCHDOG;
  if ((flags & Rcc::SFTRSTF) != 0) return ResetCause::SOFTWARE;
  if ((flags & Rcc::BORRSTF) != 0) return ResetCause::BROWN_OUT;
  return (flags & Rcc::PINRSTF) != 0 ? ResetCause::PIN : ResetCause::UNKNOWN;
}

}  // namespace bioscara
