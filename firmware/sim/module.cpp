// The simulated arm for Python. src/bioscara/sim is its only user and adds the public interface.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "../joint/src/core/version.h"
#include "src/arm.h"
#include "src/plant.h"

namespace nb = nanobind;
using namespace bioscara;
using namespace bioscara::sim;

namespace {

constexpr Py_ssize_t kMost = 32;

// One value for each joint, in memory of a simulator of bodies.
using Joints = nb::ndarray<double, nb::shape<Arm::kJoints>, nb::c_contig, nb::device::cpu>;

void require_finite(double value, const char* name) {
  if (!std::isfinite(value)) throw nb::value_error((std::string(name) + " is not finite").c_str());
}

// One result per transaction: the bytes read, or the outcome as a number.
nb::list transfer(Arm& arm, nb::sequence transactions) {
  nb::list results;
  for (nb::handle item : transactions) {
    PyObject* parts = item.ptr();
    if (!PyTuple_Check(parts) || PyTuple_Size(parts) != 3)
      throw nb::type_error("a transaction is (address, bytes, count)");
    const auto address = nb::cast<int>(nb::handle(PyTuple_GetItem(parts, 0)));
    const auto written = nb::cast<nb::bytes>(nb::handle(PyTuple_GetItem(parts, 1)));
    const auto count = nb::cast<Py_ssize_t>(nb::handle(PyTuple_GetItem(parts, 2)));
    if (count < 0) throw nb::value_error("negative count of bytes to read");
    std::uint8_t read[kMost] = {};
    const auto asked = static_cast<std::size_t>(count < kMost ? count : kMost);
    const Outcome outcome =
        address < 0 || address > 0x7F
            ? Outcome::NO_ACKNOWLEDGE
            : arm.transfer(static_cast<std::uint8_t>(address),
                           reinterpret_cast<const std::uint8_t*>(written.c_str()),
                           static_cast<std::size_t>(written.size()), read, asked);
    if (outcome == Outcome::OK) {
      std::string answer(reinterpret_cast<const char*>(read), asked);
      answer.append(static_cast<std::size_t>(count) - asked, '\xFF');
      results.append(nb::bytes(answer.data(), answer.size()));
    } else {
      results.append(static_cast<int>(outcome));
    }
  }
  return results;
}

}  // namespace

