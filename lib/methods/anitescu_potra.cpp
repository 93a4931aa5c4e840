// Anitescu and Potra's time-stepping contact model as a linear complementarity problem.
//
// Problem (nc contacts, k directions d_i = cos(2 pi i / k) t1 + sin(2 pi i / k) t2 each, e = 0):
//   0 <= c_n  _|_  N v+ + w_n          >= 0      c_n: nc, N s
//   0 <= c_t  _|_  D v+ + w_t + E lam  >= 0      c_t: k nc, N s, contact by contact
//   0 <= lam  _|_  mu c_n - E^T c_t    >= 0      lam: nc, m/s
//   v+ = v- + M^-1 (N^T c_n + D^T c_t)
// (k + 2) nc unknowns in the order c_n, c_t, lam.
//
// Source: M. Anitescu, F. A. Potra, Formulating dynamic multi-rigid-body contact problems with friction as solvable
// linear complementarity problems, Nonlinear Dynamics 14 (1997): the one-step LCP, and for e > 0 their compression and
// decompression phases with Poisson's hypothesis: the first LCP gives c (compression); then theta e c_n acts at each
// contact, and a second LCP of the same matrix, its friction bounded by mu (theta e c_n + c_n'), keeps contacts from
// approaching again.
//
// Differences from the source:
//  1. Impulses and velocities of one event only: forces have acted before (docs/architecture.md, "The path of a step").
//  2. No joint constraints: joints are inside M.
//  3. Small problems eliminate v+ (matrix of order (k + 2) nc from the Delassus matrix); larger ones keep v+ - v- as
//     free unknowns, so that what is sparse stays sparse. dense_limit decides, by the number of unknowns.
//  4. A contact with mu = 0 has no use for its c_t and lam: where told so (MethodOptions::idle_friction) they are no
//     unknowns, and z gets c_t = 0 and the lam that its slip asks for. Not with e > 0 or regularisation.
//  5. In the source theta = 1. Islands that gain energy by that are solved once more with the largest theta by which
//  they
//     cannot (restitution.h).
//  6. Optional regularisation: E is added to the diagonal of all rows of the LCP, in the unit of each row.
//
// With --warm-start, where the previous event left everything at rest, its impulses are tried first: if they hold the
// present event at rest and lie in the polygons, they are an answer with lam = 0. Then the active set of the previous
// answer is, and its answer taken where it solves the present problem to rounding; else the LCP solver starts cold.
//
// Fails as the LCP solver fails; its ending and reason are passed on. With e > 0, z holds both phases, one after the
// other, 2 (k + 2) nc numbers.

#include <array>
#include <cmath>
#include <memory>

#include "lcp/lcp.h"
#include "methods/active_set_start.h"
#include "methods/lcp_status.h"
#include "methods/registry.h"
#include "methods/resting_impulse.h"
#include "methods/restitution.h"
#include "methods/same_event.h"

namespace cb {

namespace {

/// -: of what the event is about; impulses kept from a resting one may leave their polygon by it. Larger: slip that a
/// cold start would see.
constexpr double rounding = 1e-13;
/// -: gain of energy over a fourth of |r.u-| (at most the island's energy, where it gains less) from which restitution
/// is scaled; a tenth of what the referee accepts.
constexpr double gain_rounding = 1e-10;
/// -: an entry of W below this fraction of what its two contacts have in other directions is rounding.
constexpr double entry_rounding = 1e-15;

class AnitescuPotra {
 public:
  explicit AnitescuPotra(const MethodOptions& options);
  void solve(const ContactProblem& problem, ContactSolution& solution);

