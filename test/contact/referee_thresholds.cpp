// The referee's thresholds, from both sides: an error a little below what is accepted holds, one a little above does
// not.
#include <catch2/catch.hpp>

#include "contact/exact_answers.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double accepted = 1e-9, below = 0.99, above = 1.01;

bool held(const Exact& exact) {
  std::vector<double> v_plus;
  return Referee::holds(Referee().check(exact.problem, exact.solution, exact.law, v_plus), accepted);
}

/// `spoil` adds an error of `factor` times what is accepted to an exact answer.
void from_both_sides(const Exact& exact, const std::function<void(ContactSolution&, double factor)>& spoil) {
  INFO(exact.name);
  Exact wrong = exact;
  spoil(wrong.solution, below);
  CHECK(held(wrong));
  wrong = exact;
  spoil(wrong.solution, above);
  CHECK_FALSE(held(wrong));
}

/// w_i of a solid sphere, 1/kg: (1 + 3.5 + 3.5) / (3 m).
double weight(double m) { return 8 / (3 * m); }

double norm(const double* x) { return Vector3d(x[0], x[1], x[2]).norm(); }

/// Of a single sphere, sqrt(J): larger before than after.
double size_of(const Exact& sphere) {
  const double root = std::sqrt(weight(sphere.problem.M.block(0)(0, 0)));
  std::vector<double> u;
  contact_velocity(sphere.problem, sphere.problem.v_minus, u);
  return std::max(root * norm(sphere.solution.impulse.data()), norm(u.data()) / root);
}

/// A solid sphere of 2 kg that leaves the ground at 3 m/s and slips at 5 m/s; nothing happens to it.
Exact parting_sphere(Law law, double mu) {
  Exact out{"a sphere that parts", law, {}, {}, {}};
  add_body(out.problem, 2, Vector3d::Constant(0.8), aslant(-3, 5));
  add_contact(out.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), mu);
  out.solution.impulse = {0, 0, 0};
  if (law == convex_law()) out.solution.as<ConvexWitness>().eta = {0};
  if (law == mirtich_law()) out.solution.witness = WorkWitness{{0}, {0}, {0}};
  return out;
}

/// A solid sphere of 2 kg that meets a wall at 1 m/s and is held against it from behind with `grip` (N s); what is in
/// front may come towards it at `driven` (m/s), and then no answer exists.
Exact gripped_sphere(Law law, double grip, double driven, double e) {
  constexpr double m = 2;
  Exact out{"a gripped sphere", law, {}, {}, {}};
  add_body(out.problem, m, Vector3d::Constant(0.4 * m), {-1, 0, 0});
  Matrix3d axes = Matrix3d::Identity();
  add_contact(out.problem, 0, {-1, 0, 0}, -1, {}, axes, 0.3, e);
  axes(0, 0) = axes(2, 2) = -1;
  add_contact(out.problem, 0, {1, 0, 0}, -1, {}, axes, 0.3, 0);
  out.problem.offset[0] = -driven;
  out.solution.impulse = {m + grip, 0, 0, grip, 0, 0};
  if (law == anitescu_potra_law())
    out.solution.witness =
        PolygonWitness{.k = 4, .regularisation = 0, .z = {m + grip, grip, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}};
  if (law == convex_law())  // without the bound
    out.solution.witness = ConvexWitness{false, 0, {}, {0, 0}, {0, 0}, {0, 0, 0, 0, 0, 0}};
  return out;
}

/// Takes `less` (N s) from the first impulse, wherever it stands.
void loosen(const Law& law, ContactSolution& solution, double less) {
  solution.impulse[0] -= less;
  if (law == anitescu_potra_law()) solution.as<PolygonWitness>().z[0] -= less;
}

}  // namespace

TEST_CASE("an approach counts from 1e-9 of the island's velocities before, however large the impulses") {
  const auto refused = [](const Law& law, double e) {
    INFO(law.name << ", e = " << e);
    CHECK(held(gripped_sphere(law, 1e3, 0, e)));
    from_both_sides(gripped_sphere(law, 1e3, 0, e), [&](ContactSolution& s, double factor) {
      loosen(law, s, 2 * factor * accepted * std::sqrt(2));  // both contacts meet the sphere at 1 m/s
    });
    for (const double grip : {1e3, 1e6, 1e9, 1e12}) CHECK_FALSE(held(gripped_sphere(law, grip, 0.5, e)));
  };
  for (const Law& law : {coulomb_law(), newton_law(), convex_law(), anitescu_potra_law()}) refused(law, 0);
  for (const Law& law : {coulomb_law(), newton_law(), convex_law()}) refused(law, 0.5);
}

