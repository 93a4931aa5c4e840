// Details of the referee that no exact answer asks for: what it keeps between events, what it takes of an answer, whose
// number it takes, and how far it looks.
#include <catch2/catch.hpp>

#include "contact/exact_answers.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double accepted = 1e-9, below = 0.99, above = 1.01, infinite = HUGE_VAL;
const double no_number = std::nan("");

Residuals judged(const ContactProblem& problem, const Law& law, std::vector<double> impulse, Witness witness = {}) {
  ContactSolution answer;
  answer.impulse = std::move(impulse);
  answer.witness = std::move(witness);
  std::vector<double> v_plus;
  return Referee().check(problem, answer, law, v_plus);
}
bool held(const ContactProblem& problem, const Law& law, std::vector<double> impulse, Witness witness = {}) {
  return Referee::holds(judged(problem, law, std::move(impulse), std::move(witness)), accepted);
}
bool held_by(Referee& referee, const ContactProblem& problem, const Law& law, std::vector<double> impulse) {
  ContactSolution answer;
  answer.impulse = std::move(impulse);
  std::vector<double> v_plus;
  return Referee::holds(referee.check(problem, answer, law, v_plus), accepted);
}

Matrix3d axes_of(const Vector3d& n, const Vector3d& t1) {
  Matrix3d axes;
  axes << n.transpose(), t1.transpose(), n.cross(t1).transpose();
  return axes;
}

/// Bodies of these masses that come down at 1 m/s, and contacts with the ground at their centres (W = 1/m), of the
/// bodies `touching`.
ContactProblem points(const std::vector<double>& masses, const std::vector<int>& touching, double mu = 0.5,
                      double e = 0) {
  ContactProblem p;
  for (const double m : masses) add_body(p, m, Vector3d::Constant(m), {0, -1, 0});
  for (const int b : touching) add_contact(p, b, Vector3d::Zero(), -1, {}, ground_axes(), mu, e);
  return p;
}

/// A tree of these masses (M), a row of J for each of `rows`, frictionless; joints at their limits.
ContactProblem limits(const Eigen::MatrixXd& M, const std::vector<Eigen::RowVectorXd>& rows, std::vector<double> v) {
  ContactProblem p;
  p.M.block(p.M.add_block(static_cast<int>(M.rows()))) = M;
  p.v_minus = std::move(v);
  for (const Eigen::RowVectorXd& row : rows) {
    p.J.add_band();
    p.J.entry(p.J.add_entry(0, static_cast<int>(M.rows()))).row(0) = row;
    p.offset.insert(p.offset.end(), 3, 0.0);
    p.mu.push_back(0);
    p.restitution.push_back(0);
  }
  return p;
}

constexpr double unit = 128 * std::numeric_limits<double>::epsilon();

}  // namespace

TEST_CASE("a referee that has judged an event judges the next as if it were the first: other bodies touch") {
  // The same numbers, joined otherwise: two contacts of one body, and of two, which newton holds to the letter.
  const ContactProblem together = points({2, 2}, {0, 0}, 0.5, 0.5), apart = points({2, 2}, {0, 1}, 0.5, 0.5);
  Referee kept;
  CHECK(held_by(kept, together, newton_law(), {3, 0, 0, 4, 0, 0}));
  CHECK_FALSE(held_by(kept, apart, newton_law(), {3, 0, 0, 4, 0, 0}));
  CHECK(held_by(kept, together, newton_law(), {3, 0, 0, 4, 0, 0}));
}

TEST_CASE("a referee that has judged an event judges the next as if it were the first: other contacts join") {
  const auto problem = [](bool first_joins) {
    ContactProblem p = points({1, 2, 4}, {});
    for (const int b : {0, 1, 2}) {
      if (b == 0 || b == (first_joins ? 2 : 1)) {
        p.J.add_band();
        p.offset.insert(p.offset.end(), 3, 0.0);
        p.mu.push_back(0.5);
        p.restitution.push_back(0.5);
      }
      p.J.entry(p.J.add_entry(b, 6)).leftCols<3>() = ground_axes();
    }
    return p;
  };
  Referee kept;
  for (const bool first_joins : {true, false, true}) {
    const ContactProblem p = problem(first_joins);
    ContactSolution answer;
    answer.impulse = {1, 0, 0, 1, 0, 0};
    std::vector<double> v_kept, v_new;
    const Residuals again = kept.check(p, answer, newton_law(), v_kept);
    const Residuals afresh = Referee().check(p, answer, newton_law(), v_new);
    CHECK(again.model == afresh.model);
    CHECK(v_kept == v_new);
  }
}

TEST_CASE("a referee that has judged an event judges the next as if it were the first: blocks of other sizes") {
  // The same numbers are the blocks 2 and ((1, 1), (1, 2)), and ((2, 1), (1, 1)) and 2.
  const auto problem = [](int first, int second) {
    ContactProblem p;
    for (const int size : {first, second}) p.M.add_block(size);
    p.M.values = {2, 1, 1, 1, 2};
    p.v_minus = {-1, -1, -1};
    p.J.add_band();
    p.J.add_entry(0, first);
    p.J.add_entry(1, second);
    p.J.values = {1, 0.1, 0.2, 0.5, 0.3, 0.1, 1, 0.2, 0.4};
    p.offset.assign(3, 0.0);
    p.mu = {0.5};
    p.restitution = {0};
    return p;
  };
  Referee kept;
  for (const bool small_first : {true, false, true}) {
    const ContactProblem p = problem(small_first ? 1 : 2, small_first ? 2 : 1);
    ContactSolution answer;
    answer.impulse = {1, 0.2, 0.1};
    std::vector<double> v_kept, v_new;
    const Residuals again = kept.check(p, answer, coulomb_law(), v_kept);
    const Residuals afresh = Referee().check(p, answer, coulomb_law(), v_new);
    CHECK(v_kept == v_new);
    CHECK(again.model == afresh.model);
  }
}

TEST_CASE("a referee that has judged an event judges the next as if it were the first: another law") {
  // What slides without friction is newton's, and not Coulomb's.
  ContactProblem p = points({2}, {0});
  p.v_minus[0] = 3;
  Referee kept;
  for (int times = 0; times < 2; ++times) {
    CHECK(held_by(kept, p, newton_law(), {2, 0, 0}));
    CHECK_FALSE(held_by(kept, p, coulomb_law(), {2, 0, 0}));
  }
}

TEST_CASE("what cannot be weighed cannot be weighed when it is asked about again") {
  ContactProblem p = points({2, 2}, {0, 1});
  p.M.block(1)(2, 2) = -2;
  Referee kept;
  for (int times = 0; times < 3; ++times) CHECK_FALSE(held_by(kept, p, coulomb_law(), {2, 0, 0, 2, 0, 0}));
}

TEST_CASE("an answer with more numbers than its law asks for, or fewer, does not hold") {
  const ContactProblem p = points({2}, {0});
  for (const Law& law : {coulomb_law(), newton_law(), soft_law()}) {
    const Witness rigid = SoftWitness{{.rule = Softness::Rule::mujoco, .impedance = 1}};
    CHECK(held(p, law, {2, 0, 0}, rigid));
    for (const std::vector<double>& r : {std::vector<double>{2, 0, 0, 0, 0, 0}, {2, 0, 0, 0}, {2, 0}, {}})
      CHECK_FALSE(held(p, law, r, rigid));
  }

  for (const std::size_t numbers : {4, 5, 6, 7, 11, 12, 13, 18}) {
    INFO(numbers << " unknowns of a polygon");
    std::vector<double> z(numbers, 0.0);
    z[0] = 2;
    CHECK(held(p, anitescu_potra_law(), {2, 0, 0}, PolygonWitness{4, 0, z}) == (numbers == 6));
    CHECK(held(points({2}, {0}, 0.5, 0.5), anitescu_potra_law(), {3, 0, 0}, PolygonWitness{4, 0, z}) ==
          (numbers == 12));
  }

  const WorkWitness works{{-1}, {0}, {0}};
  CHECK(held(p, mirtich_law(), {2, 0, 0}, works));
  for (std::vector<double> WorkWitness::*part :
       {&WorkWitness::compression, &WorkWitness::restitution, &WorkWitness::friction}) {
    WorkWitness other = works;
    (other.*part).push_back(0);
    CHECK_FALSE(held(p, mirtich_law(), {2, 0, 0}, other));
    (other.*part).clear();
    CHECK_FALSE(held(p, mirtich_law(), {2, 0, 0}, other));
  }

  const ConvexWitness proof{true, 0, {}, {0}, {2}, {0, 1, 0, 0, 0, 0}};
  CHECK(held(p, convex_law(), {2, 0, 0}, proof));
  for (std::vector<double> ConvexWitness::*part :
       {&ConvexWitness::eta, &ConvexWitness::frictionless, &ConvexWitness::kappa_dual}) {
    ConvexWitness other = proof;
    (other.*part).push_back(0);
    CHECK_FALSE(held(p, convex_law(), {2, 0, 0}, other));
    (other.*part).resize((other.*part).size() - 2);
    CHECK_FALSE(held(p, convex_law(), {2, 0, 0}, other));
  }
}

