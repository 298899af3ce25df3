// Virtual time of the emulated Cortex-M4: called before each instruction.
//
// Time counts in units of 1/1680 MHz, of which 16, 20 and 84 MHz are whole divisors. An
// instruction costs what the Cortex-M4 technical reference manual (table 3-1) gives, with the
// longest division; a taken branch refills the pipeline with 2 cycles; a fetch from a 16-byte line
// of flash that is neither among the last 64 lines (the accelerator's cache) nor the next one
// (its prefetch) costs the wait states; a literal from flash costs them always. Memory accesses of
// peripherals are charged by their models.
#include <stdint.h>
#include <string.h>

enum { FLASH = 0x08000000, FLASH_SIZE = 0x40000, RAM = 0x20000000, RAM_SIZE = 0x10000 };
enum { LINES = 64, RETURN = 0xFFFFFF00 };
enum { RUNNING, DEADLINE, SLEEP, EXCEPTION_RETURN, UNMASKED, LOST, NO_COPROCESSOR };

typedef struct {
  int64_t now, deadline;
  int64_t instructions;
  int32_t unit;       // units of time per cycle of the core
  int32_t wait;       // wait states of the flash
  int32_t cached;     // instruction cache on
  int32_t prefetched; // prefetch on
  int32_t why;        // why the core stopped
  int32_t masked;     // an interrupt is pending but masked: look again after an unmasking
  int32_t fpu;        // the floating-point unit is on
  int32_t fpca;       // ... and was used in this context
  int32_t lazy;       // its registers are still to be stacked
  int32_t conditional; // instructions left in an IT block
  int32_t look;
  uint32_t after;     // the address after the last instruction
  uint32_t line;
  int (*stop)(void *);
  const uint8_t *flash, *ram;
  uint8_t held[FLASH_SIZE / 16];
  uint16_t ring[LINES];
  uint32_t oldest;
} Clock;

void clock_reset(Clock *clock) {
  memset(clock->held, 0, sizeof clock->held);
  memset(clock->ring, 0, sizeof clock->ring);
  clock->oldest = clock->after = 0;
  clock->line = ~0u;
  clock->fpca = clock->lazy = clock->conditional = clock->look = 0;
}

static int cycles_16(uint32_t op, int wait) {
  if ((op & 0xF800) == 0x4800) return 2 + wait;                              // LDR literal
  if (op >= 0x5000 && op < 0xA000) return 2;                                 // LDR, STR
  if ((op & 0xF600) == 0xB400) return 1 + __builtin_popcount(op & 0x1FF);    // PUSH, POP
  if ((op & 0xF000) == 0xC000) return 1 + __builtin_popcount(op & 0xFF);     // LDM, STM
  return 1;
}

static int cycles_32(uint32_t high, uint32_t low, int wait) {
  if ((high & 0xFE40) == 0xE800) return 1 + __builtin_popcount(low);         // LDM, STM
  if ((high & 0xFE40) == 0xE840) return 3;                           // LDRD, STRD, TBB
  if ((high & 0xFE00) == 0xF800) return 2 + ((high & 0xF) == 0xF ? wait : 0);  // LDR, STR
  if ((high & 0xFFD0) == 0xFB90) return 12;                                  // SDIV, UDIV
  if ((high & 0xEC00) == 0xEC00 && (low & 0x0E00) == 0x0A00) {               // floating point
    if ((high & 0xFF00) == 0xEE00) {
      if ((low & 0x10) != 0) return 1;                                       // VMOV, VMRS
      if ((high & 0xB0) == 0x80) return 14;                                  // VDIV
      if ((high & 0xBF) == 0xB1 && (low & 0xC0) == 0xC0) return 14;          // VSQRT
      if ((high & 0xA0) == 0x00 && (high & 0x30) != 0x20) return 3;          // VMLA
      return (high & 0xB0) == 0xA0 ? 3 : 1;                                  // VFMA
    }
    if ((high & 0xFF20) == 0xED00) return 2 + ((high & 0xF) == 0xF ? wait : 0);  // VLDR, VSTR
    return 1 + (int)(low & 0xFF);                                            // VLDM, VPUSH
  }
  return 1;
}

static int is_floating(uint32_t high, uint32_t low) {
  return (high & 0xEC00) == 0xEC00 && (low & 0x0E00) == 0x0A00;
}

static int fetch(Clock *clock, uint32_t address) {
  const uint32_t line = (address - FLASH) / 16;
  if (line == clock->line) return 0;
  const int next = clock->prefetched && line == clock->line + 1;
  clock->line = line;
  if (clock->cached && clock->held[line]) return 0;
  if (clock->cached) {
    clock->held[clock->ring[clock->oldest]] = 0;
    clock->ring[clock->oldest] = (uint16_t)line;
    clock->oldest = (clock->oldest + 1) % LINES;
    clock->held[line] = 1;
  }
  return next ? 0 : clock->wait;
}

static void halt(void *engine, Clock *clock, int why) {
  clock->why = why;
  clock->stop(engine);
}

void clock_instruction(void *engine, uint64_t at, uint32_t size, void *user) {
  Clock *clock = user;
  const uint32_t address = (uint32_t)at;
  if (address >= RETURN) {
    halt(engine, clock, EXCEPTION_RETURN);
    return;
  }
  if (clock->conditional == 0) {
    if (clock->look) {
      clock->look = 0;
      if (clock->masked) {
        halt(engine, clock, UNMASKED);
        return;
      }
    }
    if (clock->now >= clock->deadline) {
      halt(engine, clock, DEADLINE);
      return;
    }
  }
  int wait = 0;
  const uint8_t *code;
  if (address - FLASH < FLASH_SIZE) {
    code = clock->flash + (address - FLASH);
    wait = fetch(clock, address);
  } else if (address - RAM < RAM_SIZE) {
    code = clock->ram + (address - RAM);
  } else {
    halt(engine, clock, LOST);
    return;
  }
  const uint32_t high = code[0] | code[1] << 8;
  int cycles = wait;
  if (address != clock->after) cycles += 2;
  if (clock->conditional > 0) --clock->conditional;
  if (size == 2) {
    if (high == 0xBF30 || high == 0xBF20) {  // WFI, WFE
      halt(engine, clock, SLEEP);
      return;
    }
    if ((high & 0xFF00) == 0xBF00 && (high & 0xF) != 0)  // IT
      clock->conditional = 4 - __builtin_ctz(high & 0xF);
    if ((high & 0xFFE8) == 0xB660) clock->look = 1;  // CPS
    cycles += cycles_16(high, clock->wait);
  } else {
    const uint32_t low = code[2] | code[3] << 8;
    if ((high & 0xFFE0) == 0xF380 && (low & 0xFF00) == 0x8800) clock->look = 1;  // MSR
    if (is_floating(high, low)) {
      if (!clock->fpu) {
        halt(engine, clock, NO_COPROCESSOR);
        return;
      }
      if (clock->lazy) {
        clock->lazy = 0;
        cycles += 18;
      }
      clock->fpca = 1;
    }
    cycles += cycles_32(high, low, clock->wait);
  }
  clock->after = address + size;
  clock->now += (int64_t)cycles * clock->unit;
  ++clock->instructions;
}