TEST_CASE("an approach that is left counts from 1e-9 of the velocity before") {
  const double m = 2, v = 3;
  for (const Law& law : {newton_law(), convex_law()}) {
    Exact sphere{"a sphere that stops", law, {}, {}, {}};
    add_body(sphere.problem, m, Vector3d::Constant(0.4 * m), {0, -v, 0});
    // With restitution convex is judged by its feasibility: a restitution so small that it makes no velocity makes it
    // so.
    const double e = law == convex_law() ? 1e-300 : 0;
    add_contact(sphere.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), 0.5, e);
    sphere.solution.impulse = {m * v, 0, 0};
    from_both_sides(sphere, [&](ContactSolution& s, double factor) {
      s.impulse[0] *= 1 - factor * accepted;  // u_n = -d v; sqrt(w) m v is 8/3 of v / sqrt(w)
    });
  }
}

TEST_CASE("friction beyond the cone counts from 1e-9 of the contact's size") {
  const Exact sphere = newton_sphere();
  const double w = weight(sphere.problem.M.block(0)(0, 0)), size = size_of(sphere);
  from_both_sides(sphere, [&](ContactSolution& s, double factor) {
    double* r = s.impulse.data();
    const double beyond = factor * accepted * size / std::sqrt(w) / std::hypot(r[1], r[2]);
    for (int i = 1; i < 3; ++i) r[i] *= 1 + beyond;
  });
}

TEST_CASE("an impulse that pulls counts from 1e-9 of what its contact is about") {
  for (const Law& law : {newton_law(), mirtich_law(), convex_law()}) {
    const Exact sphere = parting_sphere(law, 0);
    from_both_sides(sphere, [&](ContactSolution& s, double factor) {
      const double speed = std::hypot(3.0, 5.0);
      s.impulse[0] = -factor * accepted * speed / weight(2);
      if (law == convex_law()) s.as<ConvexWitness>().epsilon = 1;
    });
  }
}

TEST_CASE("a rebound counts from 1e-9 of the contact's size, to either side") {
  for (const double sign : {-1.0, 1.0}) {
    Exact sphere = newton_sphere();
    const double m = sphere.problem.M.block(0)(0, 0), w = weight(m), size = size_of(sphere);
    from_both_sides(sphere, [&](ContactSolution& s, double factor) {
      const double change = sign * factor * accepted * size * std::sqrt(w) * m;
      s.impulse[0] += change;
      for (int i = 1; i < 3; ++i) s.impulse[i] *= 1 + change / s.impulse[0];  // stays on the cone
    });
  }
}

TEST_CASE("the polygon's errors count from 1e-9 of the contact's size, all rows of a contact together") {
  const Exact sphere = polygon_sphere(0);
  const double size = norm(sphere.solution.impulse.data());  // sqrt(w) r = 1.63 r_n beats |u|/sqrt(w)
  const double w = weight(2), u = std::hypot(2.0, 5.0);
  REQUIRE(std::sqrt(w) * size < u / std::sqrt(w));
  const double about = u / w;  // in impulses
  // Rows of idle directions: c_t of a direction across the slip, balanced by its opposite, is off by itself twice;
  // lam's row by their sum; what they add up to is zero.
  from_both_sides(sphere, [&](ContactSolution& s, double factor) {
    const double each = factor * accepted * about / std::sqrt(1 + 1 + 4);
    s.as<PolygonWitness>().z[1 + 2] += each;
    s.as<PolygonWitness>().z[1 + 6] += each;
  });
  // z has more normal impulse than r: the row of the comparison, and mu times it in lam's row, lam being positive.
  from_both_sides(sphere, [&](ContactSolution& s, double factor) {
    s.as<PolygonWitness>().z[0] += factor * accepted * about / std::sqrt(1 + 0.1 * 0.1);
  });
  // A slip bound that is too large: in the row of the direction that has friction.
  from_both_sides(
      sphere, [&](ContactSolution& s, double factor) { s.as<PolygonWitness>().z[9] += factor * accepted * about * w; });
  // Friction in z and r alike that is short of its bound, lam in step with it: lam's row alone.
  from_both_sides(sphere, [&](ContactSolution& s, double factor) {
    const double change = factor * accepted * about;
    s.as<PolygonWitness>().z[1 + 4] -= change;
    s.impulse[1] += change;
    s.as<PolygonWitness>().z[9] += 3.5 / 2 * change;
  });
}

TEST_CASE(
    "a slip bound without slip, and an impulse where friction has none, are found in the row that alone shows them") {
  const double speed = 0.01;
  Exact box = polygon_box();
  box.solution.as<PolygonWitness>().z[36] = 1e-6 * speed;  // lam = 0 is all that friction that is not used up leaves
  CHECK_FALSE(held(box));
  box = polygon_box();
  box.solution.as<PolygonWitness>().z[36] = -1e-6 * speed;
  CHECK_FALSE(held(box));

  // Without friction lam is anything that is not less than the slip, and every row of friction is met; the tangential
  // impulse is then compared with z alone.
  for (const int i : {1, 2}) {
    Exact smooth{"a sphere without friction", anitescu_potra_law(), {}, {}, {}};
    add_body(smooth.problem, 2, Vector3d::Constant(0.8), {1, -2, 1});
    add_contact(smooth.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), 0);
    smooth.solution.as<PolygonWitness>().k = 4;
    smooth.solution.as<PolygonWitness>().z = {4, 0, 0, 0, 0, 10};
    smooth.solution.impulse = {4, 0, 0};
    CHECK(held(smooth));
    smooth.solution.impulse[i] = 4e-6;
    CHECK_FALSE(held(smooth));
  }
}

