// What assembly hands to a method, against velocities of points and energies that are computed without it.
#include "contact/assemble.h"

#include <catch2/catch.hpp>

#include "contact/islands.h"
#include "dynamics/free_bodies.h"
#include "dynamics/random_tree.h"
#include "problems.h"

using namespace cb;

namespace {

/// Two free bodies, the world, and a robot of five links; each has a shape of the same index, the world's is the last.
struct World {
  RandomTree robot;
  std::vector<Shape> shapes;
  int tree_bodies;
  explicit World(unsigned seed, bool floating) : robot(seed, 5, floating), tree_bodies(5) {
    Model& model = robot.model;
    State& state = robot.state;
    for (Body& body : model.bodies) body.tree = 0;
    link_twists(model, model.trees[0], state);
    for (int b = 0; b < 2; ++b) {
      model.bodies.push_back({"free", 2.0 + b, {0.3, 0.5, 0.7 + b}, -1});
      state.pose.push_back({robot.vector(1), robot.turn()});
      const std::vector<double> v = robot.numbers(6, 2);
      state.v.insert(state.v.end(), v.begin(), v.end());
    }
    for (int b = 0; b <= static_cast<int>(model.bodies.size()); ++b) {
      Shape shape;
      shape.body = b < static_cast<int>(model.bodies.size()) ? b : -1;
      shape.radius = 1;
      shapes.push_back(shape);
    }
  }
  Vec3 velocity(int shape, const Vec3& point) const {
    const int b = shapes[shape].body;
    if (b < 0) return Vec3::Zero();
    const Vec3 v(&robot.state.v[6 * b]), w(&robot.state.v[6 * b + 3]);
    return v + w.cross(point - robot.state.pose[b].p);
  }
};

}  // namespace

TEST_CASE("the Jacobian's rows are the velocity of a's point less that of b's along normal and tangents") {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    World world(seed, seed % 2 == 0);
    const std::vector<std::pair<int, int>> touching = {{5, 6}, {6, 5}, {5, 7}, {7, 6}, {0, 5},
                                                       {6, 3}, {1, 4}, {4, 7}, {7, 2}};
    std::vector<ContactPoint> contacts;
    for (const auto& [a, b] : touching)
      contacts.push_back({world.robot.vector(2), world.robot.vector(1).normalized(), 0, a, b});
    const double turn = 0.3;
    ContactProblem p;
    std::vector<BlockOwner> owners;
    const std::vector<double> mu(contacts.size(), 0.5), e(contacts.size(), 0.1);
    Assembler().assemble(world.robot.model, world.robot.state, world.shapes, contacts, {}, mu, e, turn, p, owners);
    REQUIRE(p.nc() == static_cast<int>(contacts.size()));
    CHECK(p.mu == mu);
    CHECK(p.restitution == e);
    std::vector<double> u;
    contact_velocity(p, p.v_minus, u);
    for (int c = 0; c < p.nc(); ++c) {
      INFO("seed " << seed << ", contact " << c);
      const ContactPoint& contact = contacts[c];
      const Vec3 relative =
          world.velocity(contact.shape_a, contact.position) - world.velocity(contact.shape_b, contact.position);
      // t1 is the world's x axis on the plane, turned about -n; t2 = n x t1.
      const Vec3& n = contact.normal;
      const Vec3 x = (Vec3::UnitX() - n.x() * n).normalized();
      const Vec3 t1 = Eigen::AngleAxisd(turn, -n) * x, t2 = n.cross(t1);
      CHECK(u[3 * c] == Approx(n.dot(relative)).margin(1e-12));
      CHECK(u[3 * c + 1] == Approx(t1.dot(relative)).margin(1e-12));
      CHECK(u[3 * c + 2] == Approx(t2.dot(relative)).margin(1e-12));
    }
    // M is what kinetic energy is made of.
    CHECK(0.5 * quadratic_form(p.M, p.v_minus) ==
          Approx(kinetic_energy(world.robot.model, world.robot.state)).epsilon(1e-12));
  }
}

