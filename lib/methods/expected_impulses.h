#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace cb {

/// Impulses that the next event is expected to have, from those of the events before: of each contact the polynomial
/// through its last events, of the order that would have foreseen the last of them best. What stays as it was is
/// expected to stay, to the last bit; what turns steadily, to turn on.
class ExpectedImpulses {
 public:
  /// Notes the impulses of an event (3 nc, N s). Of another size than those before: these are forgotten.
  void note(const std::vector<double>& impulse);
  /// 3 nc, N s; of no size where nothing is known.
  const std::vector<double>& next() const { return next_; }

 private:
  void note(const double* impulse, std::size_t contact);

  static constexpr std::size_t most = 3;  // -: order; beyond it rounding of the differences outweighs what they foresee

  std::array<std::vector<double>, most + 1> differences_;  // backward, 3 nc: [0] is the last event itself
  std::vector<unsigned char> known_;                       // nc: how many of them
  std::vector<double> next_;
};

}  // namespace cb
