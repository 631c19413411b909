#include "module.h"

#include <exception>
#include <stdexcept>
#include <system_error>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/refine/printable.h>

namespace ensonify::python {
namespace {

/// Sets the Python error. The text may contain a path, whose bytes need not be UTF-8 and may
/// control a terminal, so it is made printable.
void raise(const py::handle& type, const std::exception& error) {
  PyErr_SetString(type.ptr(), refine::printable(error.what()).c_str());
}

/// Exceptions of this C++ class become the Python type, as do those of derived classes for which no
/// later call sets another type.
template <class Exception>
void translate(const py::handle& type) {
  static py::handle python_type;
  python_type = type.inc_ref();
  // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 asks for this parameter
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Exception& error) {
      raise(python_type, error);
    }
  });
}

template <class Exception>
py::object add_exception(py::module_& module, const char* name, const py::handle& bases,
                         const char* doc) {
  py::exception<Exception> type(module, name, bases);
  type.doc() = doc;
  translate<Exception>(type);
  return type;
}

/// Adds the exceptions. A C++ exception derived from Error without a class here becomes an Error.
void add_exceptions(py::module_& module) {
  translate<std::system_error>(PyExc_RuntimeError);
  translate<std::invalid_argument>(PyExc_ValueError);
  const py::object base = add_exception<Error>(module, "Error", PyExc_Exception,
                                               "The base of the exceptions of this module.");
  const auto and_base = [&](PyObject* other) { return py::make_tuple(base, py::handle(other)); };
  add_exception<SceneError>(module, "SceneError", and_base(PyExc_ValueError),
                            "Something is wrong with a scene or a file it names.");
  add_exception<RecordingError>(module, "RecordingError", and_base(PyExc_ValueError),
                                "Something is wrong with a recording.");
  add_exception<refine::MeshError>(module, "MeshError", and_base(PyExc_ValueError),
                                   "Something is wrong with a mesh.");
  add_exception<engine::MemoryError>(
      module, "MemoryError", and_base(PyExc_MemoryError),
      "A scene does not fit into memory. The message states what needs memory, how much it needs, "
      "the limit, and what to change.");
}

}  // namespace
}  // namespace ensonify::python

using namespace ensonify::python;

PYBIND11_MODULE(_ensonify, module) {
  py::options options;
  options.disable_function_signatures();  // the docstrings have signatures of Python
  add_ending(module);
  add_exceptions(module);
  module.attr("layers") = layer_names();
  module.attr("__version__") = ensonify::engine::program_version();
  add_pose(module);
  add_results(module);
  add_simulator(module);
  add_recordings(module);
}
