#pragma once

// The Python module: the functions of simulate.h and run.h. Its NumPy arrays use the memory of C++.
// Each source file adds one part of the module.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulate.h>

namespace ensonify::python {

namespace py = pybind11;
namespace fs = std::filesystem;
using namespace engine;

/// The keys of a Python mapping, with values as TOML. `name` is the mapping's name in messages.
std::vector<KeyValue> key_values(const py::handle& keys, std::string_view name);

/// The scene of a path or a mapping, with changed keys.
SessionScene scene_of(const py::object& given, const py::object& keys, const fs::path& data);

/// Releases the interpreter's lock while it exists, so that other threads can run Python.
///
/// After the interpreter has ended, Python ends a thread that takes the lock again. If that happens
/// inside C++, the program aborts. So the interpreter first waits until no thread has an object of
/// this class. A thread that makes such an object later waits until the process is gone, as
/// Python's own threads do. The thread that ends the interpreter does not wait.
class FreeInterpreter {
 public:
  FreeInterpreter();
  ~FreeInterpreter();
  FreeInterpreter(const FreeInterpreter&) = delete;
  FreeInterpreter& operator=(const FreeInterpreter&) = delete;

 private:
  PyThreadState* state_;
};
/// Throws what a signal's handler throws, and std::runtime_error in a thread for which the ending
/// interpreter waits. The caller must have the interpreter's lock.
void check_interpreter();
/// For Preparation::stop_check: a function that takes the interpreter's lock and calls
/// check_interpreter(), at most every 50 ms.
std::function<void()> interpreter_check();

/// The folder for analysed seafloors: `cache`, or the default folder.
fs::path cache_of(const std::optional<fs::path>& cache);

/// An echo line that Python owns.
struct Line {
  std::string sonar;
  std::string_view sector_name;
  EchoLine line;
};

/// Whether Python has objects of a C++ class. Each class of this module sets it to true.
template <class T>
inline constexpr bool is_class_of_module = false;
template <>
inline constexpr bool is_class_of_module<Pose> = true;
template <>
inline constexpr bool is_class_of_module<Line> = true;

/// Objects of the class then refuse to be pickled and copied. (Without this, pybind11 ends the
/// program if it is asked for pickle's oldest protocol.)
template <class T>
void refuse_pickle(py::class_<T>& type, const char* remedy) {
  type.def("__reduce_ex__", [remedy](const py::object& self, int) -> py::object {
    const std::string name = py::str(py::type::of(self).attr("__name__"));
    throw py::type_error(name + " cannot be pickled or copied; " + remedy);
  });
}

std::vector<std::string> layer_names();

void add_ending(py::module_& module);
void add_pose(py::module_& module);
/// Adds EchoLine, Image and images().
void add_results(py::module_& module);
void add_recordings(py::module_& module);
void add_simulator(py::module_& module);

}  // namespace ensonify::python

/// How pybind11 finds the C++ object of a Python object. pybind11 itself returns memory without a
/// value for an object that was made by `Class.__new__(Class)`. Here it raises TypeError.
template <class T>
class pybind11::detail::type_caster<T, std::enable_if_t<ensonify::python::is_class_of_module<T>>>
    : public type_caster_base<T> {
 public:
  bool load(handle object, bool convert) {
    if (isinstance<T>(object) &&
        !reinterpret_cast<instance*>(object.ptr())->get_value_and_holder().holder_constructed())
      throw type_error("this object was made without " +
                       str(type::of(object).attr("__name__")).cast<std::string>() +
                       "(...), so it has no value");
    return type_caster_base<T>::load(object, convert);
  }
};
