// convex: least kinetic energy over impulses in the friction cones, with a bound kappa on the sum of normal impulses of
// each island (drumwright_shell.cpp has the program). An answer is feasible, and its duality gap
//   eta.(u_n)+ + r.y + s (kappa - 1.r_n)+,   y = u - W_(:,n) eta,   s: the least that puts y + s e_n into the dual cone
// is within epsilon; the frictionless impulses f and z prove kappa. On an island with restitution Poisson's second
// phase moves the answer off the optimum of the first: what is left is feasibility, and that no energy comes from
// nowhere.
//
// A contact alone, W = diag(W_n, w, w): r_n = -u_n / W_n, r_t = -u_t / w where |u_t| <= w mu r_n, else mu r_n against
// u_t; eta = 0; z = M^-1 N^T / W_n. Without the bound a contact that slides lifts as well: no closed form.

#include <algorithm>
#include <cmath>

#include "contact/evidence.h"
#include "contact/laws.h"
#include "contact/referee.h"
#include "linalg/finite.h"

namespace cb {

namespace {

using ConstVec3 = Eigen::Map<const Eigen::Vector3d>;

/// Scaled u_n up to which the frictionless solution touches, -: the bound on it below. A contact that opens faster
/// than rounding and f itself explain is open, however slowly, and carries nothing in any solution.
constexpr double touching = 1e-9;

/// y = u - W_(:,n) eta, 3 nc, m/s; as a rule eta = 0. v and scratch are kept by the caller.
void dual_velocities(const ContactProblem& problem, const BlockCholesky& factor, const std::vector<double>& u,
                     const std::vector<double>& eta, std::vector<double>& v, std::vector<double>& scratch,
                     std::vector<double>& y) {
  y = u;
  if (std::all_of(eta.begin(), eta.end(), [](double x) { return x == 0; })) return;
  scratch.assign(y.size(), 0.0);
  for (std::size_t c = 0; c < eta.size(); ++c) scratch[3 * c] = eta[c];
  v.assign(problem.nv(), 0.0);
  multiply_transposed_add(problem.J, problem.M, scratch, v);
  factor.solve_in_place(v);
  multiply(problem.J, problem.M, v, scratch);
  for (std::size_t i = 0; i < y.size(); ++i) y[i] -= scratch[i];
}

/// u after the frictionless impulses f alone.
void frictionless_velocities(const ContactProblem& problem, const BlockCholesky& factor, const std::vector<double>& f,
                             std::vector<double>& v, std::vector<double>& u) {
  u.assign(3 * f.size(), 0.0);
  for (std::size_t c = 0; c < f.size(); ++c) u[3 * c] = f[c];
  apply_impulse(problem, factor, u, v);
  contact_velocity(problem, v, u);
}

class ConvexCheck {
 public:
  void operator()(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out);

 private:
  void with_restitution(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at,
                        Worst& worst);
  void least_sum(const ContactProblem& problem, const ConvexWitness& proof, const Evidence& at, Worst& worst);
  void find_misses(const std::vector<double>& f, const Evidence& at);
  void feasibility(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Worst& worst);
  void find_gaps(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at);
  void judge_gaps(const ConvexWitness& proof, const Evidence& at, Residuals& out) const;
  double rounding_of_gap(int island, const Evidence& at) const;

