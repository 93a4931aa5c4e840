#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "linalg/file_error.h"

namespace cb {

/// A Matrix Market matrix, array or coordinate, real or integer, general, symmetric or skew-symmetric. Strict: an index
/// out of range, an entry given twice or on the wrong side of the diagonal, a number too many or too few is a
/// FileError.
Eigen::MatrixXd read_matrix_market(const std::string& file);
/// A column vector as a Matrix Market array; reading it gives the same doubles. Throws FileError.
void write_matrix_market(const std::string& file, std::span<const double> values);

}  // namespace cb
