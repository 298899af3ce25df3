// Which joint this board drives, 1 to 4. The only line that differs between the four boards.
#pragma once

#define BIOSCARA_JOINT 1
