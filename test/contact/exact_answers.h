#pragma once

// Contact problems with exact answers under each law, complete with what the answer must carry, and the same physics
// in other units, orders and frames.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "contact/referee.h"
#include "problems.h"

namespace cb::test {

struct Exact {
  std::string name;
  Law law;
  ContactProblem problem;
  ContactSolution solution;
  /// The law leaves these parts open in one direction (part, sign), or to either side (sign 0): no error.
  std::vector<std::pair<std::string, int>> open;
};

/// A number of an answer: its name, where it is, and what it is about in its unit.
struct Part {
  std::string name;
  double* value;
  double size;
};
inline std::vector<Part> parts(Exact& exact) {
  ContactSolution& s = exact.solution;
  const ContactProblem& p = exact.problem;
  std::vector<Part> out;
  double impulse = 0, speed = 0, work = 0;
  std::vector<double> u;
  contact_velocity(p, p.v_minus, u);
  for (double x : s.impulse) impulse = std::max(impulse, std::abs(x));
  for (double x : u) speed = std::max(speed, std::abs(x));
  for (double x : std::as_const(s).as<WorkWitness>().compression) work = std::max(work, std::abs(x));
  const auto add = [&](const std::string& name, std::vector<double>& values, double size) {
    for (std::size_t i = 0; i < values.size(); ++i)
      out.push_back({name + " " + std::to_string(i), &values[i], size > 0 ? size : std::abs(values[i])});
  };
  add("impulse", s.impulse, impulse);
  if (auto* polygon = std::get_if<PolygonWitness>(&s.witness)) {
    const std::size_t unknowns = (polygon->k + 2) * static_cast<std::size_t>(p.nc()), impulses = unknowns - p.nc();
    for (std::size_t i = 0; i < polygon->z.size(); ++i)
      out.push_back({"z " + std::to_string(i), &polygon->z[i], i % unknowns < impulses ? impulse : speed});
  }
  if (auto* works = std::get_if<WorkWitness>(&s.witness)) {
    add("compression", works->compression, work);
    add("restitution", works->restitution, work);
    add("friction", works->friction, work);
  }
  if (auto* proof = std::get_if<ConvexWitness>(&s.witness)) {
    add("eta", proof->eta, impulse);
    add("frictionless", proof->frictionless, impulse);
    // N z is about 1: by how much a part changes it, at the contact where it does most.
    for (std::size_t i = 0; i < proof->kappa_dual.size(); ++i) {
      std::vector<double> unit(proof->kappa_dual.size(), 0.0), moved(3 * p.nc());
      unit[i] = 1;
      multiply(p.J, p.M, unit, moved);
      double most = 0;
      for (int c = 0; c < p.nc(); ++c) most = std::max(most, std::abs(moved[3 * c]));
      if (most > 0) out.push_back({"kappa_dual " + std::to_string(i), &proof->kappa_dual[i], 1 / most});
    }
  }
  return out;
}

/// Slip at speed v along t1 and t2 alike, where it is not to be along an axis.
inline Vector3d aslant(double v_n, double slip) { return {slip * 0.6, -v_n, slip * 0.8}; }

/// A solid sphere (w_i = 8/(3 m)) that slides throughout: r_n as wanted, friction mu r_n against the slip.
struct SlidingSphere {
  ContactProblem problem;
  double m, v_n, mu;
  Vector3d slip, r;  ///< n, t1, t2
  Vector3d slip_after;
  SlidingSphere(double v_n_, double speed, double mu_, double e)
      : problem(sphere(aslant(v_n_, speed), {0, 0, 0}, mu_, e)), m(problem.M.block(0)(0, 0)), v_n(v_n_), mu(mu_) {
    std::vector<double> u;
    contact_velocity(problem, problem.v_minus, u);
    slip = {0, u[1], u[2]};
    press((1 + e) * m * v_n);
  }
  void press(double r_n) {
    r = -mu * r_n * slip.normalized();
    r[0] = r_n;
    slip_after = slip + 3.5 / m * Vector3d(0, r[1], r[2]);  // W_tt = 1/m + R^2/(2/5 m R^2)
  }
};

/// A limit of one of the two rates of block b.
inline void add_limit(ContactProblem& p, int b, int rate) {
  p.J.add_band();
  p.J.entry(p.J.add_entry(b, 2))(0, rate) = 1;
  p.offset.insert(p.offset.end(), 3, 0.0);
  p.mu.push_back(0);
  p.restitution.push_back(0);
}

/// A tree of two rates (1 kg m^2 each), the second's limit before the first's.
inline void add_limited_rates(ContactProblem& p, double first, double second) {
  const int b = p.M.add_block(2);
  p.M.block(b).setIdentity();
  p.v_minus.insert(p.v_minus.end(), {first, second});
  for (const int rate : {1, 0}) add_limit(p, b, rate);
}

inline Exact newton_sphere() {
  const SlidingSphere s(2, 4, 0.1, 0.5);
  Exact out{"a sphere that rebounds and slides", newton_law(), s.problem, {}, {}};
  out.solution.impulse = {s.r[0], s.r[1], s.r[2]};
  // Friction within the cone is all that the law asks of it.
  out.open = {{"impulse 1", s.r[1] > 0 ? -1 : 1}, {"impulse 2", s.r[2] > 0 ? -1 : 1}};
  return out;
}

inline Exact mirtich_spheres() {
  Exact out{"two spheres that rebound and slide", mirtich_law(), {}, {}, {}};
  const double e = 0.5, mu = 0.1, masses[] = {2, 3}, v_n[] = {2, 3};
  for (int b = 0; b < 2; ++b) {
    const double m = masses[b];
    add_body(out.problem, m, Vector3d::Constant(0.4 * m), aslant(v_n[b], 5 + b));
    add_contact(out.problem, b, {0, -1, 0}, -1, {}, ground_axes(), mu, e);
  }
  std::vector<double> u;
  contact_velocity(out.problem, out.problem.v_minus, u);
  for (int b = 0; b < 2; ++b) {
    const double m = masses[b], r_n = (1 + e) * m * v_n[b];
    const Eigen::Vector2d slip(u[3 * b + 1], u[3 * b + 2]), r_t = -mu * r_n * slip.normalized();
    out.solution.impulse.insert(out.solution.impulse.end(), {r_n, r_t[0], r_t[1]});
    WorkWitness& work = out.solution.as<WorkWitness>();
    work.compression.push_back(-0.5 * m * v_n[b] * v_n[b]);
    work.restitution.push_back(0.5 * e * e * m * v_n[b] * v_n[b]);
    work.friction.push_back(r_t.dot(slip + 1.75 / m * r_t));
  }
  return out;
}

/// A polygon's answer of a sphere that slides along direction 0; with restitution in two phases.
inline Exact polygon_sphere(double e) {
  const double m = 2, v_n = 2, speed = 5, mu = 0.1;
  Exact out{e > 0 ? "a sphere that rebounds in two phases" : "a sphere that slides", anitescu_potra_law(), {}, {}, {}};
  add_body(out.problem, m, Vector3d::Constant(0.4 * m), {speed, -v_n, 0});
  add_contact(out.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), mu, e);
  ContactSolution& s = out.solution;
  PolygonWitness& polygon = s.as<PolygonWitness>();
  polygon.k = 8;
  const auto phase = [&](double c_n, double c_t, double friction_so_far) {
    polygon.z.push_back(c_n);
    for (int i = 0; i < polygon.k; ++i) polygon.z.push_back(i == polygon.k / 2 ? c_t : 0);
    polygon.z.push_back(speed - 3.5 / m * (friction_so_far + c_t));
  };
  const double r_n = m * v_n;
  phase(r_n, mu * r_n, 0);
  if (e > 0) phase(0, mu * e * r_n, mu * r_n);  // e c_n is given back, and friction is bounded by mu times it
  s.impulse = {(1 + e) * r_n, -mu * (1 + e) * r_n, 0};
  return out;
}

