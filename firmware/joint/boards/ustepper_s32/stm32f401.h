// The microcontroller's registers and bits that this board uses (reference manual RM0368 and the
// Cortex-M4 generic user guide). Names are those of the manuals; nothing here acts.
#pragma once

#include <stdint.h>

namespace stm32 {

using Word = volatile uint32_t;

constexpr uint32_t bit(unsigned position) { return 1UL << position; }

struct Gpio {
  Word MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFRL, AFRH;
};

struct Rcc {
  Word CR, PLLCFGR, CFGR, CIR;
  Word AHB1RSTR, AHB2RSTR, reserved1[2], APB1RSTR, APB2RSTR, reserved2[2];
  Word AHB1ENR, AHB2ENR, reserved3[2], APB1ENR, APB2ENR, reserved4[2];
  Word AHB1LPENR, AHB2LPENR, reserved5[2], APB1LPENR, APB2LPENR, reserved6[2];
  Word BDCR, CSR;
  // CR
  static constexpr uint32_t HSION = bit(0), HSIRDY = bit(1), HSEON = bit(16), HSERDY = bit(17),
                            CSSON = bit(19), PLLON = bit(24), PLLRDY = bit(25);
  // PLLCFGR
  static constexpr uint32_t PLLSRC_HSE = bit(22);
  // CFGR
  static constexpr uint32_t SW_PLL = 2, SWS = 3U << 2, SWS_PLL = 2U << 2, PPRE1_DIV2 = 4U << 10,
                            MCO1_HSE = 2U << 21, MCO1PRE_DIV2 = 4U << 24;
  // AHB1ENR, APB1ENR, APB2ENR
  static constexpr uint32_t GPIOAEN = bit(0), GPIOBEN = bit(1), GPIOCEN = bit(2),
                            CRCEN = bit(12);
  static constexpr uint32_t TIM3EN = bit(1), TIM5EN = bit(3), SPI2EN = bit(14), SPI3EN = bit(15),
                            I2C1EN = bit(21), PWREN = bit(28);
  static constexpr uint32_t ADC1EN = bit(8), SYSCFGEN = bit(14);
  // CSR
  static constexpr uint32_t RMVF = bit(24), BORRSTF = bit(25), PINRSTF = bit(26),
                            PORRSTF = bit(27), SFTRSTF = bit(28), IWDGRSTF = bit(29),
                            WWDGRSTF = bit(30), LPWRRSTF = bit(31);
};

struct Flash {
  Word ACR;
  static constexpr uint32_t LATENCY_2 = 2, PRFTEN = bit(8), ICEN = bit(9), DCEN = bit(10);
};

struct Pwr {
  Word CR, CSR;
  static constexpr uint32_t DBP = bit(8), VOS = 3U << 14, VOS_SCALE2 = 2U << 14;
};

// The CRC unit: polynomial 0x04C11DB7, words from their highest bit on.
struct Crc {
  Word DR, IDR, CR;
  static constexpr uint32_t RESET = bit(0);
};

struct Syscfg {
  Word MEMRMP;
  static constexpr uint32_t SYSTEM_FLASH = 1;
};

struct Spi {
  Word CR1, CR2, SR, DR;
  static constexpr uint32_t CPHA = bit(0), CPOL = bit(1), MSTR = bit(2), BR_DIV16 = 3U << 3,
                            SPE = bit(6), SSI = bit(8), SSM = bit(9), DFF = bit(11);
  static constexpr uint32_t RXNE = bit(0), TXE = bit(1), BSY = bit(7);
};

struct I2c {
  Word CR1, CR2, OAR1, OAR2, DR, SR1, SR2, CCR, TRISE, FLTR;
  // CR1
  static constexpr uint32_t PE = bit(0), ACK = bit(10), SWRST = bit(15);
  // CR2
  static constexpr uint32_t ITERREN = bit(8), ITEVTEN = bit(9), ITBUFEN = bit(10);
  // OAR1: software keeps this bit at 1
  static constexpr uint32_t OAR1_ALWAYS = bit(14);
  // SR1
  static constexpr uint32_t ADDR = bit(1), BTF = bit(2), STOPF = bit(4), RXNE = bit(6),
                            TXE = bit(7), BERR = bit(8), ARLO = bit(9), AF = bit(10), OVR = bit(11);
  // SR2
  static constexpr uint32_t BUSY = bit(1), TRA = bit(2);
};

struct Timer {
  Word CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR;
  static constexpr uint32_t CEN = bit(0), UIE = bit(0), UIF = bit(0), UG = bit(0);
};

struct Iwdg {
  Word KR, PR, RLR, SR;
  static constexpr uint32_t UNLOCK = 0x5555, RELOAD = 0xAAAA, START = 0xCCCC, PR_DIV16 = 2;
};

struct Adc {
  Word SR, CR1, CR2, SMPR1, SMPR2, JOFR[4], HTR, LTR, SQR1, SQR2, SQR3, JSQR, JDR[4], DR;
  static constexpr uint32_t EOC = bit(1), ADON = bit(0), SWSTART = bit(30);
};

struct AdcCommon {
  Word CCR;
  static constexpr uint32_t ADCPRE_DIV4 = bit(16), TSVREFE = bit(23);
};

// The backup registers, inside the real-time clock.
struct Backup {
  Word BKP0R;
};

struct Nvic {
  Word ISER[8], reserved1[24], ICER[8], reserved2[24], ISPR[8], reserved3[24], ICPR[8],
      reserved4[24], IABR[8], reserved5[56];
  volatile uint8_t IPR[240];
};

struct Scb {
  Word CPUID, ICSR, VTOR, AIRCR, SCR, CCR;
  volatile uint8_t SHPR[12];
  Word SHCSR, CFSR, HFSR;
  static constexpr uint32_t VECTKEY = 0x05FAU << 16, SYSRESETREQ = bit(2);
  // CFSR, of the memory protection and of the bus
  static constexpr uint32_t STACKING_ERRORS = bit(4) | bit(12);
};

template <typename Peripheral>
Peripheral& at(uint32_t address) {
  return *reinterpret_cast<Peripheral*>(address);
}

inline Gpio& gpioa() { return at<Gpio>(0x40020000); }
inline Gpio& gpiob() { return at<Gpio>(0x40020400); }
inline Gpio& gpioc() { return at<Gpio>(0x40020800); }
inline Rcc& rcc() { return at<Rcc>(0x40023800); }
inline Flash& flash() { return at<Flash>(0x40023C00); }
inline Crc& crc() { return at<Crc>(0x40023000); }
inline Pwr& pwr() { return at<Pwr>(0x40007000); }
inline Syscfg& syscfg() { return at<Syscfg>(0x40013800); }
inline Spi& spi2() { return at<Spi>(0x40003800); }
inline Spi& spi3() { return at<Spi>(0x40003C00); }
inline I2c& i2c1() { return at<I2c>(0x40005400); }
inline Timer& tim3() { return at<Timer>(0x40000400); }
inline Timer& tim5() { return at<Timer>(0x40000C00); }
inline Iwdg& iwdg() { return at<Iwdg>(0x40003000); }
inline Adc& adc1() { return at<Adc>(0x40012000); }
inline AdcCommon& adc_common() { return at<AdcCommon>(0x40012304); }
inline Backup& backup() { return at<Backup>(0x40002850); }
inline Nvic& nvic() { return at<Nvic>(0xE000E100); }
inline Scb& scb() { return at<Scb>(0xE000ED00); }
inline Word& cpacr() { return at<Word>(0xE000ED88); }

// Three words of the unique id.
inline const Word* unique_id() { return &at<const Word>(0x1FFF7A10); }
constexpr uint32_t kSystemMemory = 0x1FFF0000;
constexpr uint32_t kMemory = 0x20000000, kMemorySize = 64 * 1024;

// Positions of interrupts in the NVIC.
enum Interrupt : unsigned { TIM3 = 29, I2C1_EV = 31, I2C1_ER = 32, kInterrupts = 85 };

// The upper four bits of a priority exist; a lower number wins.
inline void enable(Interrupt interrupt, uint8_t priority) {
  nvic().IPR[interrupt] = static_cast<uint8_t>(priority << 4);
  nvic().ISER[interrupt / 32] = bit(interrupt % 32);
}

// No interrupt of this priority or a lower one (a higher number) is taken until it is 0 again.
inline void set_base_priority(uint8_t priority) {
  __asm volatile("msr basepri, %0" ::"r"(static_cast<uint32_t>(priority) << 4) : "memory");
}

// The same for a block.
class Masked {
 public:
  explicit Masked(uint8_t priority) { set_base_priority(priority); }
  ~Masked() { set_base_priority(0); }
  Masked(const Masked&) = delete;
  Masked& operator=(const Masked&) = delete;
};

[[gnu::always_inline]] inline void barrier() { __asm volatile("dsb\n\tisb" ::: "memory"); }

[[noreturn, gnu::always_inline]] inline void reset() {
  barrier();
  scb().AIRCR = Scb::VECTKEY | Scb::SYSRESETREQ;
  barrier();
  for (;;) {
  }
}

}  // namespace stm32
