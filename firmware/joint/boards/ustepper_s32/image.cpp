// The image's identity, at a fixed place in it, and the check of its content.
#include <stddef.h>

#include "../../src/core/version.h"
#include "identity.h"

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

struct CrcTable {
  uint32_t entries[256];
};

// Reflected, polynomial 0x04C11DB7.
constexpr CrcTable make_table() {
  CrcTable table{};
  for (uint32_t index = 0; index < 256; ++index) {
    uint32_t value = index;
    for (int shift = 0; shift < 8; ++shift)
      value = value & 1 ? value >> 1 ^ 0xEDB88320U : value >> 1;
    table.entries[index] = value;
  }
  return table;
}

constexpr CrcTable kTable = make_table();

const uint8_t* const kFlash = reinterpret_cast<const uint8_t*>(0x08000000);
constexpr uint32_t kFlashSize = 256 * 1024;

uint32_t extend(uint32_t crc, const uint8_t* bytes, size_t count) {
  for (size_t i = 0; i < count; ++i) crc = crc >> 8 ^ kTable.entries[(crc ^ bytes[i]) & 0xFF];
  return crc;
}

}  // namespace

bool image_intact() {
  constexpr uint8_t kBlank[4] = {0xFF, 0xFF, 0xFF, 0xFF};
  const auto* field = reinterpret_cast<const uint8_t*>(const_cast<const uint32_t*>(&kIdentity.crc32));
  const auto before = static_cast<size_t>(field - kFlash);
  const uint32_t length = kIdentity.length;
  if (length < before + sizeof(kBlank) || length > kFlashSize) return false;
  uint32_t crc = extend(0xFFFFFFFF, kFlash, before);
  crc = extend(crc, kBlank, sizeof(kBlank));
  crc = extend(crc, field + sizeof(kBlank), length - before - sizeof(kBlank));
  return ~crc == kIdentity.crc32;
}

}  // namespace bioscara