TEST_CASE("a body's inertia turns with it, whichever of its moments are equal") {
  const std::vector<Vec3> inertias = {
      {0.3, 0.3, 0.7}, {0.3, 0.7, 0.3}, {0.7, 0.3, 0.3}, {0.3, 0.3, 0.3}, {0.3, 0.5, 0.7}};
  for (unsigned seed = 1; seed <= 3; ++seed)
    for (const Vec3& inertia : inertias) {
      INFO("seed " << seed << ", " << inertia.transpose());
      World world(seed, false);
      for (int b : {5, 6}) world.robot.model.bodies[b].inertia = inertia;
      const std::vector<ContactPoint> contacts = {{world.robot.vector(2), {0, 1, 0}, 0, 5, 6},
                                                  {world.robot.vector(2), {0, 1, 0}, 0, 0, 6}};
      ContactProblem p;
      std::vector<BlockOwner> owners;
      Assembler().assemble(world.robot.model, world.robot.state, world.shapes, contacts, {}, {0, 0}, {0, 0}, 0, p,
                           owners);
      CHECK(0.5 * quadratic_form(p.M, p.v_minus) ==
            Approx(kinetic_energy(world.robot.model, world.robot.state)).epsilon(1e-12));
      const Mat3 R = world.robot.state.pose[5].q.toRotationMatrix();
      CHECK((p.M.block(0).bottomRightCorner<3, 3>() - R * inertia.asDiagonal() * R.transpose()).norm() < 1e-15);
    }
}

TEST_CASE("a contact's bodies stand in the order of M, whichever of them is named first") {
  World world(2, true);
  std::vector<ContactPoint> contacts;
  for (const auto& [a, b] : {std::pair{5, 6}, {6, 5}, {0, 5}, {5, 0}, {6, 3}, {4, 6}})
    contacts.push_back({world.robot.vector(2), world.robot.vector(1).normalized(), 0, a, b});
  const std::vector<double> zeros(contacts.size(), 0.0);
  ContactProblem p;
  std::vector<BlockOwner> owners;
  Assembler().assemble(world.robot.model, world.robot.state, world.shapes, contacts, {}, zeros, zeros, 0, p, owners);
  for (int c = 0; c < p.nc(); ++c) {
    REQUIRE(p.J.band[c + 1] == p.J.band[c] + 2);
    CHECK(p.J.block[p.J.band[c]] < p.J.block[p.J.band[c] + 1]);
  }
}

TEST_CASE("a driven robot is no unknown, and its contacts have the same velocities") {
  for (unsigned seed = 0; seed < 5; ++seed) {
    World world(seed, seed % 2 == 0);
    std::vector<ContactPoint> contacts;
    for (const auto& [a, b] : {std::pair{5, 6}, {5, 7}, {0, 5}, {6, 3}, {5, 2}})
      contacts.push_back({world.robot.vector(2), world.robot.vector(1).normalized(), 0, a, b});
    const std::vector<double> zeros(contacts.size(), 0.0);
    ContactProblem p, driven;
    std::vector<BlockOwner> owners, owners_driven;
    const auto assemble = [&](ContactProblem& into, std::vector<BlockOwner>& who, const std::vector<char>& trees) {
      Assembler().assemble(world.robot.model, world.robot.state, world.shapes, contacts, {}, zeros, zeros, 0.3, into,
                           who, trees);
    };
    assemble(p, owners, {});
    assemble(driven, owners_driven, {1});
    CHECK(driven.M.blocks() == p.M.blocks() - 1);
    for (const BlockOwner& owner : owners_driven) CHECK(owner.tree < 0);
    std::vector<double> u, u_driven;
    contact_velocity(p, p.v_minus, u);
    contact_velocity(driven, driven.v_minus, u_driven);
    for (std::size_t i = 0; i < u.size(); ++i) CHECK(u_driven[i] == Approx(u[i]).margin(1e-12));
  }
}

