// SPDX-License-Identifier: Apache-2.0
#include "include/kerf/stability.hpp"

#include <atomic>
#include <chrono>
#include <exception>
#include <future>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/complex.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "python/module/law.hpp"
#include "python/module/module.hpp"

namespace py = pybind11;

namespace kerf::python {
namespace {

using AxisTexts = std::vector<std::pair<std::string, std::string>>;

std::vector<MapAxis> axes_of(const AxisTexts& texts) {
  std::vector<MapAxis> axes;
  for (const auto& [name, values] : texts) axes.push_back({name, values});
  return axes;
}

/// A map, measured in other threads, while this one takes signals. True: Ctrl-C ended it, and
/// columns without cells were not measured.
std::pair<StabilityMap, bool> map_of(const std::string& stiffness, const AxisTexts& axes,
                                     double seconds, std::uint64_t seed, std::size_t seeds,
                                     std::size_t threads, const std::string& direction) {
  const std::vector<MapAxis> all = axes_of(axes);
  std::atomic<bool> stop{false};
  const MapOptions options{seconds, seed, seeds, threads, &stop, direction};
  auto measured =
      std::async(std::launch::async, [&] { return stability_map(stiffness, all, options); });
  constexpr std::chrono::milliseconds kBetweenSignals{20};
  bool ended = false;
  std::exception_ptr other;
  while (true) {
    {
      const py::gil_scoped_release unlocked;
      if (measured.wait_for(kBetweenSignals) == std::future_status::ready) break;
    }
    try {
      if (!ended) handle_signals();
    } catch (py::error_already_set& raised) {
      stop = ended = true;
      if (!raised.matches(PyExc_KeyboardInterrupt)) other = std::current_exception();
    }
  }
  StabilityMap map = measured.get();
  if (other) std::rethrow_exception(other);
  return {std::move(map), ended};
}

/// The verdict, and the trajectory as rows of two doubles.
py::tuple cell_of(WallRun run, const std::optional<py::function>& function) {
  std::optional<LawFunction> law;
  if (function) {
    law.emplace(*function);
    run.law = kPythonLaw;
  }
  std::vector<std::array<double, 2>> places;
  const auto watch = [&](double tip_mm, double mm_per_s) {
    places.push_back({tip_mm, mm_per_s});
    if (law && law->failed()) law->raise(places.size());
    const bool asked = law && law->take_interrupt();
    constexpr std::size_t kTicksBetweenSignals = 1 << 14;
    if (!asked && places.size() % kTicksBetweenSignals != 0) return;
    std::optional<py::gil_scoped_acquire> locked;
    if (!law) locked.emplace();
    if (asked) throw_keyboard_interrupt();
    handle_signals();
  };
  LimitCycle verdict;
  {
    std::optional<py::gil_scoped_release> unlocked;
    if (!law) unlocked.emplace();
    const LawInUse in_use(law ? &*law : nullptr);
    verdict = run_on_wall(run, watch);
  }
  if (law && law->failed()) law->raise(places.size() + 1);
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(places.size()), 2};
  return py::make_tuple(
      verdict, py::array_t<double>(shape, places.empty() ? nullptr : places.front().data()));
}

}  // namespace

