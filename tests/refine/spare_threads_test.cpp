#include <ensonify/refine/spare_threads.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "support/catch.h"
#include "support/spare_thread.h"

#include <ensonify/refine/parallel_for.h>

using ensonify::refine::parallel_for;
using ensonify::refine::SpareThreads;
using ensonify::tests::SpareThread;

TEST_CASE("A background task is done by the spare thread each time it is sent") {
  SpareThread spare;
  std::thread::id its;
  int done = 0, finished = 0;
  SpareThreads::BackgroundTask task([&] {
    its = std::this_thread::get_id();
    ++done;
  });
  for (int i = 0; i < 100; ++i) {
    task.send(spare.threads);
    CHECK(task.is_out());
    spare.settle();
    finished += task.finish();
    CHECK_FALSE(task.is_out());
    CHECK_FALSE(task.finish());
  }
  CHECK(done == 100);
  CHECK(finished == 100);
  CHECK(its != std::this_thread::get_id());
}

TEST_CASE("A background task is either done or taken back, and finish() returns which") {
  SpareThread spare;
  std::atomic<int> miscounted = 0, sent = 0;
  const auto send_often = [&] {
    int done = 0;
    SpareThreads::BackgroundTask task([&] { ++done; });
    for (int i = 0; i < 3000; ++i) {
      const int before = done;
      task.send(spare.threads);
      sent += task.is_out();
      const int finished = task.finish();
      miscounted += done != before + finished;
    }
  };
  std::thread other(send_often);
  send_often();
  other.join();
  CHECK(miscounted == 0);
  CHECK(sent > 0);
}

TEST_CASE("Without a spare thread no background task is sent: outside loops and on one thread") {
  SpareThreads spare;
  SpareThreads::BackgroundTask task([] { FAIL("was done"); });
  task.send(spare);
  CHECK_FALSE(task.is_out());
  parallel_for(
      3, 1,
      [&](std::size_t, int) {
        task.send(spare);
        CHECK_FALSE(task.is_out());
      },
      &spare);
  CHECK_FALSE(task.finish());
}

TEST_CASE("A loop lends its idle threads, and ends even if a background task is still offered") {
  if (std::thread::hardware_concurrency() < 2) {
    WARN("skipped: the machine has one core");
    return;
  }
  for (const bool throws : {false, true}) {
    SpareThreads spare;
    std::atomic<int> done = 0;
    SpareThreads::BackgroundTask task([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      ++done;
    });
    const auto item = [&](std::size_t, int) {
      while (!spare.any()) std::this_thread::yield();
      task.send(spare);
      if (throws) throw std::runtime_error("item");
    };
    if (throws)
      CHECK_THROWS_WITH(parallel_for(1, 2, item, &spare), "item");
    else
      parallel_for(1, 2, item, &spare);
    const int then = done;
    CHECK(task.finish() == (then == 1));
    CHECK(done == then);
    CHECK_FALSE(spare.any());
  }
}