 private:
  void build_dense(const ContactProblem& problem);
  void drop_rounding();
  void build_expanded(const ContactProblem& problem);
  void set_load(const ContactProblem& problem, const std::vector<double>& v);
  void group_by_contact(const ContactProblem& problem);
  double size(const ContactProblem& problem) const;
  bool start_at_rest(const ContactProblem& problem, ContactSolution& solution);
  bool solve_phase(ContactSolution& solution);
  void append_answer(std::vector<double>& z) const;
  double least_slip_bound(const double* u) const;
  void bound_idle_slip(const ContactProblem& problem, ContactSolution& solution);
  int unknowns() const { return nc_ + (k_ + 1) * rough(); }
  int rough() const { return static_cast<int>(rough_.size()); }
  PolygonUnknowns layout() const { return {nc_, k_, rough_, cosine_, sine_}; }
  int first_direction(int f) const { return layout().first_direction(f); }  // unknowns c_t of the f-th with friction
  int slip_bound(int f) const { return layout().slip_bound(f); }            // and its lam
  void add_impulses(ContactSolution& solution) const;
  void decompress(const ContactProblem& problem, ContactSolution& solution);
  void give_back(const ContactProblem& problem, ContactSolution& solution);
  bool bound_gains(const ContactProblem& problem, const ContactSolution& solution);

  int k_;
  double regularise_;
  bool idle_friction_;
  LcpOptions lcp_options_;
  LcpSolver solver_;
  std::string solver_failure_;
  std::vector<double> cosine_, sine_;  // k

  int nc_ = 0;
  std::vector<int> rough_;  // contacts whose friction has unknowns
  BlockCholesky factor_;
  Eigen::MatrixXd W_;
  LcpProblem lcp_;
  LcpSolution answer_;
  std::vector<double> u_, v_, restored_, scratch_;
  std::vector<double> weight_;  // nc, 1/kg

  // Decompression.
  Islands islands_;
  Restitution restitution_;
  ContactSolution compression_;                // what there is without it
  Eigen::VectorXd sizes_;                      // and lcp_.groups.size then
  std::vector<char> bounded_;                  // per island: would it gain energy by all of e c_n?
  std::vector<std::array<double, 2>> gained_;  // per island, J: r.(u+ + u-)/2, r.u-

