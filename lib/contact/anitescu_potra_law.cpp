// anitescu_potra: the linear complementarity problem of a friction polygon,
//   0 <= c_n _|_ u_n >= 0,   0 <= c_t _|_ d_i.u_t + lam >= 0,   0 <= lam _|_ mu c_n - sum c_t >= 0,
// its natural map in impulses: rows of c_n and c_t divided by w_i; lam (m/s) divided by w_i too. What the polygon's
// impulses do not add up to is an error of the answer as well. With restitution z holds two phases (Poisson):
// compression from v-, then theta e c_n is given back and decompression keeps contacts from approaching, its friction
// bounded by mu (theta e c_n + c_n').
//
// A contact alone, W = diag(W_n, w, w): r_n = -u_n / W_n, friction the point of the polygon mu r_n conv{d_i} nearest to
// -u_t / w, on the two directions beside it.

#include <algorithm>
#include <cmath>

#include "contact/evidence.h"
#include "contact/laws.h"
#include "contact/polygon.h"
#include "contact/referee.h"
#include "linalg/finite.h"

namespace cb {

namespace {

using Eigen::Vector2d;
using ConstVec3 = Eigen::Map<const Eigen::Vector3d>;

class PolygonCheck {
 public:
  void operator()(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Residuals& out) {
    Worst worst = natural_map(problem, solution, at);
    see_gains(solution.impulse, 0, at, Which::all, sum_, worst);
    see_approach(at, worst);
    worst.report(out);
  }

 private:
  Worst natural_map(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at);
  void add_phase(const double* z, int nc, int k);
  double rows(const ContactProblem& problem, const Evidence& at, const double* z, int k, const double* u, int c) const;
  void restitution(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at, Worst& worst);
  double asked_share(const double* island) const { return island[0] > 0 ? island[1] / island[0] : 1; }