/// A cube that comes to rest on four corners, without friction's doing: lam = 0, and the bound on friction is slack.
inline Exact polygon_box() {
  const double approach = 0.01;
  Exact out{"a box that lands flat", anitescu_potra_law(), box(0.3, {0, -approach, 0}), {}, {}};
  ContactSolution& s = out.solution;
  s.as<PolygonWitness>().k = 8;
  s.as<PolygonWitness>().z.assign(40, 0.0);
  for (int c = 0; c < 4; ++c) {
    s.as<PolygonWitness>().z[c] = approach / 4;
    s.impulse.insert(s.impulse.end(), {approach / 4, 0, 0});
  }
  return out;
}

/// A cube that slides aslant on four corners and keeps y = 0; friction mu m approach at the base tips its load.
inline std::vector<double> box_impulses(double approach, double mu, double cx, double cz) {
  std::vector<double> r;
  for (double x : {-0.5, 0.5})
    for (double z : {-0.5, 0.5}) {
      // Torque of friction about the centre, half an edge above the base, is balanced by the load's shift.
      const double n = approach / 4 * (1 + 2 * mu * (x * cx + z * cz));
      r.insert(r.end(), {n, -mu * n * cx, mu * n * cz});  // t2 = -z
    }
  return r;
}
inline Exact newton_box() {
  Exact out{"a box that slides on four corners", newton_law(), box(0.1, {0.03, -0.01, 0.04}), {}, {}};
  out.solution.impulse = box_impulses(0.01, 0.1, 0.6, 0.8);
  return out;
}
/// The same as the convex program's answer, with its bound; eta has a multiple of what lifts the box evenly.
inline Exact convex_box() {
  const double approach = 0.01, lift = 0.02;
  Exact out{"a box that slides on four corners, bounded", convex_law(), box(0.1, {0.03, -approach, 0.04}), {}, {}};
  ContactSolution& s = out.solution;
  s.impulse = box_impulses(approach, 0.1, 0.6, 0.8);
  s.as<ConvexWitness>().bounded = true;
  s.as<ConvexWitness>().eta.assign(4, lift / 4);
  s.as<ConvexWitness>().frictionless.assign(4, approach / 4);
  s.as<ConvexWitness>().kappa_dual = {0, 1, 0, 0, 0, 0};
  s.as<ConvexWitness>().epsilon = 1e-15;  // 1e-11 of the energy
  return out;
}