TEST_CASE("what a law asks for is finite, even where it bounds nothing and touches nothing") {
  // Without friction a slip bound may be any number that is not less than the slip.
  const ContactProblem smooth = points({2}, {0}, 0);
  CHECK(held(smooth, anitescu_potra_law(), {2, 0, 0}, PolygonWitness{4, 0, {2, 0, 0, 0, 0, 1e6}}));
  CHECK_FALSE(held(smooth, anitescu_potra_law(), {2, 0, 0}, PolygonWitness{4, 0, {2, 0, 0, 0, 0, infinite}}));
  // A second body, which touches nothing.
  const ContactProblem two = points({2, 3}, {0});
  ConvexWitness proof{true, 0, {}, {0}, {2}, {0, 1, 0, 0, 0, 0, 7, 7, 7, 7, 7, 7}};
  CHECK(held(two, convex_law(), {2, 0, 0}, proof));
  for (const double x : {no_number, infinite}) {
    proof.kappa_dual[9] = x;
    CHECK_FALSE(held(two, convex_law(), {2, 0, 0}, proof));
  }
}

TEST_CASE("an island whose energies add up beyond the largest number has no answer, though each of them is one") {
  // Four contacts of a point; one stops it, without which each of them would have 1e308 J.
  ContactProblem p = points({1}, {0, 0, 0, 0}, 0);
  p.v_minus[1] = -1e154;
  CHECK_FALSE(judged(p, coulomb_law(), {1e154, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}).finite);
  p.v_minus[1] = -1e153;
  CHECK(held(p, coulomb_law(), {1e153, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
}

TEST_CASE("a refusal names the contact and its island, each by its own number") {
  const ContactProblem p = points({2, 3}, {0, 0, 1});
  const std::string why = Referee::refusal(judged(p, newton_law(), {1, 0, 0, 1, 0, 0, 4, 0, 0}), accepted);
  CHECK(why.find("at contact 2 of island 1") != std::string::npos);
}

TEST_CASE("a refusal of an error that is an island's names it, and one of neither no place") {
  Residuals out;
  out.model = 0.5;
  CHECK(Referee::refusal(out, accepted) == "checked residual 0.5, beyond 1e-09");
  out.worst_island = 2;
  CHECK(Referee::refusal(out, accepted) == "checked residual 0.5, beyond 1e-09, on island 2");
}

TEST_CASE("a gap that is refused is that of its island, and of no contact") {
  // Smooth bodies that part at 1 m/s: eta u_n is the gap, and the pull of the first is what rounding makes.
  ContactProblem p = points({2, 2}, {0, 1}, 0);
  p.v_minus[1] = p.v_minus[7] = 1;
  const Residuals out =
      judged(p, convex_law(), {-1e-12, 0, 0, 0, 0, 0}, ConvexWitness{false, 0, {}, {1e-3, 2e-3}, {}, {}});
  CHECK_FALSE(Referee::holds(out, accepted));
  CHECK(out.gap.value() == Approx(3e-3));
  CHECK(out.island_gap == Approx(2e-3));
  CHECK(out.worst_island == 1);
  CHECK(out.worst_contact == -1);
  const std::string why = Referee::refusal(out, accepted);
  CHECK(why.find("checked gap 0.002 J (allowed: ") == 0);
  CHECK(why.find("contact") == std::string::npos);
  CHECK(why.ends_with(", on island 1"));
}

TEST_CASE("where the law is broken is said, and not where that gains energy") {
  // A point between two walls that push it on along its slip: friction's error is small beside what presses.
  ContactProblem p;
  add_body(p, 1, Vector3d::Constant(1), {0, 1, 0});
  for (const double side : {1.0, -1.0})
    add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of({side, 0, 0}, {0, 1, 0}), 0.5);
  const Residuals out = judged(p, coulomb_law(), {10, 0.5, 0, 10, 0.5, 0});
  CHECK(out.model == Approx(6));  // gains 3/2 J: a quarter of sum r.u- = 1 is what it is held against
  CHECK(out.worst_contact == 0);
}

TEST_CASE("the law residual is the worst island's, however many are wrong") {
  const double one = judged(points({2}, {0}), newton_law(), {1.5, 0, 0}).law.value();
  CHECK(one > 0.1);
  CHECK(judged(points({2, 2}, {0, 1}), newton_law(), {1.5, 0, 0, 1.5, 0, 0}).law.value() == Approx(one).epsilon(1e-14));
}

TEST_CASE("newton: a contact alone that does not approach has no impulse, not even one that leaves it at rest") {
  // W = ((2, 1), (1, 2)) of normal and first tangent: r = (1, -2) moves the point along its tangent only.
  ContactProblem p;
  add_body(p, 1, Vector3d::Constant(1), {3, 0, 0});
  add_contact(p, 0, {1, -1, 0}, -1, {}, ground_axes(), 2);
  CHECK(held(p, newton_law(), {0, 0, 0}));
  const Residuals out = judged(p, newton_law(), {1, -2, 0});
  CHECK(out.approach == 0);
  CHECK(out.cone_violation == 0);
  CHECK_FALSE(Referee::holds(out, accepted));
}

TEST_CASE("each contact has its own restitution") {
  ContactProblem p = points({2, 2}, {0, 1});
  p.restitution = {0, 0.5};
  CHECK(held(p, newton_law(), {2, 0, 0, 3, 0, 0}));
  CHECK_FALSE(held(p, newton_law(), {2, 0, 0, 2, 0, 0}));
  CHECK(held(p, mirtich_law(), {2, 0, 0, 3, 0, 0}, WorkWitness{{-1, -1}, {0, 0.25}, {0, 0}}));
  CHECK_FALSE(held(p, mirtich_law(), {2, 0, 0, 2, 0, 0}, WorkWitness{{-1, -1}, {0, 0}, {0, 0}}));
}

TEST_CASE("works add up to the energy of their own island, however much another has") {
  const ContactProblem p = points({2e6, 2}, {0, 1});
  const auto works = [](double friction) { return WorkWitness{{-1e6, -1}, {0, 0}, {0, friction}}; };
  CHECK(held(p, mirtich_law(), {2e6, 0, 0, 2, 0, 0}, works(0)));
  CHECK_FALSE(held(p, mirtich_law(), {2e6, 0, 0, 2, 0, 0}, works(-1e-6)));
}

TEST_CASE("convex with restitution: a pull is one beside what its own island has, however much another has") {
  // The second parts, and is pulled at by a millionth of what it is about.
  ContactProblem p = points({2e6, 2}, {0, 1}, 0, 0.5);
  p.v_minus[1] = -1e6;
  p.v_minus[7] = 1;
  CHECK(held(p, convex_law(), {3e12, 0, 0, 0, 0, 0}));
  CHECK_FALSE(held(p, convex_law(), {3e12, 0, 0, -2e-6, 0, 0}));
}

TEST_CASE("with restitution no impulses of a witness are terms of an answer") {
  const ContactProblem p = points({2}, {0}, 0.5, 0.5);
  for (const double f : {0.0, 1e15, 1e30}) {
    const ConvexWitness proof{true, 0, {}, {0}, {f}, {0, 0, 0, 0, 0, 0}};
    CHECK(held(p, convex_law(), {3, 0, 0}, proof));
    for (const double wrong : {20.0, 1.0}) CHECK_FALSE(held(p, convex_law(), {wrong, 0, 0}, proof));
  }
}

TEST_CASE("soft with restitution: contacts give way, pull at nothing, keep their cones and gain no energy") {
  // W = 1/2, R_n = (1 - d) / d W_nn = 1/8.
  const Witness soft = SoftWitness{{.rule = Softness::Rule::mujoco, .impedance = 0.8}};
  ContactProblem p = points({2}, {0}, 0.5, 0.5);
  const auto holds = [&](std::vector<double> r) { return held(p, soft_law(), std::move(r), soft); };
  CHECK(holds({3, 0, 0}));
  CHECK(holds({1.6 * (1 + 1e-12), 0, 0}));  // u_n = -1 + r/2, and R_n r = r/8
  CHECK_FALSE(holds({1.6 * (1 - 1e-6), 0, 0}));
  CHECK(holds({4, 0, 0}));  // all the energy of before
  CHECK_FALSE(holds({4 * (1 + 1e-6), 0, 0}));
  p.v_minus[0] = -5;
  CHECK(holds({3, 1.5, 0}));
  CHECK_FALSE(holds({3, 1.5 * (1 + 1e-6), 0}));
  p.v_minus = {0, 1, 0, 0, 0, 0};
  p.mu[0] = 0;
  CHECK(holds({0, 0, 0}));
  CHECK_FALSE(holds({-1e-6, 0, 0}));
}

TEST_CASE("soft: each contact gives way by its own W, a limit by its W_nn") {
  // SAP's w is |W_ii| / 3: of a point |diag(1, 1, 1)| / (3 m), of a limit 1/m.
  const Witness soft = SoftWitness{{.rule = Softness::Rule::sap, .beta = 2 * M_PI}};
  ContactProblem p = points({2, 3, 4}, {0, 1, 2}, 0);
  p.J.entry(2).bottomRows<2>().setZero();
  const double as_point = 1 + std::sqrt(3) / 3, as_limit = 2;  // (W_nn + R_n) / W_nn
  const double r[] = {2 / as_point, 3 / as_point, 4 / as_limit};
  CHECK(held(p, soft_law(), {r[0], 0, 0, r[1], 0, 0, r[2], 0, 0}, soft));
  for (int c = 0; c < 3; ++c) {
    std::vector<double> wrong = {r[0], 0, 0, r[1], 0, 0, r[2], 0, 0};
    wrong[3 * c] *= 1 + 1e-6;
    CHECK_FALSE(held(p, soft_law(), wrong, soft));
  }
}

TEST_CASE("an error that is no number is one, and stays the worst", "[referee]") {
  Worst worst;
  Evidence::see_island(worst, no_number, 1, 3);
  CHECK(worst.ratio == infinite);
  Evidence::see_island(worst, 0, 1, 4);
  Evidence::see_island(worst, 1, 1, 5);
  CHECK(worst.island == 3);
  CHECK(worst.ratio == infinite);
}

TEST_CASE("an approach, a pull and friction whose squares are nothing are none, where nothing else is") {
  ContactProblem p = points({1}, {0, 0}, 0);
  const double least = 1e-170;
  p.v_minus[1] = -least;
  CHECK(held(p, newton_law(), {0, 0, 0, 0, 0, 0}));
  p.v_minus[1] = 0;
  CHECK(held(p, newton_law(), {-least, 0, 0, least, 0, 0}));
  CHECK(held(p, newton_law(), {0, least, 0, 0, -least, 0}));
  p.v_minus[1] = -1e-100;
  CHECK_FALSE(held(p, newton_law(), {0, 0, 0, 0, 0, 0}));
}

TEST_CASE("what moves elsewhere in its island is what a contact is about: the lesser of velocities and of energies") {
  // A body of 1 kg stops at 1 m/s; another of `mass`, joined to it, is at rest beside a wall, and touches it with a
  // tangential impulse beyond its cone. The island has 1 J, and 1 m/s makes `mass` of it.
  for (const double mass : {100.0, 1.0, 0.01}) {
    ContactProblem p = points({1, mass}, {0}, 0);
    p.v_minus[7] = 0;
    add_contact(p, 1, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
    add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
    p.J.entry(2).row(2).setZero();  // along y nothing joins them
    p.J.entry(3).row(2).setZero();
    const double size = std::sqrt(std::min(1.0, mass));
    for (const double part : {below, above}) {
      INFO(mass << " kg, " << part);
      const double impulse = part * accepted * size * std::sqrt(mass);  // w = 1 / mass
      CHECK(held(p, newton_law(), {1, 0, 0, 0, impulse, 0, 0, 0, 0}) == (part < 1));
    }
  }
}

TEST_CASE("a residual is of the sizes by which the answer was looked at again") {
  // A point stops at 1 m/s and glides at 1 cm/s along a second wall, which it approaches by 1e-13 of the first speed.
  ContactProblem p = points({1}, {0}, 0);
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
  p.J.entry(1).row(2).setZero();  // but the second contact knows of no other slip
  p.v_minus[0] = -1e-13;
  const double residual = 1e-13 / std::sqrt(2.0 / 3);  // w = 2/3, and the island has 1 J
  p.v_minus[2] = 0.01;
  CHECK(judged(p, newton_law(), {1, 0, 0, 0, 0, 0}).model == Approx(residual).epsilon(1e-3));
  p.v_minus[2] = 0;
  CHECK(judged(p, newton_law(), {1, 0, 0, 0, 0, 0}).model == Approx(residual).epsilon(1e-3));
}

TEST_CASE("the last bits of a driven stop's velocity are open as those of a body's are, whatever its sign") {
  // A point at 1e6 m/s on a stop that moves with it, but for 1 mm/s.
  for (const double V : {1e6, -1e6}) {
    ContactProblem p = points({1}, {0}, 0);
    p.v_minus[1] = V - 1e-3;
    p.offset[0] = -V;
    const double approach = V - p.v_minus[1], rho = unit * 2 * 1e6;
    for (const double part : {-1.1, -0.9, 0.9, 1.1}) {
      INFO(V << " m/s, " << part << " of the rounding");
      CHECK(held(p, newton_law(), {approach + part * rho, 0, 0}) == (std::abs(part) < 1));
    }
  }
}

TEST_CASE("what the last bits leave open at one contact is open at each of its island, whatever their order") {
  // Bodies of a common velocity of 1e6 m/s along y meet at 1 mm/s; a wall, whose rows know nothing of y, is approached.
  const double V = 1e6, rho = unit * 2 * V;
  for (const bool wall_first : {true, false})
    for (const double part : {0.9, 1.1}) {
      ContactProblem p = points({1, 1}, {}, 0);
      p.v_minus = {-part * rho, V - 1e-3, 0, 0, 0, 0, 0, V, 0, 0, 0, 0};
      const double approach = V - p.v_minus[1];
      const auto meet = [&] { add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), ground_axes(), 0); };
      const auto wall = [&] {
        add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
        p.J.entry(static_cast<int>(p.J.block.size()) - 1).row(2).setZero();
      };
      if (wall_first) wall();
      meet();
      if (!wall_first) wall();
      std::vector<double> r(6, 0.0);
      r[wall_first ? 3 : 0] = approach / 2;
      INFO((wall_first ? "wall first, " : "wall last, ") << part << " of the rounding");
      CHECK(held(p, newton_law(), r) == (part < 1));
    }
}

TEST_CASE("convex with restitution: the last bits of all contacts of an island add up by their squares") {
  // Two contacts of the same two bodies: what is left of an approach may be sqrt(2) of what is open at each.
  const double V = 1e6, rho = unit * 2 * V;
  ContactProblem p = points({1, 1}, {}, 0);
  p.v_minus = {0, V - 1e-3, 0, 0, 0, 0, 0, V, 0, 0, 0, 0};
  for (int c = 0; c < 2; ++c) add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), ground_axes(), 0, 0.5);
  const double approach = V - p.v_minus[1];
  for (const double part : {0.9, 1.1}) {
    const double r = (approach - part * std::sqrt(2) * rho) / 4;
    CHECK(held(p, convex_law(), {r, 0, 0, r, 0, 0}) == (part < 1));
  }
}

