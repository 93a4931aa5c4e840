// Leaves out of a contact problem what its answer does not need, and completes the answer (pruned.h).
//
// Certificates. Let S be the contacts kept, and r the answer of their problem. A contact c outside S gets r_c = 0, so
// that v+ and the conditions on S stay as they are. For c itself:
//   newton, mirtich   all contacts of its island part: no sweep would touch any.
//   ap                u_n+ >= 0 = c_n; c_t = 0 needs d_i . u_t+ + lam >= 0 for all directions, which
//                     lam = max(0, -min_i d_i . u_t+) gives; lam _|_ mu c_n - E^T c_t = 0 holds for any lam.
//   convex            u_n+ >= 0, and y = u - W_(:,n) eta + s e_n lies in the dual cone, mu |y_t| <= y_n, with the s
//   that
//                     the kept contacts of its island need already (any s where kappa = 0: it costs nothing there).
//                     The bound: u_n > 0 after the frictionless answer, so that c carries nothing in it and N z <= 1 is
//                     not asked of it; and leaving c out must not tear its island, for the bound is per island.
//
// Closed forms for one contact with W_nt = 0 and W_tt = w I:
//   normal       r_n = -u_n / W_nn
//   convex       r_t = -u_t / w where |u_t| <= w mu r_n, else mu r_n against u_t; eta = 0; z = M^-1 N^T / W_nn; without
//                the bound a contact that slides lifts as well: no closed form is used
//   ap           the point of the polygon mu r_n conv{d_i} nearest to -u_t / w, on the two directions beside it

#include "methods/pruned.h"

#include <algorithm>
#include <cmath>

#include "contact/islands.h"
#include "linalg/finite.h"

namespace cb {

namespace {

/// -: a contact stays out if it parts faster than this fraction of its island's fastest velocity,
constexpr double clearly_parting = 1e-6;
/// and than this fraction of the terms that its velocity is the sum of: rounding parts nothing.
constexpr double beyond_rounding = 1e-12;
/// -: after the frictionless answer of `convex` it must part faster than this fraction of what its island is about,
/// sqrt(J): to the referee what parts by less than 1e-9 of that touches, and the proof of the bound is about it too.
constexpr double clearly_apart = 1e-8;
/// -: entries of W_ii that couple normal and tangential directions, as a fraction of w, below which it is decoupled.
constexpr double decoupled = 1e-15;

bool all_zero(const std::vector<double>& x) {
  return std::all_of(x.begin(), x.end(), [](double value) { return value == 0; });
}

// |J_n| |v-| + |w_n| of contact c, m/s.
double normal_terms(const ContactProblem& problem, int c) {
  const BandMatrix& J = problem.J;
  double sum = std::abs(problem.offset[3 * c]);
  for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
    const double* row = J.values.data() + J.offset[e];
    const int first = problem.M.first[J.block[e]], size = problem.M.block_size(J.block[e]);
    for (int i = 0; i < size; ++i) sum += std::abs(row[3 * i] * problem.v_minus[first + i]);
  }
  return sum;
}

// Does any contact part (or is not a number)?
bool any_parts(const ContactProblem& problem) {
  const BandMatrix& J = problem.J;
  for (int c = 0; c < problem.nc(); ++c) {
    double u_n = problem.offset[3 * c];
    for (int e = J.band[c]; e < J.band[c + 1]; ++e) {
      const double* row = J.values.data() + J.offset[e];
      const int first = problem.M.first[J.block[e]], size = problem.M.block_size(J.block[e]);
      for (int i = 0; i < size; ++i) u_n += row[3 * i] * problem.v_minus[first + i];
    }
    if (!(u_n <= 0)) return true;
  }
  return false;
}

class Pruned {
 public:
  Pruned(const MethodRow& row, const MethodOptions& options, std::shared_ptr<LeftOut> left_out,
         const PruneOptions& prune)
      : make_(row.make), law_(row.law), options_(options), prune_(prune), left_out_(std::move(left_out)) {
    options_.idle_friction = !prune.idle_friction;
    counts_idle_friction_ = prune.idle_friction && law_ == Law::anitescu_potra && options.regularise == 0;
    closed_form_ = prune.closed_forms && ((law_ == Law::anitescu_potra && options.regularise == 0) ||
                                          (law_ == Law::convex && options.compression_bound));
    if (law_ == Law::anitescu_potra)
      for (int i = 0; i < options.k; ++i)
        directions_.emplace_back(std::cos(2 * M_PI * i / options.k), std::sin(2 * M_PI * i / options.k));
  }
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  bool look(const ContactProblem& problem);
  void leave_out_parting(const ContactProblem& problem);
  bool tears_an_island(const ContactProblem& problem);
  void keep_mixed_islands();
  void solve_parts(const ContactProblem& problem, ContactSolution& solution);
  bool solve_parts(const ContactProblem& problem, bool together, ContactSolution& solution);
  void begin(const ContactProblem& problem, ContactSolution& solution) const;
  void extract(const ContactProblem& problem, std::span<const int> contacts, std::span<const int> blocks);
  bool closed_form(const ContactProblem& part, ContactSolution& answer);
  void take_over(const ContactProblem& problem, std::span<const int> contacts, std::span<const int> blocks,
                 ContactSolution& solution) const;
  bool certify(const ContactProblem& problem, ContactSolution& solution);
  void find_sizes(const ContactProblem& problem);
  void bring_all_back();