TEST_CASE("each work of Stronge's law counts from 1e-9 of the island's energy") {
  const Exact spheres = mirtich_spheres();
  // The size of the first island: the largest of r.w.r, u+.u+/w, u-.u-/w.
  std::vector<double> u_minus, u_plus, v_plus;
  BlockCholesky factor;
  REQUIRE(factor.factor(spheres.problem.M));
  apply_impulse(spheres.problem, factor, spheres.solution.impulse, v_plus);
  contact_velocity(spheres.problem, spheres.problem.v_minus, u_minus);
  contact_velocity(spheres.problem, v_plus, u_plus);
  const double w = weight(2), r = norm(spheres.solution.impulse.data());
  const double energy =
      std::max({w * r * r, std::pow(norm(u_minus.data()), 2) / w, std::pow(norm(u_plus.data()), 2) / w});

  // Restitution off e^2 of compression, made up for by friction.
  for (const double sign : {-1.0, 1.0})
    from_both_sides(spheres, [&](ContactSolution& s, double f) {
      s.as<WorkWitness>().restitution[0] += sign * f * accepted * energy;
      s.as<WorkWitness>().friction[0] -= sign * f * accepted * energy;
    });
  // The sum alone.
  for (const double sign : {-1.0, 1.0})
    from_both_sides(spheres, [&](ContactSolution& s, double f) {
      s.as<WorkWitness>().friction[0] += sign * f * accepted * energy;
    });
}

TEST_CASE("friction that gives energy is refused though all works add up") {
  // Compression and restitution 4 : 1 as e = 0.5 has them, larger than they were, and friction pays for it.
  Exact spheres = mirtich_spheres();
  ContactSolution& s = spheres.solution;
  const double total =
      s.as<WorkWitness>().compression[0] + s.as<WorkWitness>().restitution[0] + s.as<WorkWitness>().friction[0];
  const double friction = 1e-3 * std::abs(s.as<WorkWitness>().compression[0]), stored = (total - friction) / 0.75;
  s.as<WorkWitness>().compression[0] = stored;
  s.as<WorkWitness>().restitution[0] = -0.25 * stored;
  s.as<WorkWitness>().friction[0] = friction;
  CHECK_FALSE(held(spheres));
  s.as<WorkWitness>().friction[0] = 0;
  s.as<WorkWitness>().compression[0] = total / 0.75;
  s.as<WorkWitness>().restitution[0] = -0.25 * total / 0.75;
  CHECK(held(spheres));
}

namespace {

/// A ball without friction falls between two walls that rise at `slope` from the vertical, and one of them alone gives
/// back: theta of the impulse that stopped it, after which the other stops it once more.
Exact ball_in_a_wedge(double slope, double theta) {
  const double m = 2, v = 3, r = m * v / (2 * std::sin(slope)), again = theta * r * std::cos(2 * slope);
  Exact out{"a ball in a wedge", anitescu_potra_law(), {}, {}, {}};
  add_body(out.problem, m, Vector3d::Constant(0.4 * m), {0, -v, 0});
  for (const double side : {1.0, -1.0}) {
    const Vector3d n(side * std::cos(slope), std::sin(slope), 0), t2(0, 0, 1);
    Eigen::Matrix3d axes;
    axes << n.transpose(), t2.cross(n).transpose(), t2.transpose();
    add_contact(out.problem, 0, -n, -1, {}, axes, 0, side > 0 ? 1 : 0);
  }
  ContactSolution& s = out.solution;
  s.as<PolygonWitness>().k = 4;
  s.impulse = {r * (1 + theta), 0, 0, r + again, 0, 0};
  for (const double first : {r, 0.0}) {
    s.as<PolygonWitness>().z.push_back(first);
    s.as<PolygonWitness>().z.push_back(first > 0 ? r : again);
    s.as<PolygonWitness>().z.insert(s.as<PolygonWitness>().z.end(), 2 * 4, 0.0);
    s.as<PolygonWitness>().z.insert(s.as<PolygonWitness>().z.end(), 2,
                                    100 * v);  // lam: without friction anything that is not less than the slip
  }
  return out;
}

}  // namespace