void define_stability(py::module_& module) {
  py::class_<SampledHand>(module, "SampledHand",
                          "A hand that never lets the device go; all 0: none.")
      .def(py::init<>())
      .def_readwrite("mass_kg", &SampledHand::mass_kg)
      .def_readwrite("damping_ns_per_mm", &SampledHand::damping_ns_per_mm)
      .def_readwrite("stiffness_n_per_mm", &SampledHand::stiffness_n_per_mm);
  py::class_<SampledLoop>(
      module, "SampledLoop",
      "One axis of a device in contact with a virtual wall (kerf/stability.hpp).")
      .def(py::init<>())
      .def_readwrite("mass_kg", &SampledLoop::mass_kg, "apparent, at the tip")
      .def_readwrite("viscous_ns_per_mm", &SampledLoop::viscous_ns_per_mm,
                     "damping of the device, N s/mm")
      .def_readwrite("period_s", &SampledLoop::period_s)
      .def_readwrite("delay_s", &SampledLoop::delay_s,
                     "from the reading of the encoder to its force")
      .def_readwrite("velocity_filter_s", &SampledLoop::velocity_filter_s,
                     "time constant of a low-pass; 0: none")
      .def_readwrite("hand", &SampledLoop::hand)
      .def_readwrite("coulomb_n", &SampledLoop::coulomb_n, "Coulomb friction at the tip, N")
      .def_readwrite("quantum_mm", &SampledLoop::quantum_mm, "of the encoders, at the tip");
  module.def("device_loop", &device_loop, py::arg("device"), py::arg("rate_hz") = 1000.0,
             py::arg("direction") = "",
             "The SampledLoop of a unit of a device by the figures of docs/gains.md, without a "
             "hand: with the assumed delay of 2 ms of its bus. map_loop is that of the emulated "
             "one. Or of a device.toml of kerf identify, in a direction as of zwidth.");

  const auto sound = [](const SampledLoop& loop) {
    if (const std::string problem = problem_in(loop); !problem.empty()) throw Error(problem);
  };
  const auto limit = [&](const char* name, auto function, const char* meaning) {
    module.def(
        name, [=](const SampledLoop& loop) { return sound(loop), function(loop); }, py::arg("loop"),
        meaning);
  };
  const auto limit_at = [&](const char* name, auto function, const char* meaning) {
    module.def(
        name,
        [=](const SampledLoop& loop, double damping_ns_per_mm) {
          return sound(loop), function(loop, damping_ns_per_mm);
        },
        py::arg("loop"), py::arg("damping_ns_per_mm"), meaning);
  };
  limit_at("highest_stiffness", &highest_stiffness,
           "The largest K (N/mm) below which each is stable at this damping; 0: none.");
  limit_at("passive_stiffness", &passive_stiffness,
           "The largest K (N/mm) that is passive at this damping; 0: none.");
  limit("highest_damping", &highest_damping,
        "The largest B (N s/mm) that is stable without any stiffness.");
  limit("quantum_stiffness", &quantum_stiffness, "min(2 b/T, 2 fc/D), N/mm (Abbott and Okamura).");
  module.def(
      "is_stable",
      [=](const SampledLoop& loop, double stiffness, double damping) {
        return sound(loop), is_stable(loop, stiffness, damping);
      },
      py::arg("loop"), py::arg("stiffness_n_per_mm"), py::arg("damping_ns_per_mm"),
      "Whether every motion of the loop decays.");
  module.def(
      "passive_viscosity",
      [=](const SampledLoop& loop, double stiffness, double damping) {
        return sound(loop), passive_viscosity(loop, stiffness, damping);
      },
      py::arg("loop"), py::arg("stiffness_n_per_mm"), py::arg("damping_ns_per_mm"),
      "The device damping (N s/mm) above which the wall is passive.");
  module.def(
      "wall_impedance",
      [=](const SampledLoop& loop, double stiffness, double damping,
          const py::array_t<double>& hz) {
        sound(loop);
        return py::vectorize(
            [&](double at) { return wall_impedance(loop, stiffness, damping, at); })(hz);
      },
      py::arg("loop"), py::arg("stiffness_n_per_mm"), py::arg("damping_ns_per_mm"), py::arg("hz"),
      "Force over velocity of the wall as a hand feels it, N s/mm, at each frequency.");
  module.def(
      "device_impedance",
      [=](const SampledLoop& loop, const py::array_t<double>& hz, double amplitude_mm) {
        sound(loop);
        return py::vectorize([&](double at) { return device_impedance(loop, at, amplitude_mm); })(
            hz);
      },
      py::arg("loop"), py::arg("hz"), py::arg("amplitude_mm"),
      "That of the device, with its friction in a motion of this amplitude.");

  py::class_<LimitCycle>(module, "Verdict", "The verdict on a run, or on the worst run of a cell.")
      .def_readonly("swings", &LimitCycle::swings, "the tip oscillates on, or the run cannot go on")
      .def_readonly("active", &LimitCycle::active, "the motors give energy on and on")
      .def_readonly("undecided", &LimitCycle::undecided, "neither; but not proven to be at rest")
      .def_readonly("arithmetic", &LimitCycle::arithmetic,
                    "rounding of fixed numbers keeps up a motion")
      .def_readonly("travel_mm", &LimitCycle::travel_mm, "in the last half of the run")
      .def_readonly("given_mj", &LimitCycle::given_mj, "by the motors in the last half, mJ")
      .def_readonly("port_minimum_mj", &LimitCycle::port_minimum_mj,
                    "lowest energy of the device port, mJ")
      .def_property_readonly("rests", &LimitCycle::rests, "proven to come to rest")
      .def("__repr__", [](const LimitCycle& verdict) {
        std::string words;
        for (const auto& [is, word] : {std::pair{verdict.rests(), "rests"},
                                       {verdict.swings, "swings"},
                                       {verdict.active, "active"},
                                       {verdict.undecided, "undecided"},
                                       {verdict.arithmetic, "arithmetic"}}) {
          if (is) words += (words.empty() ? "" : ", ") + std::string(word);
        }
        return "<kerf.Verdict: " + words + ">";
      });
  py::class_<WallRun>(module, "WallRun")
      .def(py::init<>())
      .def_readwrite("loop", &WallRun::loop)
      .def_readwrite("stiffness_n_per_mm", &WallRun::stiffness_n_per_mm)
      .def_readwrite("damping_ns_per_mm", &WallRun::damping_ns_per_mm)
      .def_readwrite("push_n", &WallRun::push_n)
      .def_readwrite("hit_mm_per_s", &WallRun::hit_mm_per_s)
      .def_readwrite("start_mm", &WallRun::start_mm)
      .def_readwrite("seconds", &WallRun::seconds)
      .def_readwrite("seed", &WallRun::seed)
      .def_readwrite("law", &WallRun::law)
      .def_readwrite("estimator", &WallRun::estimator)
      .def_readwrite("fixed_point", &WallRun::fixed_point)
      .def_readwrite("limits", &WallRun::limits);
  py::class_<MapColumn>(module, "MapColumn")
      .def_readonly("values", &MapColumn::values)
      .def_readonly("cells", &MapColumn::cells)
      .def_readonly("impossible", &MapColumn::impossible)
      .def_readonly("first_swing_n_per_mm", &MapColumn::first_swing_n_per_mm)
      .def_readonly("first_energy_n_per_mm", &MapColumn::first_energy_n_per_mm)
      .def_readonly("swing_by_seed_n_per_mm", &MapColumn::swing_by_seed_n_per_mm)
      .def_readonly("energy_by_seed_n_per_mm", &MapColumn::energy_by_seed_n_per_mm);
  py::class_<StabilityMap>(module, "StabilityMap")
      .def_readonly("stiffness_n_per_mm", &StabilityMap::stiffness_n_per_mm)
      .def_readonly("columns", &StabilityMap::columns);
  module.def("map_of", &map_of);
  module.def("column_loop", [](const AxisTexts& axes, const std::string& direction) {
    return column_loop(axes_of(axes), direction);
  });
  module.def("cell_of", &cell_of);
}

}  // namespace kerf::python
