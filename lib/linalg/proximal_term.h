#pragma once

#include <algorithm>
#include <cmath>

namespace cb {

/// t of proximal points: falls by tenths as long as each is found, more slowly after one that was not, and rises from
/// where none is.
class ProximalTerm {
 public:
  /// Points are worth looking for above `least`.
  explicit ProximalTerm(double least) : least_(least) {}
  double operator()() const { return t_; }
  /// No t is left: the points are those of rounding, or none is found however near.
  bool over() const { return !(t_ > least_ && t_ < most); }
  void found() {
    found_at_ = t_;
    t_ *= falls_;
    falls_ = std::max(fastest, falls_ * falls_);
  }
  void missed() {
    falls_ = std::min(slowest, std::sqrt(falls_));
    t_ = t_ < found_at_ ? std::min(found_at_, grows * t_) : grows * t_;
  }

 private:
  static constexpr double first = 0.1, most = 1e3, fastest = 0.1, slowest = 0.8, grows = 3;
  double least_, t_ = first, found_at_ = HUGE_VAL, falls_ = fastest;
};

}  // namespace cb
