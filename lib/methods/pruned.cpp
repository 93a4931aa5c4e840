// Leaves out of a contact problem what its answer does not need, and completes the answer (pruned.h).
//
// Certificates. Let S be the contacts kept, and r the answer of their problem. A contact c outside S gets r_c = 0, so
// that v+ and the conditions on S stay as they are. What the law asks of c itself it says (contact/laws.h: idle), and
// so it does which contacts may stay out, what a contact alone carries, and how parts are put together.

#include "methods/pruned.h"

#include <algorithm>
#include <cmath>

#include "contact/parting.h"
#include "linalg/finite.h"

namespace cb {

namespace {

/// -: entries of W_ii that couple normal and tangential directions, as a fraction of w, below which it is decoupled.
constexpr double decoupled = 1e-15;

bool all_zero(const std::vector<double>& x) {
  return std::all_of(x.begin(), x.end(), [](double value) { return value == 0; });
}

bool gave_up(const ContactSolution& solution) {
  return solution.status != Status::ok && solution.status != Status::inaccurate;
}

class Pruned {
 public:
  Pruned(const MethodRow& row, const MethodOptions& options, std::shared_ptr<LeftOut> left_out,
         const PruneOptions& prune)
      : make_(row.make),
        law_(row.law),
        options_(options),
        prune_(prune),
        left_out_(std::move(left_out)),
        terms_(row.terms(options)),
        may_(law_.leave_out(terms_)) {
    options_.idle_friction = !prune.idle_friction;
    may_.idle_friction = may_.idle_friction && prune.idle_friction;
    may_.islands_apart = may_.islands_apart && prune.islands;
    if (!prune.closed_forms) may_.closed_form = {};
    if (law_.idle) idle_ = law_.idle();
  }
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  bool look(const ContactProblem& problem);
  void find_same_islands(const ContactProblem& problem);
  void leave_out_parting(const ContactProblem& problem);
  bool tears_an_island(const ContactProblem& problem);
  void keep_mixed_islands();
  void solve_parts(const ContactProblem& problem, ContactSolution& solution);
  bool solve_parts(const ContactProblem& problem, bool together, ContactSolution& solution);
  void group(const ContactProblem& problem, bool together);
  void begin(const ContactProblem& problem, ContactSolution& solution) const;
  void extract(const ContactProblem& problem, std::span<const int> contacts, std::span<const int> blocks);
  bool closed_form(const ContactProblem& part, ContactSolution& answer);
  void take_over(const ProblemPart& part, ContactSolution& solution) const;
  bool certify(const ContactProblem& problem, ContactSolution& solution);
  void bring_all_back();
  void call_method(int part, const ContactProblem& problem, ContactSolution& solution);

  std::function<ContactMethod(const MethodOptions&)> make_;
  std::vector<ContactMethod> methods_;  // one; with a warm start one a part, for each to know its own previous event
  Law law_;
  MethodOptions options_;
  PruneOptions prune_;
  std::shared_ptr<LeftOut> left_out_;
  Witness terms_;
  LeaveOut may_;    // what the law allows and nobody told off
  IdleCheck idle_;  // empty: nothing is asked but that it parts

  std::vector<double> u_;          // 3 nc, before the event
  std::vector<double> speed_;      // per island, m/s: largest entry of its u_
  std::vector<char> out_, holds_;  // nc: left out as parting? does it satisfy the law?
  int out_count_ = 0;
  Islands islands_, islands_kept_;               // of the whole problem; without the contacts left out
  std::vector<int> joined_band_, joined_block_;  // what islands_ were found from
  std::vector<int> part_of_contact_, part_of_block_, block_in_part_;
  Groups contacts_of_, blocks_of_;

