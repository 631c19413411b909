#pragma once

#include <cstddef>
#include <functional>

#include <ensonify/refine/spare_threads.h>

namespace ensonify::refine {

/// Calls work(item, worker) once for each item in [0, items), on `threads` threads at most.
/// `worker` is in [0, threads) and no two running calls share one, so it can name a thread's own
/// scratch. After an exception no new item is started; the first one is rethrown here. Items start
/// in order. Those threads that have no item (left) are `spare` until the last one is done. Throws
/// std::invalid_argument if threads < 1.
void parallel_for(std::size_t items, int threads,
                  const std::function<void(std::size_t item, int worker)>& work,
                  SpareThreads* spare = nullptr);

/// How many threads to use: 1 to 1024, or for 0 as many as the machine has; others
/// std::invalid_argument.
int thread_count(int wanted);

}  // namespace ensonify::refine