TEST_CASE("a joint at its limit approaches it with its rate less the limit's own, from either side") {
  World world(3, false);
  Tree& tree = world.robot.model.trees[0];
  std::vector<LimitContact> limits;
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    if (tree.joints[j].nv() != 1) continue;
    tree.joints[j].limit_rate = 0.3 + static_cast<double>(j);
    for (const double sign : {1.0, -1.0}) limits.push_back({0, static_cast<int>(j), sign, 0});
  }
  ContactProblem p;
  std::vector<BlockOwner> owners;
  Assembler().assemble(world.robot.model, world.robot.state, world.shapes, {}, limits, {}, {}, 0, p, owners);
  std::vector<double> u;
  contact_velocity(p, p.v_minus, u);
  REQUIRE(p.nc() == static_cast<int>(limits.size()));
  for (int c = 0; c < p.nc(); ++c) {
    const Joint& joint = tree.joints[limits[c].joint];
    CHECK(u[3 * c] == Approx(limits[c].sign * (world.robot.state.qd[joint.v] - joint.limit_rate)).margin(1e-14));
    CHECK(u[3 * c + 1] == 0);
    CHECK(u[3 * c + 2] == 0);
    CHECK(is_limit(p, c));
  }
}

TEST_CASE("an island as a problem of its own has the contacts, bodies and velocities that it has in the whole") {
  ContactProblem p;
  for (int b = 0; b < 5; ++b) test::add_body(p, 1 + b, Vec3::Constant(1 + b), Vec3(b, -1, 0.1 * b), Vec3(0.2, b, 1));
  // 0 and 3 touch, 1 and 4; each contact has numbers of its own.
  const std::vector<std::pair<int, int>> touching = {{3, -1}, {4, 1}, {0, 3}, {1, -1}};
  for (std::size_t c = 0; c < touching.size(); ++c) {
    const double k = static_cast<double>(c + 1);
    test::add_contact(p, touching[c].first, Vec3(0.1 * k, -1, 0), touching[c].second, Vec3(0, 1, 0.2 * k),
                      test::ground_axes(0.1 * k), 0.1 * k, 0.2 * k);
    for (int i = 0; i < 3; ++i) p.offset[3 * c + i] = k + 10 * i;
  }
  std::vector<double> u, u_island;
  contact_velocity(p, p.v_minus, u);
  for (const std::vector<int>& island : {std::vector<int>{0, 2}, std::vector<int>{1, 3}})
    for (const int asked : island) {
      const ContactProblem alone = island_of(p, asked);
      REQUIRE(alone.nc() == 2);
      REQUIRE(alone.M.blocks() == 2);
      contact_velocity(alone, alone.v_minus, u_island);
      BlockCholesky factor, factor_alone;
      REQUIRE((factor.factor(p.M) && factor_alone.factor(alone.M)));
      std::vector<Eigen::Matrix3d> W, W_alone;
      diagonal_blocks(p, factor, W);
      diagonal_blocks(alone, factor_alone, W_alone);
      for (int i = 0; i < 2; ++i) {
        const int c = island[static_cast<std::size_t>(i)];
        CHECK(alone.mu[i] == p.mu[c]);
        CHECK(alone.restitution[i] == p.restitution[c]);
        CHECK(W_alone[i] == W[c]);
        for (int row = 0; row < 3; ++row) {
          CHECK(alone.offset[3 * i + row] == p.offset[3 * c + row]);
          CHECK(u_island[3 * i + row] == u[3 * c + row]);
        }
      }
    }
}