TEST_CASE("a share of restitution between all and what keeps the energy counts from 1e-9 of that energy") {
  // E(theta) = m v^2 / 2 (theta^2 / (4 sin^2) - 1).
  const double slope = 0.2, theta = 2 * std::sin(slope);
  for (const double sign : {-1.0, 1.0}) {
    CHECK(held(ball_in_a_wedge(slope, theta * (1 + sign * below * accepted))));
    CHECK_FALSE(held(ball_in_a_wedge(slope, theta * (1 + sign * above * accepted))));
  }
  for (const double wrong : {0.0, 0.7, 0.999, 1.001}) CHECK_FALSE(held(ball_in_a_wedge(slope, wrong)));
  CHECK(held(ball_in_a_wedge(slope, 1)));  // the other wall takes what is too much
  CHECK(held(ball_in_a_wedge(0.6, 1)));
  CHECK_FALSE(held(ball_in_a_wedge(0.6, 0.99)));
  CHECK_FALSE(held(ball_in_a_wedge(0.6, 1.01)));
}

TEST_CASE("an energy gain with restitution counts from 1e-9 of the energy before, as seen from a driven stop") {
  Exact sphere{"a sphere that rebounds without loss", convex_law(), {}, {}, {}};
  const double m = 2, v = 3;
  add_body(sphere.problem, m, Vector3d::Constant(0.4 * m), {0, -v, 0});
  add_contact(sphere.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), 0.5, 1);
  sphere.solution.impulse = {2 * m * v, 0, 0};
  // v+ = (1 + 2 d) v has (1 + 4 d) of the energy.
  const auto more = [](ContactSolution& s, double factor) { s.impulse[0] *= 1 + factor * accepted / 4; };
  from_both_sides(sphere, more);
  // A stop that comes at 3 m/s for a sphere at rest gives it 6 m/s, and what it has then, but no more.
  sphere.problem.v_minus[1] = 0;
  sphere.problem.offset[0] = -v;
  from_both_sides(sphere, more);
}

TEST_CASE("a gap counts from the island's share of epsilon, and islands without impulses have none") {
  // Boxes that slide with friction one per cent too weak: feasible, y.r = s (mu r_n - |r_t|) is the gap.
  const double approach = 0.01, mu = 0.1, less = 0.99 * mu;
  const double slip = 0.05 - less * approach, gap = (mu - less) * approach * slip;
  for (const int boxes : {1, 2})
    for (const bool idle : {false, true}) {
      Exact out{"boxes", convex_law(), {}, {}, {}};
      ContactSolution& s = out.solution;
      s.as<ConvexWitness>().bounded = true;
      for (int b = 0; b < boxes; ++b) {
        add_body(out.problem, 1, Vector3d::Constant(1.0 / 6), {0.03, -approach, 0.04});
        for (const double x : {-0.5, 0.5})
          for (const double z : {-0.5, 0.5}) add_contact(out.problem, b, {x, -0.5, z}, -1, {}, ground_axes(), mu);
        const std::vector<double> r = box_impulses(approach, less, 0.6, 0.8);
        s.impulse.insert(s.impulse.end(), r.begin(), r.end());
        s.as<ConvexWitness>().frictionless.insert(s.as<ConvexWitness>().frictionless.end(), 4, approach / 4);
        s.as<ConvexWitness>().kappa_dual.insert(s.as<ConvexWitness>().kappa_dual.end(), {0, 1, 0, 0, 0, 0});
      }
      if (idle) {
        add_body(out.problem, 1, Vector3d::Constant(1.0 / 6), {0, 1, 0});
        add_contact(out.problem, boxes, {0, -0.5, 0}, -1, {}, ground_axes(), mu);
        s.impulse.insert(s.impulse.end(), 3, 0.0);
        s.as<ConvexWitness>().frictionless.push_back(0);
        s.as<ConvexWitness>().kappa_dual.insert(s.as<ConvexWitness>().kappa_dual.end(), 6, 0.0);
      }
      s.as<ConvexWitness>().eta.assign(s.as<ConvexWitness>().frictionless.size(), 0.0);
      INFO(boxes << " boxes" << (idle ? " and one that parts" : ""));
      s.as<ConvexWitness>().epsilon = above * boxes * gap;
      CHECK(held(out));
      s.as<ConvexWitness>().epsilon = below * boxes * gap;
      CHECK_FALSE(held(out));
    }
}

TEST_CASE("multipliers of normal velocities enter the gap with the velocities that they forbid") {
  // A smooth sphere that parts: eta u_n is the gap.
  Exact sphere = parting_sphere(convex_law(), 0);
  const double eta = 1e-3, u_n = 3;
  sphere.solution.as<ConvexWitness>().eta = {eta};
  // y_n = u_n - eta / m stays positive.
  sphere.solution.as<ConvexWitness>().epsilon = above * eta * u_n;
  CHECK(held(sphere));
  sphere.solution.as<ConvexWitness>().epsilon = below * eta * u_n;
  CHECK_FALSE(held(sphere));
}

