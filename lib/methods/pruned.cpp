// Leaves out of a contact problem what its answer does not need, and completes the answer (pruned.h). What the law
// allows, what a contact alone carries, and how the answers of parts are put together it says itself (contact/laws.h).

#include "methods/pruned.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "linalg/finite.h"
#include "linalg/parallel.h"

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

/// A part as a problem of its own, with its answer.
struct Part {
  ContactProblem problem;
  ContactSolution answer;
  enum class By { formula, method, memory, nobody } by = By::nobody;
};

/// Answers of the event before, for problems that come again to the last bit. What moves never does: of it a number is
/// kept alone, and a problem where its number comes a second time.
class Memory {
 public:
  void begin_event() {
    before_.swap(now_);
    now_.clear();
  }
  /// Null where there is none; from any thread.
  const ContactSolution* find(const ContactProblem& problem) const {
    const auto found = before_.find(number_of(problem));
    return found != before_.end() && found->second && same(found->second->problem, problem) ? &found->second->answer
                                                                                            : nullptr;
  }
  /// Of the present event, after begin_event().
  void keep(const ContactProblem& problem, const ContactSolution& answer) {
    const std::uint64_t number = number_of(problem);
    const auto found = before_.find(number);
    std::shared_ptr<const Known>& known = now_[number];
    if (known || found == before_.end() || answer.status != Status::ok) return;
    if (found->second && same(found->second->problem, problem))
      known = found->second;
    else
      known = std::make_shared<const Known>(problem, answer);
  }

 private:
  struct Known {
    Known(ContactProblem of, ContactSolution is) : problem(std::move(of)), answer(std::move(is)) {}
    ContactProblem problem;
    ContactSolution answer;
  };
  using Answers = std::unordered_map<std::uint64_t, std::shared_ptr<const Known>>;

  static std::uint64_t number_of(const ContactProblem& problem) {
    std::uint64_t number = problem.v_minus.size();
    for (const auto* of : {&problem.v_minus, &problem.J.values})
      for (const double x : *of)
        number = (number ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15 + (number >> 29);
    return number;
  }
  static bool same(const ContactProblem& a, const ContactProblem& b) {
    return a.v_minus == b.v_minus && a.M.first == b.M.first && a.J.band == b.J.band && a.J.block == b.J.block &&
           a.J.values == b.J.values && a.M.values == b.M.values && a.offset == b.offset && a.mu == b.mu &&
           a.restitution == b.restitution;
  }

  Answers before_, now_;
};

/// Scratch of a thread.
struct Worker {
  explicit Worker(ClosedForm form) : closed_form(std::move(form)) {}

  ClosedForm closed_form;
  std::vector<int> block_in_part;
  BlockCholesky factor;
  std::vector<Eigen::Matrix3d> W;
  std::vector<double> u;  // 3, of a contact alone
};

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
    workers_.emplace_back(may_.closed_form);
  }
  void operator()(const ContactProblem& problem, ContactSolution& solution);

 private:
  bool look(const ContactProblem& problem);
  bool remember(const ContactProblem& problem, ContactSolution& solution) const;
  void find_same_islands(const ContactProblem& problem);
  void solve_parts(const ContactProblem& problem, ContactSolution& solution);
  bool solve_parts(const ContactProblem& problem, bool together, ContactSolution& solution);
  void group(const ContactProblem& problem, bool together);
  void begin(const ContactProblem& problem, ContactSolution& solution) const;
  void extract(const ContactProblem& problem, int part, Worker& worker, ContactProblem& out) const;
  void solve_part(const ContactProblem& problem, int part, ContactMethod* method, Worker& worker, Part& out) const;
  static bool closed_form(const ContactProblem& part, Worker& worker, ContactSolution& answer);
  void ask(ContactMethod& method, const ContactProblem& problem, ContactSolution& solution) const;
  void take_over(const ContactProblem& problem, int index, const Part& part, ContactSolution& solution);
  void count_call(const ContactProblem& problem, const ContactSolution& solution);

  std::function<ContactMethod(const MethodOptions&)> make_;
  Law law_;
  MethodOptions options_;
  PruneOptions prune_;
  std::shared_ptr<LeftOut> left_out_;
  Witness terms_;
  LeaveOut may_;  // what the law allows and nobody told off

  Islands islands_;
  std::vector<int> joined_band_, joined_block_;  // what islands_ were found from
  std::vector<int> part_of_contact_, part_of_block_;
  Groups contacts_of_, blocks_of_;

  std::vector<ContactMethod> methods_;  // one a thread; with a warm start one a part, for each to know its own previous
                                        // event
  std::vector<Part> parts_;             // one, used by part after part, or with several threads all of them
  std::vector<Worker> workers_;         // one a thread
  Memory memory_;
};

