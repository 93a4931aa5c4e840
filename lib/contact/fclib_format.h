#pragma once

#include <Eigen/SparseCore>
#include <optional>
#include <string>
#include <vector>

#include "linalg/file_error.h"

namespace cb {

/// What an FCLIB file holds, unjudged but for sizes and finite numbers.
///   global: M v = H r + f, u = H^T v + w       local: u = W r + q
struct FclibContent {
  bool global = false;
  Eigen::SparseMatrix<double> M, H;  ///< global: nv x nv, nv x 3 nc; explicit zeros are kept
  std::vector<double> f, w;          ///< global: nv, 3 nc
  Eigen::SparseMatrix<double> W;     ///< local: 3 nc x 3 nc
  std::vector<double> q;             ///< local: 3 nc
  std::vector<double> mu;            ///< nc

  /// An answer, /solution: written where r is given, never read with the problem.
  std::vector<double> v, u, r;  ///< nv, 3 nc, 3 nc

  // The group /contactbench, beside the problem's own; empty where it is not there.
  std::vector<double> v_minus;      ///< nv
  std::vector<double> restitution;  ///< nc
  std::vector<int> first;           ///< first row of each block of M, and the order at the end
};

/// Throws FileError; also where this build has no HDF5.
FclibContent read_fclib(const std::string& path);
/// The impulses of /solution (r: n, t1, t2 contact by contact, N s). Throws FileError.
std::vector<double> read_fclib_impulses(const std::string& path);
/// Writes a global problem through a file beside it that is renamed at the end. Throws FileError. Same content, same
/// bytes.
void write_fclib(const std::string& path, const FclibContent& content, const std::string& title,
                 const std::string& description);

}  // namespace cb
