// Version of this firmware, as HELLO tells it.
#pragma once

#include <stdint.h>

namespace bioscara {

constexpr uint8_t kFirmwareMajor = 0;
constexpr uint8_t kFirmwareMinor = 1;

}  // namespace bioscara
