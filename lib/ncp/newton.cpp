// Exact Coulomb friction by Newton's method: interior point steps, finished on Alart and Curnier's map, and believed
// only by a certificate.
//
// Problem: (1) of ncp.h, nc contacts, nv velocities. Attempts, the cheap ones first; whoever reaches the tolerance ends
// the rest:
//   guess    Newton's method on Alart and Curnier's map from the event before, or from no impulses (finish.h): what
//            rests or slides steadily takes one or two factorisations
//   long     long interior point steps (interior.h), and the finish from where products are small. Many contacts change
//            between sticking, slipping and open at once: some tens of factorisations, whatever their number
//   stops    what stops all contacts, by an orthogonal factorisation (stopping_impulse.h): robots on their limits
//   points   proximal points (finish.h), each about the one before: u + t w (r - r0) has answers that Newton's method
//            finds where those of u bend too much, and t falls to rounding as fast as it goes on finding them. Contacts
//            of a heap at rest, some hundreds of corners that hardly slip
//   path     the central path followed wherever it turns (interior.h), and the finish: hundreds of factorisations where
//            it turns often
//   far      the same from a start that is farther out: another path, which may end elsewhere
//   near     and from one that is nearer
// After each path points once more, from where it ended; and after points and paths the finish from the best of their
// own
//   careful  by steps that make things better, with a proximal term as large as that takes
//   cut      by many steps that end where the first contact opens or slips. Where rows are all but redundant (corners
//            that are level to a billionth) contacts want to let go by impulses that are large beside what they carry
//   patient  by many whole steps that make nothing better: for those whose friction must turn far
// And where none of these came to the tolerance, but one came near: points again from the best of all, in rounds, each
// from where the finish has left the one before. Every impulse that is met is measured on fresh velocities
// (NcpMeasure); the best is returned, whatever its ending.
//
// Source: D. Stewart, J. Trinkle (1996) for the problem in the form that interior_system.cpp has; Mehrotra's steps;
// E. Allgower, K. Georg (2003) for the path; P. Alart, A. Curnier (1991) for the finish; R. T. Rockafellar, Monotone
// operators and the proximal point algorithm, SIAM J. Control Optim. 14 (1976), though (1) is not monotone.
//
// Returns: solved; nonconverged, where no attempt came to the tolerance; not_finite.

#include <algorithm>
#include <cmath>

#include "linalg/finite.h"
#include "linalg/proximal_term.h"
#include "linalg/stop.h"
#include "linalg/stopping_impulse.h"
#include "ncp/finish.h"
#include "ncp/interior.h"
#include "ncp/ncp.h"
#include "ncp/velocity_system.h"

namespace cb {

namespace {

struct NewtonOptions : NcpOptions {
  AlartCurnierNewton::Options quick{.returns = 0}, finish, careful{.limit = 100, .returns = 6},
      cut{.limit = 1000, .patience = 100, .cut = true}, patient{.limit = 500, .patience = 50},
      point{.tolerance = 1e-11, .limit = 60, .patience = 6, .returns = 0};
  struct Points {
    double least = 1e-10;  ///< -: t
    double found = 1e-9;   ///< -: natural residual of a point
    int limit = 3000;      ///< steps of all
  } points;
  InteriorSystem::Options interior;
  LongSteps::Options long_steps;
  PathSteps::Options path;
  double far = 1e4, near = 1e-2;  ///< -: first impulses and velocities of the other paths, over the first's
  int guess_patience = 4;         ///< steps of a guess in a row that do not halve the residual
  int long_limit = 100;           ///< long steps,
  int patience = 10;              ///< and of those in a row that do not halve the error
  int path_limit = 10000;         ///< steps along a path,
  int end_patience = 2000;        ///< and of those in a row, where the finish has begun, that do not halve the error
  double finish_from = 1e-3;      ///< -: error of the interior point at which the finish is tried,
  double finish_again = 1e-1;     ///< and again at this fraction of that
  double near_finish = 1e-4;      ///< -: error from which it is not given up at its first failure
  double least_error = 1e-12;     ///< -: error that is rounding
  double as_it_is = 1e-9;         ///< -: error from which the interior point is offered as it is, too
  double ahead = 1e-4;            ///< -: proximal term of the finish, over that error
  double again_from = 1e-6;       ///< -: natural residual of all starts from which points go on, and
  int rounds = 8;                 ///< how often, each from where the finish has left the one before
  double near_rounding = 1e-3;    ///< -: natural residual after the finish from which rounding is looked at
  /// -: of the fastest velocity before: contacts that part more slowly carry in the first guess.
  double touching = 1e-10;
};

class NcpNewton {
 public:
  explicit NcpNewton(const NcpOptions& options) {
    static_cast<NcpOptions&>(o_) = options;
    o_.quick.tolerance = o_.finish.tolerance = o_.careful.tolerance = o_.cut.tolerance = o_.patient.tolerance =
        options.tolerance;
    o_.cut.enough = options.accepted;
  }
  void operator()(const NcpProblem& problem, NcpSolution& solution);