  void call_method(int part, const ContactProblem& problem, ContactSolution& solution);

  ContactMethod (*make_)(const MethodOptions&);
  std::vector<ContactMethod> methods_;  // one; with a warm start one a part, for each to know its own previous event
  Law law_;
  MethodOptions options_;
  PruneOptions prune_;
  bool closed_form_ = false, counts_idle_friction_ = false;
  std::size_t phases_ = 1;                   // ap: compression, and restitution where any contact has it
  std::vector<Eigen::Vector2d> directions_;  // ap: k, of the friction polygon
  std::shared_ptr<LeftOut> left_out_;

  std::vector<double> u_;      // 3 nc, before the event
  std::vector<double> speed_;  // per island, m/s: largest entry of its u_
  std::vector<char> out_;      // nc: left out as parting?
  int out_count_ = 0;
  Islands islands_, islands_kept_;               // of the whole problem; without the contacts left out
  std::vector<int> joined_band_, joined_block_;  // what islands_ were found from
  std::vector<int> part_of_contact_, part_of_block_, block_in_part_;
  Groups contacts_of_, blocks_of_;

  ContactProblem part_;
  ContactSolution answer_;
  BlockCholesky factor_;
  std::vector<Eigen::Matrix3d> W_;
  std::vector<double> v_, u_plus_, y_, scratch_, slack_, kappa_, weight_, size_, terms_;
};

void Pruned::operator()(const ContactProblem& problem, ContactSolution& solution) {
  left_out_->failed.reset();
  if (closed_form_ && problem.nc() == 1 && closed_form(problem, solution)) {
    ++left_out_->closed_forms;
    return;
  }
  if (!look(problem)) {
    call_method(0, problem, solution);
    return;
  }
  for (;;) {
    solve_parts(problem, solution);
    if (out_count_ == 0 || certify(problem, solution)) break;
    // Contacts that came back may be an island beside the rest of theirs.
    if (law_ == Law::convex && tears_an_island(problem)) bring_all_back();
  }
  left_out_->parted_contacts += out_count_;
}

void Pruned::call_method(int part, const ContactProblem& problem, ContactSolution& solution) {
  const std::size_t index = options_.warm_start ? part : 0;
  while (methods_.size() <= index) methods_.push_back(make_(options_));
  methods_[index](problem, solution);
  if (solution.status != Status::ok && solution.status != Status::inaccurate) left_out_->failed = problem;
  if (counts_idle_friction_ && all_zero(problem.restitution))
    left_out_->idle_friction += std::count(problem.mu.begin(), problem.mu.end(), 0.0);
}

// Is there anything to leave out? Decides which contacts, and finds the islands.
bool Pruned::look(const ContactProblem& problem) {
  const int nc = problem.nc();
  if (nc == 0) return false;
  if (problem.M.blocks() == 1 && nc > 1 && !any_parts(problem)) return false;  // at little cost
  contact_velocity(problem, problem.v_minus, u_);
  if (!all_finite(u_)) return false;
  const bool elastic = !all_zero(problem.restitution);
  // The same bodies touch as in the event before, as a rule.
  if (problem.J.band != joined_band_ || problem.J.block != joined_block_ ||
      problem.M.blocks() != static_cast<int>(islands_.of_block.size())) {
    find_islands(problem, islands_);
    joined_band_ = problem.J.band;
    joined_block_ = problem.J.block;
  }
  out_.assign(nc, 0);
  out_count_ = 0;
  if (!elastic && prune_.parted_contacts) leave_out_parting(problem);
  if (out_count_ > 0 && (law_ == Law::newton || law_ == Law::mirtich)) keep_mixed_islands();
  if (out_count_ > 0 && law_ == Law::convex && tears_an_island(problem)) {
    out_.assign(nc, 0);
    out_count_ = 0;
  }
  const bool several = prune_.islands && islands_.count > 1 && law_ != Law::convex;
  const bool alone = closed_form_ && !elastic && nc == islands_.count;
  return out_count_ > 0 || several || alone;
}

void Pruned::leave_out_parting(const ContactProblem& problem) {
  speed_.assign(islands_.count, 0.0);
  for (std::size_t i = 0; i < u_.size(); ++i) {
    double& speed = speed_[islands_.of_contact[i / 3]];
    speed = std::max(speed, std::abs(u_[i]));
  }
  for (int c = 0; c < problem.nc(); ++c) {
    const double u_n = u_[3 * c];
    if (u_n <= clearly_parting * speed_[islands_.of_contact[c]] || u_n <= beyond_rounding * normal_terms(problem, c))
      continue;
    out_[c] = 1;
    ++out_count_;
  }
}

// Contacts stay out only where all of their island part.
void Pruned::keep_mixed_islands() {
  std::vector<int>& stays = islands_.scratch;
  stays.assign(islands_.count, 0);
  for (std::size_t c = 0; c < out_.size(); ++c)
    if (!out_[c]) stays[islands_.of_contact[c]] = 1;
  for (std::size_t c = 0; c < out_.size(); ++c) {
    if (!out_[c] || !stays[islands_.of_contact[c]]) continue;
    out_[c] = 0;
    --out_count_;
  }
}

// Would an island fall apart without the contacts that are left out?
bool Pruned::tears_an_island(const ContactProblem& problem) {
  part_.J.clear();
  for (int c = 0; c < problem.nc(); ++c) {
    if (out_[c]) continue;
    part_.J.add_band();
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) part_.J.add_entry(problem.J.block[e], 0);
  }
  part_.M = problem.M;
  find_islands(part_, islands_kept_);
  // Each island of the whole may hold one island of the rest at most.
  std::vector<int>& of_island = islands_kept_.scratch;
  of_island.assign(islands_.count, -1);
  for (int c = 0, kept = 0; c < problem.nc(); ++c) {
    if (out_[c]) continue;
    int& island = of_island[islands_.of_contact[c]];
    const int now = islands_kept_.of_contact[kept++];
    if (island >= 0 && island != now) return true;
    island = now;
  }
  return false;
}

