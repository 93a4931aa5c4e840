// Answers that something large, or something elsewhere, once hid from the referee.
#include <catch2/catch.hpp>

#include "contact/exact_answers.h"

using namespace cb;
using namespace cb::test;

namespace {

bool held(const ContactProblem& problem, const Law& law, std::vector<double> impulse, Witness witness = {}) {
  ContactSolution answer;
  answer.impulse = std::move(impulse);
  answer.witness = std::move(witness);
  std::vector<double> v_plus;
  return Referee::holds(Referee().check(problem, answer, law, v_plus), 1e-9);
}

Witness works(std::vector<double> compression, std::vector<double> restitution, std::vector<double> friction) {
  return WorkWitness{std::move(compression), std::move(restitution), std::move(friction)};
}

/// Spheres of 2 kg that meet the ground at 1 m/s, each for itself, with this slip (m/s) and restitution.
ContactProblem spheres(const std::vector<double>& slip, const std::vector<double>& e, double mu) {
  ContactProblem p;
  for (std::size_t b = 0; b < slip.size(); ++b) {
    add_body(p, 2, Vector3d::Constant(0.8), aslant(1, slip[b]));
    add_contact(p, static_cast<int>(b), {0, -1, 0}, -1, {}, ground_axes(), mu, e[b]);
  }
  return p;
}

/// A point of 1 kg between two walls, gliding at 1 m/s, that both press with `grip` (N s) and push on along the slip.
ContactProblem between_walls() {
  ContactProblem p;
  add_body(p, 1, Vector3d::Constant(1), {0, 1, 0});
  Matrix3d axes = Matrix3d::Identity();
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes, 0.5);
  axes(0, 0) = axes(2, 2) = -1;
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes, 0.5);
  return p;
}
std::vector<double> pushed_on(double grip) { return {grip, 0.5, 0, grip, 0.5, 0}; }

/// The sphere without restitution by the law's own formula, and beside it one with e = 1/2, which has 3 N s.
Exact beside_restitution(const Law& law, const Witness& terms, double slip) {
  const ContactProblem alone = spheres({slip}, {0}, 0.5);
  Exact out{"beside restitution", law, spheres({slip, 0}, {0, 0.5}, 0.5), {}, {}};
  BlockCholesky factor;
  factor.factor(alone.M);
  std::vector<double> u;
  contact_velocity(alone, alone.v_minus, u);
  ContactSolution lone;
  law.leave_out(terms).closed_form({alone, factor, 1.0 / 2, 3.5 / 2, u}, lone);
  law.rest(out.problem, terms, out.solution);
  const int first[] = {0};
  if (law.join) law.join({out.problem, alone, first, first}, lone, out.solution);
  out.solution.impulse = lone.impulse;
  for (const double r : {3.0, 0.0, 0.0}) out.solution.impulse.push_back(r);
  return out;
}

}  // namespace

TEST_CASE("impulses beyond what has a square hold under no law") {
  const ContactProblem p = spheres({0}, {0}, 0.5), elastic = spheres({0}, {0.5}, 0.5);
  for (const double r : {1e155, 1e200, -1e200}) {
    INFO(r);
    for (const Law& law : {coulomb_law(), newton_law(), soft_law()}) {
      CHECK_FALSE(held(p, law, {r, 0, 0}));
      CHECK_FALSE(held(elastic, law, {r, 0, 0}));
    }
    CHECK_FALSE(held(p, coulomb_law(), {0, r, 0}));
    CHECK_FALSE(held(p, mirtich_law(), {r, 0, 0}, works({0}, {0}, {0})));
    CHECK_FALSE(held(p, anitescu_potra_law(), {r, 0, 0}, PolygonWitness{4, 0, {r, 0, 0, 0, 0, 0}}));
    CHECK_FALSE(held(elastic, convex_law(), {r, 0, 0}, ConvexWitness{false, 0, {}, {0}, {0}, {0, 0, 0, 0, 0, 0}}));
  }
}

