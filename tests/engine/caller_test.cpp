// A Simulator does not depend on what its caller has set, and answers a caller that stops or forks.

#include <algorithm>
#include <cfenv>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif
#include <sys/wait.h>
#include <unistd.h>

#include "support/catch.h"
#include "support/session_scenes.h"

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::bare_scene;
using tests::beside;
using tests::numbers;

namespace {

/// All numbers of a session's ping and of a track on two threads.
std::vector<double> results() {
  Scene scene = bare_scene();
  scene.track.pings = 6;
  scene.track.altitude_m = 8.0;
  scene.run.block_pings = 2;
  const Scene usual = scene;
  Simulator simulator(scene);
  std::vector<double> all = numbers(simulator.ping(beside));
  scene.sonars.front().frequency_hz = 2e6;  // echoes that the water absorbs to denormal numbers
  scene.sonars.front().range_m = 3000.0;
  scene.arrivals.surface = true;
  for (const double value : numbers(Simulator(scene).ping(beside))) all.push_back(value);
  scene = usual;
  for (const Waterfall& waterfall : ping_all(scene, simulator, 2).images)
    for (const float value : waterfall.pixels.intensity) all.push_back(value);
  return all;
}

/// A check that waits, at its next call, until it is let go.
class Gate {
 public:
  void operator()() {
    std::unique_lock lock(mutex_);
    if (!closed_) return;
    waits_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return !closed_; });
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  void wait_for_a_caller() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waits_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    closed_ = false;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool closed_ = false, waits_ = false;
};

/// What a child of fork() returns of `of`.
template <class F>
int in_a_child(F&& of) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);  // a child that hangs
    _exit(of());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

template <class F>
bool refuses(F&& call) {
  try {
    call();
  } catch (const std::runtime_error&) {
    return true;
  }
  return false;
}

}  // namespace

TEST_CASE("a caller's rounding mode changes no number, and stays") {
  const std::vector<double> usual = results();
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    std::fesetround(mode);
    const std::vector<double> found = results();
    const int after = std::fegetround();
    std::fesetround(FE_TONEAREST);
    CHECK(after == mode);
    CHECK(std::equal(found.begin(), found.end(), usual.begin(), usual.end()));
  }
}

#if defined(__SSE__)
TEST_CASE("a caller that flushes denormal numbers to zero changes no number, and goes on so") {
  const std::vector<double> usual = results();
  constexpr unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x40;
  const unsigned before = _mm_getcsr(), set = before | flush_to_zero | denormals_are_zero;
  _mm_setcsr(set);
  const std::vector<double> found = results();
  const unsigned after = _mm_getcsr();
  _mm_setcsr(before);
  constexpr unsigned flags = 0x3f;  // of what has happened
  CHECK((after & ~flags) == (set & ~flags));
  CHECK(std::equal(found.begin(), found.end(), usual.begin(), usual.end()));
}
#endif

#if defined(__GLIBC__)
TEST_CASE("a caller's floating-point traps do not end the program, and stay") {
  const std::vector<double> usual = results();
  constexpr int traps = FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW | FE_UNDERFLOW | FE_INEXACT;
  const int status = in_a_child([&] {  // a trap would end this program
    feenableexcept(traps);
    const std::vector<double> found = results();
    if (fegetexcept() != traps) return 1;
    fedisableexcept(traps);
    return std::equal(found.begin(), found.end(), usual.begin(), usual.end()) ? 0 : 2;
  });
  CHECK(status == 0);
}
#endif

TEST_CASE("a child of fork() uses its parent's Simulator, unless a thread was in a call of it") {
  Gate gate;
  Simulator simulator(bare_scene(), {.stop_check = [&] { gate(); }});
  Simulator clone = simulator.clone_for_thread();
  const std::vector<double> usual = numbers(simulator.ping_numbered(beside, 0));
  CHECK(in_a_child([&] { return numbers(clone.ping_numbered(beside, 0)) == usual ? 0 : 1; }) == 0);
  gate.close();
  std::thread pings([&] { simulator.ping_numbered(beside, 1); });
  gate.wait_for_a_caller();
  CHECK(in_a_child([&] {
          if (!refuses([&] { simulator.ping_numbered(beside, 0); })) return 1;
          if (!refuses([&] { clone.ping_numbered(beside, 0); })) return 2;
          if (!refuses([&] { (void)clone.clone_for_thread(); })) return 3;
          Simulator own(bare_scene());
          return numbers(own.ping_numbered(beside, 0)) == usual ? 0 : 4;
        }) == 0);
  gate.open();
  pings.join();
  CHECK(numbers(simulator.ping_numbered(beside, 0)) == usual);
}

TEST_CASE("the stop check is called for each weight of the scatterers and for each beam") {
  const auto calls_for = [](int beams) {
    Scene scene = bare_scene();
    scene.speckle = true;
    scene.sonars.front().beams = beams;
    scene.sonars.front().beam_spacing_m = 0.1;
    int calls = 0;
    const Simulator simulator(scene, {.stop_check = [&] { ++calls; }});
    return calls;
  };
  const int one = calls_for(1), nine = calls_for(9);
  CHECK(one > 128);  // half a beam of at least eight cells, in steps of a 32nd of a cell
  CHECK(nine >= one + 8);
}

TEST_CASE("the stop check ends the making of a long track") {
  Scene scene = bare_scene();
  scene.track.pings = 20000;
  scene.track.speed_mps = 0.001;
  scene.track.altitude_m = 8.0;
  bool stops = false;
  int calls = 0;
  const Simulator simulator(scene, {.stop_check = [&] {
                              ++calls;
                              if (stops) throw std::domain_error("stopped");
                            }});
  calls = 0;
  CHECK(simulator.track().size() == 20000);
  CHECK(calls >= 20);  // of each of several loops over the pings
  stops = true;
  CHECK_THROWS_AS(simulator.track(), std::domain_error);
}
