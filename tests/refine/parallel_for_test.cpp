#include <ensonify/refine/parallel_for.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.h"

using ensonify::refine::parallel_for;

TEST_CASE("Every item is done once, by a worker that no other running call has") {
  for (const int threads : {1, 2, 3, 8}) {
    constexpr std::size_t items = 3000;
    std::vector<std::atomic<int>> done(items);
    std::vector<std::atomic<bool>> busy(static_cast<std::size_t>(threads));
    std::atomic<int> shared = 0, out_of_range = 0;
    parallel_for(items, threads, [&](std::size_t item, int worker) {
      if (worker < 0 || worker >= threads) {
        ++out_of_range;
        return;
      }
      std::atomic<bool>& mine = busy[static_cast<std::size_t>(worker)];
      if (mine.exchange(true)) ++shared;
      ++done[item];
      if (item % 100 == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
      mine = false;
    });
    CHECK(out_of_range == 0);
    CHECK(shared == 0);
    int wrong = 0;
    for (const std::atomic<int>& count : done) wrong += count != 1;
    CHECK(wrong == 0);
  }
}

TEST_CASE("Items start in order, except those already taken by other workers") {
  constexpr int threads = 4;
  std::atomic<int> started = 0, early = 0;
  parallel_for(20'000, threads, [&](std::size_t item, int) {
    if (started++ + (threads - 1) < static_cast<int>(item)) ++early;
  });
  CHECK(early == 0);
}

TEST_CASE("Two threads really run at once") {
  std::atomic<int> arrived = 0;
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  parallel_for(2, 2, [&](std::size_t, int) {
    ++arrived;
    while (arrived < 2 && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
  });
  if (std::thread::hardware_concurrency() < 2)
    WARN("skipped: the machine has one core");
  else
    CHECK(std::chrono::steady_clock::now() < give_up);
}

TEST_CASE("One thread is the calling thread, and goes through the items in order") {
  std::vector<std::size_t> order;
  bool elsewhere = false;
  parallel_for(5, 1, [&, caller = std::this_thread::get_id()](std::size_t item, int worker) {
    order.push_back(item);
    elsewhere = elsewhere || worker != 0 || std::this_thread::get_id() != caller;
  });
  CHECK(order == std::vector<std::size_t>{0, 1, 2, 3, 4});
  CHECK_FALSE(elsewhere);
}

TEST_CASE("The first exception is rethrown, and no new item starts after it") {
  std::atomic<int> started = 0;
  const auto fail_at_7 = [&](std::size_t item, int) {
    ++started;
    if (item == 7) throw std::runtime_error("item 7");
    if (item > 7) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  CHECK_THROWS_WITH(parallel_for(1000, 1, fail_at_7), "item 7");
  CHECK(started == 8);
  started = 0;
  CHECK_THROWS_WITH(parallel_for(100'000, 4, fail_at_7), "item 7");
  CHECK(started < 1000);

  started = 0;
  CHECK_THROWS_AS(parallel_for(100'000, 4,
                               [&](std::size_t item, int) {
                                 ++started;
                                 throw std::out_of_range(std::to_string(item));
                               }),
                  std::out_of_range);
  CHECK(started <= 4);
}

TEST_CASE("A loop within a loop ends") {
  std::atomic<int> done = 0;
  parallel_for(20, 3,
               [&](std::size_t, int) { parallel_for(50, 3, [&](std::size_t, int) { ++done; }); });
  CHECK(done == 1000);
}

TEST_CASE("No items means no work, and no threads is refused") {
  parallel_for(0, 4, [](std::size_t, int) { FAIL("was called"); });
  CHECK_THROWS_AS(parallel_for(1, 0, [](std::size_t, int) {}), std::invalid_argument);
}
