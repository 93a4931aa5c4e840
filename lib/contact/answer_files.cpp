#include "contact/answer_files.h"

#include <fstream>

#include "contact/fclib_format.h"
#include "linalg/matrix_market.h"
#include "linalg/text_file.h"

namespace cb {

namespace {

std::string first_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(path + ": cannot be opened for reading; give the path of an existing file");
  std::string head(14, '\0');
  in.read(head.data(), static_cast<long>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

std::vector<double> from_matrix_market(const std::string& path, int nc) {
  Eigen::MatrixXd x = read_matrix_market(path);
  if (x.rows() == nc && x.cols() == 3 && nc != 1) x = x.transpose().eval();
  return {x.data(), x.data() + x.size()};
}

std::vector<double> from_text(const std::string& path) {
  TextFile file(path);
  std::vector<double> x;
  while (!file.at_end()) x.push_back(file.number("an impulse"));
  return x;
}

}  // namespace

std::vector<double> read_impulses(const std::string& path, int nc) {
  const std::string head = first_bytes(path);
  std::vector<double> r = head.starts_with("\x89HDF\r\n\x1a\n") ? read_fclib_impulses(path)
                          : head.starts_with("%%MatrixMarket")  ? from_matrix_market(path, nc)
                                                                : from_text(path);
  if (r.size() != 3 * static_cast<std::size_t>(nc))
    throw FileError(path + ": holds " + std::to_string(r.size()) + " impulses; " + std::to_string(nc) +
                    " contacts need " + std::to_string(3 * nc) + " (n, t1, t2 of each)");
  return r;
}

}  // namespace cb