TEST_CASE("what rounding leaves open of a gain is that of impulses, and of velocities before and after") {
  // Two bodies of 1 kg and a common velocity of 1e6 m/s rebound, with e = 1: r = a, gain r d / 2, and open is
  // rho (r + 2 a / W) = 2 rho a.
  const double V = 1e6, rho = unit * 2 * V;
  ContactProblem p = points({1, 1}, {}, 0);
  p.v_minus = {0, V - 1e-3, 0, 0, 0, 0, 0, V, 0, 0, 0, 0};
  add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), ground_axes(), 0, 1);
  const double a = V - p.v_minus[1];
  for (const Law& law : {coulomb_law(), convex_law()})
    for (const double part : {0.9, 1.1}) {
      INFO(law.name << ", " << part);
      CHECK(held(p, law, {a + part * 2 * rho, 0, 0}) == (part < 1));  // d = 2 W rho
    }
}

TEST_CASE("a limit is about what stopping the contacts of its island would make of its rate") {
  // M^-1 = ((2, 1/2), (1/2, 1)); a contact (w = 2/3) stops the first rate at 1 m/s, so that the second, a limit's,
  // changes by 1/4 rad/s. Stops: 3/2 N s of the contact, 1/4 of the limit; they make 3/4 + 1/4 of its rate.
  Eigen::Matrix2d inverse;
  inverse << 2, 0.5, 0.5, 1;
  for (const double part : {below, above}) {
    ContactProblem p =
        limits(inverse.inverse(), {Eigen::RowVector2d(1, 0), Eigen::RowVector2d(0, 1)}, {-1, -0.25 - part * accepted});
    p.J.entry(0)(1, 0) = 1e-12;  // a contact has tangents
    INFO(part);
    CHECK(held(p, newton_law(), {0.5, 0, 0, 0, 0, 0}) == (part < 1));
  }
}

