// With d_0 the last impulses and d_k+1 the change of d_k from event to event, order p expects d_0 + ... + d_p; by how
// much it was off the last time is d_p+1 (Newton's backward differences). Events are taken as equally far apart: where
// they are not, or a contact changes from sticking to slipping, a lower order foresaw more, and is taken.

#include "methods/expected_impulses.h"

#include <cmath>

namespace cb {

namespace {

constexpr double worth = 0.25;      // -: of what a lower order was off by, squared, that a higher one must come to
constexpr double rounding = 1e-12;  // -: change of an impulse, of itself, that says nothing of the next one

}  // namespace

void ExpectedImpulses::note(const std::vector<double>& impulse) {
  if (next_.size() != impulse.size()) {
    next_.resize(impulse.size());
    for (auto& difference : differences_) difference.assign(impulse.size(), 0.0);
    known_.assign(impulse.size() / 3, 0);
  }
  for (std::size_t c = 0; c < known_.size(); ++c) note(&impulse[3 * c], c);
}

void ExpectedImpulses::note(const double* impulse, std::size_t contact) {
  const std::size_t at = 3 * contact, known = known_[contact];
  std::array<double, 3> change{impulse[0], impulse[1], impulse[2]}, sum{};
  double least = HUGE_VAL, size2 = 0;
  for (std::size_t k = 0; k <= most; ++k) {
    double* d = &differences_[k][at];
    double off = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double before = d[i];
      d[i] = change[i];
      sum[i] += change[i];
      change[i] -= before;
      off += change[i] * change[i];
    }
    known_[contact] = static_cast<unsigned char>(k + 1);
    // Nobody knows yet by how much this order is off; or it would have been no better, and higher ones are left.
    if (k > 0 && (k == known || !(off < worth * least))) return;
    for (std::size_t i = 0; i < 3; ++i) next_[at + i] = sum[i];
    if (k == known) return;
    if (k == 0) size2 = sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2];
    if (off <= rounding * rounding * size2) return;
    least = off;
  }
}

}  // namespace cb
