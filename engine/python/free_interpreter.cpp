#include <pthread.h>

#include <chrono>
#include <thread>

#include "module.h"

namespace ensonify::python {
namespace {

// Both are read and written with the interpreter's lock held.
bool ending = false;
int running = 0;

}  // namespace

FreeInterpreter::FreeInterpreter() {
  if (ending) return;
  ++running;
  state_ = PyEval_SaveThread();
}

FreeInterpreter::~FreeInterpreter() {
  if (!state_) return;
  PyEval_RestoreThread(state_);
  --running;
}

void check_interpreter() {
  if (ending) throw std::runtime_error("the interpreter is ending");
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void add_ending(py::module_&) {
  py::module_::import("atexit").attr("register")(py::cpp_function([] {
    ending = true;
    while (running > 0) {
      const py::gil_scoped_release unlocked;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }));
  // A child of fork() has only the thread that called it.
  pthread_atfork(nullptr, nullptr, [] { running = 0; });
}

}  // namespace ensonify::python