TEST_CASE("what is open where M is ill-conditioned is of the impulses that press, of each tree that a contact joins") {
  // Levers of 3 kg and 1/8 kg m^2, seen from a point 100 km away, are pressed at their centres from both sides by 1 N
  // s, and meet a stop, or each other, 1/4 m beyond them: M^-1 J^T = ((1/m - far arm/I), arm/I).
  const double m = 3, inertia = 0.125, far = 1e5, arm = 0.25, press = 1;
  Eigen::Matrix2d M;
  M << m, m * far, m * far, m * far * far + inertia;
  const double open = (std::abs(1 / m - far * arm / inertia) + arm / inertia * far) * 2 * press;
  for (const int levers : {1, 2})
    for (const double part : {0.8, 1.2}) {
      ContactProblem p;
      for (int b = 0; b < levers; ++b) {
        p.M.block(p.M.add_block(2)) = M;
        const double rate = (b == 0 ? -1 : 0) * part * unit * open * levers;
        p.v_minus.insert(p.v_minus.end(), {rate, 0});
      }
      const auto row = [&] {
        p.J.add_band();
        p.offset.insert(p.offset.end(), 3, 0.0);
        p.mu.push_back(0);
        p.restitution.push_back(0);
      };
      std::vector<double> r;
      for (int b = 0; b < levers; ++b)
        for (const double side : {1.0, -1.0}) {
          row();
          p.J.entry(p.J.add_entry(b, 2)).row(0) << side, side * far;
          r.insert(r.end(), {press, 0, 0});
        }
      row();
      for (int b = 0; b < levers; ++b)
        p.J.entry(p.J.add_entry(b, 2)).row(0) << (b == 0 ? 1 : -1), (b == 0 ? 1 : -1) * (far + arm);
      r.insert(r.end(), {0, 0, 0});
      ContactProblem still = p;  // the presses let the centre be: the approach is the last stop's alone
      still.v_minus.assign(still.v_minus.size(), 0.0);
      INFO(levers << " levers, " << part << " of the rounding");
      CHECK(held(still, coulomb_law(), r));
      for (int b = 0; b < levers; ++b)  // turning about the centre
        p.v_minus[2 * b] *= -far / arm, p.v_minus[2 * b + 1] = -p.v_minus[2 * b] / far;
      CHECK(held(p, coulomb_law(), r) == (part < 1));
    }
}

TEST_CASE("what is open of a tree's rate is of the energy that this tree is given, whatever stands before it") {
  // As "a tree's last bits" has it, behind a body that rests.
  for (const double part : {0.9, 1.1}) {
    ContactProblem p = points({1}, {0}, 0);
    p.v_minus[1] = 0;
    add_limited_rates(p, -part * unit, -1);
    INFO(part << " of the rounding");
    CHECK(held(p, coulomb_law(), {0, 0, 0, 1, 0, 0, 0, 0, 0}) == (part < 1));
  }
}

TEST_CASE("coulomb, and convex without the bound: the last bits of a slip are open as its normal velocity's are") {
  // Two bodies of a common velocity of 1e6 m/s along y: u~, and mu |y_t| - y_n, are open by (1 + mu) rho.
  const double V = 1e6, mu = 2, slip = 1e-3;
  ContactProblem p = points({1, 1}, {}, 0);
  add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), ground_axes(), mu);
  const double rho = unit * 2 * V;
  for (const double part : {0.9, 1.1}) {
    INFO(part);
    // It lands and slips without friction: r = (r_n, 0, 0) is off by (mu, 1) |u_t| / w.
    p.v_minus = {part * (1 + mu) / std::hypot(1, mu) * rho, V - 1, 0, 0, 0, 0, 0, V, 0, 0, 0, 0};
    CHECK(held(p, coulomb_law(), {(V - p.v_minus[1]) / 2, 0, 0}) == (part < 1));
    p.v_minus = {slip, V + mu * slip - part * (1 + mu) * rho, 0, 0, 0, 0, 0, V, 0, 0, 0, 0};
    CHECK(held(p, convex_law(), {0, 0, 0}, ConvexWitness{false, 1, {}, {0}, {}, {}}) == (part < 1));
  }
}

TEST_CASE("convex: what the bound is about are the velocities of all contacts, those too that need no impulse") {
  // A point meets one wall at 1 m/s and leaves another at 3 m/s: K = (1 + 3) / w = 8 N s, kappa = 2 N s.
  ContactProblem p = points({2}, {0}, 0);
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
  p.v_minus[0] = 3;
  for (const double part : {0.0, below, above})
    CHECK(held(p, convex_law(), {2 + part * accepted * 8, 0, 0, 0, 0, 0},
               ConvexWitness{true, 1, {}, {0, 0}, {2, 0}, {0, 1, 0, 0, 0, 0}}) == (part < 1));
}

TEST_CASE("convex: the proof of the bound is held against what there was before, not against impulses") {
  // A point stops on the ground at 1 m/s, held between two limits that press it.
  ContactProblem p = points({2}, {0}, 0);
  for (const double side : {1.0, -1.0}) {
    add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitZ() * side, Vector3d::UnitX()), 0);
    p.J.entry(p.nc() - 1).bottomRows<2>().setZero();
  }
  for (const double press : {0.0, 1e3, 1e6}) {
    INFO(press << " N s");
    ConvexWitness proof{true, 1e-12, {}, {0, 0, 0}, {2, 0, 0}, {0, 1, 0, 0, 0, 0}};
    CHECK(held(p, convex_law(), {2, 0, 0, press, 0, 0, press, 0, 0}, proof));
    proof.frictionless[0] *= 1 + 1e-6;
    CHECK_FALSE(held(p, convex_law(), {2, 0, 0, press, 0, 0, press, 0, 0}, proof));
  }
}