/// A cube of 2 kg pushed into a corner: three points on the floor, two on a wall, one on another; it stops without
/// friction. N is regular: f = -N^-T M v-, and z = N^-1 1.
inline Exact convex_corner() {
  Exact out{"a box in a corner, bounded", convex_law(), {}, {}, {}};
  ContactProblem& p = out.problem;
  add_body(p, 2, {0.4, 0.5, 0.6}, Vector3d::Zero());
  const std::vector<std::pair<Vector3d, Vector3d>> touches = {
      {{-0.4, -0.5, -0.3}, Vector3d::UnitY()}, {{0.4, -0.5, -0.2}, Vector3d::UnitY()},
      {{0.1, -0.5, 0.4}, Vector3d::UnitY()},   {{-0.5, 0.1, -0.3}, Vector3d::UnitX()},
      {{-0.5, -0.1, 0.3}, Vector3d::UnitX()},  {{0.05, 0.02, -0.5}, Vector3d::UnitZ()}};
  Eigen::Matrix<double, 6, 6> N;
  for (const auto& [arm, n] : touches) {
    const Vector3d t = n.unitOrthogonal();
    Matrix3d axes;
    axes << n.transpose(), t.transpose(), n.cross(t).transpose();
    N.row(p.nc()) << n.transpose(), arm.cross(n).transpose();
    add_contact(p, 0, arm, -1, {}, axes, 0.2);
  }
  Eigen::Matrix<double, 6, 1> f;
  f << 1, 2, 1.5, 0.8, 0.6, 1.2;
  const Eigen::Matrix<double, 6, 1> momentum = -N.transpose() * f, ones = Eigen::Matrix<double, 6, 1>::Ones();
  ContactSolution& s = out.solution;
  for (int i = 0; i < 6; ++i) {
    p.v_minus[i] = momentum[i] / p.M.block(0)(i, i);
    s.as<ConvexWitness>().frictionless.push_back(f[i]);
    s.impulse.insert(s.impulse.end(), {f[i], 0, 0});
  }
  const Eigen::Matrix<double, 6, 1> z = N.inverse() * ones;
  s.as<ConvexWitness>().kappa_dual.assign(z.data(), z.data() + 6);
  s.as<ConvexWitness>().bounded = true;
  s.as<ConvexWitness>().eta.assign(6, 0.0);
  s.as<ConvexWitness>().epsilon = 1e-12;
  return out;
}