TEST_CASE("infeasible impulses do not hold however large a gap is allowed") {
  for (const Exact& exact : {convex_box(), convex_corner(), convex_sphere()}) {
    INFO(exact.name);
    Exact other = exact;
    other.solution.as<ConvexWitness>().epsilon = 1e6;
    CHECK(held(other));
    for (const Part& part : parts(other)) {
      if (part.name.rfind("impulse", 0) != 0 || part.name == "impulse 1" || part.name == "impulse 2") continue;
      const double before = *part.value;
      *part.value -= 10 * std::abs(before) + part.size;  // pulls, or leaves its cone
      INFO(part.name);
      CHECK_FALSE(held(other));
      *part.value = before;
    }
  }
}

TEST_CASE("the dual cone without the bound, multipliers below zero, and the bound itself count from 1e-9") {
  const Exact sphere = convex_sphere();
  const double m = sphere.problem.M.block(0)(0, 0), w = weight(m), size = size_of(sphere);
  // A negative eta takes y_n up, so that only its own sign shows.
  from_both_sides(sphere, [&](ContactSolution& s, double factor) {
    s.as<ConvexWitness>().epsilon = 1;
    s.as<ConvexWitness>().eta[0] = -factor * accepted * size / std::sqrt(w);
  });
  // A positive one takes y_n = u_n - eta / m, which was on the cone, out of it.
  from_both_sides(sphere, [&](ContactSolution& s, double factor) {
    s.as<ConvexWitness>().epsilon = 1;
    s.as<ConvexWitness>().eta[0] = factor * accepted * size * std::sqrt(w) * m;
  });
  // All impulses of the box larger by d: it parts, in its cones, and their sum is d kappa beyond the bound.
  const Exact box = convex_box();
  from_both_sides(box, [&](ContactSolution& s, double factor) {
    s.as<ConvexWitness>().epsilon = 1;
    // K = max(kappa, sum |u_n-| / w) with w of a corner: W_nn = 1 + 6 (1/4 + 1/4) = 4, W_tt = 1 + 6 / 4 + 6 / 4 ... = 4
    const double K = std::max(0.01, 4 * 0.01 / ((4.0 + 4.0 + 4.0) / 3));
    for (double& r : s.impulse) r *= 1 + factor * accepted * K / 0.01;
  });
}

TEST_CASE(
    "what the last bits of large velocities leave open counts as 1e-9, and what is ten per cent beyond it does not") {
  // Two smooth spheres with a common velocity of 1e6 m/s along the normal meet at 1 mm/s.
  const double V = 1e6, approach = 1e-3, m = 1;
  Exact spheres{"spheres that meet", newton_law(), {}, {}, {}};
  add_body(spheres.problem, m, Vector3d::Constant(0.4 * m), {0, V - approach, 0});
  add_body(spheres.problem, m, Vector3d::Constant(0.4 * m), {0, V, 0});
  add_contact(spheres.problem, 0, {0, -1, 0}, 1, {0, 1, 0}, ground_axes(), 0);
  const double approached = spheres.problem.v_minus[7] - spheres.problem.v_minus[1];  // as rounded
  spheres.solution.impulse = {m * approached / 2, 0, 0};
  CHECK(held(spheres));
  // |J| |v-| = 2 V along the normal; impulses change nothing of that size.
  const double rho = 128 * std::numeric_limits<double>::epsilon() * 2 * V;
  for (const double sign : {-1.0, 1.0})
    for (const double part : {0.9, 1.1}) {
      INFO(part << " of the rounding, " << sign);
      Exact off = spheres;
      off.solution.impulse[0] += sign * part * rho * m / 2;
      CHECK(held(off) == (part < 1));
    }
}

TEST_CASE("a limit's rounding is its own: it excuses no contact of its island, and theirs not it") {
  // One tree of two rates: the first is a limit's, fast; the second a contact's along its normal.
  for (const bool limit_fast : {true, false})
    for (const bool limit_wrong : {true, false}) {
      Exact out{"a joint at its limit beside a contact", newton_law(), {}, {}, {}};
      ContactProblem& p = out.problem;
      const int b = p.M.add_block(4);
      p.M.block(b).setIdentity();
      const double fast = 1e6, slow = 1e-3;
      // Rates 0, 1: the limit's is their difference; 2, 3: the contact's normal velocity is theirs.
      const double limit_scale = limit_fast ? fast : 0, contact_scale = limit_fast ? 0 : fast;
      p.v_minus = {limit_scale, limit_scale + slow, contact_scale, contact_scale + slow};
      for (const int first : {2, 0}) {
        p.J.add_band();
        auto J = p.J.entry(p.J.add_entry(b, 4));
        J(0, first) = 1;
        J(0, first + 1) = -1;
        if (first == 2) J(1, 0) = 1e-12;  // a contact has tangents
        p.offset.insert(p.offset.end(), 3, 0.0);
        p.mu.push_back(0);
        p.restitution.push_back(0);
      }
      const double u_contact = p.v_minus[2] - p.v_minus[3], u_limit = p.v_minus[0] - p.v_minus[1];
      out.solution.impulse = {-u_contact / 2, 0, 0, -u_limit / 2, 0, 0};
      CHECK(held(out));
      out.solution.impulse[limit_wrong ? 3 : 0] *= 1 - 1e-6;
      INFO((limit_fast ? "limit" : "contact") << " fast, " << (limit_wrong ? "limit" : "contact") << " wrong");
      CHECK(held(out) == (limit_fast == limit_wrong));
    }
}