void Pruned::solve_parts(const ContactProblem& problem, ContactSolution& solution) {
  // Parts: the islands; for the convex model, which parts islands itself and gives each its share of epsilon, one of
  // everything, unless each island has a closed form.
  const bool together = !prune_.islands || (law_ == Law::convex && problem.nc() > islands_.count);
  if (!solve_parts(problem, together, solution)) solve_parts(problem, true, solution);
}

// False where a part would have to be handed to a method that wants all of them together.
bool Pruned::solve_parts(const ContactProblem& problem, bool together, ContactSolution& solution) {
  const int nc = problem.nc(), blocks = problem.M.blocks();
  const int parts = together ? 1 : islands_.count;
  part_of_contact_.assign(nc, 0);
  part_of_block_.assign(blocks, 0);
  if (!together) {
    part_of_contact_ = islands_.of_contact;
    part_of_block_ = islands_.of_block;
  }
  for (int c = 0; c < nc; ++c)
    if (out_[c]) part_of_contact_[c] = -1;
  contacts_of_.assign(part_of_contact_, parts);
  blocks_of_.assign(part_of_block_, parts);

  phases_ = all_zero(problem.restitution) ? 1 : 2;
  begin(problem, solution);
  int solved = 0;
  for (int part = 0; part < parts; ++part) {
    const std::span<const int> contacts = contacts_of_[part], of_part = blocks_of_[part];
    if (contacts.empty()) continue;
    ++solved;
    extract(problem, contacts, of_part);
    if (closed_form_ && contacts.size() == 1 && closed_form(part_, answer_))
      ++left_out_->closed_forms;
    else if (law_ == Law::convex && !together)
      return false;
    else
      call_method(part, part_, answer_);
    take_over(problem, contacts, of_part, solution);
  }
  if (solved > 1) left_out_->islands += solved;
  if (solved == 0) ++left_out_->solver_calls;
  return true;
}

