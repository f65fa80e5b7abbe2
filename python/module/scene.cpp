// SPDX-License-Identifier: Apache-2.0
#include "include/kerf/scene.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/module/module.hpp"

namespace py = pybind11;

namespace kerf::python {
namespace {

Scene of_voxels(const py::array& density, const std::array<double, 3>& spacing_mm,
                const std::string& text, const Settings& settings) {
  const auto refuse = [](const std::string& problem) { throw Error("density: " + problem); };
  if (density.ndim() != 3) {
    refuse(std::to_string(density.ndim()) + " axes; give an array [z, y, x]");
  }
  if (!density.dtype().is(py::dtype::of<std::uint16_t>())) {
    refuse(py::str(density.dtype()).cast<std::string>() +
           " numbers; give uint16, 0 for air to 65535 for full");
  }
  if ((density.flags() & py::array::c_style) == 0) {
    refuse("not in C order, x fastest; numpy.ascontiguousarray(density) keeps its indices");
  }
  constexpr py::ssize_t kMost = 1 << 20;  // above what a scene takes, below what an int holds
  for (int axis = 0; axis < 3; ++axis) {
    if (density.shape(axis) > kMost) refuse("too large; give up to 1024 voxels along each axis");
  }
  const Voxels voxels{{static_cast<int>(density.shape(2)), static_cast<int>(density.shape(1)),
                       static_cast<int>(density.shape(0))},
                      spacing_mm,
                      {static_cast<const std::uint16_t*>(density.data()),
                       static_cast<std::size_t>(density.size())}};
  const py::gil_scoped_release unlocked;
  return Scene::of_voxels(voxels, text, settings);
}

}  // namespace

void define_scene(py::module_& module) {
  using Unlocked = py::call_guard<py::gil_scoped_release>;
  py::class_<Scene>(module, "Scene")
      .def_static("load", &Scene::load, Unlocked())
      .def_static("parse", &Scene::parse, Unlocked())
      .def_static("of_voxels", &of_voxels)
      .def_property_readonly("arms", &Scene::arms)
      .def_property_readonly("rate_hz", &Scene::rate_hz)
      .def_property_readonly("volumes", &Scene::volumes)
      .def_property_readonly("tools", &Scene::tools)
      .def("over_budget", &Scene::over_budget, Unlocked())
      .def("explain", &Scene::explain, Unlocked())
      .def("json", &Scene::json);
}

}  // namespace kerf::python