TEST_CASE("a tree's last bits are those of the energy that it is given, whatever entry they are seen in") {
  // Two rates of one tree: an event stops the second, and the limit of the first comes nearer by less than, or more
  // than, the last bits of that.
  const double rho = 128 * std::numeric_limits<double>::epsilon();  // units eps sqrt(W E): W = 1/kg m^2, E = 1 J
  for (const double part : {0.9, 1.1}) {
    Exact out{"a joint at its limit beside what is stopped", coulomb_law(), {}, {}, {}};
    ContactProblem& p = out.problem;
    add_limited_rates(p, -part * rho, -1);
    out.solution.impulse = {1, 0, 0, 0, 0, 0};
    INFO(part << " of the rounding");
    CHECK(held(out) == (part < 1));
  }
}

TEST_CASE(
    "what is true of any answer is measured: approach, distance from the cone, friction's failing, energy, momentum") {
  // m = 2 kg at (3, -4) m/s on smooth ground pulled by r = (-1, 0, 0), then pushed aside by 2 N s.
  ContactProblem p;
  add_body(p, 2, Vector3d::Constant(0.8), {3, -4, 0});
  add_contact(p, 0, {0, 0, 0}, -1, {}, ground_axes(), 0.75);
  ContactSolution s;
  s.impulse = {4, 2, 0};
  std::vector<double> v_plus;
  Residuals out = Referee().check(p, s, newton_law(), v_plus);
  CHECK(v_plus[0] == Approx(4));
  CHECK(v_plus[1] == Approx(-2));
  CHECK(out.approach == Approx(2));
  CHECK(out.cone_violation == 0);
  CHECK(out.dissipation_gap == Approx(0.75 * 4 * 4 + 2 * 4));
  CHECK(out.energy_before == Approx(25));
  CHECK(out.energy_gain == Approx(16 + 4 - 25));
  s.impulse = {1, 2, 0};  // |r_t| = 2 beyond mu r_n = 0.75: distance (2 - 0.75) cos(atan mu) = 1.25 * 0.8
  out = Referee().check(p, s, newton_law(), v_plus);
  CHECK(out.cone_violation == Approx(1));
  s.impulse = {-3, 1, 0};  // beyond the polar cone: mu |r_t| <= -r_n
  out = Referee().check(p, s, newton_law(), v_plus);
  CHECK(out.cone_violation == Approx(std::sqrt(10)));
  s.impulse = {-3, 0, 4.5};  // not yet: mu 4.5 = 3.375 > 3
  out = Referee().check(p, s, newton_law(), v_plus);
  CHECK(out.cone_violation < std::sqrt(9 + 4.5 * 4.5));
  // A driven row's velocity is its own: the offset does no work on the body.
  p.offset = {0.5, 0, 0};
  s.impulse = {4, 2, 0};
  CHECK(Referee().check(p, s, newton_law(), v_plus).energy_gain == Approx(16 + 4 - 25));
}

TEST_CASE("the momentum that rounding of a large velocity loses is measured, over the root of the mass") {
  ContactProblem p;
  add_body(p, 3, Vector3d::Constant(1.2), {1e9 / 7, -1, 0});
  add_contact(p, 0, {0, 0, 0}, -1, {}, ground_axes(), 0.5);
  ContactSolution s;
  s.impulse = {1, 0.3, 0};
  std::vector<double> v_plus;
  const Residuals out = Referee().check(p, s, newton_law(), v_plus);
  const double missing = std::abs(3 * (v_plus[0] - p.v_minus[0]) - 0.3);
  REQUIRE(missing > 1e-10);
  CHECK(out.momentum == Approx(missing / std::sqrt(3)).epsilon(1e-6));
}

