// Error control around an unchanged base step (docs/stepping.md).
//
// Problem: the base step S_h, of first order, from a state at t to one at t + h (m, rad, m/s, rad/s); a wanted bound A
// (m) of the error of any body's place over the run. Find steps that keep it. Source: extrapolation of one-step methods
// in powers of h (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9), between the switches of
// nonsmooth mechanics (Studer, Leine, Glocker, IJNME 76 (2008) 1747).
//   1. From one start a macro step H is crossed by sequences of n = 1, ..., p equal base steps (robots: 2, ..., p + 1).
//      Their ends are extrapolated (order p); the neighbour in the table estimates the error, per unit of time:
//      estimate <= A H / T.
//   2. In all base steps of all sequences, at the start and at the end every contact has one mode (BaseStep::Mode),
//      read from velocities. Start and end are read after a base step of the smallest length from there, so that the
//      forces there count.
//   3. Where modes differ H shrinks, down to the smallest step, which is taken by events; then H is small and grows.
//   4. Macro steps end where forces begin and end, at records, and where a contact closes: a try that meets a time of
//      contact is shortened to it, until none does. Each time what is left falls as its square. There one event with
//      restitution.
//   5. After a macro step the points that touched and did not part are brought to gap 0 by the least displacement.
// Differences from the source: the smallest step splits at times of contact, as stepping by events does; where switches
// or impacts pile up, steps of the smallest length go on by events. When it fails: as stepping by events does, in a
// step of the smallest length; a failure in a longer one shortens it.
#include "simulation/stepping/accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/kinematics.h"
#include "linalg/stop.h"
#include "simulation/stepping/events.h"
#include "simulation/stepping/extrapolation.h"

namespace cb {

namespace {

constexpr double share = 0.5;  // of the accuracy: what one step of the smallest length may miss
constexpr double memory = 1;   // s: for so long an error of a velocity is taken to act on places
constexpr double careful = 4;  // times what a column of the table improved by, the next one is taken to improve by
constexpr double least_gain = 1e-3;  // of that, at best
constexpr double rounding = 100;     // ulp of the terms: no estimate says anything below
constexpr double shorter = 0.5;      // a try of no more than that of the last one
constexpr double plateau = 0.7;      // whose estimate is at least that of the last one's says nothing but noise
constexpr double twice = 2;          // noise scatters
constexpr double forget = 0.95;      // of the noise, from one macro step to the next
constexpr double safety = 0.8;       // of the length that would just do
constexpr double most_growth = 5;    // from one macro step to the next
constexpr double slow_growth = 1.5;  // the same where the estimate is noise
constexpr double least_shrink = 0.1;
constexpr int most_tries = 200;   // of one macro step; then one of first order
constexpr std::size_t pile = 12;  // switches and impacts within as many smallest steps pile up
constexpr double same_way = 0.5;  // cosine: slip that has turned further has switched

/// Order for a wanted accuracy (m), where none is asked for: what was fastest on the scenes with a closed form.
int order_for(double accuracy, bool robots) {
  return (accuracy >= 1e-5 ? 4 : accuracy >= 1e-7 ? 5 : 6) - (robots ? 1 : 0);
}

/// Largest acceleration that gravity and the forces of a scene give a body, m/s^2; 1 where there are none.
double largest_acceleration(const Scenario& scenario) {
  double g = scenario.gravity.constant.norm(), push = 0;
  for (const Harmonic& harmonic : scenario.gravity.harmonic) g += std::abs(harmonic.amplitude);
  for (const Force& force : scenario.forces)
    push = std::max(push, force.force.norm() / scenario.model.bodies[static_cast<std::size_t>(force.body)].mass);
  return g + push > 0 ? g + push : 1;
}

/// m
double deepest(const std::vector<ContactPoint>& contacts) {
  double depth = 0;
  for (const ContactPoint& contact : contacts) depth = std::max(depth, -contact.gap);
  return depth;
}

/// Do the modes differ in the direction of friction alone? It jumps then; where a contact begins or ends to stick or to
/// press it does not.
bool friction_jumps(const std::vector<BaseStep::Mode>& a, const std::vector<BaseStep::Mode>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (a[i].a != b[i].a || a[i].b != b[i].b || (a[i].facet < 0) != (b[i].facet < 0)) return false;
  return true;
}

bool same(const std::vector<BaseStep::Mode>& a, const std::vector<BaseStep::Mode>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].a != b[i].a || a[i].b != b[i].b || a[i].facet != b[i].facet) return false;
    if (a[i].facet >= 0 && a[i].slip.dot(b[i].slip) < same_way * a[i].slip.norm() * b[i].slip.norm()) return false;
  }
  return true;
}

}  // namespace