  FrictionPolygon direction_;
  std::vector<double> given_back_, phase_, between_, error_;  // nc, 3 nc, 3 nc, nc
  std::vector<double> v_, u_, sum_;
};

Worst PolygonCheck::natural_map(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at) {
  const PolygonWitness& polygon = solution.as<PolygonWitness>();
  const int nc = problem.nc(), k = polygon.k, unknowns = (k + 2) * nc, size = static_cast<int>(polygon.z.size());
  if (size != (at.elastic ? 2 : 1) * unknowns || !all_finite(polygon.z)) return {.ratio = HUGE_VAL};

  direction_.set(k);
  Worst shares;
  given_back_.assign(nc, 0.0);
  phase_.assign(3 * nc, 0.0);
  error_.assign(nc, 0.0);  // squares
  for (int begin = 0; begin < size; begin += unknowns) {
    const double* z = polygon.z.data() + begin;
    add_phase(z, nc, k);
    const bool last = begin + unknowns == size;
    if (!last) {
      apply_impulse(problem, at.factor, phase_, v_);
      contact_velocity(problem, v_, u_);
    }
    const std::vector<double>& u = last ? at.u_plus : u_;
    for (int c = 0; c < nc; ++c) {
      const double root_w = std::sqrt(at.weight[c]);
      double error = rows(problem, at, z, k, &u[3 * c], c);
      for (int i = 3 * c; i < 3 * c + 3 && last; ++i) {
        const double missing = root_w * (phase_[i] - solution.impulse[i]);
        error += missing * missing;
      }
      error_[c] += error;
    }
    if (!last) restitution(problem, solution, at, shares);
  }
  Worst worst;
  for (int c = 0; c < nc; ++c) at.see(worst, error_[c], at.size2[c], c);
  worst.ratio = std::sqrt(worst.ratio);
  return shares.ratio > worst.ratio ? shares : worst;
}

// Impulses of a phase, and what was given back before it.
void PolygonCheck::add_phase(const double* z, int nc, int k) {
  for (int c = 0; c < nc; ++c) {
    phase_[3 * c] += z[c] + given_back_[c];
    for (int i = 0; i < k; ++i) {
      phase_[3 * c + 1] += direction_.cosine[i] * z[nc + k * c + i];
      phase_[3 * c + 2] += direction_.sine[i] * z[nc + k * c + i];
    }
  }
}

// Sum of the squares of contact c's rows, J.
double PolygonCheck::rows(const ContactProblem& problem, const Evidence& at, const double* z, int k, const double* u,
                          int c) const {
  const int nc = problem.nc();
  const double w = at.weight[c], root_w = std::sqrt(w), lam = z[nc + k * nc + c];
  double error = 0, c_sum = 0;
  const auto add = [&](double e) { error += root_w * e * (root_w * e); };
  add(std::min(z[c], u[0] / w));
  for (int i = 0; i < k; ++i) {
    const double c_t = z[nc + k * c + i];
    add(std::min(c_t, (direction_.cosine[i] * u[1] + direction_.sine[i] * u[2] + lam) / w));
    c_sum += c_t;
  }
  add(std::min(lam / w, problem.mu[c] * (z[c] + given_back_[c]) - c_sum));
  return error;
}

// theta of each island as the answer's impulses have it (least squares of r_n - c_n - c_n' = theta e c_n), into
// given_back_ as theta e c_n. It is 1, or leaves E = 0, E the energy gained by then. 1 - theta counts as the impulse
// that is missing, of the island's size; E as a fraction of what compression took, E_0, and restitution changed. phase_
// and u_ are those of compression.
void PolygonCheck::restitution(const ContactProblem& problem, const ContactSolution& solution, const Evidence& at,
                               Worst& worst) {
  const PolygonWitness& polygon = solution.as<PolygonWitness>();
  const int nc = problem.nc();
  const double *first = polygon.z.data(), *second = first + (polygon.k + 2) * nc;
  constexpr std::size_t fields = 5;  // of least squares, theta^2 and theta; E_0, E, what rounding leaves open; all J
  sum_.assign(fields * static_cast<std::size_t>(at.islands.count), 0.0);
  const auto of_island = [&](int c) { return &sum_[fields * static_cast<std::size_t>(at.islands.of_contact[c])]; };
  for (int c = 0; c < nc; ++c) {
    double* island = of_island(c);
    const double asked = problem.restitution[c] * first[c];
    given_back_[c] = asked;
    island[0] += at.weight[c] * asked * asked;
    island[1] += at.weight[c] * asked * (solution.impulse[3 * c] - first[c] - second[c]);
    island[2] += 0.5 * ConstVec3(&phase_[3 * c]).dot(ConstVec3(&u_[3 * c]) + ConstVec3(&at.u_minus[3 * c]));
  }
  between_ = phase_;
  for (int c = 0; c < nc; ++c) between_[3 * c] += given_back_[c] *= asked_share(of_island(c));
  apply_impulse(problem, at.factor, between_, v_);
  contact_velocity(problem, v_, u_);
  for (int c = 0; c < nc; ++c) {
    double* island = of_island(c);
    const ConstVec3 rc(&between_[3 * c]), u(&u_[3 * c]), q(&at.u_minus[3 * c]);
    island[3] += 0.5 * rc.dot(u + q);
    island[4] += at.open_work(rc, u, q, c);
  }
  for (int g = 0; g < at.islands.count; ++g) {
    const double* island = &sum_[fields * static_cast<std::size_t>(g)];
    const double theta = asked_share(island);
    const double size = std::max(std::abs(island[2]) + std::abs(island[3] - island[2]), island[4] / Referee::accepted);
    const double left = size > 0 ? std::abs(island[3]) / size : 0;
    const double missing = at.island_size[g] > 0 ? (1 - theta) * std::sqrt(island[0]) / at.island_size[g] : 0;
    // Only one of the two theta that leave E = 0 gives something back, and no more than was asked.
    const bool some = theta > -Referee::accepted && theta < 1 + Referee::accepted;
    Evidence::see_island(worst, some ? std::min(std::abs(missing), left) : std::abs(missing), 1, g);
  }
}

// The point of the polygon `reach` conv{d_i} nearest to `wanted` (t1, t2; N s): ca d_first + cb d_second.
struct OnPolygon {
  int first, second;
  double ca, cb;
  bool slides;  // at its rim, as `wanted` is beyond it
};
OnPolygon nearest(const FrictionPolygon& d, int k, const Vector2d& wanted, double reach) {
  const double sector = 2 * M_PI / k, half_angle = sector / 2;
  double angle = std::atan2(wanted.y(), wanted.x());
  if (angle < 0) angle += 2 * M_PI;
  OnPolygon on{};
  on.first = static_cast<int>(angle / sector) % k;
  on.second = (on.first + 1) % k;
  const Vector2d a(d.cosine[on.first], d.sine[on.first]), b(d.cosine[on.second], d.sine[on.second]);
  // Coordinates of `wanted` in the directions a, b.
  const double area = a.x() * b.y() - a.y() * b.x();
  on.ca = std::max((wanted.x() * b.y() - wanted.y() * b.x()) / area, 0.0);
  on.cb = std::max((a.x() * wanted.y() - a.y() * wanted.x()) / area, 0.0);
  on.slides = on.ca + on.cb > reach;
  if (!on.slides) return on;
  // Along the edge from reach a to reach b, whose length is 2 reach sin(half_angle).
  const double edge = 2 * std::sin(half_angle);
  const double along = reach > 0 ? std::clamp((wanted - reach * a).dot(b - a) / (edge * edge * reach), 0.0, 1.0) : 0;
  on.ca = (1 - along) * reach;
  on.cb = along * reach;
  return on;
}

void rest(const ContactProblem& problem, const Witness& terms, ContactSolution& solution) {
  const auto& asked = std::get<PolygonWitness>(terms);
  const bool elastic = is_elastic(problem);
  PolygonWitness& polygon = solution.as<PolygonWitness>();
  polygon.k = asked.k;
  polygon.regularisation = asked.regularisation;
  polygon.z.assign(static_cast<std::size_t>(elastic ? 2 : 1) * (asked.k + 2) * problem.nc(), 0.0);
}

// c_t on the two directions beside r_t: the least sum that adds up to it, and where a contact slips the only one that
// satisfies the law. lam is the least that c_t asks for.
std::string_view prove(const ImpulsesAlone& answer, ContactSolution& solution) {
  const ContactProblem& problem = answer.problem;
  for (const double e : problem.restitution)
    if (e != 0) return "with restitution the impulses of the two phases are needed, each by itself";
  rest(problem, answer.terms, solution);
  PolygonWitness& polygon = solution.as<PolygonWitness>();
  const int nc = problem.nc(), k = polygon.k;
  const FrictionPolygon direction(k);
  for (int c = 0; c < nc; ++c) {
    const double* r = &solution.impulse[3 * c];
    polygon.z[c] = r[0];
    const OnPolygon on = nearest(direction, k, Vector2d(r[1], r[2]), HUGE_VAL);
    polygon.z[nc + k * c + on.first] = on.ca;
    polygon.z[nc + k * c + on.second] = on.cb;
    polygon.z[nc + k * nc + c] = direction.least_slip_bound(&answer.u_plus[3 * c]);
  }
  return {};
}

void join(const ProblemPart& part, const ContactSolution& answer, ContactSolution& whole) {
  const std::vector<double>& from = answer.as<PolygonWitness>().z;
  PolygonWitness& to = whole.as<PolygonWitness>();
  const std::size_t n = part.contacts.size(), nc = part.whole.nc(), k = to.k;
  for (std::size_t at = 0, to_at = 0; to_at < to.z.size(); at += (k + 2) * n, to_at += (k + 2) * nc) {
    const bool idle = at + (k + 2) * n > from.size();  // without restitution: nothing but the slips of before
    if (idle) at = 0;
    if (!idle) scatter(part.contacts, from, at, 1, to.z, to_at);
    if (!idle) scatter(part.contacts, from, at + n, k, to.z, to_at + nc);
    scatter(part.contacts, from, at + n + k * n, 1, to.z, to_at + nc + k * nc);
  }
}

class PolygonAlone {
 public:
  explicit PolygonAlone(const Witness& terms) : terms_(terms) { direction_.set(std::get<PolygonWitness>(terms).k); }
  void operator()(const LoneContact& contact, ContactSolution& answer) {
    rest(contact.problem, terms_, answer);
    PolygonWitness& polygon = answer.as<PolygonWitness>();
    const std::vector<double>& u = contact.u;
    const int k = polygon.k;
    const double normal = -u[0] / contact.W_n, reach = contact.problem.mu[0] * normal;
    const OnPolygon on = nearest(direction_, k, Vector2d(-u[1] / contact.w, -u[2] / contact.w), reach);
    answer.size = k + 2;
    polygon.z[0] = normal;
    polygon.z[1 + on.first] = on.ca;
    polygon.z[1 + on.second] = on.cb;
    const auto &cosine = direction_.cosine, &sine = direction_.sine;
    answer.impulse = {normal, on.ca * cosine[on.first] + on.cb * cosine[on.second],
                      on.ca * sine[on.first] + on.cb * sine[on.second]};
    const double after[] = {0, u[1] + contact.w * answer.impulse[1], u[2] + contact.w * answer.impulse[2]};
    if (on.slides) polygon.z[k + 1] = direction_.least_slip_bound(after);
  }

 private:
  Witness terms_;
  FrictionPolygon direction_;
};

// A regularised problem is another one, with another answer for each number of contacts, of which nothing is known but
// by solving it.
LeaveOut leave_out(const Witness& terms) {
  if (std::get<PolygonWitness>(terms).regularisation != 0) return {};
  return {.corners = Corners::suffice_unless_spin, .closed_form = PolygonAlone(terms), .idle_friction = true};
}

}  // namespace

Law anitescu_potra_law() {
  return {.name = "anitescu_potra",
          .check = []() -> LawCheck { return PolygonCheck(); },
          .leave_out = leave_out,
          .rest = rest,
          .join = join,
          .prove = prove,
          .polygon_edges = [](const ContactSolution& solution) { return solution.as<PolygonWitness>().k; }};
}

}  // namespace cb