  bool warm_ = false;
  std::shared_ptr<long> warm_starts_;
  RestingImpulse resting_{3};
  double size_ = 0;  // sqrt(J), of the event
  ActiveSetStart active_set_;
};

AnitescuPotra::AnitescuPotra(const MethodOptions& options)
    : k_(options.k),
      regularise_(options.regularise),
      idle_friction_(options.idle_friction),
      warm_(options.warm_start),
      warm_starts_(options.warm_starts) {
  const std::string_view solver = options.solver.empty() ? std::string_view("lemke") : options.solver;
  const LcpSolverRow* row = find_lcp_solver(solver);
  if (row == nullptr) {
    solver_failure_ = "no LCP solver named " + std::string(solver);
  } else if (!row->unavailable.empty()) {
    solver_failure_ = std::string(row->unavailable);
  } else {
    solver_ = row->make(lcp_options_);
  }
  for (int i = 0; i < k_; ++i) {
    // Exact zeros and ones on the axes, and exactly opposite pairs: a box that slides along t1 stays on its line.
    const int half = k_ / 2, j = i % half;
    double c = std::cos(2 * M_PI * j / k_), s = std::sin(2 * M_PI * j / k_);
    if (4 * j == k_) c = 0, s = 1;
    cosine_.push_back(i < half ? c : -c);
    sine_.push_back(i < half ? s : -s);
  }
}

// Where a robot's joints do not let a contact move along a direction, W has 1e-17 of what its other directions have.
// Scaled up as a pair of its own, such a row would be noise that bases are made of.
void AnitescuPotra::drop_rounding() {
  scratch_.resize(nc_);
  for (int c = 0; c < nc_; ++c)
    scratch_[c] = std::sqrt(W_(3 * c, 3 * c) + W_(3 * c + 1, 3 * c + 1) + W_(3 * c + 2, 3 * c + 2));
  for (int j = 0; j < 3 * nc_; ++j)
    for (int i = 0; i < 3 * nc_; ++i)
      if (std::abs(W_(i, j)) <= entry_rounding * scratch_[i / 3] * scratch_[j / 3]) W_(i, j) = 0;
}

// The matrix of the LCP from W = J M^-1 J^T, v+ eliminated.
void AnitescuPotra::build_dense(const ContactProblem& problem) {
  const int nc = nc_, k = k_, n = unknowns();
  delassus(problem, factor_, W_);
  drop_rounding();
  weight_.resize(nc);
  for (int c = 0; c < nc; ++c) {
    const double normal = W_(3 * c, 3 * c), tangential = W_(3 * c + 1, 3 * c + 1) + W_(3 * c + 2, 3 * c + 2);
    weight_[c] = tangential > 0 ? (normal + tangential) / 3 : normal;
  }
  lcp_.expanded = false;
  lcp_.M.resize(n, n);
  lcp_.M.setZero();
  auto& M = lcp_.M;
  // What an impulse at contact j makes of all contacts: along its normal (b < 0), or its direction b.
  const auto fill = [&](int column, int j, int b) {
    double* m = M.data() + std::size_t(column) * n;
    const double* Wn = W_.data() + std::size_t(3 * j) * (3 * nc);
    const double *W1 = Wn + 3 * nc, *W2 = W1 + 3 * nc;
    const double c = b < 0 ? 0 : cosine_[b], s = b < 0 ? 0 : sine_[b];
    const auto u = [&](int row) { return b < 0 ? Wn[row] : c * W1[row] + s * W2[row]; };
    for (int i = 0; i < nc; ++i) m[i] = u(3 * i);
    for (int f = 0; f < rough(); ++f) {
      const double u1 = u(3 * rough_[f] + 1), u2 = u(3 * rough_[f] + 2);
      for (int a = 0; a < k; ++a) m[first_direction(f) + a] = cosine_[a] * u1 + sine_[a] * u2;
    }
  };
  for (int j = 0; j < nc; ++j) fill(j, j, -1);
  for (int f = 0; f < rough(); ++f) {
    M(slip_bound(f), rough_[f]) = problem.mu[rough_[f]];
    for (int b = 0; b < k; ++b) {
      fill(first_direction(f) + b, rough_[f], b);
      M(slip_bound(f), first_direction(f) + b) = -1;
      M(first_direction(f) + b, slip_bound(f)) = 1;
    }
  }
  if (regularise_ != 0) M.diagonal().array() += regularise_;
}

// T = -B^T, in the memory that T has.
void negate_transposed(const SparseMatrix& B, SparseMatrix& T) {
  T.resize(B.cols(), B.rows());
  T.resizeNonZeros(B.nonZeros());
  int* start = T.outerIndexPtr();
  std::fill_n(start, B.rows() + 1, 0);
  for (Eigen::Index e = 0; e < B.nonZeros(); ++e) ++start[B.innerIndexPtr()[e] + 1];
  for (Eigen::Index i = 0; i < B.rows(); ++i) start[i + 1] += start[i];
  // Each start moves to its end while its column fills, and is the next one's start then.
  for (int j = 0; j < B.cols(); ++j)
    for (SparseMatrix::InnerIterator it(B, j); it; ++it) {
      const int at = start[it.row()]++;
      T.innerIndexPtr()[at] = j;
      T.valuePtr()[at] = -it.value();
    }
  for (Eigen::Index i = B.rows(); i > 0; --i) start[i] = start[i - 1];
  start[0] = 0;
}

// What the impulses add to the velocity stays, x = v+ - v-: A = M, B = -[N^T D^T 0], C = [N; D; 0], a = 0. With x = v+
// the load of an island at rest or rolling, u- of 1e-16 on v- of 1, would have to be found as their difference.
void AnitescuPotra::build_expanded(const ContactProblem& problem) {
  const int nc = nc_, k = k_, n = unknowns(), nv = problem.nv();
  contact_weights(problem, factor_, weight_);
  lcp_.expanded = true;
  lcp_.A.resize(nv, nv);
  lcp_.A.setZero();
  for (int b = 0; b < problem.M.blocks(); ++b)
    for (int j = 0; j < problem.M.block_size(b); ++j) {
      const int first = problem.M.first[b];
      lcp_.A.startVec(first + j);
      for (int i = 0; i < problem.M.block_size(b); ++i)
        lcp_.A.insertBack(first + i, first + j) = problem.M.block(b)(i, j);
    }
  lcp_.A.finalize();

  lcp_.B.resize(nv, n);
  lcp_.B.setZero();
  lcp_.D.resize(n, n);
  lcp_.D.setZero();
  const auto diagonal = [&](int row, int column) {
    if (regularise_ != 0 || row != column) lcp_.D.insertBack(row, column) = regularise_;
  };
  const auto band = [&](int c, int column, double n_part, double t1_part, double t2_part) {
    lcp_.B.startVec(column);
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const auto entry = problem.J.entry(e);
      const int first = problem.M.first[problem.J.block[e]];
      for (int i = 0; i < entry.cols(); ++i)
        lcp_.B.insertBack(first + i, column) = -(n_part * entry(0, i) + t1_part * entry(1, i) + t2_part * entry(2, i));
    }
  };
  for (int c = 0, f = 0; c < nc; ++c) {
    band(c, c, 1, 0, 0);
    lcp_.D.startVec(c);
    diagonal(c, c);
    if (f < rough() && rough_[f] == c) lcp_.D.insertBack(slip_bound(f++), c) = problem.mu[c];
  }
  for (int f = 0; f < rough(); ++f)
    for (int b = 0; b < k; ++b) {
      const int column = first_direction(f) + b;
      band(rough_[f], column, 0, cosine_[b], sine_[b]);
      lcp_.D.startVec(column);
      diagonal(column, column);
      lcp_.D.insertBack(slip_bound(f), column) = -1;
    }
  for (int f = 0; f < rough(); ++f) {
    const int column = slip_bound(f);
    lcp_.B.startVec(column);
    lcp_.D.startVec(column);
    for (int a = 0; a < k; ++a) lcp_.D.insertBack(first_direction(f) + a, column) = 1;
    diagonal(column, column);
  }
  lcp_.B.finalize();
  lcp_.D.finalize();
  negate_transposed(lcp_.B, lcp_.C);
}

// The vectors of the LCP for velocity v before the phase; the slack of the friction bound is restored_ (mu theta e
// c_n).
void AnitescuPotra::set_load(const ContactProblem& problem, const std::vector<double>& v) {
  lcp_.q.resize(unknowns());
  contact_velocity(problem, v, u_);
  lcp_.size = problem.M.blocks() > 1 ? size(problem) : 0;
  if (lcp_.expanded) lcp_.a.setZero(problem.nv());
  for (int c = 0; c < nc_; ++c) lcp_.q[c] = u_[3 * c];
  for (int f = 0; f < rough(); ++f) {
    const double* along = &u_[3 * rough_[f]];
    for (int a = 0; a < k_; ++a) lcp_.q[first_direction(f) + a] = cosine_[a] * along[1] + sine_[a] * along[2];
    lcp_.q[slip_bound(f)] = restored_[rough_[f]];
  }
}

// Answers are judged contact by contact, as the referee does (contact/referee.cpp). Whatever the answer, a contact is
// about the velocities of all contacts before the event: the fastest were it this one's, but no more than all of them
// together.
void AnitescuPotra::group_by_contact(const ContactProblem& problem) {
  LcpGroups& groups = lcp_.groups;
  groups.of_pair.resize(unknowns());
  groups.root.resize(unknowns());
  groups.shares.assign(unknowns(), 0);
  groups.size.resize(nc_);
  double all = 0, fastest = 0;
  for (int c = 0; c < nc_; ++c) {
    const double* u = &u_[3 * c];
    const double u2 = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    fastest = std::max(fastest, u2);
    all += u2 / weight_[c];
    groups.of_pair[c] = c;
    groups.root[c] = std::sqrt(weight_[c]);
    groups.shares[c] = !is_limit(problem, c);  // a joint's limit may be in rad/s
  }
  for (int c = 0; c < nc_; ++c) groups.size[c] = std::sqrt(std::min(all, fastest / weight_[c]));
  for (int f = 0; f < rough(); ++f) {
    const int c = rough_[f], first = first_direction(f);
    std::fill_n(&groups.of_pair[first], k_, c);
    std::fill_n(&groups.root[first], k_, groups.root[c]);
    std::fill_n(&groups.shares[first], k_, groups.shares[c]);
    groups.of_pair[slip_bound(f)] = c;
    groups.root[slip_bound(f)] = 1 / groups.root[c];
  }
}

// What the event is about, sqrt(J): the fastest contact velocity, were all of it the heaviest body's. A heavy body that
// rests on a light one shows in the impulses, but not in the vectors of the LCP. Adding up sqrt(kinetic energies)
// instead would not be the same in a moving frame.
double AnitescuPotra::size(const ContactProblem& problem) const {
  const BandMatrix& J = problem.J;
  double lightest = HUGE_VAL;  // 1/kg: least inverse inertia along a normal, of one side of a contact
  for (int e = 0; e < J.band.back(); ++e) {
    const auto entry = J.entry(e);
    const auto M = problem.M.block(J.block[e]);
    double inverse = 0;
    for (int i = 0; i < entry.cols(); ++i) inverse += entry(0, i) * entry(0, i) / M(i, i);
    if (inverse > 0) lightest = std::min(lightest, inverse);
  }
  double fastest = 0;
  for (const double u : u_) fastest = std::max(fastest, std::abs(u));
  return fastest / std::sqrt(lightest);
}

// The impulses that kept the previous event at rest, split over the directions beside them: an answer where they lie in
// the polygons. Events with restitution or regularisation have other equations.
bool AnitescuPotra::start_at_rest(const ContactProblem& problem, ContactSolution& solution) {
  contact_velocity(problem, problem.v_minus, u_);
  contact_weights(problem, factor_, weight_);
  double square = 0;
  for (int c = 0; c < nc_; ++c)
    for (int i = 0; i < 3; ++i) square += u_[3 * c + i] * u_[3 * c + i] / weight_[c];
  size_ = std::sqrt(square);
  const ContactView event{problem.M, factor_, problem.J, problem.v_minus, problem.offset, problem.mu, weight_};
  if (!resting_.find(event, size_)) return false;
  const std::vector<double>&r = resting_.r(), &u = resting_.u();
  std::vector<double>& z = solution.as<PolygonWitness>().z;
  z.assign((k_ + 2) * nc_, 0.0);
  double violation = 0;  // -, of the cones: answers of pivoting methods lie on their edges
  for (int c = 0; c < nc_; ++c) {
    const double t1 = r[3 * c + 1], t2 = r[3 * c + 2], normal = std::max(0.0, r[3 * c]);
    double* part = &z[nc_ + k_ * c];
    double friction = 0;
    if (t1 != 0 || t2 != 0) {
      const double turns = std::atan2(t2, t1) / (2 * M_PI);
      const int first = static_cast<int>((turns < 0 ? turns + 1 : turns) * k_) % k_, second = (first + 1) % k_;
      const double area = cosine_[first] * sine_[second] - sine_[first] * cosine_[second];
      part[first] = std::max(0.0, (t1 * sine_[second] - t2 * cosine_[second]) / area);
      part[second] = std::max(0.0, (cosine_[first] * t2 - sine_[first] * t1) / area);
      friction = part[first] + part[second];
    }
    violation =
        std::max(violation, std::max(-r[3 * c], friction - problem.mu[c] * normal) * std::sqrt(weight_[c]) / size_);
    if (!(violation <= rounding)) return false;
    z[c] = normal;
    if (problem.mu[c] == 0) z[nc_ + k_ * nc_ + c] = least_slip_bound(&u[3 * c]);
  }
  solution.impulse = r;
  for (int c = 0; c < nc_; ++c) solution.impulse[3 * c] = z[c];
  solution.claimed_residual = std::max(violation, resting_.residual());
  if (warm_starts_) ++*warm_starts_;
  return true;
}

bool AnitescuPotra::solve_phase(ContactSolution& solution) {
  const bool warm = warm_ && active_set_.find(lcp_, layout(), u_, answer_);
  if (warm && warm_starts_) ++*warm_starts_;
  if (!warm) solver_(lcp_, answer_);
  solution.iterations += answer_.pivots;
  solution.claimed_residual = std::max(solution.claimed_residual, answer_.residual);
  const Status status = status_of(answer_.status);
  if (status > solution.status) {
    solution.status = status;
    solution.reason = answer_.reason;
  }
  const bool usable = answer_.z.size() == lcp_.q.size() && answer_.z.allFinite();
  if (usable) append_answer(solution.as<PolygonWitness>().z);
  return usable;
}

// In the places that all contacts would have.
void AnitescuPotra::append_answer(std::vector<double>& z) const {
  const std::size_t at = z.size(), nc = nc_, k = k_;
  z.resize(at + (k + 2) * nc, 0.0);
  const double* answer = answer_.z.data();
  std::copy_n(answer, nc, &z[at]);
  for (int f = 0; f < rough(); ++f) {
    std::copy_n(answer + first_direction(f), k, &z[at + nc + k * rough_[f]]);
    z[at + nc + k * nc + rough_[f]] = answer[slip_bound(f)];
  }
}

// lam of the contacts without unknowns of friction.
void AnitescuPotra::bound_idle_slip(const ContactProblem& problem, ContactSolution& solution) {
  if (rough() == nc_) return;
  apply_impulse(problem, factor_, solution.impulse, v_);
  contact_velocity(problem, v_, u_);
  std::vector<double>& z = solution.as<PolygonWitness>().z;
  for (int c = 0; c < nc_; ++c)
    if (problem.mu[c] == 0) z[(k_ + 1) * nc_ + c] = least_slip_bound(&u_[3 * c]);
}

// The least lam that lets a contact slip with u (n, t1, t2) without friction.
double AnitescuPotra::least_slip_bound(const double* u) const {
  double lam = 0;
  for (int a = 0; a < k_; ++a) lam = std::max(lam, -cosine_[a] * u[1] - sine_[a] * u[2]);
  return lam;
}

void AnitescuPotra::add_impulses(ContactSolution& solution) const {
  const double* z = answer_.z.data();
  for (int c = 0; c < nc_; ++c) solution.impulse[3 * c] += z[c];
  for (int f = 0; f < rough(); ++f) {
    double t1 = 0, t2 = 0;
    for (int a = 0; a < k_; ++a) {
      t1 += cosine_[a] * z[first_direction(f) + a];
      t2 += sine_[a] * z[first_direction(f) + a];
    }
    solution.impulse[3 * rough_[f] + 1] += t1;
    solution.impulse[3 * rough_[f] + 2] += t2;
  }
}

void AnitescuPotra::solve(const ContactProblem& problem, ContactSolution& solution) {
  solution.clear();
  nc_ = problem.nc();
  PolygonWitness& witness = solution.as<PolygonWitness>();
  witness.k = k_;
  witness.regularisation = regularise_;
  bool elastic = false;
  for (const double e : problem.restitution) elastic = elastic || e != 0;
  const bool all = idle_friction_ || elastic || regularise_ != 0;
  rough_.clear();
  for (int c = 0; c < nc_; ++c)
    if (all || problem.mu[c] != 0) rough_.push_back(c);
  solution.size = unknowns();
  solution.impulse.assign(3 * nc_, 0.0);
  if (nc_ == 0) return;
  if (!solver_) {
    solution.status = Status::unavailable;
    solution.reason = solver_failure_;
    return;
  }
  if (!factor_.factor(problem.M)) {
    solution.status = Status::singular;
    solution.reason = "the mass matrix is not positive definite";
    return;
  }

  const bool may_rest = warm_ && !elastic && regularise_ == 0;
  if (may_rest && start_at_rest(problem, solution)) return;
  witness.z.clear();

  if (solution.size <= lcp_options_.dense_limit)
    build_dense(problem);
  else
    build_expanded(problem);

  // Compression (all of it where e = 0).
  restored_.assign(nc_, 0.0);
  set_load(problem, problem.v_minus);
  group_by_contact(problem);
  if (!solve_phase(solution)) {
    active_set_.forget();
    resting_.forget();
    return;
  }
  add_impulses(solution);
  bound_idle_slip(problem, solution);
  if (warm_) active_set_.remember(problem, factor_, layout(), u_, solution.impulse, answer_);
  if (may_rest)
    resting_.remember({problem.M, factor_, problem.J, problem.v_minus, problem.offset, problem.mu, weight_},
                      solution.impulse, size_, true);
  else
    resting_.forget();
  if (elastic) decompress(problem, solution);
}

// All of e c_n is given back, and what would approach again is kept from it; where an island gains energy by that, so
// much that it cannot.
void AnitescuPotra::decompress(const ContactProblem& problem, ContactSolution& solution) {
  find_islands(problem, islands_);
  bounded_.assign(islands_.count, 0);
  compression_ = solution;
  sizes_ = lcp_.groups.size;
  do {
    solution = compression_;
    lcp_.groups.size = sizes_;
    give_back(problem, solution);
    if (!solve_phase(solution)) return;
    add_impulses(solution);
  } while (bound_gains(problem, solution));
}

void AnitescuPotra::give_back(const ContactProblem& problem, ContactSolution& solution) {
  solution.restitution_scale = restitution_.give_back(problem, factor_, islands_, bounded_, solution.impulse);
  for (int c = 0; c < nc_; ++c) {
    const double* r = &solution.impulse[3 * c];
    double& about = lcp_.groups.size[c];
    about = std::max(about, std::sqrt(weight_[c] * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2])));
    restored_[c] = problem.mu[c] * restitution_.given()[c];
  }
  set_load(problem, restitution_.v());
}

