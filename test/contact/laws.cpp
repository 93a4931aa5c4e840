// What the table of laws says of each, the polygon's directions and how soft contacts are: by hand.

#include "contact/laws.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "contact/polygon.h"
#include "contact/softness.h"

using namespace cb;

namespace {

const Law& law(std::string_view name) {
  for (const Law& row : laws())
    if (row.name == name) return row;
  throw std::logic_error("no such law");
}

template <class Test>
std::set<std::string_view> names_of(const Test& test) {
  std::set<std::string_view> out;
  for (const Law& row : laws())
    if (test(row)) out.insert(row.name);
  return out;
}

using Names = std::set<std::string_view>;

}  // namespace

TEST_CASE("laws say what is known of their answers from impulses, what adds up and what has no expansion") {
  std::vector<std::string_view> names;
  for (const Law& row : laws()) names.push_back(row.name);
  CHECK(names == std::vector<std::string_view>{"newton", "mirtich", "anitescu_potra", "convex", "coulomb", "soft"});
  CHECK(names_of([](const Law& row) { return row.lends; }) == Names{"convex"});
  CHECK(names_of([](const Law& row) { return row.claims_add_up; }) == Names{"convex"});
  CHECK(names_of([](const Law& row) { return !row.unseen_in_impulses.empty(); }) == Names{"mirtich"});
  CHECK(names_of([](const Law& row) { return !row.no_expansion.empty(); }) == Names{"newton", "mirtich", "soft"});
  CHECK(names_of([](const Law& row) { return row.polygon_edges != nullptr; }) == Names{"anitescu_potra"});
  CHECK(names_of([](const Law& row) { return row.witness_normals != nullptr; }) == Names{"convex"});
  CHECK(names_of([](const Law& row) { return row.rest != nullptr; }) ==
        Names{"mirtich", "anitescu_potra", "convex", "soft"});
  CHECK(names_of([](const Law& row) { return row.prove != nullptr; }) ==
        Names{"mirtich", "anitescu_potra", "convex", "soft"});
  CHECK(newton_law() == law("newton"));
  CHECK_FALSE(newton_law() == law("coulomb"));

  ContactSolution solution;
  solution.as<PolygonWitness>().k = 14;
  CHECK(law("anitescu_potra").polygon_edges(solution) == 14);
  ConvexWitness& proof = solution.as<ConvexWitness>();
  proof.frictionless = {1, 2};
  CHECK(law("convex").witness_normals(solution).empty());
  proof.bounded = true;
  CHECK(law("convex").witness_normals(solution).size() == 2);
}

TEST_CASE("what may be left out of an event is the law's to say, and goes by what was asked") {
  const auto may = [](std::string_view name, const Witness& terms) { return law(name).leave_out(terms); };
  for (const char* name : {"newton", "mirtich"}) {
    const LeaveOut none = may(name, NoWitness{});
    CHECK(none.corners == Corners::differ);
    CHECK(none.islands_apart);
    CHECK_FALSE(none.closed_form);
    CHECK_FALSE(none.idle_friction);
  }
  const LeaveOut coulomb = may("coulomb", NoWitness{});
  CHECK(coulomb.corners == Corners::suffice_unless_spin);
  CHECK(coulomb.islands_apart);
  CHECK(coulomb.closed_form);
  CHECK_FALSE(coulomb.idle_friction);
  for (const double regularisation : {0.0, 1e-6}) {
    const LeaveOut ap = may("anitescu_potra", PolygonWitness{.k = 8, .regularisation = regularisation, .z = {}});
    CHECK((ap.corners == Corners::suffice_unless_spin) == (regularisation == 0));
    CHECK(static_cast<bool>(ap.closed_form) == (regularisation == 0));
    CHECK(ap.idle_friction == (regularisation == 0));
    CHECK(ap.islands_apart);
  }
  for (const bool bounded : {true, false}) {
    ConvexWitness terms;
    terms.bounded = bounded;
    const LeaveOut convex = may("convex", terms);
    CHECK(convex.corners == Corners::suffice);
    CHECK_FALSE(convex.islands_apart);
    CHECK(static_cast<bool>(convex.closed_form) == bounded);
    CHECK_FALSE(convex.idle_friction);
  }
  const LeaveOut soft = may("soft", SoftWitness{});
  CHECK(soft.corners == Corners::differ);
  CHECK(soft.islands_apart);
  CHECK(soft.closed_form);
}

TEST_CASE("mirtich: at rest all works are nothing, and those of a part go where its contacts are in the whole") {
  ContactProblem whole, two;
  for (int c = 0; c < 4; ++c) {
    whole.J.add_band();
    if (c < 2) two.J.add_band();
  }
  ContactSolution all, part;
  const Law& mirtich = law("mirtich");
  all.as<WorkWitness>() = WorkWitness{{7}, {7, 7}, {}};
  mirtich.rest(whole, NoWitness{}, all);
  const std::vector<double> none(4, 0.0);
  CHECK(all.as<WorkWitness>().compression == none);
  CHECK(all.as<WorkWitness>().restitution == none);
  CHECK(all.as<WorkWitness>().friction == none);
  part.witness = WorkWitness{{-1, -2}, {0.25, 0.5}, {-3, -4}};
  const std::vector<int> contacts = {3, 1}, blocks;
  mirtich.join({whole, two, contacts, blocks}, part, all);
  CHECK(all.as<WorkWitness>().compression == std::vector<double>{0, -2, 0, -1});
  CHECK(all.as<WorkWitness>().restitution == std::vector<double>{0, 0.5, 0, 0.25});
  CHECK(all.as<WorkWitness>().friction == std::vector<double>{0, -4, 0, -3});
}

