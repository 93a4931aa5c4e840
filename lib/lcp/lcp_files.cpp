// What: stored LCPs: Matrix Market (linalg/matrix_market.h) and Siconos text.
// Fails with FileError: file, line, and what would be right.
#include "lcp/lcp_files.h"

#include "linalg/matrix_market.h"
#include "linalg/text_file.h"

namespace cb {

LcpProblem read_lcp_matrix_market(const std::string& matrix_file, const std::string& vector_file) {
  LcpProblem problem;
  problem.M = read_matrix_market(matrix_file);
  const auto n = problem.M.rows();
  if (n != problem.M.cols() || n == 0)
    throw FileError(matrix_file + ": the matrix is " + std::to_string(n) + " x " + std::to_string(problem.M.cols()) +
                    "; an LCP needs a square one");
  const Eigen::MatrixXd q = read_matrix_market(vector_file);
  if (q.rows() != n || q.cols() != 1)
    throw FileError(vector_file + ": the vector is " + std::to_string(q.rows()) + " x " + std::to_string(q.cols()) +
                    "; the matrix in " + matrix_file + " needs " + std::to_string(n) + " x 1");
  problem.q = q;
  return problem;
}

LcpProblem read_lcp_siconos(const std::string& path) {
  TextFile file(path);
  const long n = file.integer("number of unknowns", 1, lcp_file_unknowns);
  const auto M = read_siconos_matrix(file, "matrix");
  if (M.rows() != n || M.cols() != n)
    file.fail("the matrix is " + std::to_string(M.rows()) + " x " + std::to_string(M.cols()) + "; " +
              std::to_string(n) + " unknowns need it square of that size");
  LcpProblem problem;
  problem.M = M;
  problem.q.resize(n);
  for (long i = 0; i < n; ++i) problem.q[i] = file.number("q");
  return problem;
}

}  // namespace cb
