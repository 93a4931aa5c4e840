// Off-centre impacts at one contact, by the closed form of each law of restitution.
//
// Impulses r at the contact change its velocity u by K r, K = 1/m + [c]^T I^-1 [c] for the arm c. With n the normal:
//   without friction    all laws: r_n = -(1 + e) u_n / K_nn, u_n+ = -e u_n
//   sliding throughout  all laws but the convex one: r = P (1, -mu s), s the direction of the slip,
//                       P = -(1 + e) u_n / (K_nn - mu K_nt s)
//   at rest along the ground, and K^-1 n inside the cone: the contact keeps its slip of 0 all along, u_n grows by
//                       1 / (K^-1)_nn = S for each N s, all laws but the convex one: u_n+ = -e u_n
//   slip that stops while it compresses, in the plane:
//     Newton            u_n+ = -e u_n
//     Poisson           what stops the contact, r = -K^-1 u, has r_n = -(u_n - K_nt u_t / K_tt) / S; e r_n gives
//                       u_n+ = e S r_n = -e (u_n - K_nt u_t / K_tt)
//     Stronge           slip ends at p = |u_t| / (mu K_tt - K_nt s), where u_n is u_s; the work stored until u_n = 0 is
//                       A = -p (u_n + u_s) / 2 + u_s^2 / (2 S), and u_n+^2 / (2 S) = e^2 A

#include <Eigen/Dense>

#include "closed_forms.h"

using namespace cb;
using namespace cb::test;

namespace {

constexpr double rounding = 1e-11;  // -: |difference of velocities| <= rounding * the fastest one

/// What the first event of a scene without gravity did to its one body.
struct Impact {
  Vec3 c;     ///< from the centre to the contact, m
  Vec3 v, w;  ///< velocity and spin before
  Vec3 v_plus, w_plus;
  Pose pose;
};
Impact first_impact(Scenario s, const Claimant& who) {
  s.gravity.constant.setZero();
  Impact out;
  bool met = false;
  Stepped run(s, who);
  run.simulation().on_event = [&](const EventRecord& event) {
    if (met) return;
    met = true;
    REQUIRE(event.contacts.size() == 1);
    out.pose = run.pose();
    out.c = event.contacts[0].position - out.pose.p;
    const double* before = event.problem.v_minus.data();
    out.v = Vec3(before);
    out.w = Vec3(before + 3);
    out.v_plus = Vec3(event.v_plus.data());
    out.w_plus = Vec3(event.v_plus.data() + 3);
  };
  for (int i = 0; i < 50 && !met; ++i) run.step();
  REQUIRE(met);
  return out;
}

// World axes x, y (the normal), z.
Mat3 inverse_inertia(const Impact& impact, const Vec3& moments) {
  const Mat3 R = impact.pose.q.toRotationMatrix();
  return R * moments.cwiseInverse().asDiagonal() * R.transpose();
}
Mat3 yielding(const Impact& impact, double mass, const Mat3& inverse) {
  Mat3 cross;
  cross << 0, -impact.c.z(), impact.c.y(), impact.c.z(), 0, -impact.c.x(), -impact.c.y(), impact.c.x(), 0;
  return Mat3::Identity() / mass + cross.transpose() * inverse * cross;
}
Vec3 at_contact(const Impact& impact) { return impact.v + impact.w.cross(impact.c); }
void check_impulse(const Impact& impact, double mass, const Mat3& inverse, const Vec3& r) {
  const double scale = impact.v.norm() + impact.w.norm() * impact.c.norm();
  CHECK((impact.v_plus - impact.v - r / mass).norm() < rounding * scale);
  CHECK((impact.w_plus - impact.w - inverse * impact.c.cross(r)).norm() * impact.c.norm() < rounding * scale);
}

// A ball whose centre of mass is off its middle: the contact is at `arm` from that centre when it lands upright.
constexpr double mass = 2, moment = 0.05, radius = 0.5;
Scenario eccentric_ball(const Vec3& arm, double slip, double approach, double mu, double e) {
  Scenario s = empty_scene(1e-3, 1);
  add_ground(s);
  const Vec3 w(0, 0, 3), v = Vec3(slip, -approach, 0) - w.cross(arm);
  add_free(s, sphere_shape(radius), mass, {moment, moment, moment}, {-arm, Quat::Identity()}, v, w);
  s.shapes.back().local.p = arm + radius * Vec3::UnitY();
  collide_all(s, mu, e);
  return s;
}

const std::vector<double> restitutions = {0, 0.5, 1};
std::vector<Claimant> impact_laws() { return complementarity() + std::vector{newton(), mirtich()}; }

}  // namespace

TEST_CASE("a smooth box that lands on one corner leaves with e times its approach, by every method", "[closed]") {
  const Vec3 size(0.4, 0.6, 1);
  const double m = 3;
  const Vec3 squares = size.cwiseAbs2(), moments = m / 12 * (Vec3::Constant(squares.sum()) - squares);
  Claimant uncapped{"newton", "newton"};
  for (const Claimant& who : impact_laws() + std::vector{uncapped, convex(true), convex(false)})
    for (const double e : restitutions)
      for (const Vec3& spin : {Vec3(0.5, -2, 1.5), Vec3(0, 0, 0), Vec3(-3, 1, 4)}) {
        INFO(who.name << ": e = " << e << ", spin " << spin.transpose());
        Scenario s = empty_scene(1e-3, 1);
        add_ground(s);
        const Quat turn(Eigen::AngleAxisd(0.8, Vec3(1, 0.3, -0.6).normalized()));
        add_box(s, size, m, {{0, 0.7, 0}, turn}, {0.3, -12, 0.2}, spin);
        collide_all(s, 0, e);
        const Impact impact = first_impact(s, who);
        const Mat3 inverse = inverse_inertia(impact, moments), K = yielding(impact, m, inverse);
        check_impulse(impact, m, inverse, -(1 + e) * at_contact(impact).y() / K(1, 1) * Vec3::UnitY());
      }
}

