// Gauss and Seidel, contact after contact: nonsmooth, since each contact is solved by the law itself.
//
// Problem: (1) of ncp.h, nc contacts. A sweep goes over the contacts in their order; of each
//   q_i = u_i - W_ii r_i (the velocity without its impulse),  r_i <- r_i + omega (answer(W_ii, q_i) - r_i),
//   v <- v + M^-1 J_i^T (change of r_i)
// so that only W_ii (3 x 3) and M^-1 J_i^T are stored: time and memory of a sweep are linear in the contacts. The
// answer of a contact is exact (one_contact.h); as `bisection` it is RaiSim's, which is another law where it slips.
//
// Source: F. Jourdan, P. Alart, M. Jean, A Gauss-Seidel like algorithm to solve frictional contact problems, Comput.
// Methods Appl. Mech. Eng. 155 (1998); V. Acary, M. Bremond, O. Huber, On solving contact problems with Coulomb
// friction (2018), alg. 3 (NSGS). Bisection: Hwangbo, Lee and Hutter, IEEE RA-L 3 (2018).
//
// Differences from the sources:
//  1. Solved is told by the residual of the whole on fresh velocities; where a sweep changes nothing any more it ends,
//  too.
//  2. Where that is asked for it ends after a number of sweeps, as games do, and says `inaccurate` where it is not
//  done.
//
// Returns: solved; inaccurate (the sweeps that were asked for are done; bisection: it has come to rest beside the law);
// nonconverged (limit of sweeps; the best that a check has seen); not_finite.

#include <algorithm>
#include <cmath>

#include "linalg/finite.h"
#include "linalg/stop.h"
#include "ncp/ncp.h"
#include "ncp/one_contact.h"

namespace cb {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vec3 = Eigen::Map<Vector3d>;
using ConstVec3 = Eigen::Map<const Vector3d>;

struct NsgsOptions : NcpOptions {
  int check_every = 10;  ///< sweeps between two checks, at most: where one changes less than the tolerance, one is due
  int limit = 10000;     ///< sweeps, where nothing else is asked for
  bool bisection = false;
  /// -: largest change of an impulse within a sweep, over the largest impulse, at which it rests. Larger: less of
  /// the law.
  double rest = 1e-14;
  /// -: W_nn over the trace of W_ii up to which it is the rounding of a row along which no joint moves the contact, and
  /// velocities of stops over their size. Larger: what is hardly moved carries nothing.
  double immobile = 1e-28, rounding = 1e-14;
};

class Nsgs {
 public:
  Nsgs(const NcpOptions& options, bool bisection) {
    static_cast<NcpOptions&>(o_) = options;
    o_.bisection = bisection;
  }
  void operator()(const NcpProblem& problem, NcpSolution& solution);

 private:
  bool prepare(const NcpProblem& problem);
  double sweep(const NcpProblem& problem);
  void solve_contact(const NcpProblem& problem, int c);
  bool check(NcpSolution& solution);
  void end(bool at_rest, NcpSolution& solution);

  NsgsOptions o_;
  NcpMeasure measure_;
  std::vector<OneContact> contacts_;
  std::vector<char> idle_;       // nc: does no impulse move it along its normal?
  std::vector<double> columns_;  // M^-1 J_i^T, entry by entry, laid out as J's transposed
  std::vector<double> r_, u_, v_;
  double largest_change_ = 0;  // of the last sweep, of sqrt(w) r, over the largest of these
  double largest_ = 0;
};

bool Nsgs::prepare(const NcpProblem& p) {
  const int nc = p.nc();
  contacts_.clear();
  idle_.resize(nc);
  columns_.resize(p.J->values.size());
  for (int c = 0; c < nc; ++c) {
    Matrix3d W = Matrix3d::Zero();  // W_ii
    for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
      const auto entry = p.J->entry(e);
      Eigen::Map<Eigen::MatrixX3d> column(columns_.data() + p.J->offset[e], entry.cols(), 3);
      column = entry.transpose();
      p.factor->solve_block_in_place(p.J->block[e], column.data(), 3);
      W.noalias() += entry * column;
    }
    // What no impulse moves along its normal carries nothing, where no stop drives it in. A row of 1e-17 would ask for
    // an impulse of 1e17, by which a joint that swings past comes to a stop.
    idle_[c] = W(0, 0) <= o_.immobile * W.trace();
    const ConstVec3 offset(&p.offset[3 * c]);
    if (idle_[c] ? !(offset[0] >= -o_.rounding * offset.norm()) : !(W(0, 0) > 0)) return false;
    contacts_.emplace_back(W, p.mu[c]);
  }
  return true;
}