TEST_CASE("without a weight nothing can be said of an answer") {
  ContactProblem p = spheres({0}, {0}, 0.5);
  for (double& x : p.J.values) x *= 1e-170;
  for (double& v : p.v_minus) v *= 1e170;
  for (const Law& law : {coulomb_law(), newton_law(), soft_law()}) CHECK_FALSE(held(p, law, {0, 0, 0}));
  // Nor where nothing happens: a weight of zero, and one beyond the largest number.
  for (const double scale : {0.0, 1e170}) {
    p = spheres({0}, {0}, 0.5);
    for (double& x : p.J.values) x *= scale;
    for (double& v : p.v_minus) v = 0;
    for (const Law& law : {coulomb_law(), newton_law(), soft_law()}) CHECK_FALSE(held(p, law, {0, 0, 0}));
  }
}

TEST_CASE("compression stores energy and gives none, though nothing is to be returned and friction pays for it") {
  const ContactProblem p = spheres({0}, {0}, 0.5);
  CHECK(held(p, mirtich_law(), {2, 0, 0}, works({-1}, {0}, {0})));
  CHECK_FALSE(held(p, mirtich_law(), {2, 0, 0}, works({1}, {0}, {-2})));
}

TEST_CASE("an error of bodies of next to no mass is one") {
  ContactProblem p = spheres({0}, {0}, 0.5);
  for (double& x : p.M.values) x *= 1e-170;
  const double m = 2e-170;
  CHECK(held(p, coulomb_law(), {m, 0, 0}));
  CHECK_FALSE(held(p, coulomb_law(), {3 * m, 0, 0}));
  CHECK(held(p, anitescu_potra_law(), {m, 0, 0}, PolygonWitness{4, 0, {m, 0, 0, 0, 0, 0}}));
  CHECK_FALSE(held(p, anitescu_potra_law(), {3 * m, 0, 0}, PolygonWitness{4, 0, {3 * m, 0, 0, 0, 0, 0}}));
}

TEST_CASE("ap gives back between nothing and what e asks for") {
  const ContactProblem p = spheres({0}, {0.5}, 0);
  const double r = 2;  // stops it
  const auto given = [&](double second, double sum) {
    PolygonWitness witness{4, 0, std::vector<double>(12, 0.0)};
    witness.z[0] = r;
    witness.z[6] = second;
    return held(p, anitescu_potra_law(), {sum, 0, 0}, witness);
  };
  CHECK(given(0, 1.5 * r));
  CHECK_FALSE(given(0, 2 * r));  // all of it: the energy of before
  CHECK_FALSE(given(r, r));      // stopped twice
  CHECK_FALSE(given(0, r));
}

TEST_CASE("an energy gain beside large impulses is one, with restitution or without") {
  const ContactProblem p = between_walls();
  for (const double grip : {1e3, 1e6}) {
    CHECK_FALSE(held(p, mirtich_law(), pushed_on(grip), works({0, 0}, {0, 0}, {0, 0})));
    CHECK_FALSE(held(p, coulomb_law(), pushed_on(grip)));
  }
  // Work that compression is said to have given.
  CHECK_FALSE(held(spheres({0}, {0}, 0), mirtich_law(), {200, 0, 0}, works({9800}, {0}, {0})));
}

TEST_CASE("what proves a bound counts only where there is one") {
  for (const double e : {0.0, 0.5})
    for (const double r : {0.0, 20.0})
      CHECK_FALSE(held(spheres({0}, {e}, 0.5), convex_law(), {r, 0, 0},
                       ConvexWitness{false, 0, {}, {0}, {1e15}, {0, 0, 0, 0, 0, 0}}));
}

TEST_CASE("newton: a contact alone on its island is held to the letter beside others, and where it parts") {
  const ContactProblem p = spheres({0, 0}, {0.5, 0.5}, 0.5);
  CHECK(held(p, newton_law(), {3, 0, 0, 3, 0, 0}));
  CHECK_FALSE(held(p, newton_law(), {3, 0, 0, 1000, 0, 0}));
  ContactProblem parting = spheres({0}, {0}, 0.5);
  for (double& v : parting.v_minus) v = -v;
  CHECK(held(parting, newton_law(), {0, 0, 0}));
  CHECK_FALSE(held(parting, newton_law(), {5, 0, 0}));
}