AccuracyStepping::AccuracyStepping(const Scenario& scenario, const SimulationOptions& options)
    : model_(scenario.model),
      options_(options),
      order_(options.order > 0 ? options.order : order_for(options.accuracy, !scenario.model.trees.empty())),
      acceleration_(largest_acceleration(scenario)),
      smallest_(options.smallest > 0
                    ? options.smallest
                    : std::min(std::sqrt(2 * share * options.accuracy / acceleration_), options.duration)),
      finest_(std::min(smallest_, share * options.accuracy / (acceleration_ * memory))) {
  // A body's radius: how far its shapes reach. Of one without shapes the least radius of gyration, since moments of
  // inertia beyond any matter's are a way to freeze turns.
  radius_.assign(model_.bodies.size(), 0.0);
  for (const Shape& shape : scenario.shapes)
    if (shape.body >= 0) {
      double& radius = radius_[static_cast<std::size_t>(shape.body)];
      radius = std::max(radius, shape.bounding_radius() + shape.local.p.norm());
    }
  for (std::size_t b = 0; b < radius_.size(); ++b)
    if (radius_[b] == 0) radius_[b] = std::sqrt(model_.bodies[b].inertia.minCoeff() / model_.bodies[b].mass);
  for (const Force& force : scenario.forces) edges_.insert(edges_.end(), {force.from, force.to});
  std::sort(edges_.begin(), edges_.end());
  // Velocities of robots in contact are bound where a base step began: what the first one misses is no power of h, so
  // that no sequence is of one (Hairer, Lubich, Roche, The Numerical Solution of Differential-Algebraic Systems (1989),
  // ch. 6).
  const int least = model_.trees.empty() ? 1 : 2;
  for (int n = order_ - 1 + least; n >= least; --n) n_.push_back(n);
  results_.resize(n_.size());
  tally_.order = order_;
  tally_.smallest_step = smallest_;
  next_ = std::min(options.longest, 16 * smallest_);
  looking_ = smallest_;
}

// s: when a macro step from t on has to end, later than t.
double AccuracyStepping::until_edge(double t) const {
  double edge = options_.duration;
  const auto next = std::upper_bound(edges_.begin(), edges_.end(), t);
  if (next != edges_.end()) edge = std::min(edge, *next);
  if (options_.record_interval > 0) {
    const double interval = options_.record_interval;
    double record = (std::floor(t / interval) + 1) * interval;
    if (record <= t) record = (std::floor(t / interval) + 2) * interval;
    edge = std::min(edge, record);
  }
  return edge;
}

// What touches and comes together faster than rest does: one event, with restitution.
void AccuracyStepping::take_impact(BaseStep& base) {
  const double rest = acceleration_ * smallest_;
  base.set_rest_speed(rest);
  base.look(0);
  if (!(base.approach_speed() > rest)) return;
  base.kick(0);  // no time passes
  if (!base.approaching() || !base.event(0)) return;
  base.forget_contacts();
  modes_known_ = false;
  struck_ = true;
  next_ = std::min(next_, 16 * smallest_);
  nearing_ = HUGE_VAL;
  looking_ = smallest_;
  ++tally_.impacts;
  taken_.impact = true;
  stumbles_.push_back(base.state().t);
}

// Modes as the forces of the present leave them. False where that has no answer. Leaves `base` elsewhere.
bool AccuracyStepping::probe(BaseStep& base, double h, Modes& modes, std::vector<ContactPoint>& held) {
  base.set_rest_speed(HUGE_VAL);
  base.kick(h);
  base.look(h);
  const bool answered = !base.approaching() || base.event(0);
  base.read_modes(modes);
  base.read_held(held);
  return answered && base.going_on();
}