/// Without the bound what slides is lifted by mu times its slip: r.u = 0 with u on the dual cone.
inline Exact convex_sphere() {
  SlidingSphere s(2, 4, 0.1, 0);
  s.press(s.m * (s.v_n + s.mu * s.slip.norm()) / (1 + 3.5 * s.mu * s.mu));
  Exact out{"a sphere that slides, without the bound", convex_law(), s.problem, {}, {}};
  out.solution.impulse = {s.r[0], s.r[1], s.r[2]};
  out.solution.as<ConvexWitness>().eta = {0};
  out.solution.as<ConvexWitness>().epsilon = 1e-12;
  return out;
}

/// Exact Coulomb friction: what slides carries mu r_n against the slip.
inline Exact coulomb_sphere() {
  const SlidingSphere s(2, 4, 0.1, 0);
  Exact out{"a sphere that slides, exactly", coulomb_law(), s.problem, {}, {}};
  out.solution.impulse = {s.r[0], s.r[1], s.r[2]};
  return out;
}
inline Exact coulomb_box() {
  Exact out = newton_box();
  out.law = coulomb_law();
  out.name += ", exactly";
  return out;
}

/// Without friction: what comes is stopped, whether it slips or not, what parts carries nothing; and both at a joint's
/// limit, whose tangential rows are zero.
inline Exact frictionless(const Law& law) {
  Exact out{"without friction, " + std::string(law.name), law, {}, {}, {}};
  const double masses[] = {2, 3, 1.5, 2.5, 4}, approach[] = {2, 1, -3, 1.5, -2.5}, slip[] = {5, 0, 0, 0, 0};
  for (int b = 0; b < 5; ++b) {
    const double m = masses[b];
    add_body(out.problem, m, Vector3d::Constant(0.4 * m), aslant(approach[b], slip[b]));
    add_contact(out.problem, b, {0, -1, 0}, -1, {}, ground_axes(), 0);
    if (b >= 3) out.problem.J.entry(b).bottomRows<2>().setZero();
    out.solution.impulse.insert(out.solution.impulse.end(), {std::max(0.0, m * approach[b]), 0, 0});
  }
  if (law == soft_law()) out.solution.witness = SoftWitness{{.rule = Softness::Rule::mujoco, .impedance = 1}};  // rigid
  return out;
}

/// Contacts that give way: a sphere that slides, by MuJoCo's R, and one that sticks, by SAP's (docs/methods/soft.md).
inline Exact soft_spheres(Softness::Rule rule) {
  const bool mujoco = rule == Softness::Rule::mujoco;
  Exact out{
      mujoco ? "a sphere that slides and gives way" : "a sphere that sticks and gives way", soft_law(), {}, {}, {}};
  const double m = 2, v_n = 2, mu = mujoco ? 0.1 : 0.9, slip = mujoco ? 4 : 1;
  add_body(out.problem, m, Vector3d::Constant(0.4 * m), aslant(v_n, slip));
  add_contact(out.problem, 0, {0, -1, 0}, -1, {}, ground_axes(), mu);
  Softness& softness = out.solution.as<SoftWitness>().softness;
  softness.rule = rule;
  const double W_n = 1 / m, w = 3.5 / m;
  double r_n = 0, r_t = 0;
  if (mujoco) {
    softness.impedance = 0.8;
    softness.impratio = 2;
    const double R_n = 0.25 * W_n, R_t = R_n / 2;
    r_n = (mu * slip + v_n) / (W_n + R_n + mu * mu * (w + R_t));
    r_t = mu * r_n;
  } else {
    softness.beta = 0.5;
    softness.sigma = 0.1;
    softness.compliance = 0.3 / m;
    r_n = v_n / (W_n + 0.3 / m);
    r_t = slip / (w + 0.1 * std::sqrt(1 + 2 * 3.5 * 3.5) / (3 * m));
  }
  std::vector<double> u;
  contact_velocity(out.problem, out.problem.v_minus, u);
  out.solution.impulse = {r_n, -r_t * u[1] / slip, -r_t * u[2] / slip};
  return out;
}