TEST_CASE("coulomb: an island without restitution is held to the law beside one that has some") {
  const ContactProblem p = spheres({3, 0}, {0, 0.5}, 0.5);
  const double r = 2;
  std::vector<double> u;
  contact_velocity(p, p.v_minus, u);
  const double t1 = -0.5 * r * u[1] / 3, t2 = -0.5 * r * u[2] / 3;
  CHECK(held(p, coulomb_law(), {r, t1, t2, 1.5 * r, 0, 0}));
  CHECK_FALSE(held(p, coulomb_law(), {r, 0, 0, 1.5 * r, 0, 0}));  // no friction
  CHECK_FALSE(held(p, coulomb_law(), {1.9 * r, 1.9 * t1, 1.9 * t2, 1.5 * r, 0, 0}));
}

TEST_CASE("convex and soft: an island without restitution is held to the optimum beside one that has some") {
  for (const double slip : {0.0, 3.0})
    for (const auto& [law, terms] :
         {std::pair{convex_law(), Witness(ConvexWitness{true, 0, {}, {}, {}, {}})}, {soft_law(), SoftWitness{}}}) {
      INFO(law.name << ", slip " << slip);
      const Exact exact = beside_restitution(law, terms, slip);
      const auto holds = [&](std::vector<double> r) {
        return held(exact.problem, law, std::move(r), exact.solution.witness);
      };
      const std::vector<double>& right = exact.solution.impulse;
      CHECK(holds(right));
      // Feasible, and no gain of energy: more than it takes to stop; no friction.
      for (const double more : {1 + 1e-6, 1.5}) CHECK_FALSE(holds({more * right[0], right[1], right[2], 3, 0, 0}));
      if (slip > 0) CHECK_FALSE(holds({right[0], 0, 0, 3, 0, 0}));
      // An island with restitution may part with any speed that gains nothing.
      for (const double other : {2.0, 4.0}) CHECK(holds({right[0], right[1], right[2], other, 0, 0}));
      CHECK_FALSE(holds({right[0], right[1], right[2], 4 * (1 + 1e-6), 0, 0}));
      CHECK_FALSE(holds({right[0], right[1], right[2], 1, 0, 0}));
      CHECK_FALSE(holds({right[0], right[1], right[2], -1, 0, 0}));
      CHECK_FALSE(holds({right[0], right[1], right[2], 3, 2, 0}));
    }
  // Without the bound optimality says so.
  const ContactProblem p = spheres({0, 0}, {0, 0.5}, 0.5);
  const Witness unbounded = ConvexWitness{false, 0, {}, {0, 0}, {}, {}};
  CHECK(held(p, convex_law(), {2, 0, 0, 3, 0, 0}, unbounded));
  CHECK_FALSE(held(p, convex_law(), {2 * (1 + 1e-6), 0, 0, 3, 0, 0}, unbounded));
}

TEST_CASE("convex: what proves the bound counts on islands without restitution, and there alone") {
  const Exact exact = beside_restitution(convex_law(), ConvexWitness{true, 0, {}, {}, {}, {}}, 3);
  const ConvexWitness right = exact.solution.as<ConvexWitness>();
  const auto holds = [&](const ConvexWitness& proof) {
    return held(exact.problem, convex_law(), exact.solution.impulse, proof);
  };
  CHECK(holds(right));
  ConvexWitness proof = right;
  proof.frictionless[1] = 1e15;
  proof.eta[1] = -1;
  for (int i = 6; i < 12; ++i) proof.kappa_dual[i] = 1e3;
  CHECK(holds(proof));
  // Impulses of a witness that proves nothing are no terms, either.
  CHECK_FALSE(held(exact.problem, convex_law(), {1, 0, 0, 3, 0, 0}, proof));
  CHECK_FALSE(held(exact.problem, convex_law(), {2, 0, 0, 5, 0, 0}, proof));
  proof = right;
  proof.frictionless[0] *= 1 + 1e-6;
  CHECK_FALSE(holds(proof));
  proof = right;
  proof.eta[0] = -1e-6;
  CHECK_FALSE(holds(proof));
  proof = right;
  for (int i = 0; i < 6; ++i) proof.kappa_dual[i] *= 1 + 1e-6;
  CHECK_FALSE(holds(proof));
  proof = right;
  proof.eta.clear();
  CHECK_FALSE(holds(proof));
}