TEST_CASE("convex: a limit has no part in the bound and no use of its multiplier") {
  // A point of 2 kg slides over ground that it meets, beside a limit: y of the first is taken into the dual cone by s =
  // mu |u_t|, y of the limit stands as it is.
  const double mu = 0.5, slip = 4;
  ContactProblem p = points({2}, {0}, mu);
  p.v_minus[0] = slip;
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitZ(), Vector3d::UnitX()), 0);
  p.J.entry(1).bottomRows<2>().setZero();
  std::vector<double> r = {2, -mu * 2, 0, 0, 0, 0};
  ConvexWitness proof{true, 1e-12, {}, {0, 0}, {2, 0}, {0, 1, 0, 0, 0, 0}};
  CHECK(held(p, convex_law(), r, proof));
  // With eta = d at the limit its y is -d / m, which only s would take into the cone; eta u_n = 0.
  proof.eta[1] = 1e-6;
  CHECK_FALSE(held(p, convex_law(), r, proof));
  proof.eta[1] = 0;
  // The limit stops 1 m/s besides: s is no part of its gap, or r s = 2 mu |u_t| would be.
  p.v_minus[2] = -1;
  r[3] = 2;
  proof.frictionless[1] = 2;
  const Residuals out = judged(p, convex_law(), r, proof);
  CHECK(Referee::holds(out, accepted));
  CHECK(std::abs(out.gap.value()) < 1e-14);
}

TEST_CASE("convex: a negative gap is a residual as a positive one is") {
  // Two contacts of a point that parts at 1 m/s pull with 1e-10 N s: the gap is r.u, S^2 = sum u^2 / w = 4 J.
  ContactProblem p = points({2}, {0, 0}, 0);
  p.v_minus[1] = 1;
  const Residuals out =
      judged(p, convex_law(), {-1e-10, 0, 0, -1e-10, 0, 0}, ConvexWitness{false, 1, {}, {0, 0}, {}, {}});
  CHECK(out.gap.value() == Approx(-2e-10));
  CHECK(out.infeasibility.value() == Approx(1e-10 / std::sqrt(2) / 2));
  CHECK(out.model == Approx(2e-10 / 4));
}

TEST_CASE("ap: each island gives back its own share, of its own size") {
  // The first is the ball in a wedge of referee_thresholds.cpp, whose share keeps its energy; the second rebounds.
  const double slope = 0.2, theta = 2 * std::sin(slope), m = 2, v = 3, r = m * v / (2 * std::sin(slope));
  const double again = theta * r * std::cos(2 * slope), slips = 100 * v, light = 1e-9;
  for (const bool wedge_first : {true, false})
    for (const double given : {0.5, 0.5 * (1 + 1e-6), 0.5 * theta}) {
      ContactProblem p;
      std::vector<double> impulse, first, second;
      const auto wedge = [&] {
        const int b = add_body(p, m, Vector3d::Constant(0.4 * m), {0, -v, 0});
        for (const double side : {1.0, -1.0}) {
          const Vector3d n(side * std::cos(slope), std::sin(slope), 0), t2(0, 0, 1);
          add_contact(p, b, Vector3d::Zero(), -1, {}, axes_of(n, t2.cross(n)), 0, side > 0 ? 1 : 0);
        }
        impulse.insert(impulse.end(), {r * (1 + theta), 0, 0, r + again, 0, 0});
        first.insert(first.end(), {r, r});
        second.insert(second.end(), {0, again});
      };
      const auto lone = [&] {
        const int b = add_body(p, light, Vector3d::Constant(light), {0, -1, 0});
        add_contact(p, b, Vector3d::Zero(), -1, {}, ground_axes(), 0, 0.5);
        impulse.insert(impulse.end(), {light * (1 + given), 0, 0});
        first.push_back(light);
        second.push_back(0);
      };
      if (wedge_first) wedge();
      lone();
      if (!wedge_first) wedge();
      PolygonWitness polygon{4, 0, {}};
      for (const std::vector<double>& normal : {first, second}) {
        polygon.z.insert(polygon.z.end(), normal.begin(), normal.end());
        polygon.z.insert(polygon.z.end(), 12, 0.0);
        polygon.z.insert(polygon.z.end(), 3, slips);
      }
      INFO((wedge_first ? "wedge first, " : "wedge last, ") << given);
      CHECK(held(p, anitescu_potra_law(), impulse, polygon) == (given == 0.5));
    }
}

TEST_CASE("ap: friction alone proves an answer that slides, by the slip that is left") {
  // What came at 5 m/s slides on at 4.
  ContactProblem p = points({2}, {0}, 1);
  p.v_minus[0] = 5;
  ContactSolution answer;
  answer.impulse = {2, -2, 0};
  Islands islands;
  find_islands(p, islands);
  const std::vector<double> u_minus = {-1, 5, 0}, u_plus = {0, 4, 0};
  const Witness terms = PolygonWitness{.k = 4, .regularisation = 0, .z = {}};
  CHECK(anitescu_potra_law().prove({p, islands, terms, u_minus, u_plus}, answer).empty());
  CHECK(answer.as<PolygonWitness>().z == std::vector<double>{2, 0, 0, 2, 0, 4});
  CHECK(held(p, anitescu_potra_law(), answer.impulse, answer.witness));
}

TEST_CASE("the momentum of what turns is over the root of its inertia") {
  ContactProblem p;
  add_body(p, 3, {0.01, 0.02, 0.04}, {0, -1, 0}, {0, 0, 1e9 / 7});
  add_contact(p, 0, {1, 0, 0}, -1, {}, ground_axes(), 0.5);
  ContactSolution s;
  s.impulse = {1.0 / 3, 0, 0};
  std::vector<double> v_plus;
  const Residuals out = Referee().check(p, s, newton_law(), v_plus);
  const double missing = std::abs(0.04 * (v_plus[5] - p.v_minus[5]) - 1.0 / 3);
  REQUIRE(missing > 1e-10);
  CHECK(out.momentum == Approx(missing / 0.2).epsilon(1e-6));
}

TEST_CASE("a limit is a row without friction and without tangents of any body") {
  ContactProblem p = points({2, 3}, {0}, 0);
  add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), ground_axes(), 0);
  CHECK_FALSE(is_limit(p, 0));
  CHECK_FALSE(is_limit(p, 1));
  p.J.entry(0).row(1).setZero();
  CHECK_FALSE(is_limit(p, 0));  // a tangent is left
  p.J.entry(0).row(2).setZero();
  CHECK(is_limit(p, 0));
  p.J.entry(1).bottomRows<2>().setZero();
  CHECK_FALSE(is_limit(p, 1));  // the second body has tangents
  p.J.entry(2).bottomRows<2>().setZero();
  CHECK(is_limit(p, 1));
  p.mu[0] = 0.5;
  CHECK_FALSE(is_limit(p, 0));
}

TEST_CASE("energy before an event is the bodies', and that of the offset which has most, by its own weight") {
  ContactProblem p = points({2, 8}, {0, 1});  // 1/2 (2 + 8) J
  CHECK(energy_before(p) == Approx(5));
  p.offset[4] = -3;  // w = 1/8: 36 J
  CHECK(energy_before(p) == Approx(5 + 36));
  p.offset[0] = 4;  // w = 1/2: 16 J
  CHECK(energy_before(p) == Approx(5 + 36));
  p.offset[2] = 7;  // 49 J
  CHECK(energy_before(p) == Approx(5 + 49));
}

TEST_CASE("an answer ends as its worst failure, the first of those that are equally bad") {
  ContactSolution s;
  s.fail(Status::nonconverged, "first");
  s.fail(Status::nonconverged, "again");
  s.fail(Status::inaccurate, "less");
  CHECK(s.status == Status::nonconverged);
  CHECK(s.reason == "first");
  s.fail(Status::singular, "worse");
  CHECK(s.status == Status::singular);
  CHECK(s.reason == "worse");
}

TEST_CASE("a limit that rests beside what stops is about its own rate, where the others make nothing of it") {
  // A tree of two rates that know nothing of each other: a contact stops the first, a limit of the second is approached
  // by 1e-10 of what is stopped.
  for (const double approach : {0.0, 1e-10}) {
    ContactProblem p =
        limits(Eigen::Matrix2d::Identity(), {Eigen::RowVector2d(1, 0), Eigen::RowVector2d(0, 1)}, {-1, -approach});
    p.J.entry(0)(1, 0) = 1e-12;  // a contact has tangents
    for (const Law& law : {coulomb_law(), newton_law()}) CHECK(held(p, law, {1, 0, 0, 0, 0, 0}) == (approach == 0));
  }
}

