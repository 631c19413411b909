#pragma once

#include <cstddef>
#include <functional>

#include <ensonify/refine/spare_threads.h>

namespace ensonify::refine {

/// Calls work(item, worker) once for each item in [0, items), on at most `threads` threads.
/// `worker` is in [0, threads) and no two running calls share one, so it can select a thread's own
/// buffers. Items start in order. After an exception no new item starts, and the first exception is
/// rethrown. Threads that have no item (left) serve `spare` until the last item is done. Throws
/// std::invalid_argument if threads < 1.
void parallel_for(std::size_t items, int threads,
                  const std::function<void(std::size_t item, int worker)>& work,
                  SpareThreads* spare = nullptr);

/// Calls work(begin, end) for equal parts of [0, items), one per thread.
template <class Work>
void for_parts(std::size_t items, int threads, const Work& work) {
  const auto parts = static_cast<std::size_t>(threads);
  parallel_for(parts, threads, [&](std::size_t part, int) {
    work(items * part / parts, items * (part + 1) / parts);
  });
}

/// The number of threads to use: `wanted` in 1 to 1024, or for 0 the machine's number. Throws
/// std::invalid_argument for other values.
int thread_count(int wanted);

}  // namespace ensonify::refine
