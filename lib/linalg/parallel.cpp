#include "linalg/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

namespace cb {

void for_each_item_at_once(int count, int threads, const std::function<void(int item, int worker)>& work) {
  threads = std::min(threads, count);
  std::atomic<int> next{0};
  std::vector<std::exception_ptr> thrown(threads);
  const auto take_items = [&](int worker) {
    try {
      for (int item = next++; item < count; item = next++) work(item, worker);
    } catch (...) {
      thrown[worker] = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> others;
    try {
      for (int worker = 1; worker < threads; ++worker) others.emplace_back(take_items, worker);
    } catch (const std::system_error&) {  // the system has no more
    }
    take_items(0);
  }
  for (const std::exception_ptr& what : thrown)
    if (what) std::rethrow_exception(what);
}

}  // namespace cb