TEST_CASE("mirtich: the work of impulses known alone is that of all their parts, by the mean of both velocities") {
  ContactProblem p;
  for (int c = 0; c < 3; ++c) p.J.add_band();
  Islands islands;
  islands.count = 2;
  islands.of_contact = {0, 1, 0};
  const std::vector<double> before = {-3, 2, 1, -1, 4, -2, -2, 0, 6}, after = {1, 1, -1, 0, 2, -1, 3, 2, 0};
  ContactSolution answer;
  answer.impulse = {2, -1, 3, 5, -2, 4, 1, -4, -1};
  const Witness terms = NoWitness{};
  CHECK(law("mirtich").prove({p, islands, terms, before, after}, answer).empty());
  // Contacts 0 and 2: 2 (-2) - 3 + 0 / 2, and 1 - 8 - 6 over two: (-2 - 1.5 + 0) + (0.5 - 4 - 3); contact 1: its own.
  const double first = 2 * -1 - 1 * 1.5 + 3 * 0, third = 1 * 0.5 - 4 * 1 - 1 * 3, second = 5 * -0.5 - 2 * 3 + 4 * -1.5;
  CHECK(answer.as<WorkWitness>().friction == std::vector<double>{(first + third) / 2, second, (first + third) / 2});
  CHECK(answer.as<WorkWitness>().compression == std::vector<double>(3, 0.0));
  CHECK(answer.as<WorkWitness>().restitution == std::vector<double>(3, 0.0));
}

TEST_CASE("a polygon's directions go round from t1 in even steps, exact on the axes and in opposite pairs") {
  for (const int k : {4, 6, 8, 12}) {
    INFO(k);
    FrictionPolygon polygon;
    polygon.set(k);
    REQUIRE(polygon.k() == k);
    for (int i = 0; i < k; ++i) {
      CHECK(polygon.cosine[i] == Approx(std::cos(2 * M_PI * i / k)).margin(1e-15));
      CHECK(polygon.sine[i] == Approx(std::sin(2 * M_PI * i / k)).margin(1e-15));
      CHECK(polygon.cosine[i] == -polygon.cosine[(i + k / 2) % k]);
      CHECK(polygon.sine[i] == -polygon.sine[(i + k / 2) % k]);
    }
    if (k % 4 == 0) {
      CHECK(polygon.cosine[k / 4] == 0);
      CHECK(polygon.sine[k / 4] == 1);
    }
    const double u[] = {9, 3, -4}, none[] = {9, 0, 0};
    CHECK(polygon.least_slip_bound(none) == 0);
    // Against the slip (3, -4): along -t1 3, along t2 4, and between as far as a direction lies there.
    const double expected = k == 4 ? 4 : k == 8 ? 7 / std::sqrt(2) : 1.5 + 2 * std::sqrt(3);
    CHECK(polygon.least_slip_bound(u) == Approx(expected));
  }
  FrictionPolygon same(4);
  const double* before = same.cosine.data();
  same.set(4);
  CHECK(same.cosine.data() == before);
  same.set(6);
  CHECK(same.k() == 6);
}

TEST_CASE("contacts give way by the size of W or by its normal part, limits by that alone, and no less than is asked") {
  const Eigen::Matrix3d W = Eigen::Vector3d(1, 2, 2).asDiagonal();  // of norm 3
  Softness sap;
  sap.beta = 2 * M_PI;
  sap.sigma = 0.25;
  CHECK(regularisation(3 * W, false, sap).n == Approx(3));
  CHECK(regularisation(3 * W, false, sap).t == Approx(0.75));
  Eigen::Matrix3d lone = Eigen::Matrix3d::Zero();
  lone(0, 0) = 6;
  CHECK(regularisation(lone, true, sap).n == Approx(6));
  CHECK(regularisation(lone, true, sap).t == Approx(1.5));
  sap.compliance = 2.5;
  CHECK(regularisation(W, false, sap).n == 2.5);
  CHECK(regularisation(3 * W, false, sap).n == Approx(3));
  CHECK(regularisation(W, false, sap).t == Approx(0.25));
  Softness mujoco;
  mujoco.rule = Softness::Rule::mujoco;
  mujoco.impedance = 0.75;
  mujoco.impratio = 5;
  mujoco.compliance = 100;  // of the other rule
  for (const bool limit : {true, false}) {
    CHECK(regularisation(3 * W, limit, mujoco).n == Approx(1));
    CHECK(regularisation(3 * W, limit, mujoco).t == Approx(0.2));
  }
}
