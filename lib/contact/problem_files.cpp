// What: contact problems in files: FCLIB HDF5 (global: M, H, f, w, mu; local: W, q, mu) and Siconos friction text
//   (W, q, mu), turned into a ContactProblem, and back into FCLIB.
// Source: FCLIB 3.1 (fclib.h) for M v = H r + f, u = H^T v + w; H = J^T, f = M v_minus.
// Differences from the source: 1. bilateral constraints (G, b; V, R, s) and plane problems (spacedim 2) are refused.
//   2. M's blocks are the connected components of its pattern; components with the same contacts are kept as one block
//   of at most six rows (a free body whose M is stored without its zeros).
// Fails with FileError: file, dataset or line, and what would be right.
#include "contact/problem_files.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "contact/delassus_factor.h"
#include "contact/fclib_format.h"
#include "linalg/text_file.h"

namespace cb {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr double symmetric_mass = 1e-12;   // |M_ij - M_ji| / sqrt(M_ii M_jj) that counts as rounding
constexpr double consistent_force = 1e-9;  // |f - M v_minus| over the size of its terms, row by row
constexpr int merged_rows = 6;             // a free body

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

// Blocks of M by the connected components of its pattern and H's columns; returns the block of each row, blocks
// numbered by their first row.
std::vector<int> find_blocks(const Sparse& M, const Sparse& H, int& count) {
  const int nv = static_cast<int>(M.rows());
  std::vector<int> root(nv);
  for (int i = 0; i < nv; ++i) root[i] = i;
  const auto find = [&](int i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  const auto join = [&](int i, int j) {
    i = find(i);
    j = find(j);
    root[std::max(i, j)] = std::min(i, j);
  };
  for (int j = 0; j < nv; ++j)
    for (Sparse::InnerIterator it(M, j); it; ++it)
      if (it.value() != 0) join(static_cast<int>(it.row()), j);

  // Components with the same contacts: one block, as long as it stays small.
  std::map<int, std::vector<int>> contacts;  // of a component, ascending
  std::map<int, int> size;
  for (int i = 0; i < nv; ++i) ++size[find(i)];
  for (int c = 0; c < H.cols(); ++c)
    for (Sparse::InnerIterator it(H, c); it; ++it)
      if (it.value() != 0) {
        auto& list = contacts[find(static_cast<int>(it.row()))];
        if (list.empty() || list.back() != c / 3) list.push_back(c / 3);
      }
  std::map<std::vector<int>, int> open;  // contacts -> component that may still grow
  for (const auto& [component, list] : contacts) {
    const auto [at, fresh] = open.try_emplace(list, component);
    if (fresh) continue;
    const int into = find(at->second);
    if (size[into] + size[component] > merged_rows) {
      at->second = component;
      continue;
    }
    const int sum = size[into] + size[component];
    join(into, component);
    size[find(into)] = sum;
  }

  std::vector<int> block(nv), index(nv, -1);
  count = 0;
  for (int i = 0; i < nv; ++i) {
    int& at = index[find(i)];
    if (at < 0) at = count++;
    block[i] = at;
  }
  return block;
}

std::vector<int> given_blocks(const std::string& path, const std::vector<int>& first, int nv, int& count) {
  std::vector<int> block(nv);
  bool good = first.size() >= 2 && first.front() == 0 && first.back() == nv;
  for (std::size_t b = 0; good && b + 1 < first.size(); ++b) {
    good = first[b] < first[b + 1] && first[b + 1] <= nv;
    for (int i = first[b]; good && i < first[b + 1]; ++i) block[i] = static_cast<int>(b);
  }
  if (!good)
    throw FileError(path +
                    ": /contactbench/first: must rise from 0 to the order of M; remove the group to have the "
                    "blocks found from M");
  count = static_cast<int>(first.size()) - 1;
  return block;
}

void check_laws(const std::string& path, const ContactProblem& problem) {
  for (int c = 0; c < problem.nc(); ++c) {
    if (!(problem.mu[c] >= 0))
      throw FileError(path + ": mu of contact " + std::to_string(c) + " is " + number(problem.mu[c]) +
                      "; it must not be negative");
    if (!(problem.restitution[c] >= 0 && problem.restitution[c] <= 1))
      throw FileError(path + ": restitution of contact " + std::to_string(c) + " is " + number(problem.restitution[c]) +
                      "; it must be from 0 to 1");
  }
}

/// A file in global form while it becomes a problem: the block of each row of M, its place there, and their rows.
struct Global {
  const std::string& path;
  const FclibContent& file;
  int count = 0;
  std::vector<int> block, place;
  std::vector<std::vector<int>> rows;

  bool ours() const { return !file.first.empty(); }
  int nv() const { return static_cast<int>(file.M.rows()); }
  [[noreturn]] void fail(const std::string& what) const { throw FileError(path + ": " + what); }
};

// Blocks, and the order that makes each of them contiguous.
void order_rows(Global& in, StoredProblem& out) {
  const FclibContent& file = in.file;
  in.block = in.ours() ? given_blocks(in.path, file.first, in.nv(), in.count) : find_blocks(file.M, file.H, in.count);
  in.rows.resize(in.count);
  for (int i = 0; i < in.nv(); ++i) in.rows[in.block[i]].push_back(i);
  long values = 0;
  for (const auto& list : in.rows) values += static_cast<long>(list.size()) * static_cast<long>(list.size());
  if (values > file_limits.dense_entries)
    in.fail("/fclib_global/M: its blocks hold " + std::to_string(values) + " numbers; at most " +
            std::to_string(file_limits.dense_entries) + " fit");
  in.place.resize(in.nv());
  for (const std::vector<int>& list : in.rows) {
    out.problem.M.add_block(static_cast<int>(list.size()));
    for (std::size_t i = 0; i < list.size(); ++i) {
      in.place[list[i]] = static_cast<int>(i);
      out.row_of_v.push_back(list[i]);
    }
  }
}

void fill_mass(const Global& in, ContactProblem& problem) {
  for (int j = 0; j < in.nv(); ++j)
    for (Sparse::InnerIterator it(in.file.M, j); it; ++it) {
      const int i = static_cast<int>(it.row());
      if (in.block[i] != in.block[j]) {
        if (it.value() == 0) continue;
        in.fail("/fclib_global/M couples rows " + std::to_string(i) + " and " + std::to_string(j) +
                " of different blocks of /contactbench/first");
      }
      problem.M.block(in.block[j])(in.place[i], in.place[j]) = it.value();
    }
  for (int b = 0; b < in.count; ++b) {
    const auto B = problem.M.block(b);
    for (int j = 0; j < B.cols(); ++j)
      for (int i = 0; i < j; ++i)
        if (!(std::abs(B(i, j) - B(j, i)) <= symmetric_mass * std::sqrt(B(i, i) * B(j, j))))
          in.fail("/fclib_global/M is not symmetric at (" + std::to_string(in.rows[b][i]) + ", " +
                  std::to_string(in.rows[b][j]) + ")");
  }
}

// The band of contact c; explicit zeros of our own files keep the shape of an entry. `stored`: numbers so far.
void add_band(const Global& in, int c, long& stored, ContactProblem& problem) {
  problem.J.add_band();
  std::vector<int> touched;
  bool moves = false;
  for (int r = 0; r < 3; ++r)
    for (Sparse::InnerIterator it(in.file.H, 3 * c + r); it; ++it) {
      if (it.value() != 0 || in.ours()) touched.push_back(in.block[it.row()]);
      moves = moves || it.value() != 0;
    }
  if (!moves)
    in.fail("/fclib_global/H: contact " + std::to_string(c) +
            " moves nothing (its three columns are zero); leave it out");
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  for (const int b : touched) {
    stored += 3L * problem.M.block_size(b);
    if (stored > file_limits.dense_entries)
      in.fail("/fclib_global/H: its bands over the blocks of M are too large to be kept");
    problem.J.add_entry(b, problem.M.block_size(b));
  }
  for (int r = 0; r < 3; ++r)
    for (Sparse::InnerIterator it(in.file.H, 3 * c + r); it; ++it) {
      const int b = in.block[it.row()];
      const auto at = std::lower_bound(touched.begin(), touched.end(), b);
      if (at == touched.end() || *at != b) continue;
      problem.J.entry(problem.J.band[c] + static_cast<int>(at - touched.begin()))(r, in.place[it.row()]) = it.value();
    }
}

// Does v_minus belong to f, row by row?
void check_force(const Global& in, const StoredProblem& stored) {
  const ContactProblem& problem = stored.problem;
  std::vector<double> force(in.nv()), size(in.nv(), 0.0);
  multiply(problem.M, problem.v_minus, force);
  for (int b = 0; b < in.count; ++b) {
    const int at = problem.M.first[b];
    for (int j = 0; j < problem.M.block_size(b); ++j)
      for (int i = 0; i < problem.M.block_size(b); ++i)
        size[at + i] += std::abs(problem.M.block(b)(i, j) * problem.v_minus[at + j]);
  }
  for (int i = 0; i < in.nv(); ++i)
    if (!(std::abs(force[i] - in.file.f[stored.row_of_v[i]]) <= consistent_force * size[i]))
      in.fail(
          "/contactbench/v_minus does not belong to /fclib_global/vectors/f (f = M v_minus); "
          "remove the group /contactbench to have it computed from f");
}

void from_global(const std::string& path, const FclibContent& file, StoredProblem& out) {
  ContactProblem& problem = out.problem;
  Global in{path, file, 0, {}, {}, {}};
  for (int i = 0; i < in.nv(); ++i)
    if (!(file.M.coeff(i, i) > 0))
      in.fail("/fclib_global/M: entry (" + std::to_string(i) + ", " + std::to_string(i) + ") is " +
              number(file.M.coeff(i, i)) + "; M must be positive definite");
  problem.clear();
  order_rows(in, out);
  fill_mass(in, problem);
  BlockCholesky factor;
  if (!factor.factor(problem.M)) in.fail("/fclib_global/M is not positive definite");

  const int nc = static_cast<int>(file.mu.size());
  long stored = 0;
  for (int c = 0; c < nc; ++c) add_band(in, c, stored, problem);

  problem.offset = file.w;
  problem.mu = file.mu;
  problem.restitution = file.restitution.empty() ? std::vector<double>(nc, 0.0) : file.restitution;
  problem.v_minus.resize(in.nv());
  const std::vector<double>& source = file.v_minus.empty() ? file.f : file.v_minus;
  for (int i = 0; i < in.nv(); ++i) problem.v_minus[i] = source[out.row_of_v[i]];
  if (!file.v_minus.empty()) return check_force(in, out);
  factor.solve_in_place(problem.v_minus);
  for (const double v : problem.v_minus)
    if (!std::isfinite(v)) in.fail("v_minus = M^-1 f is not finite; M is nearly singular");
}

void from_local(const std::string& path, Sparse W, std::vector<double> q, std::vector<double> mu,
                const ProblemFileOptions& options, StoredProblem& out) {
  double largest = 0, difference = 0;
  const Sparse transposed = W.transpose();
  const Sparse skew = W - transposed;
  for (int j = 0; j < W.outerSize(); ++j)
    for (Sparse::InnerIterator it(W, j); it; ++it) largest = std::max(largest, std::abs(it.value()));
  for (int j = 0; j < skew.outerSize(); ++j)
    for (Sparse::InnerIterator it(skew, j); it; ++it) difference = std::max(difference, std::abs(it.value()));
  out.asymmetry = largest > 0 ? difference / largest : 0;
  if (out.asymmetry > options.symmetry_tolerance) {
    if (!options.symmetrise)
      throw FileError(path + ": W is not symmetric (largest difference " + number(out.asymmetry) +
                      " of its largest entry); --symmetrise solves the problem with (W + W^T)/2");
    out.notes.push_back("W symmetrised: it differed from its transpose by " + number(out.asymmetry) +
                        " of its largest entry");
  }
  W = Sparse(0.5 * (W + transposed));
  W.prune([](const Eigen::Index&, const Eigen::Index&, const double& x) { return x != 0; });

  DelassusFactorOptions factor_options;
  factor_options.negative_tolerance =
      options.symmetrise ? options.negative_tolerance_symmetrised : options.negative_tolerance;
  DelassusFactorReport report;
  const std::string reason = factor_delassus(W, q, factor_options, out.problem, report);
  if (!reason.empty())
    throw FileError(path + ": " + reason +
                    (reason.find("semidefinite") != std::string::npos && !options.symmetrise
                         ? "; --symmetrise takes the nearest matrix that is"
                         : ""));
  if (report.most_negative > 1e-12)
    out.notes.push_back("W made positive semidefinite: its smallest eigenvalue was -" + number(report.most_negative) +
                        " of its largest");
  if (report.rank < static_cast<int>(W.rows()))
    out.notes.push_back("W has rank " + std::to_string(report.rank) + " of " + std::to_string(W.rows()));
  out.rank = report.rank;
  out.factor_error = report.error;
  out.problem.mu = std::move(mu);
  out.problem.restitution.assign(out.problem.mu.size(), 0.0);
  out.W.swap(W);
  out.q = std::move(q);
}

void read_siconos(const std::string& path, const ProblemFileOptions& options, StoredProblem& out) {
  TextFile file(path);
  const long dimension = file.integer("dimension of the contacts", 2, 3);
  if (dimension != 3) file.fail("contacts of dimension 2 are not supported; 3 is");
  const long nc = file.integer("number of contacts", 1, file_limits.dimension / 3);
  Sparse W = read_siconos_matrix(file, "W");
  if (W.rows() != 3 * nc || W.cols() != 3 * nc)
    file.fail("W is " + std::to_string(W.rows()) + " x " + std::to_string(W.cols()) + "; " + std::to_string(nc) +
              " contacts need it square of size " + std::to_string(3 * nc));
  file.expect_room(4 * nc, "q and mu");
  std::vector<double> q(3 * static_cast<std::size_t>(nc)), mu(static_cast<std::size_t>(nc));
  for (double& x : q) x = file.number("q");
  for (double& x : mu) x = file.number("mu");
  from_local(path, W, std::move(q), std::move(mu), options, out);
}

}  // namespace

std::string_view name(ProblemFormat format) {
  switch (format) {
    case ProblemFormat::fclib_global:
      return "fclib_global";
    case ProblemFormat::fclib_local:
      return "fclib_local";
    case ProblemFormat::siconos_text:
      return "siconos_text";
  }
  return "";
}

StoredProblem to_problem(FclibContent content, const std::string& path, const ProblemFileOptions& options) {
  StoredProblem out;
  out.format = content.global ? ProblemFormat::fclib_global : ProblemFormat::fclib_local;
  if (content.global)
    from_global(path, content, out);
  else
    from_local(path, content.W, content.q, content.mu, options, out);
  if (!content.global && !content.restitution.empty()) out.problem.restitution = content.restitution;
  check_laws(path, out.problem);
  return out;
}

StoredProblem read_contact_problem(const std::string& path, const ProblemFileOptions& options) {
  char head[8] = {};
  {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw FileError(path + ": cannot be opened for reading; give the path of an existing file");
    in.read(head, sizeof head);
  }
  if (std::string_view(head, sizeof head) == "\x89HDF\r\n\x1a\n") return to_problem(read_fclib(path), path, options);
  StoredProblem out;
  out.format = ProblemFormat::siconos_text;
  read_siconos(path, options, out);
  check_laws(path, out.problem);
  return out;
}

void write_contact_problem(const std::string& path, const ContactProblem& problem, const std::string& title,
                           const std::vector<int>& row_of_v, const StoredAnswer* answer) {
  const int nv = problem.nv(), nc = problem.nc();
  std::vector<int> row = row_of_v;
  bool own_order = true;
  for (int i = 0; i < static_cast<int>(row.size()); ++i) own_order = own_order && row[i] == i;
  if (row.empty())
    for (int i = 0; i < nv; ++i) row.push_back(i);

  FclibContent out;
  out.global = true;
  std::vector<Eigen::Triplet<double>> triplets;
  for (int b = 0; b < problem.M.blocks(); ++b) {
    const auto B = problem.M.block(b);
    const int at = problem.M.first[b];
    for (int j = 0; j < B.cols(); ++j)
      for (int i = 0; i < B.rows(); ++i) triplets.emplace_back(row[at + i], row[at + j], B(i, j));
  }
  out.M.resize(nv, nv);
  out.M.setFromTriplets(triplets.begin(), triplets.end());
  triplets.clear();
  for (int c = 0; c < nc; ++c)
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const auto entry = problem.J.entry(e);
      const int at = problem.M.first[problem.J.block[e]];
      for (int j = 0; j < entry.cols(); ++j)
        for (int r = 0; r < 3; ++r) triplets.emplace_back(row[at + j], 3 * c + r, entry(r, j));
    }
  out.H.resize(nv, 3L * nc);
  out.H.setFromTriplets(triplets.begin(), triplets.end());

  std::vector<double> force(nv);
  multiply(problem.M, problem.v_minus, force);
  out.f.resize(nv);
  out.v_minus.resize(nv);
  for (int i = 0; i < nv; ++i) {
    out.f[row[i]] = force[i];
    out.v_minus[row[i]] = problem.v_minus[i];
  }
  if (answer) {
    out.v.resize(nv);
    for (int i = 0; i < nv; ++i) out.v[row[i]] = answer->v_plus[i];
    out.u = answer->u_plus;
    out.r = answer->impulse;
  }
  out.w = problem.offset;
  out.mu = problem.mu;
  out.restitution = problem.restitution;
  // The blocks are contiguous in our own order only.
  if (own_order) out.first = problem.M.first;
  write_fclib(path, out, title,
              "One contact event: M v = H r + f, u = H^T v + w, rows of a contact n, t1, t2; v before the event and "
              "restitution are in /contactbench.");
}

}  // namespace cb