TEST_CASE("convex: impulses alone prove a bound where all islands have restitution, and nowhere else") {
  for (const auto& [e, proven] : {std::pair{std::vector{0.5, 0.5}, true}, {{0.0, 0.5}, false}, {{0.0, 0.0}, false}}) {
    const ContactProblem p = spheres({0, 0}, e, 0.5);
    Islands islands;
    find_islands(p, islands);
    const std::vector<double> u(6, 0.0);
    const Witness terms = ConvexWitness{true, 0, {}, {}, {}, {}};
    ContactSolution s;
    s.impulse = {3, 0, 0, 3, 0, 0};
    CHECK(convex_law().prove({p, islands, terms, u, u}, s).empty() == proven);
  }
}

TEST_CASE("what a mass matrix is known to is no error of an answer") {
  // A lever: m (kg) and 1/8 kg m^2, seen from a point `far` (m) away, meets a stop 1/4 m beyond its centre. M has all
  // of its digits; its factor has not, unless a square root happens to have them.
  const auto held_at = [](double m, double far, double change, const Law& law) {
    ContactProblem p;
    const double inertia = 0.125, arm = 0.25;
    p.M.add_block(2);
    p.M.block(0) << m, m * far, m * far, m * far * far + inertia;
    p.v_minus = {0.5, -1 / far};
    p.J.add_band();
    auto J = p.J.entry(p.J.add_entry(0, 2));
    J.setZero();
    J.row(0) << 1, far + arm;
    p.offset.assign(3, 0.0);
    p.mu = {0};
    p.restitution = {0};
    const double exact = (0.5 + arm / far) / (1 / m + arm * arm / inertia);
    return held(p, law, {exact * (1 + change), 0, 0});
  };
  for (const Law& law : {coulomb_law(), newton_law()}) {
    for (const double m : {3, 5, 7, 11})
      for (const double far : {17, 101, 1009, 10007, 100003, 1000003}) {
        INFO(m << " kg, " << far << " m");
        CHECK(held_at(m, far, 0, law));
      }
    for (const double change : {1e-4, -1e-4}) CHECK_FALSE(held_at(3, 1009, change, law));
  }
}

TEST_CASE("what a limit turns at is no velocity of the contacts, in any unit") {
  for (const double unit : {1e-3, 1.0, 1e3}) {  // m
    INFO(unit);
    ContactProblem p;
    p.M.add_block(2);
    p.M.block(0) << 1 / (unit * unit), 1e-9 / unit, 1e-9 / unit, 1e-6;
    p.v_minus = {-1e-8 * unit, 1e6};
    p.J.add_band();
    auto contact = p.J.entry(p.J.add_entry(0, 2));
    contact << 1, 0, 1e-3, 0, 0, 0;
    p.J.add_band();
    auto limit = p.J.entry(p.J.add_entry(0, 2));
    limit << 0, 1, 0, 0, 0, 0;
    p.offset.assign(6, 0.0);
    p.mu = {0, 0};
    p.restitution = {0, 0};
    CHECK_FALSE(held(p, coulomb_law(), std::vector<double>(6, 0.0)));
  }
}

TEST_CASE("a mass matrix without a factor leaves the velocities as they were, in the size of this problem") {
  ContactProblem p = spheres({0, 0}, {0, 0}, 0);
  p.M.block(1)(0, 0) = -1;
  ContactSolution answer;
  answer.impulse.assign(6, 0.0);
  std::vector<double> v_plus(3, 7.0);
  CHECK_FALSE(Referee().check(p, answer, newton_law(), v_plus).finite);
  CHECK(v_plus == p.v_minus);
}

TEST_CASE("an error in what is beyond the largest number is an error, and stays the worst", "[referee]") {
  Worst worst;
  Evidence::see_island(worst, 1, HUGE_VAL, 3);
  CHECK(worst.ratio == HUGE_VAL);
  CHECK(worst.island == 3);
  Evidence::see_island(worst, 1, 2, 4);
  CHECK(worst.island == 3);
}
