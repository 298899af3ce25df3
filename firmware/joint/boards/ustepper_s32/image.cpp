// The image's identity, at a fixed place in it, and the check of its content.
#include "../../src/core/version.h"
#include "identity.h"
#include "stm32f401.h"

namespace bioscara {

namespace {

constexpr uint32_t kUnset = 0xFFFFFFFF;

// Little endian at offset 0x200 of the image; seal.py sets the last two after linking.
struct Identity {
  char magic[8];
  uint8_t format, joint, major, minor, patch;
  uint8_t reserved[3];
  uint32_t length;  // Bytes of the image.
  uint32_t crc32;   // CRC-32 as in zlib over them, with this field taken as 0xFFFFFFFF.
};
static_assert(sizeof(Identity) == 24, "the layout is part of the image format");

__attribute__((section(".identity"), used)) const volatile Identity kIdentity = {
    {'B', 'I', 'O', 'S', 'C', 'A', 'R', 'A'},
    1,
    BIOSCARA_JOINT,
    kFirmwareMajor,
    kFirmwareMinor,
    kFirmwarePatch,
    {},
    kUnset,
    kUnset};

constexpr uint32_t kFlash = 0x08000000;
constexpr uint32_t kFlashSize = 256 * 1024;

inline uint32_t reversed(uint32_t word) {
  uint32_t result;
  __asm("rbit %0, %1" : "=r"(result) : "r"(word));
  return result;
}

}  // namespace

uint32_t image_crc() { return kIdentity.crc32; }

// The CRC unit takes words highest bit first, where zlib takes bytes lowest bit first.
bool image_intact() {
  const uint32_t length = kIdentity.length;
  if (length < sizeof(Identity) || length > kFlashSize || length % sizeof(uint32_t) != 0) return false;
  stm32::rcc().AHB1ENR |= stm32::Rcc::CRCEN;
  (void)stm32::rcc().AHB1ENR;
  stm32::Crc& unit = stm32::crc();
  unit.CR = stm32::Crc::RESET;
  const stm32::Word* const field = &kIdentity.crc32;
  const stm32::Word* const end = &stm32::at<const stm32::Word>(kFlash + length);
  for (const stm32::Word* word = &stm32::at<const stm32::Word>(kFlash); word < end; ++word)
    unit.DR = reversed(word == field ? kUnset : *word);
  const uint32_t found = ~reversed(unit.DR);
  stm32::rcc().AHB1ENR &= ~stm32::Rcc::CRCEN;
  return found == *field;
}

}  // namespace bioscara
