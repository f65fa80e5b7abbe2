// SPDX-License-Identifier: Apache-2.0
#include "python/module/module.hpp"

#include <cstring>
#include <exception>
#include <string>

#include <pybind11/numpy.h>

#include "include/kerf/scene.hpp"
#include "include/kerf/tick.hpp"

namespace py = pybind11;

namespace kerf::python {
namespace {

/// `error` as `kerf.Error`. Its text may have a file's name that is no UTF-8.
void set_error(const py::handle& type, const char* text) {
  PyObject* const line =
      PyUnicode_DecodeUTF8(text, static_cast<py::ssize_t>(std::strlen(text)), "backslashreplace");
  if (line == nullptr) return;
  PyErr_SetObject(type.ptr(), line);
  Py_DECREF(line);
}

}  // namespace

py::object row_type() {
  const py::object type = py::module_::import("kerf_reader.tick").attr("TICK");
  if (type.attr("itemsize").cast<std::size_t>() != sizeof(TickRecord)) {
    throw py::import_error("kerf: kerf_reader is of another version; install both of one");
  }
  return type;
}

void make_read_only(py::object& array) {
  array.attr("setflags")(py::arg("write") = false);
}

void handle_signals() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void throw_keyboard_interrupt() {
  PyErr_SetNone(PyExc_KeyboardInterrupt);
  throw py::error_already_set();
}

}  // namespace kerf::python

PYBIND11_MODULE(_kerf, module) {
  using namespace kerf::python;
  module.attr("__version__") = KERF_VERSION;
  static py::handle error = PyErr_NewExceptionWithDoc(
      "kerf.Error",
      "What is wrong with a file, a setting, an argument or a recording: one line, "
      "\"location: value; way out\".",
      PyExc_ValueError, nullptr);
  module.attr("Error") = error;
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const kerf::Error& line) {
      set_error(error, line.what());
    }
  });
  define_scene(module);
  define_law(module);
  define_device(module);
  define_loop(module);
  define_log(module);
  define_stability(module);
}
