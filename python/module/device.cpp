// SPDX-License-Identifier: Apache-2.0
#include "include/kerf/device.hpp"

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <thread>

#include <pybind11/stl.h>

#include "python/module/module.hpp"

namespace py = pybind11;

namespace kerf::python {
namespace {

/// A `Device` that can be given back before its end, as a `with` does.
class OpenDevice {
 public:
  explicit OpenDevice(const std::string& name) : device_(Device::open(name)) {}

  [[nodiscard]] Device& get() {
    if (!device_) throw Error("Device: it was closed; open another one");
    return *device_;
  }
  void close() { device_.reset(); }

  /// Without the interpreter's lock, which other threads may want; looks for Ctrl-C on the way.
  bool wait() {
    constexpr auto kSlice = std::chrono::milliseconds(50);
    Device& device = get();
    for (;;) {
      bool is_new = false;
      {
        const py::gil_scoped_release others;
        const auto until = std::chrono::steady_clock::now() + kSlice;
        const std::chrono::duration<double> quarter(device.period_s() / 4);
        while (!(is_new = device.poll()) && device.alive() &&
               std::chrono::steady_clock::now() < until) {
          std::this_thread::sleep_for(quarter);
        }
      }
      if (is_new || !device.alive()) return is_new;
      handle_signals();
    }
  }

 private:
  std::optional<Device> device_;
};

}  // namespace

void define_device(py::module_& module) {
  using Point = std::array<double, 3>;
  py::enum_<Phase>(module, "Phase",
                   "Phase of the safety state machine; motors are on in RAMPING and ACTIVE.")
      .value("OFF", Phase::off)
      .value("CALIBRATING", Phase::calibrating)
      .value("ARMED", Phase::armed)
      .value("RAMPING", Phase::ramping)
      .value("ACTIVE", Phase::active)
      .value("FAULT", Phase::fault);
  py::class_<DeviceState>(module, "DeviceState",
                          "The last tick of an arm, as a program with a force of its own sees it.")
      .def_readonly("tick", &DeviceState::tick, "count of servo steps; 0: none yet")
      .def_readonly("answers", &DeviceState::answers,
                    "number of the newest force that the tick had")
      .def_readonly("position_mm", &DeviceState::position_mm,
                    "tip in the scene: x, y, z; NaN until calibrated")
      .def_readonly("orientation", &DeviceState::orientation,
                    "quaternion x, y, z, w; NaN until calibrated")
      .def_readonly("velocity_mm_per_s", &DeviceState::velocity_mm_per_s,
                    "x, y, z; NaN until the device was in hand")
      .def_readonly("force_n", &DeviceState::force_n,
                    "sent to the device, after all limits: x, y, z")
      .def_readonly("phase", &DeviceState::phase, "kerf.Phase")
      .def_property_readonly(
          "fault", [](const DeviceState& state) { return fault_name(state.fault); },
          "\"none\", or why there is no force")
      .def_readonly("flags", &DeviceState::flags, "bits of the column flags of a log");
  py::class_<OpenDevice>(module, "Device",
                         "A device for a force of your own, under kerf's limits: of the controller "
                         "that runs under `name`, with a scene of\n"
                         "force.model = \"external\" (docs/own-law.md). Raises kerf.Error: there "
                         "is none, or another program has it.\n\n"
                         "    with kerf.Device(\"mine\") as device:\n"
                         "        for state in device:                      # each tick, or the "
                         "newest; ends with the controller\n"
                         "            device.give(force_n=(0, 0.5, 0))")
      .def(py::init<const std::string&>(), py::arg("name") = "kerf")
      .def_property_readonly("arms", [](OpenDevice& self) { return self.get().arms(); })
      .def_property_readonly(
          "workspace_scale", [](OpenDevice& self) { return self.get().workspace_scale(); },
          "mm of the scene for each mm of the device")
      .def_property_readonly("period_s", [](OpenDevice& self) { return self.get().period_s(); })
      .def_property_readonly(
          "alive", [](OpenDevice& self) { return self.get().alive(); },
          "False once the controller was found to have ended")
      .def_property_readonly(
          "refused", [](OpenDevice& self) { return self.get().refused(); },
          "forces that were none, as the controller counts them: not finite, or beyond the scene's "
          "stiffness or damping")
      .def("wait", &OpenDevice::wait,
           "Waits for the next tick. Returns False if the controller has ended.")
      .def(
          "state", [](OpenDevice& self, std::size_t arm) { return self.get().state(arm); },
          py::arg("arm") = 0, "The tick that was taken last, a kerf.DeviceState.")
      .def(
          "give",
          [](OpenDevice& self, const Point& force_n, const Point& goal_mm, double stiffness,
             double damping, std::size_t arm) {
            return self.get().give({force_n, goal_mm, stiffness, damping}, arm);
          },
          py::arg("force_n") = Point{}, py::arg("goal_mm") = Point{}, py::kw_only(),
          py::arg("stiffness_n_per_mm") = 0.0, py::arg("damping_ns_per_mm") = 0.0,
          py::arg("arm") = 0,
          "What the arm gets from the next tick on: force_n + stiffness (goal_mm - tip) - damping "
          "v. It holds for force.stale_ms.\n"
          "Returns its number, which `answers` of a state will reach.")
      .def("close", &OpenDevice::close,
           "Gives the device back: the last force fades out. A second call does nothing.")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](OpenDevice& self, const py::args&) { self.close(); })
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", [](OpenDevice& self) {
        if (!self.wait()) throw py::stop_iteration();
        return self.get().state();
      });
}

}  // namespace kerf::python
