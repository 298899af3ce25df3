#ifdef ARDUINO

#include "ustepper_s32.h"

#include <HardwareTimer.h>
#include <IWatchdog.h>
#include <Wire.h>

namespace bioscara {

namespace {

// Wiring of the board (its schematic).
constexpr uint32_t kDriverEnable = PA1;  // low closes the power stage
constexpr uint32_t kDriverClock = PC9;   // the controller's clock output, 10 MHz
constexpr uint32_t kSdMode = PC8;        // low: the internal ramp generator
constexpr uint32_t kSpiMode = PC1;       // high: SPI
constexpr uint32_t kDriverSelect = PB12;
constexpr uint32_t kEncoderSelect = PA15;
constexpr uint32_t kEncoderData = PC12;

constexpr uint32_t kWatchdogMicros = 100000;
// The tick gives way to the I2C interrupt, so that the bus is never held up.
constexpr uint32_t kTickPriority = 3;
constexpr size_t kFrameMost = 32;

SPIClass driver_bus(PB15, PB14, PB13);
SPIClass encoder_bus(PC12, PC11, PC10);
const SPISettings kDriverSettings(2600000, MSBFIRST, SPI_MODE3);
const SPISettings kEncoderSettings(4000000, MSBFIRST, SPI_MODE1);

// Not initialised at start: what it holds outlives a reset without loss of power.
struct BootRecord {
  uint32_t mark;
  uint16_t boot;
} boot_record __attribute__((section(".noinit")));
constexpr uint32_t kMark = 0x42534A31;

ResetCause read_reset_cause() {
  const uint32_t flags = RCC->CSR;
  RCC->CSR |= RCC_CSR_RMVF;
  if ((flags & RCC_CSR_PORRSTF) != 0) return ResetCause::POWER_ON;
  if ((flags & (RCC_CSR_IWDGRSTF | RCC_CSR_WWDGRSTF)) != 0) return ResetCause::WATCHDOG;
  if ((flags & RCC_CSR_BORRSTF) != 0) return ResetCause::BROWN_OUT;
  if ((flags & RCC_CSR_SFTRSTF) != 0) return ResetCause::SOFTWARE;
  return (flags & RCC_CSR_PINRSTF) != 0 ? ResetCause::PIN : ResetCause::UNKNOWN;
}

// After a loss of power nothing is remembered; the unique id and the noise of the start-up time
// make the same number twice in a row unlikely.
uint16_t next_boot_id() {
  if (boot_record.mark != kMark) {
    boot_record.mark = kMark;
    const uint32_t seed = HAL_GetUIDw0() ^ HAL_GetUIDw1() * 2654435761U ^ SysTick->VAL << 8 ^
                          static_cast<uint32_t>(analogRead(PA0)) << 16;
    boot_record.boot = static_cast<uint16_t>(seed >> 16 ^ seed);
  }
  return ++boot_record.boot;
}

}  // namespace

void UstepperS32::begin() {
  pinMode(kDriverEnable, OUTPUT);
  digitalWrite(kDriverEnable, HIGH);
  cause_ = read_reset_cause();
  boot_id_ = next_boot_id();
  pinMode(kDriverSelect, OUTPUT);
  digitalWrite(kDriverSelect, HIGH);
  pinMode(kEncoderSelect, OUTPUT);
  digitalWrite(kEncoderSelect, HIGH);
  pinMode(kSdMode, OUTPUT);
  digitalWrite(kSdMode, LOW);
  pinMode(kSpiMode, OUTPUT);
  digitalWrite(kSpiMode, HIGH);
  // 10 MHz for the driver: half of the 20 MHz crystal.
  HAL_RCC_MCOConfig(RCC_MCO2, RCC_MCO2SOURCE_HSE, RCC_MCODIV_2);
  (void)kDriverClock;
  driver_bus.begin();
  encoder_bus.begin();
  IWatchdog.begin(kWatchdogMicros);
}

void UstepperS32::listen(uint8_t address, void (*receive)(int), void (*request)()) {
  Wire.onReceive(receive);
  Wire.onRequest(request);
  Wire.begin(address);
}

void UstepperS32::every(uint32_t micros, void (*tick)()) {
  static HardwareTimer timer(TIM4);
  timer.setOverflow(micros, MICROSEC_FORMAT);
  timer.setInterruptPriority(kTickPriority, 0);
  timer.attachInterrupt(tick);
  timer.resume();
}

void UstepperS32::receive(Joint& joint) {
  uint8_t data[kFrameMost];
  size_t size = 0;
  while (Wire.available() > 0) {
    const int byte = Wire.read();
    if (size < kFrameMost) data[size++] = static_cast<uint8_t>(byte);
  }
  joint.on_receive(data, size);
}

void UstepperS32::request(Joint& joint) {
  uint8_t answer[Joint::kAnswerMax];
  const size_t size = joint.on_request(answer);
  // Asked for more than it was given, the peripheral would hold the clock low for ever.
  uint8_t padded[kFrameMost];
  for (size_t i = 0; i < kFrameMost; ++i) padded[i] = i < size ? answer[i] : 0xFF;
  Wire.write(padded, kFrameMost);
}

uint32_t UstepperS32::micros() { return ::micros(); }

void UstepperS32::driver_exchange(const uint8_t (&sent)[5], uint8_t (&received)[5]) {
  for (size_t i = 0; i < 5; ++i) received[i] = sent[i];
  driver_bus.beginTransaction(kDriverSettings);
  digitalWrite(kDriverSelect, LOW);
  driver_bus.transfer(received, 5);
  digitalWrite(kDriverSelect, HIGH);
  driver_bus.endTransaction();
}

void UstepperS32::encoder_exchange(uint16_t command, uint16_t* words, size_t count) {
  const bool reads = (command & 0x8000) != 0;
  encoder_bus.beginTransaction(kEncoderSettings);
  digitalWrite(kEncoderSelect, LOW);
  encoder_bus.transfer16(command);
  // One data line: while the chip answers, the controller lets go of it.
  if (reads) pinMode(kEncoderData, INPUT);
  for (size_t i = 0; i < count; ++i) {
    const uint16_t word = encoder_bus.transfer16(reads ? 0xFFFF : words[i]);
    if (reads) words[i] = word;
  }
  digitalWrite(kEncoderSelect, HIGH);
  if (reads) pinmap_pinout(digitalPinToPinName(kEncoderData), PinMap_SPI_MOSI);
  encoder_bus.endTransaction();
}

void UstepperS32::driver_enable(bool on) { digitalWrite(kDriverEnable, on ? LOW : HIGH); }

void UstepperS32::feed_watchdog() { IWatchdog.reload(); }

// Both interrupts of the peripheral end transactions.
void UstepperS32::lock() {
  NVIC_DisableIRQ(I2C1_EV_IRQn);
  NVIC_DisableIRQ(I2C1_ER_IRQn);
}

void UstepperS32::unlock() {
  NVIC_EnableIRQ(I2C1_ER_IRQn);
  NVIC_EnableIRQ(I2C1_EV_IRQn);
}

}  // namespace bioscara

#endif
