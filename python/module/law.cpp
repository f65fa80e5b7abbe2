// SPDX-License-Identifier: Apache-2.0
#include "python/module/law.hpp"

#include <cmath>
#include <utility>

#include <pybind11/numpy.h>

#include "include/kerf/law.hpp"
#include "include/kerf/scene.hpp"
#include "python/module/module.hpp"

namespace py = pybind11;

namespace kerf::python {
namespace {

thread_local LawFunction* in_use = nullptr;

/// A value that is no force, as a message has it.
std::string shown(const py::handle& value) {
  if (value.is_none()) return "None";
  auto text = py::repr(value).cast<std::string>();
  for (char& letter : text) {
    if (static_cast<unsigned char>(letter) < ' ') letter = ' ';
  }
  constexpr std::size_t kMost = 60;
  if (text.size() > kMost) text = text.substr(0, kMost) + "...";
  return text;
}

py::array_t<double> vector_of(const std::array<double, 3>& values) {
  return py::array_t<double>(3, values.data());
}

}  // namespace

std::array<double, 3> LawFunction::call(const LawValues& values) {
  const py::object result = function_(values);
  constexpr const char* kRemedy = "; return three finite numbers, the force in N";
  const auto numbers = py::array_t<double, py::array::forcecast>::ensure(result);
  if (!numbers || result.is_none() || numbers.ndim() != 1 || numbers.shape(0) != 3) {
    PyErr_Clear();
    throw Error("it returned " + shown(result) + kRemedy);
  }
  const std::array<double, 3> force_n{numbers.at(0), numbers.at(1), numbers.at(2)};
  for (const double axis_n : force_n) {
    if (!std::isfinite(axis_n)) throw Error("it returned " + shown(result) + kRemedy);
  }
  return force_n;
}

std::optional<std::array<double, 3>> LawFunction::force(const LawValues& values) noexcept {
  if (failed()) return std::nullopt;
  for (bool again = false;; again = true) {
    try {
      return call(values);
    } catch (py::error_already_set& raised) {
      if (!again && raised.matches(PyExc_KeyboardInterrupt)) {
        interrupted_ = true;
        continue;
      }
      const auto type = raised.type().attr("__name__").cast<std::string>();
      const std::string said = py::str(raised.value()).cast<std::string>();
      problem_ = "it raised " + type + (said.empty() ? "" : ": " + said) +
                 "; a law returns three finite numbers, the force in N";
      for (char& letter : problem_) {
        if (static_cast<unsigned char>(letter) < ' ') letter = ' ';
      }
      cause_.emplace(raised);
    } catch (const std::exception& error) {
      problem_ = error.what();
    }
    return std::nullopt;
  }
}

void LawFunction::raise(Tick tick) const {
  const std::string line = "law, tick " + std::to_string(tick) + ": " + problem_;
  const py::object type = py::module_::import("kerf._kerf").attr("Error");
  py::object error = type(line);
  if (cause_) {
    PyException_SetCause(error.ptr(), py::object(cause_->value()).release().ptr());
  }
  PyErr_SetObject(type.ptr(), error.ptr());
  throw py::error_already_set();
}

LawInUse::LawInUse(LawFunction* function) noexcept : before_(std::exchange(in_use, function)) {}
LawInUse::~LawInUse() {
  in_use = before_;
}

/// The law as the servo has it: it has no constants, and no memory that a snapshot would keep.
template <class N>
class PythonLaw {
  using Real = typename N::Real;

 public:
  static constexpr const char* kName = kPythonLaw;
  static constexpr const char* kMeaning = "a function of a Python program";
  static constexpr std::array<LawSetting, 2> kSettings{{
      {"stiffness_n_per_mm", "N/mm", 0, 1e6, 0.4, "for the function"},
      {"damping_ns_per_mm", "N s/mm", 0, 1e6, 0.002, "for the function"},
  }};
  struct State {};

  explicit PythonLaw(const LawSetup& setup) noexcept
      : stiffness_n_per_mm_(setup["stiffness_n_per_mm"]),
        damping_ns_per_mm_(setup["damping_ns_per_mm"]) {}

  LawForce<Real> step(const ForceInput<N>& in, State&) const noexcept {
    const auto doubles = [](const auto& v) {
      return std::array{static_cast<double>(v.x), static_cast<double>(v.y),
                        static_cast<double>(v.z)};
    };
    std::optional<std::array<double, 3>> force_n;
    if (in_use != nullptr) {
      force_n = in_use->force({doubles(in.tip_mm), doubles(in.scene_tip_mm),
                               doubles(in.velocity_mm_per_s), doubles(in.spring_mm),
                               doubles(in.normal), stiffness_n_per_mm_, damping_ns_per_mm_});
    }
    if (!force_n) return LawForce<Real>::failed();
    const auto& [x, y, z] = *force_n;
    return DeviceVec<Real>{Real(x), Real(y), Real(z)};
  }

 private:
  double stiffness_n_per_mm_, damping_ns_per_mm_;
};

void define_law(py::module_& module) {
  const auto vector = [](std::array<double, 3> LawValues::*member) {
    return [member](const LawValues& values) { return vector_of(values.*member); };
  };
  py::class_<LawValues>(module, "LawInput",
                        R"(What a force law gets in a tick; arrays of three float64, each a copy.

The axes are those of the device: x right, y up, z to the user.)")
      .def_property_readonly("tip_mm", vector(&LawValues::tip_mm),
                             "of the hand, at the device port, mm")
      .def_property_readonly("scene_tip_mm", vector(&LawValues::scene_tip_mm),
                             "the same position in the scene, mm")
      .def_property_readonly("velocity_mm_per_s", vector(&LawValues::velocity_mm_per_s),
                             "of the hand, as the scene's estimator has it, mm/s")
      .def_property_readonly("spring_mm", vector(&LawValues::spring_mm),
                             "from the hand to the proxy, which rests on the surface, mm; 0 in air")
      .def_property_readonly(
          "normal", vector(&LawValues::normal),
          "out of the solid, of all that the tool presses on, length 1; 0 in air")
      .def_readonly("stiffness_n_per_mm", &LawValues::stiffness_n_per_mm,
                    "of the scene or the cell, N/mm: a law may use it")
      .def_readonly("damping_ns_per_mm", &LawValues::damping_ns_per_mm,
                    "of the scene or the cell, N s/mm");
}

}  // namespace kerf::python

namespace kerf {
using python::PythonLaw;
KERF_REGISTER_FORCE_LAW(PythonLaw)
}  // namespace kerf