namespace {

/// Two carts of 2 and 3 kg, each a tree of its own, on rails along x and y; a free ball of 5 kg between them in the
/// list. Each has a shape of its index; the world's is the last.
struct Carts {
  Model model;
  State state;
  std::vector<Shape> shapes;
  Carts() {
    model.bodies = {{"cart", 2, {1, 1, 1}, 0}, {"ball", 5, {1, 1, 1}}, {"other", 3, {1, 1, 1}, 1}};
    state.pose = {{{0, 0, 0}, Quat::Identity()}, {{1, 0, 0}, Quat::Identity()}, {{2, 0, 0}, Quat::Identity()}};
    state.v.assign(18, 0.0);
    for (int i = 0; i < 6; ++i) state.v[6 + i] = 10 + i;
    state.q = {0, 0};
    state.qd = {0.25, -0.5};
    for (int t = 0; t < 2; ++t) {
      Tree tree;
      Joint joint;
      joint.kind = JointKind::prismatic;
      joint.body = 2 * t;
      joint.axis_C = t == 0 ? Vec3::UnitX() : Vec3::UnitY();
      joint.q = joint.v = tree.v = t;
      tree.nv = 1;
      tree.joints = {joint};
      model.trees.push_back(tree);
    }
    for (const int body : {0, 1, 2, -1}) {
      Shape shape;
      shape.body = body;
      shapes.push_back(shape);
    }
  }
  std::vector<std::pair<int, int>> owners_of(const std::vector<std::pair<int, int>>& touching,
                                             const std::vector<LimitContact>& limits, ContactProblem& p,
                                             const ImplicitJoints* joints = nullptr) const {
    std::vector<ContactPoint> contacts;
    for (const auto& [a, b] : touching) contacts.push_back({{0, 0, 0}, {0, 1, 0}, 0, a, b});
    std::vector<double> mu(contacts.size(), 0.5), restitution(contacts.size(), 0.25);
    std::vector<BlockOwner> owners;
    Assembler().assemble(model, state, shapes, contacts, limits, mu, restitution, 0, p, owners, {}, joints);
    std::vector<std::pair<int, int>> out;
    for (const BlockOwner& owner : owners) out.emplace_back(owner.body, owner.tree);
    return out;
  }
};

}  // namespace

TEST_CASE("blocks are those of what touches something: free bodies, then trees, each with its own mass and rates") {
  using Owners = std::vector<std::pair<int, int>>;
  const Carts carts;
  ContactProblem p;
  CHECK(carts.owners_of({{2, 3}}, {}, p) == Owners{{-1, 1}});
  CHECK(p.v_minus == std::vector<double>{-0.5});
  CHECK(p.M.block(0)(0, 0) == Approx(3));
  CHECK(carts.owners_of({{2, 1}, {0, 3}}, {}, p) == Owners{{1, -1}, {-1, 0}, {-1, 1}});
  CHECK(p.v_minus == std::vector<double>{10, 11, 12, 13, 14, 15, 0.25, -0.5});
  CHECK(p.M.block(0)(0, 0) == 5);
  CHECK(p.M.block(1)(0, 0) == Approx(2));
  CHECK(p.mu == std::vector<double>{0.5, 0.5});
  // A limit is a contact of its tree, after all others, without friction and restitution.
  CHECK(carts.owners_of({{1, 3}}, {{1, 0, -1, 0}}, p) == Owners{{1, -1}, {-1, 1}});
  CHECK(p.mu == std::vector<double>{0.5, 0});
  CHECK(p.restitution == std::vector<double>{0.25, 0});
  CHECK(p.J.entry(1)(0, 0) == -1);
  CHECK(is_limit(p, 1));
}

TEST_CASE("joint forces of a step's end make trees heavier, by their own dampers and springs") {
  const Carts carts;
  JointGains passive(2), motors(2);
  passive.damping = {4, 6};
  motors.stiffness = {8, 16};
  ImplicitJoints joints(passive, motors);
  joints.begin(0.5);
  ContactProblem p;
  carts.owners_of({{0, 3}, {2, 3}, {1, 3}}, {}, p, &joints);
  CHECK(p.M.block(0)(0, 0) == 5);
  CHECK(p.M.block(1)(0, 0) == Approx(2 + 0.5 * 4 + 0.25 * 8));
  CHECK(p.M.block(2)(0, 0) == Approx(3 + 0.5 * 6 + 0.25 * 16));
}