void Nsgs::solve_contact(const NcpProblem& p, int c) {
  if (idle_[c]) return;
  Vec3 r(&r_[3 * c]);
  Vector3d u = ConstVec3(&p.offset[3 * c]);
  for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
    const auto entry = p.J->entry(e);
    u.noalias() += entry * Eigen::Map<const Eigen::VectorXd>(&v_[p.M->first[p.J->block[e]]], entry.cols());
  }
  const OneContact& contact = contacts_[c];
  const Vector3d q = u - contact.W() * r, answer = o_.bisection ? contact.bisect(q) : contact.solve(q);
  const Vector3d change = o_.relaxation * (answer - r);
  const double root = std::sqrt(p.weight[c]);
  r += change;
  largest_change_ = std::max(largest_change_, root * change.norm());
  largest_ = std::max(largest_, root * r.norm());
  for (int e = p.J->band[c]; e < p.J->band[c + 1]; ++e) {
    const int size = (p.J->offset[e + 1] - p.J->offset[e]) / 3;
    Eigen::Map<Eigen::VectorXd>(&v_[p.M->first[p.J->block[e]]], size).noalias() +=
        Eigen::Map<const Eigen::MatrixX3d>(columns_.data() + p.J->offset[e], size, 3) * change;
  }
}

// Returns the largest change, over the largest impulse.
double Nsgs::sweep(const NcpProblem& p) {
  largest_change_ = largest_ = 0;
  for (int c = 0; c < p.nc(); ++c) solve_contact(p, c);
  return largest_ > 0 ? largest_change_ / largest_ : 0;
}

// Keeps the best. Is it done?
bool Nsgs::check(NcpSolution& solution) {
  measure_.velocities(r_, v_, u_);
  const double residual = measure_.residual(r_, u_);
  if (residual < solution.residual) {
    solution.residual = residual;
    solution.r = r_;
    solution.u = u_;
  }
  return residual <= o_.tolerance;
}

void Nsgs::end(bool at_rest, NcpSolution& solution) {
  if (solution.residual > o_.tolerance)
    solution.residual = std::min(solution.residual, measure_.residual_beside_rounding(solution.r, solution.u));
  if (solution.residual <= o_.accepted) {
    solution.status = NcpStatus::solved;
  } else if (!all_finite(r_) || solution.residual == HUGE_VAL) {
    solution.status = NcpStatus::not_finite;
    solution.reason = "impulses overflow";
  } else if (o_.bisection && at_rest) {
    solution.status = NcpStatus::inaccurate;
    solution.reason = "at rest beside Coulomb's law: friction by bisection is not against the slip";
  } else if (o_.sweeps > 0 && solution.iterations >= o_.sweeps) {
    solution.status = NcpStatus::inaccurate;
    solution.reason = "the sweeps that were asked for are done";
  } else {
    solution.reason = at_rest ? "a sweep changes nothing any more" : "limit of sweeps";
  }
}

void Nsgs::operator()(const NcpProblem& p, NcpSolution& solution) {
  const int nc = p.nc();
  solution.clear();
  solution.r.assign(3 * nc, 0.0);
  measure_.begin(p);
  solution.u = measure_.q();
  solution.residual = HUGE_VAL;
  if (!all_finite(solution.u) || !prepare(p)) {
    solution.status = NcpStatus::not_finite;
    solution.reason = "NaN or infinity in the problem, or a contact that no impulse moves";
    return;
  }
  r_.assign(3 * nc, 0.0);
  if (static_cast<int>(p.start.size()) == 3 * nc) r_.assign(p.start.begin(), p.start.end());
  for (int c = 0; c < nc; ++c)
    if (idle_[c]) std::fill_n(&r_[3 * c], 3, 0.0);
  const int limit = o_.sweeps > 0 ? o_.sweeps : o_.limit;
  const int every = nc > 1 ? o_.check_every : 1;  // of one contact the first sweep is the answer
  bool at_rest = false, done = check(solution);
  while (!done && !at_rest && solution.iterations < limit) {
    double change = HUGE_VAL;
    for (int k = 0; k < every && solution.iterations < limit && change > o_.tolerance; ++k) {
      poll_stop();
      change = sweep(p);
      ++solution.iterations;
    }
    if (!all_finite(r_)) break;
    done = check(solution);
    at_rest = change <= o_.rest;
  }
  // Games take the last sweep, whatever its residual.
  if (!done && (o_.sweeps > 0 || o_.bisection) && all_finite(r_)) {
    solution.residual = HUGE_VAL;
    check(solution);
  }
  end(at_rest, solution);
}

template <bool bisection>
NcpSolver make(const NcpOptions& options) {
  return [solver = Nsgs(options, bisection)](const NcpProblem& problem, NcpSolution& solution) mutable {
    solver(problem, solution);
  };
}

}  // namespace

NcpSolverRow nsgs_row() {
  return {"nsgs", "Gauss and Seidel, contact after contact by the law itself",
          "Jourdan, Alart and Jean, Comput. Methods Appl. Mech. Eng. 155 (1998)", make<false>};
}

NcpSolverRow bisection_row() {
  return {"bisection", "nsgs with friction by bisection on the cone: not maximum dissipation, another law on slip",
          "Hwangbo, Lee and Hutter, IEEE Robotics and Automation Letters 3 (2018)", make<true>};
}

}  // namespace cb