  ContactProblem part_;
  ContactSolution answer_;
  BlockCholesky factor_;
  std::vector<Eigen::Matrix3d> W_;
  std::vector<double> v_, u_plus_;
};

void Pruned::operator()(const ContactProblem& problem, ContactSolution& solution) {
  left_out_->failed.reset();
  if (problem.nc() == 1 && closed_form(problem, solution)) {
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
    if (may_.parting == Parting::untorn && tears_an_island(problem)) bring_all_back();
  }
  left_out_->parted_contacts += out_count_;
}

void Pruned::call_method(int part, const ContactProblem& problem, ContactSolution& solution) {
  const std::size_t index = options_.warm_start ? part : 0;
  while (methods_.size() <= index) methods_.push_back(make_(options_));
  methods_[index](problem, solution);
  if (gave_up(solution)) left_out_->failed = problem;
  if (may_.idle_friction && all_zero(problem.restitution))
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
  find_same_islands(problem);
  out_.assign(nc, 0);
  out_count_ = 0;
  if (!elastic && prune_.parted_contacts) leave_out_parting(problem);
  if (out_count_ > 0 && may_.parting == Parting::whole_islands) keep_mixed_islands();
  if (out_count_ > 0 && may_.parting == Parting::untorn && tears_an_island(problem)) {
    out_.assign(nc, 0);
    out_count_ = 0;
  }
  const bool several = may_.islands_apart && islands_.count > 1;
  const bool alone = may_.closed_form && !elastic && nc == islands_.count;
  return out_count_ > 0 || several || alone;
}

// The same bodies touch as in the event before, as a rule.
void Pruned::find_same_islands(const ContactProblem& problem) {
  if (problem.J.band == joined_band_ && problem.J.block == joined_block_ &&
      problem.M.blocks() == static_cast<int>(islands_.of_block.size()))
    return;
  find_islands(problem, islands_);
  joined_band_ = problem.J.band;
  joined_block_ = problem.J.block;
}

void Pruned::leave_out_parting(const ContactProblem& problem) {
  island_speeds(islands_, u_, speed_);
  for (int c = 0; c < problem.nc(); ++c) {
    const double u_n = u_[3 * c];
    if (u_n <= clearly_parting * speed_[islands_.of_contact[c]] ||
        u_n <= parting_beyond_rounding * normal_terms(problem, c))
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

// Parts: the islands; for a method that parts islands itself one of everything, unless each island has a closed form.
void Pruned::solve_parts(const ContactProblem& problem, ContactSolution& solution) {
  const bool alone = prune_.islands && problem.nc() <= islands_.count;
  if (!solve_parts(problem, !may_.islands_apart && !alone, solution)) solve_parts(problem, true, solution);
}

// False where a part would have to be handed to a method that wants all of them together.
bool Pruned::solve_parts(const ContactProblem& problem, bool together, ContactSolution& solution) {
  group(problem, together);
  begin(problem, solution);
  int solved = 0;
  for (int part = 0; part < (together ? 1 : islands_.count); ++part) {
    const std::span<const int> contacts = contacts_of_[part], blocks = blocks_of_[part];
    if (contacts.empty()) continue;
    ++solved;
    extract(problem, contacts, blocks);
    if (contacts.size() == 1 && closed_form(part_, answer_))
      ++left_out_->closed_forms;
    else if (!may_.islands_apart && !together)
      return false;
    else
      call_method(part, part_, answer_);
    take_over({problem, part_, contacts, blocks}, solution);
  }
  if (solved > 1) left_out_->islands += solved;
  if (solved == 0) ++left_out_->solver_calls;
  return true;
}

void Pruned::group(const ContactProblem& problem, bool together) {
  part_of_contact_.assign(problem.nc(), 0);
  part_of_block_.assign(problem.M.blocks(), 0);
  if (!together) {
    part_of_contact_ = islands_.of_contact;
    part_of_block_ = islands_.of_block;
  }
  for (int c = 0; c < problem.nc(); ++c)
    if (out_[c]) part_of_contact_[c] = -1;
  const int parts = together ? 1 : islands_.count;
  contacts_of_.assign(part_of_contact_, parts);
  blocks_of_.assign(part_of_block_, parts);
}

// An answer of zeros, in the shape that the law asks for.
void Pruned::begin(const ContactProblem& problem, ContactSolution& solution) const {
  solution.clear();
  solution.impulse.assign(3 * problem.nc(), 0.0);
  if (law_.rest) law_.rest(problem, terms_, solution);
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
  if (!may_.closed_form || !factor_.factor(part.M)) return false;
  diagonal_blocks(part, factor_, W_);
  const Eigen::Matrix3d& W = W_[0];
  const double w = (W(1, 1) + W(2, 2)) / 2, W_n = W(0, 0), small = decoupled * (w + W_n);
  const double coupling = std::abs(W(1, 0)) + std::abs(W(2, 0)) + std::abs(W(2, 1)) + std::abs(W(1, 1) - W(2, 2));
  if (!(W_n > 0 && w > 0 && coupling <= small)) return false;
  if (part.restitution[0] != 0 || !(part.mu[0] >= 0) || !std::isfinite(part.mu[0])) return false;
  contact_velocity(part, part.v_minus, u_plus_);
  if (u_plus_[0] > 0) return false;
  answer.clear();
  may_.closed_form({part, factor_, W_n, w, u_plus_}, answer);
  return true;
}

// The answer of a part as that of its contacts in the whole.
void Pruned::take_over(const ProblemPart& part, ContactSolution& solution) const {
  const ContactSolution& answer = answer_;
  if (answer.status > solution.status) {
    solution.status = answer.status;
    solution.reason = answer.reason;
  }
  solution.iterations += answer.iterations;
  solution.size += answer.size;
  solution.claimed_residual = law_.claims_add_up ? solution.claimed_residual + answer.claimed_residual
                                                 : std::max(solution.claimed_residual, answer.claimed_residual);
  solution.restitution_scale = std::min(solution.restitution_scale, answer.restitution_scale);
  scatter(part.contacts, answer.impulse, 0, 3, solution.impulse, 0);
  if (law_.join) law_.join(part, answer, solution);
}

// Do the contacts left out satisfy the law with zero impulse? Those that do not are brought back, and the answer is
// false. So are all where the method gave up: what it cannot answer without them it may with them.
bool Pruned::certify(const ContactProblem& problem, ContactSolution& solution) {
  if (gave_up(solution)) {
    bring_all_back();
    return false;
  }
  if (!factor_.factor(problem.M)) return true;  // nothing to complete
  apply_impulse(problem, factor_, solution.impulse, v_);
  contact_velocity(problem, v_, u_plus_);
  const int nc = problem.nc();
  holds_.resize(nc);
  for (int c = 0; c < nc; ++c) holds_[c] = u_plus_[3 * c] >= 0;
  if (idle_) idle_({problem, factor_, islands_, out_, u_, u_plus_}, solution, holds_);
  int failed = 0;
  for (int c = 0; c < nc; ++c) {
    if (!out_[c] || holds_[c]) continue;
    out_[c] = 0;
    --out_count_;
    ++failed;
  }
  left_out_->brought_back += failed;
  return failed == 0;
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
