#pragma once

// The Python module: what simulate.h and run.h offer, with NumPy arrays over the same memory. Each
// source adds one part of it.

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

/// The keys of a mapping with their values as TOML. `name` stands for it in messages.
std::vector<KeyValue> key_values(const py::handle& keys, std::string_view name);

/// The scene that a path or a mapping gives, with keys changed.
SessionScene scene_of(const py::object& given, const py::object& keys, const fs::path& data);

/// Releases the interpreter's lock while it exists, so that other threads can run Python.
///
/// When the interpreter ends, a thread that takes the lock again is ended inside of C++, which
/// aborts the program. So the interpreter first waits until no thread has an object of this class.
/// A thread that makes one after that waits until the process is gone, as Python's own threads do;
/// the thread that ends the interpreter does not wait.
class FreeInterpreter {
 public:
  FreeInterpreter();
  ~FreeInterpreter();
  FreeInterpreter(const FreeInterpreter&) = delete;
  FreeInterpreter& operator=(const FreeInterpreter&) = delete;

 private:
  PyThreadState* state_;
};
/// Throws what a signal's handler throws, and std::runtime_error in a thread that the interpreter's
/// end waits for. Needs the lock.
void check_interpreter();
/// For Preparation::stop_check: calls check_interpreter(), at most every 50 ms. Takes the
/// interpreter's lock.
std::function<void()> interpreter_check();

/// The folder for analysed seafloors: this one, or the default.
fs::path cache_of(const std::optional<fs::path>& cache);

/// A line that Python owns.
struct Line {
  std::string sonar;
  std::string_view sector_name;
  EchoLine line;
};

/// Whether Python has objects of the class. True for each class of this module.
template <class T>
inline constexpr bool is_class_of_module = false;
template <>
inline constexpr bool is_class_of_module<Pose> = true;
template <>
inline constexpr bool is_class_of_module<Line> = true;

/// Refuses to pickle and to copy objects of a class. (pybind11 ends the program if it is asked for
/// the oldest of pickle's protocols.)
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
/// EchoLine, Image and images().
void add_results(py::module_& module);
void add_recordings(py::module_& module);
void add_simulator(py::module_& module);

}  // namespace ensonify::python

/// How pybind11 finds the C++ object of a Python object. By itself it gives an object that
/// `Class.__new__(Class)` made memory without a value. Here such an object raises TypeError.
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