// One sequence. `result`: where it ended, as seen from the start.
AccuracyStepping::Try AccuracyStepping::cross(BaseStep& base, int n, double H, std::vector<double>& result) {
  const double h = H / n;
  base.restore(start_);
  for (int k = 0; k < n; ++k) {
    poll_stop();
    ++tally_.base_steps;
    base.kick(h);
    base.look(h);
    const bool solved = base.approaching();
    if (solved && !base.event(0)) return {Try::failed, false, k * h};
    base.read_modes(modes_);
    if (!same(entry_, modes_)) return {Try::switched, friction_jumps(entry_, modes_), k * h};
    const double dt = base.until_contact(h, false, solved);
    if (dt < h) return {Try::arrived, false, k * h + dt};
    base.move(h);
    if (base.strays()) return {Try::bent, false, k * h};
    base.forget_contacts();
    if (!base.going_on()) return {Try::failed, false, k * h};
  }
  to_vector(model_, start_.state, base.state(), result);
  return {};
}

AccuracyStepping::Try AccuracyStepping::attempt(BaseStep& base, double H, double t_end) {
  base.set_rest_speed(HUGE_VAL);  // never across restitution
  for (std::size_t i = 0; i < n_.size(); ++i) {
    const Try crossed = cross(base, n_[i], H, results_[n_.size() - 1 - i]);
    if (crossed.what != Try::taken) return crossed;
  }
  std::vector<int> n(n_.rbegin(), n_.rend());
  extrapolate(results_, n, best_, neighbour_, before_);
  best_state_ = neighbour_state_ = before_state_ = start_.state;
  from_vector(model_, start_.state, best_, best_state_);
  from_vector(model_, start_.state, neighbour_, neighbour_state_);
  best_state_.t = t_end;
  const Try judged = judge(H);
  if (judged.what != Try::taken) return judged;
  Try out = leave(base, H, t_end);
  out.estimate = judged.estimate;
  out.excess = judged.excess;
  return out;
}

// Is the macro step as exact as it has to be? The last two of the table's last row differ by the error of the one
// before the last; by how much a column more improves is read from the column before.
AccuracyStepping::Try AccuracyStepping::judge(double H) {
  const double eps = std::numeric_limits<double>::epsilon(),
               rest = std::min(memory, options_.duration - start_.state.t);
  const auto error = [&](const State& a, const State& b) {
    return distance(radius_, a, b) + rest * speed_difference(radius_, a, b);
  };
  Try out;
  const double last = error(best_state_, neighbour_state_);
  double gain = 1;
  if (order_ >= 3) {
    from_vector(model_, start_.state, before_, before_state_);
    const double first = error(neighbour_state_, before_state_);
    if (first > 0) gain = std::clamp(careful * last / first, least_gain, 1.0);
  }
  out.estimate = gain * last;
  double terms = 0;  // what rounding is a fraction of
  for (std::size_t b = 0; b < radius_.size(); ++b)
    terms = std::max(
        terms, best_state_.pose[b].p.norm() + radius_[b] +
                   rest * (Vec3(&best_state_.v[6 * b]).norm() + radius_[b] * Vec3(&best_state_.v[6 * b + 3]).norm()));
  const double beyond = std::max(0.0, out.estimate - std::max(rounding * eps * terms, noise_));
  out.excess = beyond * options_.duration / (options_.accuracy * H);
  // A step of first order, the other choice where H may not shrink, would miss this.
  const bool better = H <= smallest_ && beyond <= acceleration_ * H * H / 2;
  if (out.excess > 1 && !better) out.what = Try::inexact;
  return out;
}

// The end of a macro step: what touched touches, and moves as it did.
AccuracyStepping::Try AccuracyStepping::leave(BaseStep& base, double H, double t_end) {
  base.restore({best_state_, base.energy_input(), start_.spinning});
  const double reach = 10 * distance(radius_, best_state_, neighbour_state_);
  base.close_gaps(entry_held_, start_.state, reach);
  base.set_rest_speed(acceleration_ * smallest_);
  base.look(0);
  // Within its last base step a link's arc may have gone into what its tangent passes.
  if (!base.going_on() || deepest(base.contacts()) > std::max({options_.accuracy, reach, deepest(entry_held_)}))
    return {Try::failed};
  base.save(end_);
  end_.state.t = t_end;
  if (base.approach_speed() > acceleration_ * smallest_) {  // an impact, which may change anything
    modes_known_ = false;
    return {};
  }
  if (!probe(base, std::min(smallest_, H / n_.front()), exit_, exit_held_)) return {Try::failed};
  const double sampled = H * (n_.front() - 1) / n_.front();
  if (!same(entry_, exit_)) return {Try::switched, friction_jumps(entry_, exit_), std::max(sampled, H / 2)};
  modes_known_ = true;
  entry_ = exit_;
  entry_held_ = exit_held_;
  return {};
}