namespace {

/// Two bodies of 1 kg with a common velocity of 1e6 m/s along y meet at their centres, W = w = 2; what its last bits
/// leave open is `rho`.
struct Meeting {
  static constexpr double V = 1e6, rho = unit * 2 * V;
  ContactProblem problem = points({1, 1}, {}, 0);
  double approach;
  Meeting(double wanted, double mu, double e, double across = 0) {
    problem.v_minus = {across, V - wanted, 0, 0, 0, 0, 0, V, 0, 0, 0, 0};
    approach = V - problem.v_minus[1];
    add_contact(problem, 0, Vector3d::Zero(), 1, Vector3d::Zero(), ground_axes(), mu, e);
  }
  /// z of a bound: N z of what meets along y, and along x.
  static std::vector<double> dual(double y, double x) { return {x, y, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}; }
};

}  // namespace

TEST_CASE("ap: the energy that restitution leaves is open by the last bits of velocities") {
  // e = 1, and all but d of it is given back: E = -a^2 d / 2, and open are rho (a + 2 a / w) = 2 a rho of it.
  const Meeting meeting(1e-3, 0, 1);
  const double a = meeting.approach, r = a / 2;
  for (const double part : {0.0, 0.9, 1.1}) {
    const double d = part * 4 * Meeting::rho / a;
    CHECK(held(meeting.problem, anitescu_potra_law(), {r * (2 - d), 0, 0},
               PolygonWitness{4, 0, {r, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1}}) == (part < 1));
  }
}

TEST_CASE("convex: what the bound is about is open by the last bits of velocities") {
  const Meeting meeting(1e-3, 0, 0);
  const double r = meeting.approach / 2;
  for (const double part : {0.0, 0.9, 1.1})  // K = rho / (1e-9 w)
    CHECK(held(meeting.problem, convex_law(), {r + part * Meeting::rho / 2, 0, 0},
               ConvexWitness{true, 1, {}, {0}, {r}, Meeting::dual(1, 0)}) == (part < 1));
}

TEST_CASE("convex: where nothing moves the bound leaves nothing") {
  // A point between two walls.
  ContactProblem p = points({2}, {0}, 0);
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(-Vector3d::UnitY(), Vector3d::UnitX()), 0);
  p.v_minus[1] = 0;
  for (const double press : {0.0, 1e-30, 1e-12, 1e-6})
    CHECK(held(p, convex_law(), {press, 0, 0, press, 0, 0},
               ConvexWitness{true, 0, {}, {0, 0}, {0, 0}, {0, 0, 0, 0, 0, 0}}) == (press == 0));
}

TEST_CASE("convex: what opens slower than f lets something approach touches") {
  // A point lands at 1 m/s beside a wall that it leaves at 3e-10 of that; z counts the wall for 2.
  ContactProblem p = points({2}, {0}, 0);
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
  p.v_minus[0] = 3e-10;
  for (const double off : {0.0, 7e-10, -7e-10})
    CHECK(held(p, convex_law(), {2, 0, 0, 0, 0, 0},
               ConvexWitness{true, 1e-6, {}, {0, 0}, {2 * (1 + off), 0}, {2, 1, 0, 0, 0, 0}}) == (off == 0));
}

TEST_CASE("convex: what opens slower than the last bits of velocities touches") {
  for (const double part : {0.9, 1.1}) {
    Meeting meeting(1e-3, 0, 0, part * Meeting::rho);
    add_contact(meeting.problem, 0, Vector3d::Zero(), 1, Vector3d::Zero(),
                axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
    const double r = meeting.approach / 2;
    // Impulses that are off by next to what is open make the referee ask for it.
    CHECK(held(meeting.problem, convex_law(), {r + 0.4 * Meeting::rho / 2, 0, 0, 0, 0, 0},
               ConvexWitness{true, 1, {}, {0, 0}, {r, 0}, Meeting::dual(1, 2)}) == (part > 1));
  }
}

TEST_CASE("convex: a gap is open by the last bits of the velocities, and of the impulses that they determine") {
  // What parts at 1 m/s is pushed by d: gap d u_n, open are rho u_n / w.
  const Meeting parting(-1, 0, 0);
  for (const double part : {0.0, 0.9, 1.1})
    CHECK(held(parting.problem, convex_law(), {part * Meeting::rho / 2, 0, 0},
               ConvexWitness{false, 0, {}, {0}, {}, {}}) == (part < 1));
  // What lands slips by d without friction: gap s r_n = mu d r_n, open are rho r_n, and (1 + mu) rho kappa by s.
  const double mu = 9;
  for (const double part : {0.0, 0.9, 1.1}) {
    const Meeting landing(1e-3, mu, 0, part * (2 + mu) / mu * Meeting::rho);
    const double r = landing.approach / 2;
    CHECK(held(landing.problem, convex_law(), {r, 0, 0}, ConvexWitness{true, 0, {}, {0}, {r}, Meeting::dual(1, 0)}) ==
          (part < 1));
  }
}

TEST_CASE("ap: what decompression adds is no part of what is given back") {
  // A ball between two walls of which both give back, one less than the other takes to be stopped once more.
  const double slope = 0.6, m = 2, v = 3, r = m * v / (2 * std::sin(slope)), e = 0.1;
  ContactProblem p;
  add_body(p, m, Vector3d::Constant(0.4 * m), {0, -v, 0});
  for (const double side : {1.0, -1.0}) {
    const Vector3d n(side * std::cos(slope), std::sin(slope), 0), t2(0, 0, 1);
    add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(n, t2.cross(n)), 0, side > 0 ? 1 : e);
  }
  const double again = r * std::cos(2 * slope) - e * r;
  const auto answer = [&](double share) {
    PolygonWitness polygon{4, 0, {r, r}};
    polygon.z.resize(12, 0.0);
    polygon.z[10] = polygon.z[11] = 100 * v;
    polygon.z.insert(polygon.z.end(), {0, again});
    polygon.z.resize(24, 0.0);
    polygon.z[22] = polygon.z[23] = 100 * v;
    return held(p, anitescu_potra_law(), {r * (1 + share), 0, 0, r * (1 + e * share) + again, 0, 0}, polygon);
  };
  CHECK(answer(1));
  CHECK_FALSE(answer(1 - 1e-6));
  CHECK_FALSE(answer(1 + 1e-6));
}

TEST_CASE("a referee that has judged an event judges the next as if it were the first: what excused the first") {
  // Last bits of 1e12 m/s, and restitution.
  ContactProblem fast = points({2}, {0});
  fast.v_minus[1] = -1e12;
  Referee kept;
  CHECK_FALSE(held_by(kept, fast, coulomb_law(), {0, 0, 0}));
  CHECK_FALSE(held_by(kept, points({2}, {0}), coulomb_law(), {2 * (1 + 1e-8), 0, 0}));
  CHECK(held_by(kept, points({2}, {0}, 0.5, 0.5), coulomb_law(), {3, 0, 0}));
  CHECK_FALSE(held_by(kept, points({2}, {0}), coulomb_law(), {3, 0, 0}));
}

TEST_CASE("what is measured of any answer is that of the worst contact, and the law's where nothing rebounds") {
  ContactProblem p = points({2, 2}, {0, 1});
  CHECK(judged(p, newton_law(), {0, 0, 0, 2, 0, 0}).approach == 1);
  CHECK(judged(p, newton_law(), {-3, 0, 0, -4, 0, 0}).cone_violation == Approx(4));
  p.v_minus[0] = 2;
  CHECK(judged(p, newton_law(), {2, 0, 0, 2, 0, 0}).dissipation_gap == Approx(2));
  CHECK(judged(p, newton_law(), {2, 0, 0, 2, 0, 0}).law.has_value());
  CHECK_FALSE(judged(points({2}, {0}, 0.5, 0.5), newton_law(), {3, 0, 0}).law.has_value());
}

