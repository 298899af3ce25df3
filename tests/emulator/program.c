// What the emulator's own test runs: exceptions that nest, the floating-point unit in all of them,
// masking, sleep, and SysTick. Results lie in `result` for the test to read.
#include <stdint.h>

typedef volatile uint32_t Word;
#define AT(address) (*(Word *)(address))

enum { WORDS = 16 };
__attribute__((used)) volatile uint32_t result[WORDS];
__attribute__((used)) volatile float kept;
static volatile uint32_t depth, deepest;

void reset(void), systick(void), low(void), high(void), fault(void);

// Interrupts 0 and 1 have no peripheral here: software pends them.
__attribute__((section(".vectors"), used)) void (*const vectors[18])(void) = {
    (void (*)(void))0x20010000, reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault,
    0,                          fault, systick, low, high};

static void enter(void) {
  if (++depth > deepest) deepest = depth;
}

void fault(void) {
  result[0] = 0xBAD;
  for (;;) {
  }
}

void systick(void) { ++result[1]; }

// Spoils the registers that the main program uses.
void low(void) {
  enter();
  float product = 1.0f;
  for (int i = 1; i < 8; ++i) product *= (float)i;
  AT(0xE000E200) = 2;  // pend `high`, which comes before the next instruction counts
  result[2] = result[3];
  result[4] = (uint32_t)product;
  --depth;
}

void high(void) {
  enter();
  float sum = 0.5f;
  for (int i = 0; i < 8; ++i) sum += 0.25f * (float)i;
  result[3] = (uint32_t)sum;
  --depth;
}

static float series(int count) {
  float a = 1.0f, b = 2.0f, c = 3.0f, d = 4.0f;
  for (int i = 0; i < count; ++i) {
    a += b * 0.001f, b += c * 0.001f, c += d * 0.001f, d -= a * 0.001f;
    if (a > 100.0f) a /= 3.0f;
  }
  return a + b + c + d;
}

void reset(void) {
  AT(0xE000ED88) |= 0xFu << 20;
  __asm volatile("dsb\n\tisb");
  for (int i = 0; i < WORDS; ++i) result[i] = 0;
  depth = deepest = 0;
  AT(0xE000E400) = 0x1020;  // `low` 0x20, `high` 0x10
  AT(0xE000E100) = 3;
  const float quiet = series(2000);
  AT(0xE000E014) = 999;
  AT(0xE000E018) = 0;
  AT(0xE000E010) = 7;
  // The same numbers, interrupted.
  result[5] = series(2000) == quiet;
  AT(0xE000E200) = 1;
  __asm volatile("dsb\n\tisb");
  result[6] = deepest;
  // Masked: pending, and taken as soon as it is unmasked.
  __asm volatile("cpsid i");
  result[3] = 0;
  AT(0xE000E200) = 2;
  __asm volatile("dsb\n\tisb");
  result[7] = result[3];
  __asm volatile("cpsie i\n\tisb");
  result[8] = result[3];
  // BASEPRI holds off what is not more urgent.
  __asm volatile("msr basepri, %0" ::"r"(0x20));
  result[4] = 0;
  AT(0xE000E200) = 1;
  __asm volatile("dsb\n\tisb");
  result[9] = result[4];
  __asm volatile("msr basepri, %0\n\tisb" ::"r"(0));
  result[10] = result[4];
  // Sleep ends with the next interrupt.
  const uint32_t before = result[1];
  __asm volatile("wfi");
  result[11] = result[1] - before;
  result[0] = 1;
  for (;;) __asm volatile("wfi");
}
