// Prints the calls between the core and its board, on the simulated chips of one joint: at boot,
// while it homes, follows setpoints and stalls. A line an event, numbers in hexadecimal, those of
// the core behind a colon:
//
//     boot, tick
//     receive BYTES, request :BYTES     the I2C interrupt
//     micros VALUE, reset_cause VALUE, boot_id VALUE
//     driver RECEIVED :SENT
//     encoder WORDS :COMMAND COUNT      of a read; of a write the words are behind the colon
//     enable :ON
//
// Arguments: joint, its position [joint units], and the payload of HOME.
#include <cstdio>
#include <cstdlib>

#include "../joint/src/core/joint.h"
#include "../sim/src/plant.h"
#include "client.h"

namespace {

using bioscara::Flags;
using bioscara::Joint;
using bioscara::JointState;
using bioscara::Register;
using client::has;

constexpr double kDegrees = 57.29577951308232;

void print(const std::uint8_t* bytes, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) std::printf("%02x", bytes[i]);
}

// Between the core and a board: prints what passes.
class Recorder final : public bioscara::Hal {
 public:
  explicit Recorder(bioscara::Hal& board) : board_(board) {}

  std::uint32_t micros() override { return answered("micros", board_.micros()); }
  void driver_exchange(const std::uint8_t (&sent)[5], std::uint8_t (&received)[5]) override {
    std::uint8_t copy[5];
    std::copy_n(sent, 5, copy);
    board_.driver_exchange(copy, received);
    std::printf("driver ");
    print(received, 5);
    std::printf(" :");
    print(copy, 5);
    std::printf("\n");
  }
  void encoder_exchange(std::uint16_t command, std::uint16_t* words, std::size_t count) override {
    const bool read = (command & 0x8000) != 0;
    std::printf("encoder ");
    if (!read) std::printf(" :%x %zx", command, count);
    for (std::size_t i = 0; !read && i < count; ++i) std::printf(" %x", words[i]);
    board_.encoder_exchange(command, words, count);
    for (std::size_t i = 0; read && i < count; ++i) std::printf("%s%x", i > 0 ? "," : "", words[i]);
    if (read) std::printf(" :%x %zx", command, count);
    std::printf("\n");
  }
  void driver_enable(bool on) override {
    std::printf("enable :%d\n", on);
    board_.driver_enable(on);
  }
  bioscara::ResetCause reset_cause() override { return answered("reset_cause", board_.reset_cause()); }
  std::uint16_t boot_id() override { return answered("boot_id", board_.boot_id()); }
  void feed_watchdog() override { board_.feed_watchdog(); }
  std::uint16_t bus_errors() override { return board_.bus_errors(); }
  std::uint32_t image() override { return board_.image(); }
  bioscara::ExceptionRecord exception() override { return board_.exception(); }
  void indicate(bool lit) override { board_.indicate(lit); }
  void enter_bootloader() override { board_.enter_bootloader(); }
  void lock() override {}
  void unlock() override {}

 private:
  template <typename Value>
  static Value answered(const char* what, Value value) {
    std::printf("%s %x\n", what, static_cast<unsigned>(value));
    return value;
  }

  bioscara::Hal& board_;
};

// One joint on its chips, with ticks of 1 ms and frames between them.
class Recorded {
 public:
  Recorded(int joint, double position)
      : plant_(joint, 1),
        recorder_(plant_.board().wires()),
        joint_(recorder_, bioscara::configuration_of(static_cast<std::uint8_t>(joint))) {
    mechanics().set_position(position);
    run(0.0);
    std::printf("boot\n");
    joint_.boot();
  }
  double now() const { return static_cast<double>(ticks_) * 1e-3; }
  bioscara::sim::Mechanics& mechanics() { return plant_.board().mechanics(); }

  void run(double seconds) {
    for (const long end = ticks_ + std::lround(seconds * 1e3); ticks_ < end;) {
      plant_.advance(static_cast<double>(++ticks_) * 1e-3);
      std::printf("tick\n");
      joint_.tick();
    }
  }

  void transfer(std::uint8_t, const std::uint8_t* written, std::size_t size, std::uint8_t* read,
                std::size_t count) {
    std::printf("receive ");
    print(written, size);
    std::printf("\n");
    joint_.on_receive(written, size);
    std::uint8_t answer[Joint::kAnswerMax];
    const std::size_t length = joint_.on_request(answer);
    std::printf("request :");
    print(answer, length);
    std::printf("\n");
    std::fill_n(read, count, std::uint8_t{0xFF});
    std::copy_n(answer, std::min(length, count), read);
  }

 private:
  bioscara::sim::Plant plant_;
  Recorder recorder_;
  Joint joint_;
  long ticks_ = 0;
};

void require(bool expected, const char* what) {
  if (expected) return;
  std::fprintf(stderr, "no %s\n", what);
  std::exit(EXIT_FAILURE);
}

}  // namespace

int main(int count, char** arguments) {
  require(count == 7, "arguments: JOINT POSITION DIRECTION RPM SENSITIVITY CURRENT");
  const int number = std::atoi(arguments[1]);
  const auto argument = [arguments](int at) { return std::atoi(arguments[at]); };
  Recorded joint(number, std::atof(arguments[2]));
  client::Host<Recorded> host(joint, number);
  joint.run(0.03);
  host.arm_session();
  host.enable(40);
  host.home(argument(3) != 0, argument(4), argument(5), argument(6));
  require(!has(host.wait_until_idle(), Flags::NOTHOMED), "home");

  // Setpoints every 20 ms, of a smooth course away from the end stop and back.
  const double away = argument(3) != 0 ? -1.0 : 1.0;
  const double begin = host.degrees();
  for (int step = 1; step <= 30; ++step) {
    const double phase = 6.283185307179586 * step / 30;
    const double turned = away * 60.0 * (1.0 - std::cos(phase));
    const double rpm = away * 60.0 * std::sin(phase) * (6.283185307179586 / 0.6) / 6.0;
    const float degrees = static_cast<float>(begin + turned);
    host.send(Register::TRACK, client::setpoint(degrees, static_cast<float>(rpm)));
    joint.run(0.02);
  }
  require(host.state().state == JointState::TRACKING, "course");

  // An obstacle, a radian of the motor ahead.
  host.send(Register::MOVEANGLE, client::packed(static_cast<float>(begin + away * 720.0)));
  host.keep(0.1);
  const double reduction = bioscara::sim::parameters_of(number).reduction;
  joint.mechanics().add_obstacle(joint.mechanics().position() + away / reduction, 1.0);
  double end = joint.now() + 5.0;
  while (!has(host.flags(), Flags::STALL) && joint.now() < end) host.keep(0.02);
  require(has(host.flags(), Flags::STALL), "stall");
  host.keep(0.3);
  return EXIT_SUCCESS;
}