// s: what to try after a try of H that was not taken.
double AccuracyStepping::next_length(const Try& tried, double H) const {
  switch (tried.what) {
    case Try::inexact:
      return H * std::max(least_shrink, safety * std::pow(tried.excess, -1.0 / growth_order()));
    case Try::arrived:
      return tried.at < H ? tried.at : H / 2;
    case Try::bent:
      return H / 2;
    case Try::switched:
      // Up to the last base step that was as at the start; where the first was not, within it.
      return tried.at > 0 ? std::min(tried.at, 0.9 * H) : H / n_.front() / 2;
    default:
      return H / 4;
  }
}

// Are there as many switches and impacts as smallest steps?
bool AccuracyStepping::piles_up(double t) {
  if (stumbles_.size() < pile) return false;
  const bool piled = t - stumbles_.front() <= static_cast<double>(pile) * smallest_;
  stumbles_.clear();
  if (piled)
    batch_ = std::min(2 * batch_ + static_cast<long>(pile), 100000L);
  else
    batch_ = 0;
  first_order_left_ = batch_;
  return piled;
}

void AccuracyStepping::step(BaseStep& base) {
  taken_ = {};
  step_once(base);
  base.record(taken_);
  tally_.base_solves += base.record().solves;
}

// Does `contacts` have a point of each pair as often as `others` have?
bool AccuracyStepping::covers(const std::vector<ContactPoint>& contacts, const std::vector<ContactPoint>& others) {
  per_pair_.clear();
  for (const ContactPoint& c : contacts) ++per_pair_[std::minmax(c.shape_a, c.shape_b)];
  return std::ranges::all_of(
      others, [&](const ContactPoint& c) { return --per_pair_[std::minmax(c.shape_a, c.shape_b)] >= 0; });
}

// Velocities at the places of end_ from the forces of the step of h that led there, bound by what touches at these
// places: then what bodies turn by within the step counts. False where something else touches than at its start.
bool AccuracyStepping::bind_at_end(BaseStep& base, double h) {
  base.set_rest_speed(HUGE_VAL);  // what turns into contact within the step does not bounce
  base.restore(start_);
  base.look(0);
  touching_ = base.contacts();
  base.kick(h);
  State bound = base.state();
  bound.pose = end_.state.pose;
  bound.q = end_.state.q;
  bound.t = end_.state.t;
  for (const Tree& tree : model_.trees) link_twists(model_, tree, bound);
  base.restore({bound, end_.energy_input, start_.spinning});
  base.look(0);
  return covers(touching_, base.contacts()) && (!base.approaching() || base.event(0));
}

// After an impact velocities that are bound where the step begins hold closed what opens at once as bodies turn, and
// leave what goes on touching with a velocity of its own, both by a h. Those that are bound where it ends do not, and
// what they open is not held closed on the way there. False, and the step not taken, where something else comes to
// touch, or what goes on touching would be lost.
bool AccuracyStepping::step_from_impact(BaseStep& base, double h) {
  const auto go = [&] {
    base.set_rest_speed(acceleration_ * smallest_);
    base.restore(start_);
    const bool whole = step_by_events(base, h);
    base.save(end_);
    return whole && base.going_on() && bind_at_end(base, h);
  };
  base.set_trial(true);
  bool bound = go();
  if (bound && base.contacts().size() == touching_.size()) {
    opening_.clear();
    exit_held_.clear();
    for (std::size_t c = 0; c < touching_.size(); ++c)
      (base.parts(base.contacts()[c]) ? opening_ : exit_held_).push_back(touching_[c]);
    if (!opening_.empty()) {
      base.forgive();
      base.release(opening_);
      bound = go() && covers(base.contacts(), exit_held_);
      base.release({});
    }
  }
  base.forgive();
  bound = bound && bind_at_end(base, h);
  if (!bound) base.forgive();
  base.set_trial(false);
  if (bound) base.settle();
  return bound;
}

void AccuracyStepping::take_first_order(BaseStep& base, double h, double edge, AccuracyStep::Kind kind) {
  const double t0 = start_.state.t;
  h = std::min(h, edge - t0);
  taken_.kind = kind;
  taken_.length = h;
  taken_.estimate = acceleration_ * h * h / 2;
  if (!modes_known_ || !struck_ || !step_from_impact(base, h)) {
    base.set_trial(false);
    base.set_rest_speed(acceleration_ * smallest_);
    base.restore(start_);
    step_by_events(base, h);
  }
  ++(kind == AccuracyStep::switched ? tally_.switches : tally_.first_order);
  tally_.estimated_error += taken_.estimate;
  modes_known_ = false;
  looking_ = h;
  next_ = std::min(options_.longest, 4 * h);
  if (base.going_on()) base.end_at(h >= edge - t0 ? edge : t0 + h);
}