void Pruned::operator()(const ContactProblem& problem, ContactSolution& solution) {
  left_out_->failed.reset();
  if (prune_.repeats) memory_.begin_event();
  if (problem.nc() == 1 && closed_form(problem, workers_[0], solution)) {
    ++left_out_->closed_forms;
    return;
  }
  if (look(problem)) {
    solve_parts(problem, solution);
    return;
  }
  if (methods_.empty()) methods_.resize(1);
  if (remember(problem, solution)) {
    ++left_out_->repeats;
  } else {
    ask(methods_[0], problem, solution);
    count_call(problem, solution);
  }
  if (prune_.repeats) memory_.keep(problem, solution);
}

// From the event before, if it was the same.
bool Pruned::remember(const ContactProblem& problem, ContactSolution& solution) const {
  const ContactSolution* known = prune_.repeats ? memory_.find(problem) : nullptr;
  if (known == nullptr) return false;
  solution = *known;
  solution.iterations = 0;
  return true;
}

void Pruned::ask(ContactMethod& method, const ContactProblem& problem, ContactSolution& solution) const {
  if (!method) method = make_(options_);
  method(problem, solution);
}

void Pruned::count_call(const ContactProblem& problem, const ContactSolution& solution) {
  if (gave_up(solution)) left_out_->failed = problem;
  if (may_.idle_friction && all_zero(problem.restitution))
    left_out_->idle_friction += std::count(problem.mu.begin(), problem.mu.end(), 0.0);
}