// Does an island that is not bounded yet gain energy, as the referee measures it? It is from now on.
bool AnitescuPotra::bound_gains(const ContactProblem& problem, const ContactSolution& solution) {
  apply_impulse(problem, factor_, solution.impulse, v_);
  contact_velocity(problem, v_, u_);
  contact_velocity(problem, problem.v_minus, scratch_);
  gained_.assign(islands_.count, {0, 0});
  for (int i = 0; i < 3 * nc_; ++i) {
    auto& [gain, before] = gained_[islands_.of_contact[i / 3]];
    gain += solution.impulse[i] * (u_[i] + scratch_[i]) / 2;
    before += solution.impulse[i] * scratch_[i];
  }
  bool again = false;
  for (int g = 0; g < islands_.count; ++g) {
    const auto& [gain, before] = gained_[g];
    if (bounded_[g] || !(gain > gain_rounding * std::abs(before) / 4)) continue;
    bounded_[g] = 1;
    again = true;
  }
  return again;
}

}  // namespace

MethodRow anitescu_potra_row() {
  MethodRow row{"ap",
                "Anitescu and Potra: friction polygon, linear complementarity problem",
                "Anitescu and Potra, Nonlinear Dynamics 14 (1997)",
                anitescu_potra_law(),
                {},
                {},
                {{"k", "-", "4", "edges of the friction polygon, even, at least 4"},
                 {"regularise", "unit of each row", "0", "added to the diagonal of the LCP"},
                 {"warm-start", "-", "off", "try the active set of the previous event first"}},
                [](const MethodOptions& options) -> ContactMethod {
                  auto method = std::make_shared<AnitescuPotra>(options);
                  const auto solve = [method](const ContactProblem& problem, ContactSolution& solution) {
                    method->solve(problem, solution);
                  };
                  return options.warm_start ? reuse_same_event(solve, options.warm_starts) : ContactMethod(solve);
                },
                [](const MethodOptions& options) -> Witness {
                  return PolygonWitness{.k = options.k, .regularisation = options.regularise, .z = {}};
                }};
  for (const LcpSolverRow& solver : lcp_solvers())
    row.solvers.push_back({solver.name, solver.summary, solver.source, solver.unavailable});
  return row;
}

}  // namespace cb
