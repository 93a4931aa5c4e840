#include "linalg/parallel.h"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace cb;

TEST_CASE("each item is worked on once, by no more threads than there are items") {
  for (const int count : {0, 1, 2, 3, 1000})
    for (const int threads : {1, 2, 7}) {
      INFO(count << " items on " << threads << " threads");
      std::vector<int> times(count, 0), by(count, -1);
      for_each_item(count, threads, [&](int item, int worker) {
        ++times[item];
        by[item] = worker;
      });
      CHECK(std::count(times.begin(), times.end(), 1) == count);
      CHECK(std::all_of(by.begin(), by.end(), [&](int w) { return 0 <= w && w < std::min(threads, count); }));
    }
}

TEST_CASE("two threads are at work at once") {
  std::atomic<int> begun{0};
  bool met[2] = {false, false};
  for_each_item(2, 2, [&](int item, int) {
    ++begun;
    for (long i = 0; i < 4'000'000'000 && !met[item]; ++i) met[item] = begun == 2;
  });
  CHECK(met[0]);
  CHECK(met[1]);
}

TEST_CASE("what an item throws ends the work and is thrown again") {
  for (const int threads : {1, 2}) {
    INFO(threads << " threads");
    std::atomic<int> begun{0};
    const auto work = [&](int item, int) {
      ++begun;
      if (item == 3) throw std::runtime_error("the fourth");
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    CHECK_THROWS_WITH(for_each_item(2000, threads, work), "the fourth");
    CHECK(begun < 1000);
  }
}

// More of each length than is kept, so that some of it is new.
TEST_CASE("all memory begins on a line of the cache") {
  std::vector<std::vector<std::unique_ptr<std::byte[]>>> held;
  for (const std::size_t size : {1, 24, 64, 100, 1000, 4096, 10'000}) {
    held.emplace_back();
    for (int i = 0; i < 100; ++i) {
      held.back().push_back(std::make_unique<std::byte[]>(size));
      CHECK(reinterpret_cast<std::uintptr_t>(held.back().back().get()) % 64 == 0);
    }
  }
}
