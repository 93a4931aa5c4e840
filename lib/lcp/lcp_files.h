#pragma once

#include <span>
#include <string>

#include "lcp/lcp.h"
#include "linalg/file_error.h"

namespace cb {

/// Largest n of an LCP that is read: its matrix is kept dense (8 n^2 bytes).
inline constexpr long lcp_file_unknowns = 10'000;

/// LCP from two Matrix Market files: M (n x n) and q (n x 1). Throws FileError.
LcpProblem read_lcp_matrix_market(const std::string& matrix_file, const std::string& vector_file);
/// LCP in the text form of Siconos: n, matrix, q; what follows is comment. Throws FileError.
LcpProblem read_lcp_siconos(const std::string& file);

/// A Matrix Market matrix, array or coordinate, real or integer, general, symmetric or skew-symmetric. Strict: an index
/// out of range, an entry given twice or on the wrong side of the diagonal, a number too many or too few is a
/// FileError.
Eigen::MatrixXd read_matrix_market(const std::string& file);
/// A column vector as a Matrix Market array; reading it gives the same doubles. Throws FileError.
void write_matrix_market(const std::string& file, std::span<const double> values);

}  // namespace cb
