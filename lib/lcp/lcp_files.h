#pragma once

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

}  // namespace cb
