// SPDX-License-Identifier: Apache-2.0
#include "include/kerf/log.hpp"

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/module/law.hpp"
#include "python/module/module.hpp"

namespace py = pybind11;

namespace kerf::python {
namespace {

std::vector<std::string> problems_of(const std::filesystem::path& folder) {
  const py::gil_scoped_release unlocked;
  return Log::open(folder).check();
}

/// The outcome, and the rows that were stepped if they are asked for, else None. With a function
/// the law `python` of the settings is it, and the interpreter stays locked.
py::tuple replay(const std::filesystem::path& folder, const Settings& settings,
                 const std::optional<py::function>& function, bool with_rows) {
  std::optional<LawFunction> law;
  if (function) law.emplace(*function);
  std::vector<TickRecord> rows;
  ReplayOutcome outcome;
  {
    std::optional<py::gil_scoped_release> unlocked;
    if (!law) unlocked.emplace();
    const LawInUse in_use(law ? &*law : nullptr);
    constexpr Tick kTicksBetweenSignals = 1000;
    const auto visit = [&](const TickRecord&, const TickRecord& replayed) {
      if (with_rows) rows.push_back(replayed);
      if (law && law->failed()) law->raise(replayed.tick);
      const bool asked = law && law->take_interrupt();
      if (!asked && replayed.tick % kTicksBetweenSignals != 0) return;
      std::optional<py::gil_scoped_acquire> locked;
      if (!law) locked.emplace();
      if (asked) throw_keyboard_interrupt();
      handle_signals();
    };
    outcome = Log::open(folder).replay(settings, visit);
  }
  py::object made = py::none();
  if (with_rows) {
    const py::array array(py::reinterpret_borrow<py::dtype>(row_type()),
                          std::vector{static_cast<py::ssize_t>(rows.size())});
    if (!rows.empty()) {
      std::memcpy(py::array(array).mutable_data(), rows.data(), rows.size() * sizeof(TickRecord));
    }
    made = array;
  }
  return py::make_tuple(outcome, made);
}

}  // namespace

void define_log(py::module_& module) {
  py::class_<ReplayDifference>(module, "ReplayDifference", "The first difference of a replay.")
      .def_readonly("tick", &ReplayDifference::tick)
      .def_readonly("arm", &ReplayDifference::arm)
      .def_readonly("stage", &ReplayDifference::stage,
                    "pose, safety, contact, force, cut, energy or output")
      .def_readonly("field", &ReplayDifference::field, "with its element: \"contact_force_n[1]\"")
      .def_readonly("recorded", &ReplayDifference::recorded)
      .def_readonly("replayed", &ReplayDifference::replayed);
  py::class_<ReplayOutcome>(module, "ReplayOutcome")
      .def_readonly("ticks", &ReplayOutcome::ticks)
      .def_readonly("output_hash", &ReplayOutcome::output_hash)
      .def_readonly("difference", &ReplayOutcome::difference)
      .def_readonly("cut_short", &ReplayOutcome::cut_short);
  module.def("problems_of", &problems_of);
  module.def("replay", &replay);
}

}  // namespace kerf::python
