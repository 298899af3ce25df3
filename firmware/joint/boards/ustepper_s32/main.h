// The program, once memory is set up.
#pragma once

#include <stdint.h>

namespace bioscara {

// `noise`: what memory held at power-up, for the boot id.
[[noreturn]] void run(uint32_t noise);

}  // namespace bioscara
