// Little-endian numbers in frames, and the check byte.
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

namespace bioscara {

template <typename T>
T load(const uint8_t* bytes) {
  T value;
  memcpy(&value, bytes, sizeof(T));  // The controller is little endian, as is the wire.
  return value;
}

template <typename T>
size_t store(uint8_t* bytes, T value) {
  memcpy(bytes, &value, sizeof(T));
  return sizeof(T);
}

// CRC-8 of the SMBus packet error check: polynomial 0x07, start 0. By table: it runs in the I2C
// interrupt.
struct Crc8Table {
  uint8_t entries[256];
};
constexpr Crc8Table make_crc8_table() {
  Crc8Table table{};
  for (int index = 0; index < 256; ++index) {
    int crc = index;
    for (int bit = 0; bit < 8; ++bit) crc = crc & 0x80 ? (crc << 1) ^ 0x107 : crc << 1;
    table.entries[index] = static_cast<uint8_t>(crc);
  }
  return table;
}
constexpr Crc8Table kCrc8Table = make_crc8_table();

inline uint8_t crc8(uint8_t crc, const uint8_t* data, size_t size) {
  for (size_t i = 0; i < size; ++i) crc = kCrc8Table.entries[crc ^ data[i]];
  return crc;
}

}  // namespace bioscara
