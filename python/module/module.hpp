// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include "include/kerf/scene.hpp"

// `kerf._kerf`: include/kerf for Python. It has what needs C++; python/kerf/ has defaults, names of
// files and the docstrings that users read.

namespace kerf::python {

/// The type of a row, `kerf_reader.tick.TICK`. Throws ImportError if it is not that of
/// `TickRecord`.
[[nodiscard]] pybind11::object row_type();

/// Makes an attribute of a NumPy array that nobody may write through.
void make_read_only(pybind11::object& array);

/// Throws what a signal's handler raised: of Ctrl-C, KeyboardInterrupt. With the interpreter's
/// lock.
void handle_signals();
[[noreturn]] void throw_keyboard_interrupt();

void define_scene(pybind11::module_& module);
void define_law(pybind11::module_& module);
void define_device(pybind11::module_& module);
void define_loop(pybind11::module_& module);
void define_log(pybind11::module_& module);
void define_stability(pybind11::module_& module);

}  // namespace kerf::python
