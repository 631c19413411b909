#pragma once

#include <cstddef>
#include <functional>

#include <ensonify/refine/spare_threads.h>

namespace ensonify::refine {

/// Calls work(item, worker) once for each item in [0, items), on at most `threads` threads.
/// `worker` is in [0, threads), and two running calls never have the same one, so it can select the
/// buffers of a thread. Items start in order. After an exception no new item starts, and the first
/// exception is rethrown. Threads without an item serve `spare` until the last item is done. Throws
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

/// The number of threads to use: `wanted` if it is 1 to 1024, the machine's number of threads if it
/// is 0. Throws std::invalid_argument for other values.
int thread_count(int wanted);

}  // namespace ensonify::refine