NB_MODULE(_native, module) {
  // Arms may live until the interpreter ends, and it would print each.
  nb::set_leak_warnings(false);
  module.attr("__version__") = std::to_string(kFirmwareMajor) + "." + std::to_string(kFirmwareMinor) +
                           "." + std::to_string(kFirmwarePatch);
  nb::class_<Arm>(module, "Arm")
      .def(
          "__init__",
          [](Arm* self, std::uint32_t seed, double frequency, double overhead,
             const std::array<int, Arm::kJoints>& firmwares) {
            Arm::Firmwares flashed;
            for (std::size_t i = 0; i < flashed.size(); ++i) {
              if (firmwares[i] < 0 || firmwares[i] > static_cast<int>(Firmware::ORIGINAL))
                throw nb::value_error("no such firmware");
              flashed[i] = static_cast<Firmware>(firmwares[i]);
            }
            new (self) Arm(seed, Timing{frequency, overhead}, flashed);
          },
          nb::arg("seed"), nb::arg("frequency"), nb::arg("overhead"), nb::arg("firmwares"))
      .def(nb::init<const Arm&>(), nb::arg("other"))
      .def("now", &Arm::now)
      .def("run",
           [](Arm& arm, double seconds) {
             require_finite(seconds, "duration");
             if (seconds < 0) throw nb::value_error("time cannot run backwards");
             arm.run(seconds);
           })
      .def("transfer", &transfer)
      .def("assign", &Arm::assign, nb::arg("other"))
      .def("set_world",
           [](Arm& arm, Joints position, Joints velocity, Joints drive, Joints contact,
              nb::callable step) {
             // The function keeps what it uses alive. It does not know the arm: there is no cycle.
             auto call = [position, velocity, drive, contact, step] { step(); };
             arm.set_world({position.data(), velocity.data(), drive.data(), contact.data(), call});
           },
           nb::arg("position"), nb::arg("velocity"), nb::arg("drive"), nb::arg("contact"),
           nb::arg("step"))
      .def("remove_world", &Arm::remove_world)
      .def("load_inertia",
           [](Arm& arm, int joint) {
             return std::as_const(arm.board(joint)).mechanics().load_inertia();
           })
      .def("set_stretch", &Arm::set_stretch)
      .def("position", [](Arm& arm, int joint) { return arm.board(joint).mechanics().position(); })
      .def("velocity", [](Arm& arm, int joint) { return arm.board(joint).mechanics().velocity(); })
      .def("load_angle", [](Arm& arm, int joint) { return arm.board(joint).load_angle(); })
      .def("position_error",
           [](Arm& arm, int joint) { return arm.board(joint).position_error(); })
      .def("field", [](Arm& arm, int joint) { return arm.board(joint).driver().field(); })
      .def("has_torque", [](Arm& arm, int joint) { return arm.board(joint).has_torque(); })
      .def("set_position",
           [](Arm& arm, int joint, double position) {
             require_finite(position, "position");
             arm.board(joint).mechanics().set_position(position);
           })
      .def("add_obstacle",
           [](Arm& arm, int joint, double position, double stiffness) {
             arm.board(joint).mechanics().add_obstacle(position, stiffness);
           })
      .def("clear_obstacles",
           [](Arm& arm, int joint) { arm.board(joint).mechanics().clear_obstacles(); })
      .def("remove_stops", [](Arm& arm, int joint) { arm.board(joint).mechanics().remove_stops(); })
      .def("take_off_belt",
           [](Arm& arm, int joint) { arm.board(joint).mechanics().take_off_belt(); })
      .def("slip",
           [](Arm& arm, int joint, double distance) { arm.board(joint).mechanics().slip(distance); })
      .def("push",
           [](Arm& arm, int joint, double force) { arm.board(joint).mechanics().push(force); })
      .def("set_friction_factor",
           [](Arm& arm, int joint, double factor) {
             arm.board(joint).mechanics().set_friction_factor(factor);
           })
      .def("reset",
           [](Arm& arm, int joint, int cause) {
             arm.board(joint).reset(static_cast<ResetCause>(cause));
           })
      .def("set_power", [](Arm& arm, int joint, bool on) { arm.board(joint).set_power(on); })
      .def("set_motor_power",
           [](Arm& arm, int joint, bool on) { arm.board(joint).set_motor_power(on); })
      .def("hang", [](Arm& arm, int joint, bool on) { arm.board(joint).hang(on); })
      .def("set_watchdog", [](Arm& arm, int joint, bool on) { arm.board(joint).set_watchdog(on); })
      .def("overheat",
           [](Arm& arm, int joint, bool on) { arm.board(joint).driver().raise_overtemperature(on); })
      .def("reverse_coil",
           [](Arm& arm, int joint, bool on) { arm.board(joint).driver().reverse_coil(on); })
      .def("reverse_encoder",
           [](Arm& arm, int joint, bool on) { arm.board(joint).encoder().reverse(on); })
      .def("freeze_encoder",
           [](Arm& arm, int joint, bool on) { arm.board(joint).encoder().freeze(on); })
      .def("corrupt_encoder",
           [](Arm& arm, int joint, bool on) { arm.board(joint).encoder().corrupt(on); })
      .def("jump_encoder", [](Arm& arm, int joint, double turns) {
        arm.board(joint).encoder().jump(turns);
      });

  nb::class_<Plant>(module, "Plant")
      .def(
          "__init__",
          [](Plant* self, int joint, std::uint32_t seed) {
            if (joint < 1 || joint > Arm::kJoints) throw nb::value_error("a joint is 1 to 4");
            new (self) Plant(joint, seed);
          },
          nb::arg("joint"), nb::arg("seed"))
      .def("now", &Plant::now)
      .def("advance",
           [](Plant& plant, double until) {
             require_finite(until, "time");
             plant.advance(until);
           })
      .def("driver_answer",
           [](Plant& plant) {
             const auto answer = plant.driver_answer();
             return nb::bytes(answer.data(), answer.size());
           })
      .def("driver_accept",
           [](Plant& plant, nb::bytes datagram) {
             if (datagram.size() != 5) throw nb::value_error("a datagram has 5 bytes");
             std::uint8_t sent[5];
             std::memcpy(sent, datagram.c_str(), sizeof sent);
             plant.driver_accept(sent);
           })
      .def("encoder_exchange",
           [](Plant& plant, std::uint16_t command, nb::sequence words) {
             std::uint16_t exchanged[16] = {};
             std::size_t count = 0;
             for (nb::handle word : words) {
               if (count == 16) throw nb::value_error("at most 16 words");
               exchanged[count++] = nb::cast<std::uint16_t>(word);
             }
             plant.encoder_exchange(command, exchanged, count);
             nb::list answer;
             for (std::size_t i = 0; i < count; ++i) answer.append(exchanged[i]);
             return answer;
           })
      .def("enable", &Plant::enable)
      .def("power_up",
           [](Plant& plant) {
             plant.board().driver().power_up();
             plant.board().encoder().power_up();
           })
      .def("set_motor_power",
           [](Plant& plant, bool on) { plant.board().set_motor_power(on); })
      .def("reset_driver", [](Plant& plant) { plant.board().driver().power_up(); })
      .def("position", [](Plant& plant) { return plant.board().mechanics().position(); })
      .def("velocity", [](Plant& plant) { return plant.board().mechanics().velocity(); })
      .def("set_position",
           [](Plant& plant, double position) {
             require_finite(position, "position");
             plant.board().mechanics().set_position(position);
           })
      .def("has_torque", [](Plant& plant) { return plant.board().has_torque(); })
      .def("reverse_coil",
           [](Plant& plant, bool on) { plant.board().driver().reverse_coil(on); })
      .def("corrupt_encoder", [](Plant& plant, bool on) { plant.board().encoder().corrupt(on); });
}