 private:
  bool settles(std::string_view who, NcpSolution& solution);
  bool attempt(std::string_view who, NcpSolution& solution);
  bool guess(std::string_view who, NcpSolution& solution);
  bool go_straight(std::string_view who, NcpSolution& solution);
  bool stop(std::string_view who, NcpSolution& solution);
  bool follow_path(double start, std::string_view who, NcpSolution& solution);
  bool go_by_points(std::string_view who, NcpSolution& solution);
  bool finish_best(std::string_view who, NcpSolution& solution);
  void begin_interior(double start);
  bool try_finish(std::string_view who, NcpSolution& solution);
  bool finish_interior(const AlartCurnierNewton::Options& o, std::string_view who, NcpSolution& solution);
  bool finish(AlartCurnierNewton::Options o, double proximal, std::string_view who, NcpSolution& solution);
  bool offer(double residual, std::string_view who, NcpSolution& solution);
  bool offer_beside_rounding(double residual, std::string_view who, NcpSolution& solution);

  NewtonOptions o_;
  NcpMeasure measure_;
  VelocitySystem system_;
  InteriorSystem interior_;
  LongSteps long_steps_;
  PathSteps path_;
  AlartCurnierNewton finish_;
  StoppingImpulse stopping_;
  std::vector<char> all_;  // nc
  const NcpProblem* problem_ = nullptr;
  double next_finish_ = 0;  // -: error from which it is tried
  struct {
    double residual = 0;
    std::vector<double> r;
  } own_;                     // of the attempt, its best: paths end in different places
  double finished_from_ = 0;  // -: residual of the best after the last of these
  double pointed_from_ = 0;   // -: where points began last
  std::vector<double> tried_, tried_u_, v_;
};

// Keeps (tried_, tried_u_) where it is the best so far. Is it good?
bool NcpNewton::offer(double residual, std::string_view who, NcpSolution& solution) {
  if (residual < own_.residual) {
    own_.residual = residual;
    own_.r = tried_;
  }
  if (residual < solution.residual) {
    solution.residual = residual;
    solution.r = tried_;
    solution.u = tried_u_;
    solution.who = who;
  }
  return solution.residual <= o_.tolerance;
}

// Newton's method from the event before, else with all contacts closed that do not part: what rests takes one step.
bool NcpNewton::guess(std::string_view who, NcpSolution& solution) {
  AlartCurnierNewton::Options o = o_.quick;
  o.patience = o_.guess_patience;
  if (problem_->start.size() == solution.r.size()) {
    tried_.assign(problem_->start.begin(), problem_->start.end());
    o.sharper = problem_->M->blocks() > 1;  // of one body no errors add up
  } else {
    tried_.assign(solution.r.size(), 0.0);
    for (const double u : measure_.q()) o.touching = std::max(o.touching, o_.touching * std::abs(u));
  }
  if (offer(finish_.solve(o, tried_, tried_u_, solution.iterations), who, solution)) return true;
  // Nothing approaches but by rounding?
  tried_.assign(solution.r.size(), 0.0);
  tried_u_ = measure_.q();
  const double nothing = measure_.residual_beside_rounding(tried_, tried_u_);
  return nothing <= o_.accepted && offer(nothing, who, solution);
}

bool NcpNewton::finish(AlartCurnierNewton::Options o, double proximal, std::string_view who, NcpSolution& solution) {
  o.proximal = proximal;
  return offer_beside_rounding(finish_.solve(o, tried_, tried_u_, solution.iterations), who, solution);
}

bool NcpNewton::offer_beside_rounding(double residual, std::string_view who, NcpSolution& solution) {
  if (offer(residual, who, solution)) return true;
  if (!(residual < o_.near_rounding)) return false;
  // What is left may be rounding.
  return offer(measure_.residual_beside_rounding(tried_, tried_u_), who, solution) || solution.residual <= o_.accepted;
}

void NcpNewton::begin_interior(double start) {
  InteriorSystem::Options o = o_.interior;
  o.start *= start;
  interior_.begin(o, *problem_, system_, measure_, measure_.size_before());
  next_finish_ = o_.finish_from;
}

// The finish, where the interior point is another tenth nearer.
bool NcpNewton::try_finish(std::string_view who, NcpSolution& solution) {
  const double error = interior_.error();
  if (error > next_finish_) return false;
  next_finish_ = error * o_.finish_again;
  return finish_interior(error > o_.near_finish ? o_.quick : o_.finish, who, solution);
}

bool NcpNewton::finish_interior(const AlartCurnierNewton::Options& o, std::string_view who, NcpSolution& solution) {
  tried_ = interior_.r();
  if (interior_.error() <= o_.as_it_is) {
    // A contact that has nothing but rounding about it is never done by its own size, and the finish goes astray by it.
    measure_.velocities(tried_, v_, tried_u_);
    if (offer(measure_.residual_beside_rounding(tried_, tried_u_), who, solution)) return true;
  }
  return finish(o, std::max(o.proximal, o_.ahead * interior_.error()), who, solution);
}

bool NcpNewton::go_straight(std::string_view who, NcpSolution& solution) {
  begin_interior(1);
  double mark = HUGE_VAL;
  for (int k = 0, since = 0; k < o_.long_limit && since < o_.patience && interior_.error() > o_.least_error; ++k) {
    ++solution.iterations;
    if (!long_steps_.step(o_.long_steps, interior_)) break;
    if (try_finish(who, solution)) return true;
    const bool halved = interior_.error() < 0.5 * mark;
    since = halved ? 0 : since + 1;
    if (halved) mark = interior_.error();
  }
  // Where it stands it is near, if anywhere.
  return (interior_.error() <= o_.finish_from && finish_interior(o_.finish, who, solution)) ||
         solution.residual <= o_.accepted;
}

// What W of a chain of links with a heavy end leaves of 16 digits is less than Newton's steps in velocities need.
bool NcpNewton::stop(std::string_view who, NcpSolution& solution) {
  constexpr int times = 2;  // the second takes away what rounding left
  const NcpProblem& p = *problem_;
  all_.assign(static_cast<std::size_t>(p.nc()), 1);
  if (!stopping_.prepare(*p.M, *p.J, *p.factor, p.weight, all_, 3)) return false;
  tried_.assign(solution.r.size(), 0.0);
  tried_u_ = measure_.q();
  for (int k = 0; k < times; ++k) {
    stopping_.correct(tried_u_, tried_);
    ++solution.iterations;
    measure_.velocities(tried_, v_, tried_u_);
  }
  const double residual = measure_.residual_beside_rounding(tried_, tried_u_);
  return residual <= o_.accepted && offer(residual, who, solution);
}

bool NcpNewton::follow_path(double start, std::string_view who, NcpSolution& solution) {
  begin_interior(start);
  path_.begin(o_.path, interior_);
  double mark = o_.finish_from;
  for (int k = 0, since = 0; k < o_.path_limit && since < o_.end_patience && interior_.error() > o_.least_error; ++k) {
    ++solution.iterations;
    if (!path_.step()) break;
    if (try_finish(who, solution)) return true;
    const bool halved = interior_.error() < 0.5 * mark;
    since = halved || interior_.error() > o_.finish_from ? 0 : since + 1;
    if (halved) mark = interior_.error();
  }
  return false;
}

// From the best of the attempt before, where it had one.
bool NcpNewton::go_by_points(std::string_view who, NcpSolution& solution) {
  const NewtonOptions::Points& of = o_.points;
  AlartCurnierNewton::Options o = o_.point;
  if (own_.residual == HUGE_VAL) {
    own_.residual = solution.residual;
    own_.r = solution.r;
  }
  const bool again = own_.residual == pointed_from_;  // from there they went already
  pointed_from_ = own_.residual;
  own_.residual = HUGE_VAL;  // what they find is theirs
  if (again) return false;
  std::vector<double> last = own_.r;
  const int until = solution.iterations + of.limit;
  for (ProximalTerm t(of.least); !t.over() && solution.iterations < until;) {
    o.anchor = t();
    tried_ = last;
    if (!(finish_.solve(o, tried_, tried_u_, solution.iterations) <= of.found)) {
      t.missed();
      continue;
    }
    last = tried_;
    measure_.velocities(tried_, v_, tried_u_);
    const double residual = measure_.residual(tried_, tried_u_);
    if (offer(residual, who, solution)) return true;
    // What is left may be rounding; the finish may be sharper.
    if (residual < o_.near_rounding && measure_.residual_beside_rounding(tried_, tried_u_) <= o_.accepted) {
      own_.residual = residual;
      own_.r = tried_;
      return false;
    }
    t.found();
  }
  return false;
}

bool NcpNewton::finish_best(std::string_view who, NcpSolution& solution) {
  if (who == "guess" || who == "stops" || who == "long") return false;
  if (own_.residual == HUGE_VAL) {
    if (who == "points") return false;
    own_.residual = solution.residual;
    own_.r = solution.r;
  }
  if (own_.residual == finished_from_) return false;  // from there it went already
  for (const auto& [way, o] :
       {std::pair("careful", &o_.careful), std::pair("cut", &o_.cut), std::pair("patient", &o_.patient)}) {
    tried_ = own_.r;
    if (finish(*o, o->proximal, way, solution)) return true;
  }
  finished_from_ = own_.residual;
  return false;
}

bool NcpNewton::attempt(std::string_view who, NcpSolution& solution) {
  if (who == "guess") return guess(who, solution);
  if (who == "long") return go_straight(who, solution);
  if (who == "stops") return stop(who, solution);
  if (who == "points") return go_by_points(who, solution);
  return follow_path(who == "path" ? 1 : who == "far" ? o_.far : o_.near, who, solution);
}

bool NcpNewton::settles(std::string_view who, NcpSolution& solution) {
  const bool done = attempt(who, solution) || finish_best(who, solution);
  if (!done && solution.residual > o_.accepted) return false;
  solution.status = NcpStatus::solved;
  return true;
}

void NcpNewton::operator()(const NcpProblem& p, NcpSolution& solution) {
  const int nc = p.nc();
  problem_ = &p;
  solution.clear();
  solution.r.assign(3 * nc, 0.0);
  solution.residual = HUGE_VAL;
  measure_.begin(p);
  solution.u = measure_.q();
  if (!all_finite(solution.u) || !all_finite(p.v0)) {
    solution.status = NcpStatus::not_finite;
    solution.reason = "NaN or infinity in the problem";
    return;
  }
  system_.prepare(*p.M, *p.J);
  finish_.begin(p, system_, measure_);
  finished_from_ = pointed_from_ = HUGE_VAL;
  for (const std::string_view who :
       {"guess", "long", "stops", "points", "path", "points", "far", "points", "near", "points"}) {
    poll_stop();
    if (who != "stops" && who != "points") own_.residual = HUGE_VAL;
    if (settles(who, solution)) return;
  }
  own_.residual = HUGE_VAL;  // from the best of all
  for (int round = 0; round < o_.rounds && solution.residual <= o_.again_from; ++round) {
    poll_stop();
    if (settles("points", solution)) return;
    if (own_.residual == HUGE_VAL) break;  // from there they went already
  }
  solution.reason = "no start came to the tolerance";
}

}  // namespace

NcpSolverRow newton_ncp_row() {
  return {"newton",
          "interior point steps along the central path, finished by a semismooth Newton method, in velocities",
          "D. Stewart, J. Trinkle 1996; P. Alart, A. Curnier 1991; E. Allgower, K. Georg 2003",
          [](const NcpOptions& options) -> NcpSolver {
            return [solver = NcpNewton(options)](const NcpProblem& problem, NcpSolution& solution) mutable {
              solver(problem, solution);
            };
          }};
}

}  // namespace cb