// An answer of zeros, in the shape that the law asks for.
void Pruned::begin(const ContactProblem& problem, ContactSolution& solution) const {
  const std::size_t nc = problem.nc();
  solution.clear();
  solution.impulse.assign(3 * nc, 0.0);
  switch (law_) {
    case Law::newton:
      break;
    case Law::mirtich:
      solution.compression_work.assign(nc, 0.0);
      solution.restitution_work.assign(nc, 0.0);
      solution.friction_work.assign(nc, 0.0);
      break;
    case Law::anitescu_potra:
      solution.k = options_.k;
      solution.regularisation = options_.regularise;
      solution.z.assign(phases_ * (options_.k + 2) * nc, 0.0);
      break;
    case Law::convex:
      solution.eta.assign(nc, 0.0);
      solution.bounded = options_.compression_bound;
      if (solution.bounded) {
        solution.frictionless.assign(nc, 0.0);
        solution.kappa_dual.assign(problem.nv(), 0.0);
      }
      solution.epsilon = options_.epsilon_relative.value_or(0) * 0.5 * quadratic_form(problem.M, problem.v_minus);
      if (!options_.epsilon_relative) solution.epsilon = options_.epsilon;
      break;
  }
}

void Pruned::extract(const ContactProblem& problem, std::span<const int> contacts, std::span<const int> blocks) {
  part_.clear();
  block_in_part_.resize(problem.M.blocks());
  for (const int b : blocks) {
    block_in_part_[b] = part_.M.add_block(problem.M.block_size(b));
    part_.M.block(block_in_part_[b]) = problem.M.block(b);
    part_.v_minus.insert(part_.v_minus.end(), problem.v_minus.begin() + problem.M.first[b],
                         problem.v_minus.begin() + problem.M.first[b + 1]);
  }
  for (const int c : contacts) {
    part_.J.add_band();
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const auto entry = problem.J.entry(e);
      const int k = part_.J.add_entry(block_in_part_[problem.J.block[e]], static_cast<int>(entry.cols()));
      part_.J.entry(k) = entry;
    }
    part_.mu.push_back(problem.mu[c]);
    part_.restitution.push_back(problem.restitution[c]);
    part_.offset.insert(part_.offset.end(), problem.offset.begin() + 3 * c, problem.offset.begin() + 3 * c + 3);
  }
}

