#include <pthread.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>

#include "module.h"

namespace ensonify::python {
namespace {

using Clock = std::chrono::steady_clock;

// Both are used only by threads that hold the interpreter's lock.
std::optional<std::thread::id> ends_in;  // the thread that ends the interpreter
int running = 0;

bool is_too_late() { return ends_in && *ends_in != std::this_thread::get_id(); }

}  // namespace

FreeInterpreter::FreeInterpreter() {
  const bool too_late = is_too_late();
  if (!too_late) ++running;
  state_ = PyEval_SaveThread();
  if (too_late)
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

FreeInterpreter::~FreeInterpreter() {
  PyEval_RestoreThread(state_);
  --running;
}

void check_interpreter() {
  if (is_too_late()) throw std::runtime_error("the interpreter is ending");
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

std::function<void()> interpreter_check() {
  using namespace std::chrono_literals;
  const auto due = std::make_shared<std::atomic<Clock::time_point>>(Clock::now());
  return [due] {
    const Clock::time_point now = Clock::now();
    if (now < due->load()) return;
    due->store(now + 50ms);
    const py::gil_scoped_acquire locked;
    check_interpreter();
  };
}

void add_ending(py::module_&) {
  py::module_::import("atexit").attr("register")(py::cpp_function([] {
    ends_in = std::this_thread::get_id();
    while (running > 0) {
      const py::gil_scoped_release unlocked;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }));
  // The child of a fork() has only the thread that called fork().
  pthread_atfork(nullptr, nullptr, [] { running = 0; });
}

}  // namespace ensonify::python
