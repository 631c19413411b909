#include <ensonify/refine/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <ensonify/refine/standard_floats.h>

#ifdef ENSONIFY_EXECUTOR_TBB
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace ensonify::refine {
namespace {

/// Calls body(worker) for every worker in [0, workers), on as many threads as the system gives. The
/// number belongs to a call and not to a thread, so two running calls never have the same.
template <class Body>
void on_threads(int workers, const Body& body) {
  if (workers == 1) return body(0);
#ifdef ENSONIFY_EXECUTOR_TBB
  // TBB prints a warning if it is asked for more threads than it has.
  const std::size_t had =
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  tbb::task_arena arena(static_cast<int>(std::min(had, static_cast<std::size_t>(workers))));
  arena.execute([&] { tbb::parallel_for(0, workers, body, tbb::simple_partitioner()); });
#else
  std::vector<std::jthread> threads;
  threads.reserve(static_cast<std::size_t>(workers));
  try {
    for (int worker = 1; worker < workers; ++worker) threads.emplace_back(body, worker);
  } catch (const std::system_error&) {
    // The system gives no more threads, so the existing ones do the work.
  }
  body(0);
#endif
}

}  // namespace

void parallel_for(std::size_t items, int threads,
                  const std::function<void(std::size_t item, int worker)>& work,
                  SpareThreads* spare) {
  if (threads < 1) throw std::invalid_argument("parallel_for: threads must be at least 1");
  std::atomic<std::size_t> next = 0;
  std::exception_ptr first;
  std::mutex first_mutex;
  const auto pull = [&](int worker) {
    const StandardFloats floats;  // TBB may have started this thread for another caller
    if (spare) spare->begin_items();
    try {
      for (std::size_t item; (item = next++) < items;) work(item, worker);
    } catch (...) {
      next = items;
      const std::lock_guard lock(first_mutex);
      if (!first) first = std::current_exception();
    }
    if (spare) spare->serve();
  };
  const auto most = static_cast<std::size_t>(threads);
  if (items > 0) on_threads(static_cast<int>(spare ? most : std::min(items, most)), pull);
  if (first) std::rethrow_exception(first);
}

int thread_count(int wanted) {
  constexpr int most = 1024;
  if (wanted < 0 || wanted > most)
    throw std::invalid_argument("threads is " + std::to_string(wanted) + ", expected 1 to " +
                                std::to_string(most) + ", or 0 for the machine's number");
  return wanted > 0 ? wanted : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

}  // namespace ensonify::refine