// The answer of a part with one contact, where there is a formula for it.
bool Pruned::closed_form(const ContactProblem& part, ContactSolution& answer) {
  if (!factor_.factor(part.M)) return false;
  diagonal_blocks(part, factor_, W_);
  const Eigen::Matrix3d& W = W_[0];
  const double w = (W(1, 1) + W(2, 2)) / 2, Wn = W(0, 0), small = decoupled * (w + Wn);
  const double coupling = std::abs(W(1, 0)) + std::abs(W(2, 0)) + std::abs(W(2, 1)) + std::abs(W(1, 1) - W(2, 2));
  if (!(Wn > 0 && w > 0 && coupling <= small)) return false;
  if (part.restitution[0] != 0 || !(part.mu[0] >= 0) || !std::isfinite(part.mu[0])) return false;
  contact_velocity(part, part.v_minus, u_plus_);
  if (u_plus_[0] > 0) return false;

  answer.clear();
  const double normal = -u_plus_[0] / Wn, reach = part.mu[0] * normal;
  const double slip = std::hypot(u_plus_[1], u_plus_[2]);
  answer.impulse = {normal, 0, 0};
  if (law_ == Law::convex) {
    const double size = std::min(slip / w, reach);
    for (int i = 1; i < 3 && slip > 0; ++i) answer.impulse[i] = -size * u_plus_[i] / slip;
    answer.size = 3;
    answer.bounded = true;
    answer.eta = {0};
    answer.frictionless = {normal};
    answer.kappa_dual.assign(part.nv(), 0.0);
    constexpr double unit[] = {1, 0, 0};
    multiply_transposed_add(part.J, part.M, unit, answer.kappa_dual);
    factor_.solve_in_place(answer.kappa_dual);
    for (double& z : answer.kappa_dual) z /= Wn;
    answer.epsilon = options_.epsilon_relative ? *options_.epsilon_relative * quadratic_form(part.M, part.v_minus) / 2
                                               : options_.epsilon;
    return true;
  }

  // ap: -u_t / w if it lies in the polygon, else the nearest point of the edge that faces it.
  const int k = options_.k;
  answer.k = k;
  answer.size = k + 2;
  answer.z.assign(k + 2, 0.0);
  answer.z[0] = normal;
  const double sector = 2 * M_PI / k, half_angle = sector / 2;
  double angle = std::atan2(-u_plus_[2], -u_plus_[1]);
  if (angle < 0) angle += 2 * M_PI;
  int first = static_cast<int>(angle / sector) % k;
  const int second = (first + 1) % k;
  const Eigen::Vector2d a = directions_[first], b = directions_[second], wanted(-u_plus_[1] / w, -u_plus_[2] / w);
  // Coordinates of `wanted` in the directions a, b.
  const double area = a.x() * b.y() - a.y() * b.x();
  double ca = (wanted.x() * b.y() - wanted.y() * b.x()) / area, cb = (a.x() * wanted.y() - a.y() * wanted.x()) / area;
  ca = std::max(ca, 0.0);
  cb = std::max(cb, 0.0);
  const bool slides = ca + cb > reach;
  if (slides) {
    // Along the edge from reach a to reach b, whose length is 2 reach sin(half_angle).
    const double edge = 2 * std::sin(half_angle);
    const double along = reach > 0 ? std::clamp((wanted - reach * a).dot(b - a) / (edge * edge * reach), 0.0, 1.0) : 0;
    ca = (1 - along) * reach;
    cb = along * reach;
  }
  answer.z[1 + first] = ca;
  answer.z[1 + second] = cb;
  answer.impulse[1] = ca * a.x() + cb * b.x();
  answer.impulse[2] = ca * a.y() + cb * b.y();
  double lam = 0;
  const double u1 = u_plus_[1] + w * answer.impulse[1], u2 = u_plus_[2] + w * answer.impulse[2];
  if (slides)
    for (int i = 0; i < k; ++i) lam = std::max(lam, -directions_[i].dot(Eigen::Vector2d(u1, u2)));
  answer.z[k + 1] = lam;
  return true;
}

