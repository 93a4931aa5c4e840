#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "contact/islands.h"
#include "contact/problem.h"

namespace cb {

struct Evidence;
struct Residuals;

/// Judges an answer on what the referee has recomputed of it: sets `model`, where that is worst, and the measures that
/// the law alone has. Owns its scratch.
using LawCheck = std::function<void(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at,
                                    Residuals& out)>;

/// Is the motion the same when a patch of contacts keeps the corners of its hull alone (docs/performance.md)?
enum class Corners {
  differ,               ///< no: how often a patch is hit depends on its points
  suffice_unless_spin,  ///< yes, but where the patch spins: there the answer depends on who carries what
  suffice
};

/// A contact alone on its island whose normal and tangential directions do not couple, without restitution.
struct LoneContact {
  const ContactProblem& problem;  ///< of it alone
  const BlockCholesky& factor;    ///< of M
  double W_n, w;                  ///< 1/kg: W = diag(W_n, w, w)
  const std::vector<double>& u;   ///< n, t1, t2 before the event, m/s; u_n <= 0
};
/// Its answer by a formula; `answer` is empty before.
using ClosedForm = std::function<void(const LoneContact& contact, ContactSolution& answer)>;

/// What may be left out of an event before the method sees it.
struct LeaveOut {
  Corners corners = Corners::differ;
  bool islands_apart = true;  ///< may islands be handed to the method one by one? No: it shares something among them
  ClosedForm closed_form = {};
  bool idle_friction = false;  ///< unknowns of friction where mu = 0: they are zero, or follow from the slip
};

/// A part of a problem: these contacts and blocks of it, in this order.
struct ProblemPart {
  const ContactProblem &whole, &problem;
  std::span<const int> contacts, blocks;
};

/// An answer of which nothing is known but its impulses (from a file, or from a solver that is not ours).
struct ImpulsesAlone {
  const ContactProblem& problem;
  const Islands& islands;
  const Witness& terms;                        ///< what was asked
  const std::vector<double>&u_minus, &u_plus;  ///< 3 nc, m/s
};

/// Everything that is known of a law apart from how it is solved. What is null says: nothing beyond impulses.
struct Law {
  std::string_view name;
  LawCheck (*check)();
  /// Terms: a witness that holds what was asked of the method and no numbers (MethodRow::terms).
  LeaveOut (*leave_out)(const Witness& terms) = [](const Witness&) { return LeaveOut{}; };
  /// The witness of zero impulses for `problem`.
  void (*rest)(const ContactProblem& problem, const Witness& terms, ContactSolution& solution) = nullptr;
  /// Takes over the witness of a part into that of the whole.
  void (*join)(const ProblemPart& part, const ContactSolution& answer, ContactSolution& whole) = nullptr;
  /// Sets the witness that proves impulses known alone, which are in `solution`. Returns why they have none that they
  /// determine; empty where they have. Null beside a witness: they never do.
  std::string_view (*prove)(const ImpulsesAlone& answer, ContactSolution& solution) = nullptr;
  /// Does the witness of one answer prove every other one (a certificate of the problem, and no claim of the solver)?
  bool lends = false;
  /// What of the law cannot be judged on impulses alone, whatever they are; empty: nothing.
  std::string_view unseen_in_impulses = {};
  /// Do claimed residuals of parts add up (an energy)? Else the worst is that of the whole.
  bool claims_add_up = false;
  /// Normal impulses of the witness (nc, N s) whose velocities count among the terms of an answer; empty where none.
  std::span<const double> (*witness_normals)(const ContactSolution& solution) = nullptr;
  /// Into how many directions a polygon splits friction in this answer; null: it has none.
  int (*polygon_edges)(const ContactSolution& solution) = nullptr;
  /// Why a step's error is no smooth function of the step; empty where it is one.
  std::string_view no_expansion = {};

  friend bool operator==(const Law& a, const Law& b) { return a.name == b.name; }
};

/// What is so of laws that answer contact after contact.
inline constexpr std::string_view one_after_another =
    "it answers contact after contact, so that its error has no expansion in the step that could be extrapolated";

/// All laws: the one table.
std::span<const Law> laws();

/// Rows, one a file (contact/newton_law.cpp, ...).
Law newton_law();
Law mirtich_law();
Law anitescu_potra_law();
Law convex_law();
Law coulomb_law();
Law soft_law();

/// Copies `width` numbers a contact from `from` (that of a part, beginning at `first`) to where the contacts are in the
/// whole, beginning at `to_first`. What a method that failed left empty is skipped.
void scatter(std::span<const int> contacts, const std::vector<double>& from, std::size_t first, std::size_t width,
             std::vector<double>& to, std::size_t to_first);

}  // namespace cb