inline std::vector<Exact> exact_answers() {
  return {newton_sphere(),
          newton_box(),
          mirtich_spheres(),
          polygon_sphere(0),
          polygon_sphere(0.5),
          polygon_box(),
          convex_box(),
          convex_corner(),
          convex_sphere(),
          coulomb_sphere(),
          coulomb_box(),
          frictionless(coulomb_law()),
          frictionless(soft_law()),
          soft_spheres(Softness::Rule::mujoco),
          soft_spheres(Softness::Rule::sap)};
}

/// The same physics where one kilogramme is called `mass`, one metre `length`, one second `time`.
inline Exact in_units(Exact exact, double mass, double length, double time) {
  ContactProblem& p = exact.problem;
  const double speed = length / time, impulse = mass * speed, energy = impulse * speed;
  const auto scale = [](std::vector<double>& values, double by) {
    for (double& x : values) x *= by;
  };
  for (int b = 0; b < p.M.blocks(); ++b) {
    p.M.block(b) *= mass;
    p.M.block(b).bottomRows<3>() *= length;
    p.M.block(b).rightCols<3>() *= length;
  }
  for (int e = 0; e < static_cast<int>(p.J.block.size()); ++e) p.J.entry(e).rightCols<3>() *= length;
  for (int i = 0; i < p.nv(); ++i) p.v_minus[i] *= i % 6 < 3 ? speed : 1 / time;
  scale(p.offset, speed);
  ContactSolution& s = exact.solution;
  scale(s.impulse, impulse);
  const auto nc = static_cast<std::size_t>(p.nc());
  if (auto* polygon = std::get_if<PolygonWitness>(&s.witness))
    for (std::size_t i = 0; i < polygon->z.size(); ++i)
      polygon->z[i] *= i % ((polygon->k + 2) * nc) < (polygon->k + 1) * nc ? impulse : speed;
  if (auto* works = std::get_if<WorkWitness>(&s.witness))
    for (auto* work : {&works->compression, &works->restitution, &works->friction}) scale(*work, energy);
  if (auto* proof = std::get_if<ConvexWitness>(&s.witness)) {
    scale(proof->eta, impulse);
    scale(proof->frictionless, impulse);
    for (std::size_t i = 0; i < proof->kappa_dual.size(); ++i) proof->kappa_dual[i] /= i % 6 < 3 ? 1 : length;
    proof->epsilon *= energy;
  }
  if (auto* soft = std::get_if<SoftWitness>(&s.witness)) soft->softness.compliance /= mass;
  return exact;
}

/// Contacts and bodies in the opposite order.
inline Exact reversed(const Exact& exact) {
  Exact out = exact;
  const ContactProblem& from = exact.problem;
  const ContactSolution& s = exact.solution;
  ContactProblem& p = out.problem;
  const int nc = from.nc(), bodies = from.M.blocks();
  p.clear();
  const auto body = [&](int b) { return bodies - 1 - b; };
  for (int b = 0; b < bodies; ++b) {
    p.M.block(p.M.add_block(6)) = from.M.block(body(b));
    p.v_minus.insert(p.v_minus.end(), &from.v_minus[6 * body(b)], &from.v_minus[6 * body(b)] + 6);
  }
  for (int c = nc - 1; c >= 0; --c) {
    p.J.add_band();
    for (int e = from.J.band[c + 1] - 1; e >= from.J.band[c]; --e)
      p.J.entry(p.J.add_entry(body(from.J.block[e]), 6)) = from.J.entry(e);
    p.offset.insert(p.offset.end(), &from.offset[3 * c], &from.offset[3 * c] + 3);
    p.mu.push_back(from.mu[c]);
    p.restitution.push_back(from.restitution[c]);
  }
  const auto turn = [](const std::vector<double>& values, std::size_t first, std::size_t count, std::size_t width,
                       std::vector<double>& into) {
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j < width; ++j) into[first + i * width + j] = values[first + (count - 1 - i) * width + j];
  };
  const auto n = static_cast<std::size_t>(nc);
  turn(s.impulse, 0, n, 3, out.solution.impulse);
  if (const auto* polygon = std::get_if<PolygonWitness>(&s.witness)) {
    const auto k = static_cast<std::size_t>(polygon->k);
    std::vector<double>& z = out.solution.as<PolygonWitness>().z;
    for (std::size_t at = 0; at < z.size(); at += (k + 2) * n) {
      turn(polygon->z, at, n, 1, z);
      turn(polygon->z, at + n, n, k, z);
      turn(polygon->z, at + (k + 1) * n, n, 1, z);
    }
  }
  if (const auto* works = std::get_if<WorkWitness>(&s.witness)) {
    WorkWitness& into = out.solution.as<WorkWitness>();
    turn(works->compression, 0, n, 1, into.compression);
    turn(works->restitution, 0, n, 1, into.restitution);
    turn(works->friction, 0, n, 1, into.friction);
  }
  if (const auto* proof = std::get_if<ConvexWitness>(&s.witness)) {
    ConvexWitness& into = out.solution.as<ConvexWitness>();
    turn(proof->eta, 0, proof->eta.size(), 1, into.eta);
    turn(proof->frictionless, 0, proof->frictionless.size(), 1, into.frictionless);
    turn(proof->kappa_dual, 0, proof->kappa_dual.size() / 6, 6, into.kappa_dual);
  }
  for (auto& [part, sign] : out.open) part += nc > 1 ? " (reversed)" : "";  // of single contacts only
  return out;
}