TEST_CASE("a contact is about its own island's energy, however much the first has") {
  // "What moves elsewhere in its island" behind a body of 1e6 kg that lands.
  ContactProblem p = points({1e6, 1, 100}, {0, 1}, 0);
  p.v_minus[13] = 0;
  const Matrix3d side = axes_of(Vector3d::UnitX(), Vector3d::UnitZ());
  add_contact(p, 2, Vector3d::Zero(), -1, {}, side, 0);
  add_contact(p, 1, Vector3d::Zero(), 2, Vector3d::Zero(), side, 0);
  for (const int e : {3, 4}) p.J.entry(e).row(2).setZero();
  for (const double part : {below, above})
    CHECK(held(p, newton_law(), {1e6, 0, 0, 1, 0, 0, 0, part * accepted * 10, 0, 0, 0, 0}) == (part < 1));
}

TEST_CASE("a limit is about no more than its own island's energy, whatever stops would make of its rate") {
  // Behind a body of 1e6 kg: M^-1 = ((2, 1.3), (1.3, 1)), a contact stops 1 m/s and the limit's rate of 0.65 rad/s; the
  // limit pulls. Stops would make 2.6 of its rate, the island has 3/2 + 0.65^2.
  Eigen::Matrix2d inverse;
  inverse << 2, 1.3, 1.3, 1;
  const double size = std::sqrt(1.5 + 0.65 * 0.65);
  for (const double part : {below, above}) {
    ContactProblem p = points({1e6}, {0}, 0);
    const int b = p.M.add_block(2);
    p.M.block(b) = inverse.inverse();
    p.v_minus.insert(p.v_minus.end(), {-1, -0.65 + 1e-6});
    for (const int rate : {0, 1}) add_limit(p, b, rate);
    p.J.entry(1)(1, 0) = 1e-12;  // a contact has tangents
    const double pull = part * accepted * size;
    CHECK(held(p, newton_law(), {1e6, 0, 0, 0.5 + 0.65 * pull, 0, 0, -pull, 0, 0}) == (part < 1));
  }
}

TEST_CASE("newton: an impulse where nothing approaches counts from 1e-9 of the contact's size, whatever its mass") {
  for (const double mass : {1e6, 1e-6}) {
    ContactProblem p = points({mass}, {0});
    p.v_minus[1] = 1;
    for (const double part : {below, above}) CHECK(held(p, newton_law(), {part * accepted * mass, 0, 0}) == (part < 1));
  }
  // The impulse is that of the contact which parts, and no other's.
  ContactProblem p = points({2, 3, 5}, {0, 1, 2});
  p.v_minus[13] = 1;
  CHECK(held(p, newton_law(), {2, 0, 0, 3, 0, 0, 0, 0, 0}));
  CHECK_FALSE(held(p, newton_law(), {2, 0, 0, 3, 0, 0, 1, 0, 0}));
  p.v_minus[1] = p.v_minus[7] = 1;
  CHECK(held(p, newton_law(), {0, 0, 0, 0, 0, 0, 0, 0, 0}));
  CHECK_FALSE(held(p, newton_law(), {0, 0, 0, 0, 0, 0, 1, 0, 0}));
}

TEST_CASE("a work is a fraction of what the island has, not of what its contact has") {
  const ContactProblem p = points({2}, {0, 0});  // 2 J / contact, 4 J
  for (const double part : {below, above}) {
    const double given = part * accepted * 4;
    CHECK(held(p, mirtich_law(), {1, 0, 0, 1, 0, 0}, WorkWitness{{-1 - given, 0}, {0, 0}, {0, given}}) == (part < 1));
  }
}

TEST_CASE("mirtich: works of impulses known alone are friction, an equal share of their island's at each contact") {
  const ContactProblem p = points({2, 2}, {0, 0, 1});
  ContactSolution answer;
  answer.impulse = {1.5, 0, 0, 0.5, 0, 0, 2, 0, 0};
  Islands islands;
  find_islands(p, islands);
  const std::vector<double> u_minus = {-1, 0, 0, -1, 0, 0, -1, 0, 0}, u_plus(9, 0.0);
  const Witness terms = WorkWitness{};
  CHECK(mirtich_law().prove({p, islands, terms, u_minus, u_plus}, answer).empty());
  CHECK(answer.as<WorkWitness>().friction == std::vector<double>{-0.5, -0.5, -1});
}

TEST_CASE("ap: friction alone proves each contact by its own directions") {
  const ContactProblem p = points({2, 2}, {0, 1}, 1);
  ContactSolution answer;
  answer.impulse = {2, 0, 0, 2, -1, 1};
  Islands islands;
  find_islands(p, islands);
  const std::vector<double> u_minus(6, 0.0), u_plus(6, 0.0);
  const Witness terms = PolygonWitness{.k = 4, .regularisation = 0, .z = {}};
  CHECK(anitescu_potra_law().prove({p, islands, terms, u_minus, u_plus}, answer).empty());
  CHECK(answer.as<PolygonWitness>().z == std::vector<double>{2, 2, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0});
}

TEST_CASE("soft: velocities are made impulses by their own contact's weight") {
  const Witness rigid = SoftWitness{{.rule = Softness::Rule::mujoco, .impedance = 1}};
  const ContactProblem p = points({1e-6, 2}, {0, 1}, 0);
  CHECK(held(p, soft_law(), {1e-6, 0, 0, 2, 0, 0}, rigid));
  CHECK_FALSE(held(p, soft_law(), {1e-6, 0, 0, 2 * (1 - 1e-6), 0, 0}, rigid));
}

TEST_CASE("convex: each island is held against what it has itself, however much the first has") {
  ContactProblem p = points({1e12, 2}, {0, 1}, 0);
  const std::vector<double> z = {0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0};
  const auto bounded = [&](double r, double f) {
    return held(p, convex_law(), {1e12, 0, 0, r, 0, 0}, ConvexWitness{true, 1, {}, {0, 0}, {1e12, f}, z});
  };
  CHECK(bounded(2, 2));
  CHECK_FALSE(bounded(2, 2 * (1 + 1e-6)));  // f
  CHECK_FALSE(bounded(2 * (1 + 1e-6), 2));  // the bound
  p.v_minus[7] = 1;
  const ConvexWitness free{false, 1, {}, {0, 0}, {}, {}};
  CHECK(held(p, convex_law(), {1e12, 0, 0, 0, 0, 0}, free));
  CHECK_FALSE(held(p, convex_law(), {1e12, 0, 0, -2e-6, 0, 0}, free));
  const ConvexWitness multiplier{false, 1, {}, {0, 1e-3}, {}, {}};  // 1e-3 J of 2 J
  CHECK(judged(p, convex_law(), {1e12, 0, 0, 0, 0, 0}, multiplier).model == Approx(5e-4));
  // With restitution: a gain of 4e-6 J.
  p.v_minus[7] = -1;
  p.restitution = {1, 1};
  CHECK(held(p, convex_law(), {2e12, 0, 0, 4, 0, 0}, free));
  CHECK_FALSE(held(p, convex_law(), {2e12, 0, 0, 4 * (1 + 1e-6), 0, 0}, free));
}

TEST_CASE("convex: multipliers excuse no gap beyond 1e-9 of their own island's energy") {
  // A point slides at 1 m/s between two walls and leaves one by 1e-14 m/s; multipliers of both cancel. 4 J.
  ContactProblem p = points({1e12, 2}, {0}, 0);
  for (const double side : {1.0, -1.0})
    add_contact(p, 1, Vector3d::Zero(), -1, {}, axes_of(side * Vector3d::UnitX(), Vector3d::UnitZ()), 0);
  p.v_minus[6] = 1e-14;
  for (const double eta : {1e5, 1e6})
    CHECK(held(p, convex_law(), {1e12, 0, 0, 0, 0, 0, 0, 0, 0}, ConvexWitness{false, 0, {}, {0, eta, eta}, {}, {}}) ==
          (eta < 4e5));
}

TEST_CASE("convex: a negative gap is held against epsilon as a positive one is, and uses it") {
  const auto pulls = [](const std::vector<int>& touching, double epsilon) {
    ContactProblem p = points({2, 2}, touching, 0);
    p.v_minus[1] = p.v_minus[7] = 1;
    std::vector<double> r(3 * touching.size(), 0.0);
    for (std::size_t c = 0; c < touching.size(); ++c) r[3 * c] = -1e-10;
    return held(p, convex_law(), r,
                ConvexWitness{false, epsilon, {}, std::vector<double>(touching.size(), 0.0), {}, {}});
  };
  CHECK(pulls({0, 0}, 3e-10));
  CHECK_FALSE(pulls({0, 0}, 1e-10));
  CHECK(pulls({0, 0, 1, 1}, 5e-10));
  CHECK_FALSE(pulls({0, 0, 1, 1}, 3e-10));
}