void Pruned::take_over(const ContactProblem& problem, std::span<const int> contacts, std::span<const int> blocks,
                       ContactSolution& solution) const {
  const ContactSolution& answer = answer_;
  if (answer.status > solution.status) {
    solution.status = answer.status;
    solution.reason = answer.reason;
  }
  solution.iterations += answer.iterations;
  solution.size += answer.size;
  if (law_ == Law::convex)
    solution.claimed_residual += answer.claimed_residual;
  else
    solution.claimed_residual = std::max(solution.claimed_residual, answer.claimed_residual);
  solution.epsilon = std::max(solution.epsilon, answer.epsilon);
  solution.restitution_scale = std::min(solution.restitution_scale, answer.restitution_scale);

  const std::size_t n = contacts.size(), nc = problem.nc(), k = options_.k;
  const auto scatter = [&](const std::vector<double>& from, std::size_t first, std::size_t width,
                           std::vector<double>& to, std::size_t to_first) {
    if (from.size() < first + n * width) return;  // a method that failed may leave its answer empty
    for (std::size_t i = 0; i < n; ++i)
      std::copy_n(from.begin() + static_cast<long>(first + i * width), width,
                  to.begin() + static_cast<long>(to_first + width * contacts[i]));
  };
  scatter(answer.impulse, 0, 3, solution.impulse, 0);
  switch (law_) {
    case Law::newton:
      break;
    case Law::mirtich:
      scatter(answer.compression_work, 0, 1, solution.compression_work, 0);
      scatter(answer.restitution_work, 0, 1, solution.restitution_work, 0);
      scatter(answer.friction_work, 0, 1, solution.friction_work, 0);
      break;
    case Law::anitescu_potra:
      for (std::size_t phase = 0, at = 0, to = 0; phase < phases_; ++phase, to += (k + 2) * nc) {
        const bool idle = at + (k + 2) * n > answer.z.size();  // without restitution: nothing but the slips of before
        if (idle) at = 0;
        if (!idle) scatter(answer.z, at, 1, solution.z, to);
        if (!idle) scatter(answer.z, at + n, k, solution.z, to + nc);
        scatter(answer.z, at + n + k * n, 1, solution.z, to + nc + k * nc);
        at += (k + 2) * n;
      }
      break;
    case Law::convex:
      scatter(answer.eta, 0, 1, solution.eta, 0);
      if (!solution.bounded) break;
      scatter(answer.frictionless, 0, 1, solution.frictionless, 0);
      if (answer.kappa_dual.size() == static_cast<std::size_t>(part_.nv()))
        for (std::size_t i = 0; i < blocks.size(); ++i)
          std::copy(answer.kappa_dual.begin() + part_.M.first[i], answer.kappa_dual.begin() + part_.M.first[i + 1],
                    solution.kappa_dual.begin() + problem.M.first[blocks[i]]);
      break;
  }
}

