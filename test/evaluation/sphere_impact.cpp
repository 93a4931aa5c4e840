#include "evaluation/sphere_impact.h"

#include <catch2/catch.hpp>

#include "evaluation/stored.h"

using namespace cb;
using cb::test::stored;

namespace {

SphereBody unit_sphere() { return {4.1887902047863905, 0.4 * 4.1887902047863905, 1}; }

Vec3 vec(const nlohmann::json& x) { return Vec3(x[0].get<double>(), x[1].get<double>(), x[2].get<double>()); }

}  // namespace

TEST_CASE("A sphere's impacts have the stored velocities, for the cone and for polygons") {
  const Vec3 up(0, 1, 0);
  for (const auto& row : stored()["sphere_impact"]) {
    const Vec3 v = vec(row["v0"]), w = vec(row["w0"]);
    const SphereImpact cone = sphere_impact(unit_sphere(), v, w, up, row["mu"], row["e"]);
    CHECK((cone.v - vec(row["cone"]["v"])).norm() < 1e-12);
    CHECK((cone.w - vec(row["cone"]["w"])).norm() < 1e-12);
    CHECK((cone.impulse - vec(row["cone"]["impulse"])).norm() < 1e-10);
    CHECK(cone.sticks == (row["cone"]["mode"] == "stick"));
    CHECK(unit_sphere().kinetic_energy(cone.v, cone.w) == Approx(row["cone"]["ke1"].get<double>()).epsilon(1e-12));
    if (row["e"] != 0.0) continue;
    for (const int k : {4, 8}) {
      const auto& expected = row[k == 4 ? "k4" : "k8"];
      const SphereImpact polygon = sphere_impact_polygon(unit_sphere(), v, w, up, row["mu"], k, 0);
      CHECK((polygon.v - vec(expected["v"])).norm() < 1e-12);
      CHECK((polygon.w - vec(expected["w"])).norm() < 1e-12);
    }
  }
}

TEST_CASE("The stored table of exact impacts holds digit for digit") {
  const SphereImpact a = sphere_impact(unit_sphere(), Vec3(5, -10, 0), Vec3::Zero(), Vec3(0, 1, 0), 0.60581, 0);
  CHECK(a.v.x() == Approx(3.57142857).epsilon(1e-9));
  CHECK(unit_sphere().kinetic_energy(a.v, a.w) == Approx(37.39991254).epsilon(1e-9));
  const SphereImpact b = sphere_impact(unit_sphere(), Vec3(20, -3, 0), Vec3::Zero(), Vec3(0, 1, 0), 0.60581, 0);
  CHECK(b.v.x() == Approx(18.18257).epsilon(1e-12));
  CHECK(b.w.z() == Approx(-4.543575).epsilon(1e-12));
  CHECK(unit_sphere().kinetic_energy(b.v, b.w) == Approx(709.71401565).epsilon(1e-10));
  // Rolls 0.6563746689 s later at 14.28571429.
  const SphereFlight after(unit_sphere(), Pose(), Vec3(20, -3, 0), Vec3::Zero(), 0, Vec3(0, 1, 0), 9.8, 0.60581);
  CHECK(after.t_roll == Approx(0.6563746689).epsilon(1e-9));
  CHECK((after.position(2) - after.position(1)).x() == Approx(14.28571429).epsilon(1e-9));
}

TEST_CASE(
    "A sphere's impact does not depend on the frame, and a sliding one keeps the momentum about the contact point") {
  const Quat turn(Eigen::AngleAxisd(0.7, Vec3(0.3, 0.5, -1).normalized()));
  const Vec3 v(8, -3, -6), w(2, 5, -4), up(0, 1, 0);
  for (const double e : {0.0, 0.6}) {
    const SphereImpact here = sphere_impact(unit_sphere(), v, w, up, 0.4, e);
    const SphereImpact there = sphere_impact(unit_sphere(), turn * v, turn * w, turn * up, 0.4, e);
    CHECK((turn * here.v - there.v).norm() < 1e-13);
    CHECK((turn * here.w - there.w).norm() < 1e-13);
    // r x m v + I w about the contact point, r = (0, 1, 0).
    const SphereBody s = unit_sphere();
    const auto momentum = [&](const Vec3& a, const Vec3& b) -> Vec3 { return s.mass * up.cross(a) + s.inertia * b; };
    CHECK((momentum(v, w) - momentum(here.v, here.w)).norm() < 1e-12);
  }
}

TEST_CASE("From flight to rolling the sphere passes through the stored places") {
  for (const auto& row : stored()["sphere_trajectory"]) {
    Pose start;
    start.p = Vec3(0, 1 + row["h0"].get<double>(), 0);
    const SphereFlight flight(unit_sphere(), start, vec(row["v0"]), vec(row["w0"]), row["h0"], Vec3(0, 1, 0), 9.8,
                              0.60581);
    CHECK(flight.t_impact == Approx(row["t_impact"].get<double>()).epsilon(1e-12));
    CHECK(flight.t_roll == Approx(row["t_roll"].get<double>()).epsilon(1e-12));
    for (std::size_t i = 0; i < row["t"].size(); ++i)
      CHECK((flight.position(row["t"][i]) - vec(row["x"][i])).norm() < 1e-11);
  }
}

TEST_CASE("A sphere that leaves the plane it touches comes down again where its throw ends") {
  const SphereFlight thrown(unit_sphere(), Pose(), Vec3(0, 4.9, 0), Vec3::Zero(), 0, Vec3(0, 1, 0), 9.8, 0.5);
  CHECK(thrown.t_impact == Approx(1));
  CHECK(thrown.position(0.5).y() == Approx(4.9 / 4));
}