TEST_CASE("convex: the bound is about itself where it is more than the velocities before") {
  // A narrow wedge: sum f = m v / sin = 20 N s, of velocities 0.4 N s.
  const double sine = 0.1;
  ContactProblem p = points({2}, {}, 0);
  for (const double side : {1.0, -1.0}) {
    const Vector3d n(side * std::sqrt(1 - sine * sine), sine, 0);
    add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(n, Vector3d::UnitZ()), 0);
  }
  for (const double part : {below, above}) {
    const double r = 10 * (1 + part * accepted);
    CHECK(held(p, convex_law(), {r, 0, 0, r, 0, 0},
               ConvexWitness{true, 1, {}, {0, 0}, {10, 10}, {0, 1 / sine, 0, 0, 0, 0}}) == (part < 1));
  }
}

TEST_CASE("coulomb with restitution: a pull is one beside what its contact has, not its island") {
  // 10 mg leave a wall at 1 m/s, and 1 kg that they are joined to.
  const double light = 1e-8;
  for (const double pull : {0.0, 1e-6 * light}) {
    ContactProblem p = points({1, light}, {0}, 0, 0.5);
    p.v_minus[6] = 1;
    add_contact(p, 1, Vector3d::Zero(), -1, {}, axes_of(Vector3d::UnitX(), Vector3d::UnitZ()), 0);
    add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), axes_of(-Vector3d::UnitX(), Vector3d::UnitZ()), 0);
    CHECK(held(p, coulomb_law(), {1.5, 0, 0, -pull, 0, 0, 0, 0, 0}) == (pull == 0));
  }
}

TEST_CASE("an offset between fixed bodies is no energy") {
  ContactProblem p = points({2}, {0});
  p.J.add_band();
  p.offset.insert(p.offset.end(), {3.0, 0.0, 0.0});
  p.mu.push_back(0);
  p.restitution.push_back(0);
  CHECK(energy_before(p) == Approx(1));
}

TEST_CASE("an answer that is cleared has no terms of the one before") {
  ContactSolution s;
  s.restitution_scale = 0.5;
  s.as<ConvexWitness>().epsilon_relative = 0.1;
  s.clear();
  CHECK(s.restitution_scale == 1);
  CHECK_FALSE(s.as<ConvexWitness>().epsilon_relative.has_value());
  s.as<PolygonWitness>().regularisation = 0.1;
  s.clear();
  CHECK(s.as<PolygonWitness>().regularisation == 0);
}

TEST_CASE("convex: what rounding leaves open of a slip's gap is of its own island's bound") {
  // As "a gap is open by the last bits" has it, behind a body that rests.
  const double mu = 9, V = Meeting::V, rho = Meeting::rho;
  for (const double part : {0.0, 0.9, 1.1}) {
    ContactProblem p = points({1, 1, 1}, {2}, 0);
    p.v_minus = {part * (2 + mu) / mu * rho, V - 1e-3, 0, 0, 0, 0, 0, V, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    add_contact(p, 0, Vector3d::Zero(), 1, Vector3d::Zero(), ground_axes(), mu);
    const double r = (V - p.v_minus[1]) / 2;
    std::vector<double> z = Meeting::dual(1, 0);
    z.resize(18, 0.0);
    CHECK(held(p, convex_law(), {0, 0, 0, r, 0, 0}, ConvexWitness{true, 0, {}, {0, 0}, {0, r}, z}) == (part < 1));
  }
}

TEST_CASE("W_ii of a contact between trees of any size is the sum of both") {
  for (const int size : {6, 10, 70}) {
    ContactProblem p;
    p.J.add_band();
    for (const int b : {0, 1}) {
      p.M.block(p.M.add_block(size)).setIdentity();
      p.J.entry(p.J.add_entry(b, size))(0, b) = 1;
    }
    p.v_minus.assign(2 * static_cast<std::size_t>(size), 0.0);
    p.offset.assign(3, 0.0);
    p.mu = p.restitution = {0};
    BlockCholesky factor;
    REQUIRE(factor.factor(p.M));
    std::vector<Eigen::Matrix3d> W;
    diagonal_blocks(p, factor, W);
    CHECK(W[0](0, 0) == 2);
  }
}

TEST_CASE("there is a thread for what little there is") {
  Islands islands;
  find_islands(points({2}, {0}), islands);
  CHECK(worthwhile_threads(islands, 4) == 1);
}

TEST_CASE("an error beside what is beyond the largest number is one, and stays the worst", "[referee]") {
  Worst worst;
  Evidence::see_island(worst, 1, infinite, 2);
  CHECK(worst.ratio == infinite);
  CHECK(worst.island == 2);
  worst = {0.5, -1, 1};
  Evidence::see_island(worst, 1, infinite, 2);
  CHECK(worst.ratio == infinite);
  CHECK(worst.island == 2);
}

TEST_CASE("of a gap that is no finite number, or that may be any, nothing but that is said") {
  const auto refused = [](double gap, double allowed) {
    Residuals out;
    out.gap = 1.0;
    out.infeasibility = 0.5;
    out.island_gap = gap;
    out.allowed_gap = allowed;
    return Referee::refusal(out, accepted);
  };
  const std::string beyond = "energies beyond the largest number: nothing can be said of the gap";
  CHECK(refused(infinite, 1) == beyond);
  CHECK(refused(no_number, 1) == beyond);
  CHECK(refused(1, infinite) == beyond);
  CHECK(refused(2, 1) == "checked gap 2 J (allowed: 1), infeasibility 0.5 (allowed: 1e-09)");
}

TEST_CASE("what rests and would rebound has nothing to give back, by every law") {
  ContactProblem p = points({2}, {0}, 0.5, 0.5);
  p.v_minus[1] = 0;
  const Witness rigid = SoftWitness{{.rule = Softness::Rule::mujoco, .impedance = 1}};
  for (const Law& law : {coulomb_law(), newton_law(), convex_law()}) CHECK(held(p, law, {0, 0, 0}));
  CHECK(held(p, soft_law(), {0, 0, 0}, rigid));
  CHECK(held(p, mirtich_law(), {0, 0, 0}, WorkWitness{{0}, {0}, {0}}));
  CHECK(held(p, anitescu_potra_law(), {0, 0, 0}, PolygonWitness{4, 0, std::vector<double>(12, 0.0)}));
}

TEST_CASE("ap: where restitution does no work any share of it may be given back, but no more and none the other way") {
  // A point at rest that two walls press from both sides.
  ContactProblem p = points({2}, {0}, 0, 0.5);
  add_contact(p, 0, Vector3d::Zero(), -1, {}, axes_of(-Vector3d::UnitY(), Vector3d::UnitX()), 0, 0.5);
  p.v_minus[1] = 0;
  const double press = 3;
  PolygonWitness polygon{4, 0, {press, press}};
  polygon.z.resize(24, 0.0);
  for (const double share : {0.0, 0.5, 1.0, -0.5, 1.5}) {
    INFO(share);
    const double r = press * (1 + 0.5 * share);
    CHECK(held(p, anitescu_potra_law(), {r, 0, 0, r, 0, 0}, polygon) == (share >= 0 && share <= 1));
  }
}

TEST_CASE("convex: what proves nothing of an island with restitution is finite all the same, beside one without") {
  ContactProblem p = points({2, 3}, {0, 1});
  p.restitution = {0, 0.5};
  const ConvexWitness proof{true, 0, {}, {0, 0}, {2, 0}, {0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}};
  CHECK(held(p, convex_law(), {2, 0, 0, 4.5, 0, 0}, proof));
  for (std::vector<double> ConvexWitness::*part : {&ConvexWitness::eta, &ConvexWitness::frictionless})
    for (const double x : {no_number, infinite}) {
      ConvexWitness other = proof;
      (other.*part)[1] = x;
      CHECK_FALSE(held(p, convex_law(), {2, 0, 0, 4.5, 0, 0}, other));
    }
}