// Do the contacts left out satisfy the law with zero impulse? Completes their multipliers. Those that do not are
// brought back, and the answer is false.
bool Pruned::certify(const ContactProblem& problem, ContactSolution& solution) {
  const int nc = problem.nc();
  if (solution.status != Status::ok && solution.status != Status::inaccurate) return true;  // nothing to complete
  if (!factor_.factor(problem.M)) return true;
  apply_impulse(problem, factor_, solution.impulse, v_);
  contact_velocity(problem, v_, u_plus_);
  const auto tangential = [](const double* x) { return std::hypot(x[1], x[2]); };

  if (law_ == Law::convex) {
    y_ = u_plus_;
    scratch_.assign(3 * nc, 0.0);
    for (int c = 0; c < nc; ++c) scratch_[3 * c] = solution.eta[c];
    v_.assign(problem.nv(), 0.0);
    multiply_transposed_add(problem.J, problem.M, scratch_, v_);
    factor_.solve_in_place(v_);
    multiply(problem.J, problem.M, v_, scratch_);
    for (int i = 0; i < 3 * nc; ++i) y_[i] -= scratch_[i];
    slack_.assign(islands_.count, 0.0);
    kappa_.assign(islands_.count, 0.0);
    for (int c = 0; c < nc; ++c) {
      if (out_[c] || !solution.bounded) continue;
      const int island = islands_.of_contact[c];
      slack_[island] = std::max(slack_[island], problem.mu[c] * tangential(&y_[3 * c]) - y_[3 * c]);
      kappa_[island] += solution.frictionless[c];
    }
    if (solution.bounded) {  // velocities after the frictionless answer
      scratch_.assign(3 * nc, 0.0);
      for (int c = 0; c < nc; ++c) scratch_[3 * c] = solution.frictionless[c];
      apply_impulse(problem, factor_, scratch_, v_);
      contact_velocity(problem, v_, scratch_);
      find_sizes(problem);
    }
  }

  int failed = 0;
  for (int c = 0; c < nc; ++c) {
    if (!out_[c]) continue;
    bool holds = u_plus_[3 * c] >= 0;
    if (law_ == Law::convex) {
      const double missing = problem.mu[c] * tangential(&y_[3 * c]) - y_[3 * c];
      const int island = islands_.of_contact[c];
      holds = holds && (missing <= slack_[island] || (solution.bounded && kappa_[island] == 0));
      if (solution.bounded)
        holds = holds && scratch_[3 * c] > std::max({clearly_parting * speed_[island], beyond_rounding * terms_[island],
                                                     clearly_apart * size_[island] * std::sqrt(weight_[c])});
    } else if (law_ == Law::anitescu_potra) {
      double lam = 0;
      for (int i = 0; i < options_.k; ++i) {
        lam = std::max(lam, -directions_[i].dot(Eigen::Vector2d(u_plus_[3 * c + 1], u_plus_[3 * c + 2])));
      }
      solution.z[nc + options_.k * nc + c] = lam;
    }
    if (holds) continue;
    out_[c] = 0;
    --out_count_;
    ++failed;
  }
  left_out_->brought_back += failed;
  return failed == 0;
}

// Of each island: |u-| / sqrt(w) over its contacts, sqrt(J), and the largest terms of a normal velocity, m/s: what one
// velocity rounds by is no motion of another.
void Pruned::find_sizes(const ContactProblem& problem) {
  contact_weights(problem, factor_, weight_);
  size_.assign(islands_.count, 0.0);
  for (int c = 0; c < problem.nc(); ++c)
    size_[islands_.of_contact[c]] += Eigen::Map<const Eigen::Vector3d>(&u_[3 * c]).squaredNorm() / weight_[c];
  for (double& size : size_) size = std::sqrt(size);
  terms_.assign(islands_.count, 0.0);
  for (int c = 0; c < problem.nc(); ++c)
    terms_[islands_.of_contact[c]] = std::max(terms_[islands_.of_contact[c]], normal_terms(problem, c));
}

void Pruned::bring_all_back() {
  left_out_->brought_back += out_count_;
  out_.assign(out_.size(), 0);
  out_count_ = 0;
}

}  // namespace

std::vector<LeftOutItem> items(const LeftOut& left_out) {
  return {
      {"islands solved apart", "bodies that no contact joins do not change each other", left_out.islands},
      {"separating contacts", "they carry nothing, which is checked after the solve", left_out.parted_contacts},
      {"separating contacts brought back", "the check failed: solved again with them", left_out.brought_back},
      {"solver calls for events in which all contacts separate", "there is nothing to solve", left_out.solver_calls},
      {"solver calls for single contacts with a closed form", "one contact through a centre of mass has a formula",
       left_out.closed_forms},
      {"unknowns of friction of contacts with mu = 0", "they are zero, or follow from the slip",
       left_out.idle_friction},
  };
}

ContactMethod pruned(const MethodRow& row, const MethodOptions& options, std::shared_ptr<LeftOut> left_out,
                     const PruneOptions& prune) {
  auto method = std::make_shared<Pruned>(row, options, std::move(left_out), prune);
  return [method](const ContactProblem& problem, ContactSolution& solution) { (*method)(problem, solution); };
}

}  // namespace cb