// Counts a macro step of H that was taken, and finds the next one's length. `nearing`: it ended at a time of contact.
void AccuracyStepping::go_on_from(const Try& taken, double H, double limit, bool nearing) {
  const bool noisy = taken.estimate <= noise_ && taken.estimate * options_.duration > options_.accuracy * H;
  ++tally_.taken;
  if (noisy) ++tally_.noisy;
  tally_.shortest = std::min(tally_.shortest, H);
  tally_.longest = std::max(tally_.longest, H);
  tally_.estimated_error += taken.estimate;
  taken_.length = H;
  taken_.estimate = taken.estimate;
  noise_ *= forget;
  if (taken.excess <= 1) {  // what was taken as better than the other choice goes on as it is
    const double growth = safety * std::pow(std::max(taken.excess, 1e-12), -1.0 / growth_order());
    next_ = std::max(H, std::min(next_, limit)) * std::clamp(growth, least_shrink, noisy ? slow_growth : most_growth);
    next_ = std::min(options_.longest, std::max(next_, finest_));
  }
  nearing_ = nearing ? 2 * H : most_growth * nearing_;
}

// Tries until a macro step is taken, or one of first order in its place.
void AccuracyStepping::take_macro_step(BaseStep& base, double edge) {
  const double t0 = start_.state.t, limit = edge - t0;
  double H = std::min({next_, nearing_, limit, options_.longest});
  if (H < limit && 2 * H > limit) H = limit / 2;  // no sliver before an edge
  bool nearing = false;
  double last_H = 0, last_estimate = 0;  // of the last try that was not exact enough
  for (int tries = 0;; ++tries) {
    const Try tried = attempt(base, H, H >= limit ? edge : t0 + H);
    if (tried.what == Try::taken) {
      struck_ = false;
      go_on_from(tried, H, limit, nearing);
      base.set_trial(false);
      base.restore(end_);
      return base.settle();
    }
    ++tally_.refused;
    ++taken_.refused;
    base.forgive();
    if (tried.what == Try::inexact) {
      // An estimate that does not fall with the step is the solver's noise, which a shorter one only counts more often.
      if (last_H > 0 && H <= shorter * last_H && tried.estimate >= plateau * last_estimate) {
        noise_ = twice * std::max(tried.estimate, last_estimate);
        next_ = H = last_H;
        continue;
      }
      last_H = H;
      last_estimate = tried.estimate;
    }
    const double least = tried.jumps ? finest_ : smallest_;
    const bool meets = tried.what == Try::arrived || tried.what == Try::bent;  // however short that asks H to be
    if (tries >= most_tries || (!meets && H <= least)) {
      stumbles_.push_back(t0);
      return take_first_order(base, std::min(H, smallest_), edge,
                              tried.what == Try::switched ? AccuracyStep::switched : AccuracyStep::first_order);
    }
    H = next_length(tried, H);
    nearing = meets;
    if (!nearing) next_ = H = std::max(H, std::min(least, limit));
  }
}

void AccuracyStepping::step_once(BaseStep& base) {
  const double t0 = base.state().t, edge = until_edge(t0);
  base.hold_contacts(true);
  base.set_trial(false);
  base.choose_forces_at(t0);
  if (std::binary_search(edges_.begin(), edges_.end(), t0)) {
    modes_known_ = false;
    looking_ = smallest_;
    next_ = std::min(next_, 16 * smallest_);
  }
  take_impact(base);
  if (!base.going_on()) return;
  base.save(start_);
  if (first_order_left_ > 0 || piles_up(t0)) {
    --first_order_left_;
    modes_known_ = false;
    return take_first_order(base, smallest_, edge, AccuracyStep::first_order);
  }
  base.set_trial(true);
  if (!modes_known_ && !probe(base, looking_, entry_, entry_held_)) {
    ++tally_.refused;
    ++taken_.refused;
    base.forgive();
    return take_first_order(base, smallest_, edge, AccuracyStep::first_order);
  }
  modes_known_ = true;
  take_macro_step(base, edge);
}

}  // namespace cb