/// The same seen from axes that are turned by R (x' = R x).
inline Exact turned(Exact exact, const Matrix3d& R) {
  ContactProblem& p = exact.problem;
  Eigen::Matrix<double, 6, 6> both = Eigen::Matrix<double, 6, 6>::Zero();
  both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = R;
  const auto turn = [&](std::vector<double>& v) {
    for (std::size_t b = 0; 6 * b < v.size(); ++b) {
      Eigen::Map<Eigen::Matrix<double, 6, 1>> block(&v[6 * b]);
      block = (both * block).eval();
    }
  };
  for (int b = 0; b < p.M.blocks(); ++b) p.M.block(b) = (both * p.M.block(b) * both.transpose()).eval();
  for (int e = 0; e < static_cast<int>(p.J.block.size()); ++e) p.J.entry(e) = (p.J.entry(e) * both.transpose()).eval();
  turn(p.v_minus);
  if (auto* proof = std::get_if<ConvexWitness>(&exact.solution.witness)) turn(proof->kappa_dual);
  return exact;
}

/// Tangents turned by a right angle: t1' = t2, t2' = -t1.
inline Exact other_tangents(Exact exact) {
  ContactProblem& p = exact.problem;
  for (int e = 0; e < static_cast<int>(p.J.block.size()); ++e) {
    const Eigen::RowVectorXd t1 = p.J.entry(e).row(1);
    p.J.entry(e).row(1) = p.J.entry(e).row(2).eval();
    p.J.entry(e).row(2) = -t1;
  }
  ContactSolution& s = exact.solution;
  for (int c = 0; c < p.nc(); ++c) {
    const double t1 = s.impulse[3 * c + 1];
    s.impulse[3 * c + 1] = s.impulse[3 * c + 2];
    s.impulse[3 * c + 2] = -t1;
  }
  if (auto* polygon = std::get_if<PolygonWitness>(&s.witness)) {
    const std::vector<double> z = polygon->z;
    const int k = polygon->k, unknowns = (k + 2) * p.nc();
    for (int at = 0; at < static_cast<int>(z.size()); at += unknowns)
      for (int c = 0; c < p.nc(); ++c)
        for (int i = 0; i < k; ++i) polygon->z[at + p.nc() + k * c + i] = z[at + p.nc() + k * c + (i + k / 4) % k];
  }
  std::vector<std::pair<std::string, int>> open;
  for (auto [part, sign] : exact.open) {
    if (part == "impulse 1")
      open.emplace_back("impulse 2", -sign);
    else if (part == "impulse 2")
      open.emplace_back("impulse 1", sign);
    else
      open.emplace_back(part, sign);
  }
  exact.open = open;
  return exact;
}

}  // namespace cb::test