TEST_CASE("an off-centre impact that slides throughout takes mu of its normal impulse, by every law", "[closed]") {
  Claimant uncapped{"newton", "newton"};
  for (const Claimant& who : impact_laws() + std::vector{uncapped})
    for (const double e : restitutions)
      for (const double x : {-0.2, 0.1, 0.3})
        for (const double mu : {0.1, 0.4}) {
          INFO(who.name << ": e = " << e << ", arm " << x << ", mu " << mu);
          const Impact impact = first_impact(eccentric_ball({x, -0.3, 0}, 20, 1, mu, e), who);
          const Mat3 inverse = Mat3::Identity() / moment, K = yielding(impact, mass, inverse);
          const double P = (1 + e) / (K(1, 1) - mu * K(0, 1));
          REQUIRE(20 + (K(0, 1) - mu * K(0, 0)) * P > 0);  // slips on
          check_impulse(impact, mass, inverse, P * Vec3(-mu, 1, 0));
        }
}

TEST_CASE("an off-centre impact without slip sticks inside the cone and leaves with e times its approach", "[closed]") {
  for (const Claimant& who : impact_laws())
    for (const double e : restitutions)
      for (const double x : {-0.15, 0.05, 0.25}) {
        INFO(who.name << ": e = " << e << ", arm " << x);
        const Impact impact = first_impact(eccentric_ball({x, -0.3, 0}, 0, 2, 1.5, e), who);
        const Mat3 inverse = Mat3::Identity() / moment, K = yielding(impact, mass, inverse);
        check_impulse(impact, mass, inverse, (1 + e) * 2 * K.inverse().col(1));
      }
}

TEST_CASE("slip that stops during compression: Newton, Poisson and Stronge return what each says", "[closed]") {
  const double approach = 2, slip = 0.8, mu = 1.5;
  for (const Claimant& who : impact_laws())
    for (const double e : restitutions)
      for (const double x : {-0.1, 0.05, 0.2}) {
        INFO(who.name << ": e = " << e << ", arm " << x);
        const Impact impact = first_impact(eccentric_ball({x, -0.3, 0}, slip, approach, mu, e), who);
        const Mat3 inverse = Mat3::Identity() / moment, K = yielding(impact, mass, inverse);
        const double S = 1 / K.inverse()(1, 1), p = slip / (mu * K(0, 0) - K(0, 1)),
                     stopped = -approach + (K(1, 1) - mu * K(0, 1)) * p;
        REQUIRE(stopped < 0);
        REQUIRE(std::abs(K(0, 1)) < mu * K(0, 0));
        double leaves = e * approach;
        if (who.method == "ap") leaves = e * (approach + K(0, 1) * slip / K(0, 0));
        if (who.method == "mirtich")
          leaves = e * std::sqrt(2 * S * (p * (approach - stopped) / 2 + stopped * stopped / (2 * S)));
        const Vec3 r = K.ldlt().solve(Vec3(-slip, leaves + approach, 0));
        // Newton's rule with all of this friction can gain energy; stick-tested stops short of it
        // (docs/methods/newton.md).
        const double gain = r.dot(Vec3(slip, leaves - approach, 0)) / 2;
        if (who.method == "newton" && gain > 0) continue;
        CHECK(gain < 1e-12);
        check_impulse(impact, mass, inverse, r);
      }
}

// One contact: kappa is the frictionless impulse P0 = -u_n / K_nn. With r_n <= P0 friction must not press, K_nt r_t >=
// 0: where it would, there is none. Where it relieves the contact, it gets mu P0 and the contact is lifted by K_nt r_t.
TEST_CASE("with the bound convex gives no friction to an impact that friction presses, and lifts one that it relieves",
          "[closed]") {
  for (const double x : {-0.2, 0.1, 0.3})
    for (const double mu : {0.1, 0.4}) {
      INFO("arm " << x << ", mu " << mu);
      const Impact impact = first_impact(eccentric_ball({x, -0.3, 0}, 20, 1, mu, 0), convex(true));
      const Mat3 inverse = Mat3::Identity() / moment, K = yielding(impact, mass, inverse);
      const bool presses = K(0, 1) > 0;  // friction is along -x
      check_impulse(impact, mass, inverse, 1 / K(1, 1) * Vec3(presses ? 0 : -mu, 1, 0));
    }
}

TEST_CASE("without the bound convex stops an off-centre impact that sticks", "[closed]") {
  for (const double x : {-0.15, 0.05, 0.25})
    for (const double slip : {0.0, 0.8}) {
      INFO("arm " << x << ", slip " << slip);
      const Impact impact = first_impact(eccentric_ball({x, -0.3, 0}, slip, 2, 1.5, 0), convex(false));
      const Mat3 inverse = Mat3::Identity() / moment, K = yielding(impact, mass, inverse);
      check_impulse(impact, mass, inverse, K.ldlt().solve(Vec3(-slip, 2, 0)));
    }
}
