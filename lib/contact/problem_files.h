#pragma once

#include <Eigen/SparseCore>
#include <string>
#include <string_view>
#include <vector>

#include "contact/problem.h"
#include "linalg/file_error.h"

namespace cb {

/// Can FCLIB files be read and written by this build? The reason where they cannot; empty where they can.
bool fclib_available();
std::string_view fclib_unavailable_reason();

struct ProblemFileOptions {
  /// Take W for its nearest symmetric positive semidefinite matrix: without, an unsymmetric or indefinite one is
  /// refused.
  bool symmetrise = false;
  /// max |W - W^T| / max |W| that counts as rounding, -; larger: more is averaged away without being asked for.
  double symmetry_tolerance = 1e-12;
  /// -(smallest eigenvalue of W) / largest that counts as rounding (of seven digits) and is set to zero with a note, -,
  /// without and with symmetrise.
  double negative_tolerance = 1e-6;
  double negative_tolerance_symmetrised = 1e-3;
};

enum class ProblemFormat { fclib_global, fclib_local, siconos_text };
std::string_view name(ProblemFormat format);

/// A contact problem from a file, and what was noticed on the way.
struct StoredProblem {
  ContactProblem problem;
  ProblemFormat format = ProblemFormat::fclib_global;
  /// nv: the file's row of each entry of v (global); empty for a problem given by W and q, whose v is ours.
  std::vector<int> row_of_v;
  Eigen::SparseMatrix<double> W;   ///< as it is solved, for a problem given by W and q
  std::vector<double> q;           ///< as in the file, for a problem given by W and q
  int rank = 0;                    ///< of W, for a problem given by W and q
  double asymmetry = 0;            ///< max |W - W^T| / max |W| of the file
  double factor_error = 0;         ///< largest |W - J M^-1 J^T|, scaled by the contacts' mobilities
  std::vector<std::string> notes;  ///< one line each
};

/// Reads an FCLIB HDF5 file (local or global) or a Siconos friction text file: which, its first bytes say.
/// A problem given by W and q becomes one with M = 1 and J J^T = W. Throws FileError.
StoredProblem read_contact_problem(const std::string& path, const ProblemFileOptions& options = {});

struct FclibContent;
/// The same from what an FCLIB file holds: sizes fit, numbers are finite. `path` begins the messages.
StoredProblem to_problem(FclibContent content, const std::string& path, const ProblemFileOptions& options = {});
/// An answer that goes into a problem's file, FCLIB's /solution.
struct StoredAnswer {
  std::vector<double> impulse;         ///< 3 nc, N s
  std::vector<double> v_plus, u_plus;  ///< nv, 3 nc, after it; u_plus with the offset
};

/// Writes a problem as FCLIB (global). M, H = J^T, f = M v_minus, w, mu are stored to the last bit; v_minus and
/// restitution travel in the group /contactbench. `row_of_v` (as read) restores a file's own order of unknowns.
/// Throws FileError.
void write_contact_problem(const std::string& path, const ContactProblem& problem, const std::string& title = {},
                           const std::vector<int>& row_of_v = {}, const StoredAnswer* answer = nullptr);

}  // namespace cb
