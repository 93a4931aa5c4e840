#pragma once

#include <Eigen/Core>
#include <span>

namespace cb {

/// True where no entry is NaN or infinite.
inline bool all_finite(std::span<const double> x) {
  return (Eigen::Map<const Eigen::ArrayXd>(x.data(), static_cast<Eigen::Index>(x.size())) * 0.0).sum() == 0.0;
}

}  // namespace cb
