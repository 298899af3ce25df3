// Identity of this image, of this boot and of this reset.
#pragma once

#include <stdint.h>

#include "../../src/generated/registers.h"

namespace bioscara {

// Whether the flash holds the sealed image: false after an interrupted flashing.
bool image_intact();

// Its CRC-32, as sealed.
uint32_t image_crc();

// A number derived from the content of memory at power-up. Call before memory is set up.
uint32_t power_up_noise();

// The boot id, once per boot; `noise` as above.
uint16_t next_boot_id(uint32_t noise);

// Why the controller started, once per boot.
ResetCause read_reset_cause();

}  // namespace bioscara