  std::vector<double> y_, u_frictionless_, u_dual_, v_, scratch_;  // 3 nc, 3 nc, 3 nc, nv, 3 nc
  std::vector<double> gains_;                                      // of see_gains
  // Per island: least s, and what rounding leaves open of it; sum of r_n; kappa, and what it is made of; what f leaves
  // of f_i u_n,i = 0; the gap, and what rounding leaves open of it.
  std::vector<double> slack_, slack_rounding_, sum_, kappa_, kappa_scale_, miss_, gap_, gap_rounding_;
};

void ConvexCheck::operator()(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at,
                             Residuals& out) {
  const ConvexWitness& proof = solution.as<ConvexWitness>();
  Worst worst;
  const bool two_phases_all =
      at.elastic && std::find(at.elastic_island.begin(), at.elastic_island.end(), 0) == at.elastic_island.end();
  if (!two_phases_all) {
    if (static_cast<int>(proof.eta.size()) != problem.nc() || !all_finite(proof.eta)) {
      out.gap = out.infeasibility = out.model = out.island_gap = HUGE_VAL;
      return;
    }
    dual_velocities(problem, at.factor, at.u_plus, proof.eta, v_, scratch_, y_);
    kappa_.assign(at.islands.count, 0.0);
    kappa_scale_.assign(at.islands.count, 0.0);
    if (proof.bounded) least_sum(problem, proof, at, worst);
    feasibility(problem, solution, at, worst);
  }
  if (at.elastic) with_restitution(problem, solution, at, worst);
  see_approach(at, worst);
  worst.report(out);
  if (two_phases_all) return;
  out.infeasibility = worst.ratio;
  find_gaps(problem, solution, at);
  judge_gaps(proof, at, out);
}

// What is left of islands with restitution.
void ConvexCheck::with_restitution(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at,
                                   Worst& worst) {
  for (int c = 0; c < problem.nc(); ++c)
    if (at.is_elastic(c))
      see_feasible(problem, solution.impulse, at, at.island_size[at.islands.of_contact[c]], c, worst);
  see_gains(solution.impulse, solution.as<ConvexWitness>().epsilon, at, Which::elastic, gains_, worst);
}

// kappa: the frictionless impulses must solve min 1/2 v.M v, N v + w_n >= 0, and z must prove that no other solution of
// it has a smaller sum: N z <= 1 where contacts touch, f.(1 - N z) = 0 (duality of the linear program). Limits of
// joints do not count in the sum: there 0 stands for 1.
void ConvexCheck::least_sum(const ContactProblem& problem, const ConvexWitness& proof, const Evidence& at,
                            Worst& worst) {
  const int nc = problem.nc();
  const auto& f = proof.frictionless;
  const auto& z = proof.kappa_dual;
  if (static_cast<int>(f.size()) != nc || static_cast<int>(z.size()) != problem.nv() || !all_finite(f) ||
      !all_finite(z)) {
    worst.ratio = HUGE_VAL;
    return;
  }
  frictionless_velocities(problem, at.factor, f, v_, u_frictionless_);
  u_dual_.resize(3 * nc);
  multiply(problem.J, problem.M, z, u_dual_);
  find_misses(f, at);
  for (int c = 0; c < nc; ++c) {
    if (at.is_elastic(c)) continue;
    const int g = at.islands.of_contact[c];
    const double size = at.island_size_q[g];  // impulses with friction, however large, are no matter here
    const double root_w = std::sqrt(at.weight[c]), u_n = u_frictionless_[3 * c];
    const double share = is_limit(problem, c) ? 0 : 1, excess = u_dual_[3 * c] - share;
    at.see(worst, -f[c] * root_w, size, c);
    at.see(worst, -u_n / root_w, size, c);
    at.see(worst, std::min(f[c] * root_w, u_n / root_w), size, c);  // f_i u_n,i = 0
    double touches = touching * size;
    if (!at.rounding.empty()) touches = std::min(touches, at.open(c) / root_w + miss_[g]);

    if (u_n / root_w <= touches) at.see(worst, excess, 1, c);         // N z <= 1 where it touches
    at.see(worst, std::min(-excess * size, f[c] * root_w), size, c);  // f_i (1 - N z)_i = 0
    kappa_[g] += share * f[c];
    kappa_scale_[g] += (std::abs(at.u_minus[3 * c]) + at.open(c) / Referee::accepted) / at.weight[c];
  }
  for (int g = 0; g < at.islands.count; ++g) kappa_scale_[g] = std::max(kappa_scale_[g], std::abs(kappa_[g]));
}

// f solves exactly the problem whose velocities differ by what it leaves of f_i u_n,i = 0: there a contact touches.
void ConvexCheck::find_misses(const std::vector<double>& f, const Evidence& at) {
  miss_.assign(at.islands.count, 0.0);
  for (std::size_t c = 0; c < f.size(); ++c) {
    const double root_w = std::sqrt(at.weight[c]), u_n = u_frictionless_[3 * c] / root_w;
    double& miss = miss_[at.islands.of_contact[c]];
    miss = std::max({miss, -u_n, std::min(f[c] * root_w, u_n)});
  }
}

// The least s that puts every y of an island into the dual cone mu |y_t| <= y_n, and everything that is bounded.
void ConvexCheck::feasibility(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at,
                              Worst& worst) {
  const auto& r = solution.impulse;
  const ConvexWitness& proof = solution.as<ConvexWitness>();
  slack_.assign(at.islands.count, 0.0);
  slack_rounding_.assign(at.islands.count, 0.0);
  sum_.assign(at.islands.count, 0.0);
  for (int c = 0; c < problem.nc(); ++c) {
    if (at.is_elastic(c)) continue;
    const int g = at.islands.of_contact[c];
    const double root_w = std::sqrt(at.weight[c]), size = at.island_size[g], mu = problem.mu[c];
    const double short_of = mu * tangential(y_, c) - y_[3 * c];
    const bool limit = is_limit(problem, c);  // does not count in the bound
    slack_rounding_[g] = std::max(slack_rounding_[g], (1 + mu) * at.open(c));
    if (proof.bounded && !limit)
      slack_[g] = std::max(slack_[g], short_of);
    else
      at.see(worst, short_of / root_w, std::max(size, (1 + mu) * at.open(c) / root_w / Referee::accepted), c);
    at.see(worst, -r[3 * c] * root_w, size, c);
    at.see(worst, (tangential(r, c) - mu * r[3 * c]) * root_w, size, c);
    at.see(worst, -proof.eta[c] * root_w, size, c);
    if (!limit) sum_[g] += r[3 * c];
  }
  if (proof.bounded)
    for (int g = 0; g < at.islands.count; ++g) Evidence::see_island(worst, sum_[g] - kappa_[g], kappa_scale_[g], g);
}

// Gaps island by island: eta.u_n + r.y + s 1.r_n, all three complementary, + s (kappa - 1.r_n), with the bounds that
// the answer meets: u_n below 0 counts as 0, and a sum beyond kappa as kappa (how far they are from the problem's is
// the infeasibility).
void ConvexCheck::find_gaps(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at) {
  const auto& r = solution.impulse;
  const ConvexWitness& proof = solution.as<ConvexWitness>();
  gap_.assign(at.islands.count, 0.0);
  gap_rounding_.assign(at.islands.count, 0.0);
  for (int c = 0; c < problem.nc(); ++c) {
    const int g = at.islands.of_contact[c];
    const ConstVec3 rc(&r[3 * c]), yc(&y_[3 * c]);
    const double eta = proof.eta[c], s = is_limit(problem, c) ? 0 : slack_[g];
    gap_[g] += eta * std::max(at.u_plus[3 * c], 0.0) + rc.dot(yc) + s * rc[0];
    gap_rounding_[g] += at.open(c) * (rc.norm() + std::abs(eta) + (yc.norm() + s) / at.weight[c]);
  }
  if (!proof.bounded) return;
  for (int g = 0; g < at.islands.count; ++g) gap_[g] += slack_[g] * std::max(kappa_[g] - sum_[g], 0.0);
}

// Of velocities, and of the impulses that they determine, J. Large multipliers excuse no more than `accepted` of what
// the island is about.
double ConvexCheck::rounding_of_gap(int island, const Evidence& at) const {
  return std::min(gap_rounding_[island] + slack_rounding_[island] * std::abs(kappa_[island]),
                  Referee::accepted * at.island_size[island] * at.island_size[island]);
}

// What is more than rounding adds up to epsilon at most.
void ConvexCheck::judge_gaps(const ConvexWitness& proof, const Evidence& at, Residuals& out) const {
  double total = 0, excess = 0, worst = -1;
  int worst_island = -1;
  for (int g = 0; g < at.islands.count; ++g) {
    if (at.elastic_island[g]) continue;
    total += gap_[g];
    const double size = at.island_size[g] * at.island_size[g];
    // One number for the law: the gap as a fraction of the energy that the island is about.
    if (gap_[g] != 0) out.model = std::max(out.model, size > 0 ? std::abs(gap_[g]) / size : HUGE_VAL);
    const double beyond = std::abs(gap_[g]) - rounding_of_gap(g, at);
    excess += std::max(beyond, 0.0);
    if (worst_island >= 0 && !(beyond > worst)) continue;
    worst = beyond;
    worst_island = g;
  }
  out.gap = total;
  if (worst_island < 0) return;
  // What the others leave of epsilon.
  const double others = excess - std::max(worst, 0.0);
  out.island_gap = gap_[worst_island];
  out.allowed_gap = rounding_of_gap(worst_island, at) + std::max(proof.epsilon - others, 0.0);
  if (std::abs(out.island_gap) > out.allowed_gap && out.infeasibility <= Referee::accepted) {
    out.worst_island = worst_island;
    out.worst_contact = -1;
  }
}

void rest(const ContactProblem& problem, const Witness& terms, ContactSolution& solution) {
  const auto& asked = std::get<ConvexWitness>(terms);
  ConvexWitness& proof = solution.as<ConvexWitness>();
  proof.bounded = asked.bounded;
  proof.epsilon_relative = asked.epsilon_relative;
  proof.epsilon = asked.epsilon_relative ? *asked.epsilon_relative * energy_before(problem) : asked.epsilon;
  proof.eta.assign(problem.nc(), 0.0);
  if (!proof.bounded) return;
  proof.frictionless.assign(problem.nc(), 0.0);
  proof.kappa_dual.assign(problem.nv(), 0.0);
}

// Without the bound u_n >= 0 follows from optimality and eta = 0. Of islands with restitution nothing is asked of the
// witness.
std::string_view prove(const ImpulsesAlone& answer, ContactSolution& solution) {
  rest(answer.problem, answer.terms, solution);
  std::vector<char> elastic;
  find_elastic(answer.problem, answer.islands, elastic);
  const bool asked = std::find(elastic.begin(), elastic.end(), 0) != elastic.end();
  if (!asked || !solution.as<ConvexWitness>().bounded) return {};
  return "the bound on the sum of normal impulses is known with its proof only from solving the problem";
}

void join(const ProblemPart& part, const ContactSolution& answer, ContactSolution& whole) {
  const ConvexWitness& from = answer.as<ConvexWitness>();
  ConvexWitness& to = whole.as<ConvexWitness>();
  to.epsilon = std::max(to.epsilon, from.epsilon);
  scatter(part.contacts, from.eta, 0, 1, to.eta, 0);
  if (!to.bounded) return;
  scatter(part.contacts, from.frictionless, 0, 1, to.frictionless, 0);
  const std::vector<int>& first = part.problem.M.first;
  if (from.kappa_dual.size() != static_cast<std::size_t>(part.problem.nv())) return;
  for (std::size_t i = 0; i < part.blocks.size(); ++i)
    std::copy(from.kappa_dual.begin() + first[i], from.kappa_dual.begin() + first[i + 1],
              to.kappa_dual.begin() + part.whole.M.first[part.blocks[i]]);
}

class ConvexAlone {
 public:
  explicit ConvexAlone(const Witness& terms) : terms_(terms) {}
  void operator()(const LoneContact& contact, ContactSolution& answer) const {
    rest(contact.problem, terms_, answer);
    const std::vector<double>& u = contact.u;
    const double normal = -u[0] / contact.W_n, slip = std::hypot(u[1], u[2]);
    const double size = std::min(slip / contact.w, contact.problem.mu[0] * normal);
    answer.impulse = {normal, 0, 0};
    for (int i = 1; i < 3 && slip > 0; ++i) answer.impulse[i] = -size * u[i] / slip;
    answer.size = 3;
    ConvexWitness& proof = answer.as<ConvexWitness>();
    proof.frictionless[0] = normal;
    constexpr double unit[] = {1, 0, 0};
    multiply_transposed_add(contact.problem.J, contact.problem.M, unit, proof.kappa_dual);
    contact.factor.solve_in_place(proof.kappa_dual);
    for (double& z : proof.kappa_dual) z /= contact.W_n;
  }

 private:
  Witness terms_;
};

// The bound is per island, and the islands share epsilon: the method parts them itself.
LeaveOut leave_out(const Witness& terms) {
  LeaveOut out{.corners = Corners::suffice, .islands_apart = false};
  if (std::get<ConvexWitness>(terms).bounded) out.closed_form = ConvexAlone(terms);
  return out;
}

}  // namespace

Law convex_law() {
  return {.name = "convex",
          .check = []() -> LawCheck { return ConvexCheck(); },
          .leave_out = leave_out,
          .rest = rest,
          .join = join,
          .prove = prove,
          .lends = true,
          .claims_add_up = true,
          .witness_normals = [](const ContactSolution& solution) -> std::span<const double> {
            const auto& proof = solution.as<ConvexWitness>();
            return proof.bounded ? proof.frictionless : std::span<const double>();
          }};
}

}  // namespace cb