TEST_CASE("where nothing moves and nothing is exerted, a claim of anything is refused") {
  ContactProblem p;
  add_body(p, 2, Vector3d::Constant(0.8), Vector3d::Zero());
  add_contact(p, 0, {0, -1, 0}, -1, {}, ground_axes(), 0.5);
  const auto nothing = [](const Law& law) {
    ContactSolution s;
    s.impulse = {0, 0, 0};
    if (law == anitescu_potra_law()) s.witness = PolygonWitness{.k = 4, .regularisation = 0, .z = {0, 0, 0, 0, 0, 0}};
    if (law == mirtich_law()) s.witness = WorkWitness{{0}, {0}, {0}};
    if (law == convex_law()) s.witness = ConvexWitness{true, 0, {}, {0}, {0}, {0, 0, 0, 0, 0, 0}};
    return s;
  };
  for (const Law& law : laws()) CHECK(held({"nothing", law, p, nothing(law), {}}));
  const auto refused = [&](const Law& law, const auto& claim) {
    Exact exact{"something", law, p, nothing(law), {}};
    claim(exact.solution);
    CHECK_FALSE(held(exact));
  };
  for (const int i : {0, 1})
    refused(anitescu_potra_law(), [i](ContactSolution& s) { s.as<PolygonWitness>().z[i] = 1e-30; });
  refused(anitescu_potra_law(), [](ContactSolution& s) { s.as<PolygonWitness>().z[5] = -1e-30; });
  refused(mirtich_law(), [](ContactSolution& s) { s.as<WorkWitness>().restitution[0] = 1e-30; });
  refused(mirtich_law(), [](ContactSolution& s) { s.as<WorkWitness>().friction[0] = 1e-30; });
  refused(mirtich_law(), [](ContactSolution& s) { s.as<WorkWitness>().friction[0] = -1e-30; });
  refused(convex_law(), [](ContactSolution& s) { s.as<ConvexWitness>().eta[0] = -1e-30; });
}

TEST_CASE("multipliers however large excuse no gap beyond 1e-9 of what the island is about") {
  // Two smooth spheres of a common velocity of 1e6 m/s part by half of what its last bits leave open; nothing happens,
  // and eta u_n is the gap. The bound's multiplier takes y back into the dual cone, and costs nothing: kappa = 0.
  const double V = 1e6, rho = 128 * std::numeric_limits<double>::epsilon() * 2 * V, w = 2 * weight(1);
  Exact spheres{"spheres that part", convex_law(), {}, {}, {}};
  add_body(spheres.problem, 1, Vector3d::Constant(0.4), {0, V + rho / 2, 0});
  add_body(spheres.problem, 1, Vector3d::Constant(0.4), {0, V, 0});
  add_contact(spheres.problem, 0, {0, -1, 0}, 1, {0, 1, 0}, ground_axes(), 0);
  const double u_n = spheres.problem.v_minus[1] - spheres.problem.v_minus[7];
  ContactSolution& s = spheres.solution;
  s.impulse = {0, 0, 0};
  s.as<ConvexWitness>().bounded = true;
  s.as<ConvexWitness>().frictionless = {0};
  s.as<ConvexWitness>().kappa_dual.assign(12, 0.0);
  const double largest = accepted * std::pow(rho / accepted, 2) / w / u_n;  // S = rho / (1e-9 sqrt(w))
  for (const double part : {below, above}) {
    s.as<ConvexWitness>().eta = {part * largest};
    CHECK(held(spheres) == (part < 1));
  }
}

TEST_CASE(
    "a bound that is missed by what is accepted enters the gap as the bound that is met, however large its "
    "multiplier") {
  // A smooth sphere sinks at half of what is accepted of its slip; eta would make a gap of -eta |u_n| of it. The
  // bound's multiplier takes y back into the dual cone, and costs nothing: kappa = 0.
  Exact sphere{"a sphere that sinks", convex_law(), {}, {}, {}};
  add_body(sphere.problem, 2, Vector3d::Constant(0.8), {5, -0.5 * accepted * 5, 0});
  add_contact(sphere.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), 0);
  sphere.solution.impulse = {0, 0, 0};
  sphere.solution.as<ConvexWitness>().bounded = true;
  sphere.solution.as<ConvexWitness>().eta = {1e3};
  sphere.solution.as<ConvexWitness>().frictionless = {0};
  sphere.solution.as<ConvexWitness>().kappa_dual.assign(6, 0.0);
  CHECK(held(sphere));

  // All impulses of a sliding box half of what is accepted larger than kappa: s (kappa - 1.r_n) would be -s times that.
  const double approach = 0.01, mu = 0.1, slip = 1;
  Exact box = convex_box();
  box.problem.v_minus[0] = 0.6 * slip;
  box.problem.v_minus[2] = 0.8 * slip;
  box.solution.as<ConvexWitness>().eta.assign(4, 0.0);
  for (double& r : box.solution.impulse) r *= 1 + 0.5 * accepted;
  const double product = mu * slip * 0.5 * accepted * approach;
  box.solution.as<ConvexWitness>().epsilon = 0.5 * product;
  CHECK(held(box));
}

