#pragma once

#include <functional>

namespace cb {

/// for_each_item on two threads or more.
void for_each_item_at_once(int count, int threads, const std::function<void(int item, int worker)>& work);

/// Calls work(item, worker) once for each item below `count`, on up to `threads` threads at once; worker, below
/// `threads`, is the thread's own number. In any order: what is written has to be the item's or the worker's own.
/// Where work throws no more items begin, and what the lowest worker met is thrown again when those at hand are done.
/// Where the system has no more threads to give, there are fewer.
template <class Work>
void for_each_item(int count, int threads, const Work& work) {
  if (threads > 1 && count > 1) {
    for_each_item_at_once(count, threads, std::cref(work));
    return;
  }
  for (int item = 0; item < count; ++item) work(item, 0);
}

}  // namespace cb
