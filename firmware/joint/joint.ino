// Firmware of a Bioscara joint for the uStepper S32. Set the joint in configuration.h, then flash.
#include "configuration.h"
#include "src/boards/ustepper_s32.h"
#include "src/core/joint.h"

static_assert(BIOSCARA_JOINT >= 1 && BIOSCARA_JOINT <= 4, "configuration.h: a joint is 1 to 4");

static constexpr bioscara::Configuration kConfiguration =
    bioscara::configuration_of(BIOSCARA_JOINT);

static bioscara::UstepperS32 board;
static bioscara::Joint joint(board, kConfiguration);

static void receive(int) { board.receive(joint); }
static void request() { board.request(joint); }
static void tick() { joint.tick(); }

void setup() {
  board.begin();
  joint.boot();
  board.listen(kConfiguration.address, receive, request);
  board.every(bioscara::Joint::kTickMicros, tick);
}

// Everything happens in the control tick and the two I2C interrupts.
void loop() {}
