// Version of this firmware: in the image, and the first two numbers in HELLO.
#pragma once

#include <stdint.h>

namespace bioscara {

constexpr uint8_t kFirmwareMajor = 0;
constexpr uint8_t kFirmwareMinor = 1;
constexpr uint8_t kFirmwarePatch = 0;

}  // namespace bioscara
