// Exceptions of the processor: the power stage opens, what happened is kept, and the controller
// resets.
#pragma once

#include "../../src/core/hal.h"

extern "C" void fault_handler();

namespace bioscara::exceptions {

// Once per boot, before last(); after a power-up nothing is known of an exception.
void count_start(bool powered_up);

ExceptionRecord last();

}  // namespace bioscara::exceptions