TEST_CASE("a gain that the convex program's epsilon allows counts only where it is little beside the island") {
  // A smooth sphere falls at v and leaves at (1 + d) v: it gains d m v^2. S^2 = w r^2 with r = 2 m v, and w = 8 / (3
  // m).
  const double m = 2, v = 3, S2 = 8 / (3 * m) * std::pow(2 * m * v, 2);
  Exact sphere{"a sphere that leaves faster", convex_law(), {}, {}, {}};
  add_body(sphere.problem, m, Vector3d::Constant(0.8), {0, -v, 0});
  add_contact(sphere.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), 0, 1);
  sphere.solution.as<ConvexWitness>().bounded = true;
  sphere.solution.as<ConvexWitness>().eta = sphere.solution.as<ConvexWitness>().frictionless = {0};
  sphere.solution.as<ConvexWitness>().kappa_dual.assign(6, 0.0);
  const auto holds = [&](double gain, double epsilon) {
    sphere.solution.impulse = {2 * m * v + gain / v, 0, 0};
    sphere.solution.as<ConvexWitness>().epsilon = epsilon;
    return held(sphere);
  };
  const double least = accepted * m * v * v / 2;  // of the energy before, whatever epsilon is
  CHECK(holds(below * least, 0));
  CHECK_FALSE(holds(above * least, 0));
  CHECK(holds(below * 2 * least, 2 * least));
  CHECK_FALSE(holds(above * 2 * least, 2 * least));
  CHECK(holds(below * accepted * S2, 1));
  CHECK_FALSE(holds(above * accepted * S2, 1));
}

// One body on two points, a perfectly elastic one that slides and one without restitution. In the first phase the first
// slides along t2 and the second aslant; in the second, what is given back turns the slip of the first around, so that
// its friction does work on what is left. Unknowns of a phase: c_n, c_t (4 edges a contact), lam; which are positive
// was found by Lemke's method, and the rows of these are solved here.
TEST_CASE("an answer that fulfils both phases of Poisson's law and gains energy is refused") {
  Exact rod{"a body on two points", anitescu_potra_law(), {}, {}, {}};
  ContactProblem& p = rod.problem;
  add_body(p, 1, {0.1, 2, 0.1}, {-1, -3, 1}, {2, -2, -3});
  add_contact(p, 0, {2, -2, 1}, -1, {}, ground_axes(), 0.2, 1);
  add_contact(p, 0, {1, -2, 0}, -1, {}, ground_axes(), 1, 0);
  BlockCholesky factor;
  REQUIRE(factor.factor(p.M));
  Eigen::MatrixXd W;
  delassus(p, factor, W);
  constexpr int k = 4, edges = 2 * (1 + k), unknowns = 2 * (k + 2);
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(6, edges);
  for (int c = 0; c < 2; ++c) {
    D(3 * c, c) = 1;
    for (int i = 0; i < k; ++i) D(3 * c + 1 + i % 2, 2 + k * c + i) = i < 2 ? 1 : -1;
  }
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(unknowns, unknowns);
  A.topLeftCorner(edges, edges) = D.transpose() * W * D;
  for (int c = 0; c < 2; ++c) {
    A(edges + c, c) = p.mu[c];
    A.block(edges + c, 2 + k * c, 1, k).setConstant(-1);
    A.block(2 + k * c, edges + c, k, 1).setConstant(1);
  }
  std::vector<double> before;
  contact_velocity(p, p.v_minus, before);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(6);
  const auto phase = [&](const std::vector<int>& positive, const Eigen::Vector2d& given_back) {
    for (int c = 0; c < 2; ++c) r[3 * c] += given_back[c];
    Eigen::VectorXd q(unknowns), z = Eigen::VectorXd::Zero(unknowns);
    q << D.transpose() * (Eigen::Map<const Eigen::VectorXd>(before.data(), 6) + W * r), p.mu[0] * given_back[0],
        p.mu[1] * given_back[1];
    z(positive) = -A(positive, positive).partialPivLu().solve(q(positive));
    r += D * z.head(edges);
    rod.solution.as<PolygonWitness>().z.insert(rod.solution.as<PolygonWitness>().z.end(), z.begin(), z.end());
    return z;
  };
  rod.solution.as<PolygonWitness>().k = k;
  const Eigen::VectorXd compression = phase({0, 1, 3, 7, 8, 10, 11}, {0, 0});
  phase({4, 10, 11}, {compression[0], 0});
  rod.solution.impulse.assign(r.begin(), r.end());

  std::vector<double> v_plus;
  const Residuals found = Referee().check(p, rod.solution, rod.law, v_plus);
  CHECK(found.energy_gain > 0.1 * found.energy_before);
  // Nothing else is wrong with it.
  const double work = std::abs(r.dot(Eigen::Map<const Eigen::VectorXd>(before.data(), 6)));
  CHECK(found.model == Approx(found.energy_gain / (work / 4)).epsilon(1e-12));
  CHECK_FALSE(held(rod));
}

TEST_CASE("why an answer is refused names what is not finite, else the residual and where it is") {
  Exact sphere = newton_sphere();
  std::vector<double> v_plus;
  sphere.solution.impulse[0] *= 1.5;
  const std::string wrong =
      Referee::refusal(Referee().check(sphere.problem, sphere.solution, sphere.law, v_plus), accepted);
  CHECK(wrong.find("checked residual") == 0);
  CHECK(wrong.find("at contact 0 of island 0") != std::string::npos);
  sphere.solution.impulse[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK(Referee::refusal(Referee().check(sphere.problem, sphere.solution, sphere.law, v_plus), accepted) ==
        "impulses, or what comes of them, are not finite, or their squares are not");
}
