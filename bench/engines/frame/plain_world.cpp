#include "plain_world.h"

#include <algorithm>

namespace cb {

namespace {

plain::Pose plain_pose(const Pose& pose) {
  return {{pose.p.x(), pose.p.y(), pose.p.z()}, {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()}};
}
plain::Kind plain_kind(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::sphere:
      return plain::Kind::sphere;
    case ShapeKind::box:
      return plain::Kind::box;
    case ShapeKind::cylinder:
      return plain::Kind::cylinder;
    case ShapeKind::capsule:
    case ShapeKind::hull:
      throw Unsupported(std::string("a ") + std::string(name(kind)) + ": this adapter knows no such shape");
    case ShapeKind::half_space:
      break;
  }
  return plain::Kind::half_space;
}

}  // namespace

plain::Scene plain_scene(const Scenario& scenario, std::string_view engine) {
  refuse_robots(scenario, engine);
  plain::Scene out;
  for (std::size_t b = 0; b < scenario.model.bodies.size(); ++b) {
    const Body& body = scenario.model.bodies[b];
    const double* v = &scenario.initial.v[6 * b];
    const Vec3& I = body.inertia;
    out.bodies.push_back({body.mass,
                          {I.x(), I.y(), I.z()},
                          plain_pose(scenario.initial.pose[b]),
                          {v[0], v[1], v[2]},
                          {v[3], v[4], v[5]}});
  }
  for (const Shape& shape : scenario.shapes) {
    const Vec3& half = shape.half_extents;
    out.shapes.push_back(
        {shape.body, plain_kind(shape.kind), shape.radius, {half.x(), half.y(), half.z()}, plain_pose(shape.local)});
  }
  const auto n = static_cast<int>(scenario.shapes.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j)
      if (const PairLaw* law = scenario.pairs.find(i, j);
          law != nullptr && scenario.shapes[i].body != scenario.shapes[j].body)
        out.pairs.push_back({i, j, law->mu, law->restitution});
  return out;
}

void read_plain(const std::vector<plain::Body>& bodies, State& state) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const double* q = bodies[b].pose.q;
    state.pose[b] = {Vec3(bodies[b].pose.p), Quat(q[0], q[1], q[2], q[3])};
    for (std::size_t k = 0; k < 3; ++k) {
      state.v[6 * b + k] = bodies[b].v[k];
      state.v[6 * b + 3 + k] = bodies[b].w[k];
    }
  }
}

bool own_problem(const plain::Problem& plain, OwnProblem& out) {
  out = {};
  for (std::size_t at = 0; at < plain.M.size(); at += 36)
    out.problem.M.block(out.problem.M.add_block(6)) = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(&plain.M[at]);
  out.problem.v_minus = plain.v_minus;
  out.v_plus = plain.v_plus;
  using Rows = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
  for (const plain::Contact& contact : plain.contacts) {
    out.problem.J.add_band();
    const int first = contact.body[1] >= 0 && contact.body[1] < contact.body[0] ? 1 : 0;
    for (const int e : {first, 1 - first})
      if (contact.body[e] >= 0)
        out.problem.J.entry(out.problem.J.add_entry(contact.body[e], 6)) = Eigen::Map<const Rows>(contact.J[e]);
    out.impulse.insert(out.impulse.end(), contact.impulse, contact.impulse + 3);
    out.problem.offset.insert(out.problem.offset.end(), contact.offset, contact.offset + 3);
    out.compliance.insert(out.compliance.end(), contact.compliance, contact.compliance + 3);
    out.problem.mu.push_back(contact.mu);
    out.problem.restitution.push_back(0);
  }
  if (std::all_of(out.compliance.begin(), out.compliance.end(), [](double R) { return R == 0; }))
    out.compliance.clear();
  return out.problem.nc() > 0;
}

EngineWorld engine_world(std::shared_ptr<plain::World> world, std::vector<plain::Body> bodies) {
  EngineWorld out;
  const auto now = std::make_shared<std::vector<plain::Body>>(std::move(bodies));
  out.load = [world, now](const Loads& loads) {
    for (std::size_t b = 0; b < now->size(); ++b) {
      const Vec3 force = (*now)[b].mass * loads.gravity + loads.force[b];
      world->load(static_cast<int>(b), force.data());
    }
  };
  out.step = [world](double h) { world->step(h); };
  out.read = [world, now](State& state) {
    world->read(*now);
    read_plain(*now, state);
  };
  out.contacts = [world] { return world->contacts(); };
  return out;
}

}  // namespace cb
