#include "module.h"

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/recording/recording_reader.h>

namespace ensonify::python {
namespace {

/// The exceptions. Those of C++ that have no class here become an Error.
void add_exceptions(py::module_& module) {
  const auto doc = [](auto& exception, const char* text) { exception.doc() = text; };
  auto& base = py::register_exception<Error>(module, "Error", PyExc_Exception);
  doc(base, "The base of the exceptions of this module.");
  const auto and_base = [&](PyObject* other) {
    return py::make_tuple(py::handle(base), py::handle(other));
  };
  doc(py::register_exception<SceneError>(module, "SceneError", and_base(PyExc_ValueError)),
      "Something is wrong with a scene or a file it names.");
  doc(py::register_exception<RecordingError>(module, "RecordingError", and_base(PyExc_ValueError)),
      "Something is wrong with a recording.");
  doc(py::register_exception<refine::MeshError>(module, "MeshError", and_base(PyExc_ValueError)),
      "Something is wrong with a mesh.");
  doc(py::register_exception<engine::MemoryError>(module, "MemoryError",
                                                  and_base(PyExc_MemoryError)),
      "A scene does not fit into memory: what needs how much, the limit and the cure.");
}

}  // namespace
}  // namespace ensonify::python

using namespace ensonify::python;

PYBIND11_MODULE(_ensonify, module) {
  py::options options;
  options.disable_function_signatures();  // the docstrings have Python's own
  add_ending(module);
  add_exceptions(module);
  module.attr("layers") = layer_names();
  module.attr("__version__") = ensonify::engine::program_version();
  add_pose(module);
  add_results(module);
  add_simulator(module);
  add_recordings(module);
}
