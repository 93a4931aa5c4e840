#pragma once

#include <atomic>
#include <exception>

namespace cb {

/// Ends whatever is being computed, from within, as bad_alloc does: only app/ catches it.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped"; }
};

/// One for the process, as its signals are: set by a signal, by the timer of a limit, by a look at memory
/// (app/limits.h). What a signal handler may set has no lock.
inline std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// Stands in every loop whose body may take long or whose end no small number bounds, so that a stop is heard within a
/// tenth of a second. One load, no clock: results cannot depend on it.
inline void poll_stop() {
  if (stop_asked.load(std::memory_order_relaxed)) [[unlikely]]
    throw Stopped();
}

}  // namespace cb