// Is there anything to leave out? Finds the islands.
bool Pruned::look(const ContactProblem& problem) {
  const int nc = problem.nc();
  if (nc == 0 || (problem.M.blocks() == 1 && nc > 1)) return false;
  find_same_islands(problem);
  const bool several = may_.islands_apart && islands_.count > 1;
  const bool alone = may_.closed_form && all_zero(problem.restitution) && nc == islands_.count;
  return several || alone;
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

// Parts: the islands; for a method that parts islands itself one of everything, unless each island has a closed form.
void Pruned::solve_parts(const ContactProblem& problem, ContactSolution& solution) {
  const bool alone = prune_.islands && problem.nc() <= islands_.count;
  if (!solve_parts(problem, !may_.islands_apart && !alone, solution)) solve_parts(problem, true, solution);
}

// False where a part would have to be handed to a method that wants all of them together.
bool Pruned::solve_parts(const ContactProblem& problem, bool together, ContactSolution& solution) {
  group(problem, together);
  begin(problem, solution);
  const int count = together ? 1 : islands_.count;
  const bool may_ask = together || may_.islands_apart;
  const int threads = may_ask && !together ? worthwhile_threads(islands_, options_.threads) : 1;
  const auto grow = [](auto& list, int size) { list.resize(std::max(list.size(), static_cast<std::size_t>(size))); };
  grow(methods_, options_.warm_start ? count : threads);
  grow(parts_, threads > 1 ? count : 1);
  while (static_cast<int>(workers_.size()) < threads) workers_.emplace_back(may_.closed_form);
  const auto solve = [&](int index, int worker, Part& part) {
    ContactMethod& method = methods_[options_.warm_start ? index : worker];
    solve_part(problem, index, may_ask ? &method : nullptr, workers_[worker], part);
  };
  if (threads > 1) for_each_item(count, threads, [&](int index, int worker) { solve(index, worker, parts_[index]); });
  // In their order, on however many threads they were solved: sums and the worst are the same.
  long closed = 0;
  for (int index = 0; index < count; ++index) {
    Part& part = parts_[threads > 1 ? index : 0];
    if (threads == 1) solve(index, 0, part);
    if (part.by == Part::By::nobody) return false;
    closed += part.by == Part::By::formula;
    take_over(problem, index, part, solution);
  }
  left_out_->closed_forms += closed;
  if (count > 1) left_out_->islands += count;
  return true;
}

// By its formula, if there is one, else by the method, where it may be asked.
void Pruned::solve_part(const ContactProblem& problem, int part, ContactMethod* method, Worker& worker,
                        Part& out) const {
  extract(problem, part, worker, out.problem);
  out.by = Part::By::formula;
  if (out.problem.nc() == 1 && closed_form(out.problem, worker, out.answer)) return;
  out.by = Part::By::memory;
  if (remember(out.problem, out.answer)) return;
  out.by = method != nullptr ? Part::By::method : Part::By::nobody;
  if (method != nullptr) ask(*method, out.problem, out.answer);
}

void Pruned::group(const ContactProblem& problem, bool together) {
  part_of_contact_.assign(problem.nc(), 0);
  part_of_block_.assign(problem.M.blocks(), 0);
  if (!together) {
    part_of_contact_ = islands_.of_contact;
    part_of_block_ = islands_.of_block;
  }
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

void Pruned::extract(const ContactProblem& problem, int part, Worker& worker, ContactProblem& out) const {
  out.clear();
  worker.block_in_part.resize(problem.M.blocks());
  for (const int b : blocks_of_[part]) {
    const int at = worker.block_in_part[b] = out.M.add_block(problem.M.block_size(b));
    out.M.block(at) = problem.M.block(b);
    out.v_minus.insert(out.v_minus.end(), problem.v_minus.begin() + problem.M.first[b],
                       problem.v_minus.begin() + problem.M.first[b + 1]);
  }
  for (const int c : contacts_of_[part]) {
    out.J.add_band();
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) {
      const auto entry = problem.J.entry(e);
      const int k = out.J.add_entry(worker.block_in_part[problem.J.block[e]], static_cast<int>(entry.cols()));
      out.J.entry(k) = entry;
    }
    out.mu.push_back(problem.mu[c]);
    out.restitution.push_back(problem.restitution[c]);
    out.offset.insert(out.offset.end(), problem.offset.begin() + 3 * c, problem.offset.begin() + 3 * c + 3);
  }
}

// The answer of a part with one contact, where there is a formula for it.
bool Pruned::closed_form(const ContactProblem& part, Worker& worker, ContactSolution& answer) {
  if (!worker.closed_form || !worker.factor.factor(part.M)) return false;
  diagonal_blocks(part, worker.factor, worker.W);
  const Eigen::Matrix3d& W = worker.W[0];
  const double w = (W(1, 1) + W(2, 2)) / 2, W_n = W(0, 0), small = decoupled * (w + W_n);
  const double coupling = std::abs(W(1, 0)) + std::abs(W(2, 0)) + std::abs(W(2, 1)) + std::abs(W(1, 1) - W(2, 2));
  if (!(W_n > 0 && w > 0 && coupling <= small)) return false;
  if (part.restitution[0] != 0 || !(part.mu[0] >= 0) || !std::isfinite(part.mu[0])) return false;
  std::vector<double>& u = worker.u;
  contact_velocity(part, part.v_minus, u);
  if (!all_finite(u) || u[0] > 0) return false;
  answer.clear();
  worker.closed_form({part, worker.factor, W_n, w, u}, answer);
  return true;
}

// The answer of a part as that of its contacts in the whole.
void Pruned::take_over(const ContactProblem& problem, int index, const Part& part, ContactSolution& solution) {
  const ContactSolution& answer = part.answer;
  if (part.by == Part::By::method) count_call(part.problem, answer);
  if (part.by == Part::By::memory) ++left_out_->repeats;
  if (prune_.repeats && part.by != Part::By::formula) memory_.keep(part.problem, answer);
  if (answer.status > solution.status) {
    solution.status = answer.status;
    solution.reason = answer.reason;
  }
  solution.iterations += answer.iterations;
  solution.size += answer.size;
  solution.claimed_residual = law_.claims_add_up ? solution.claimed_residual + answer.claimed_residual
                                                 : std::max(solution.claimed_residual, answer.claimed_residual);
  solution.restitution_scale = std::min(solution.restitution_scale, answer.restitution_scale);
  const ProblemPart of{problem, part.problem, contacts_of_[index], blocks_of_[index]};
  scatter(of.contacts, answer.impulse, 0, 3, solution.impulse, 0);
  if (law_.join) law_.join(of, answer, solution);
}

}  // namespace

std::vector<LeftOutItem> items(const LeftOut& left_out) {
  return {
      {"islands solved apart", "bodies that no contact joins do not change each other", left_out.islands},
      {"solver calls for single contacts with a closed form", "one contact through a centre of mass has a formula",
       left_out.closed_forms},
      {"unknowns of friction of contacts with mu = 0", "they are zero, or follow from the slip",
       left_out.idle_friction},
      {"solver calls for islands that rest", "they are those of the event before, to the last bit", left_out.repeats},
  };
}

ContactMethod pruned(const MethodRow& row, const MethodOptions& options, std::shared_ptr<LeftOut> left_out,
                     const PruneOptions& prune) {
  auto method = std::make_shared<Pruned>(row, options, std::move(left_out), prune);
  return [method](const ContactProblem& problem, ContactSolution& solution) { (*method)(problem, solution); };
}

}  // namespace cb
