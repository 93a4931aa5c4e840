// What solvers of exact friction are measured by, by hand; and what each of them makes of its options, of floors that
// move and of what is no number.

#include <catch2/catch.hpp>
#include <cmath>

#include "contact/problem.h"
#include "ncp/interior_system.h"
#include "ncp/ncp.h"
#include "problems.h"

using namespace cb;
using namespace cb::test;

namespace {

/// A problem with what solvers ask for beside it.
struct Posed {
  ContactProblem p;
  BlockCholesky factor;
  std::vector<double> weight;
  explicit Posed(ContactProblem problem) : p(std::move(problem)) {
    REQUIRE(factor.factor(p.M));
    contact_weights(p, factor, weight);
  }
  NcpProblem view(std::span<const double> start = {}) const {
    return {&p.M, &factor, &p.J, p.v_minus, p.offset, p.mu, weight, start};
  }
  NcpSolution solve(std::string_view solver, const NcpOptions& options = {}, std::span<const double> start = {}) const {
    NcpSolution out;
    find_ncp_solver(solver)->make(options)(view(start), out);
    return out;
  }
};

/// Two points of 1 and 4 kg without friction, each with its contact: u = v, W = 1 and 1/4.
Posed points() {
  ContactProblem p;
  const double masses[] = {1, 4};
  for (int b = 0; b < 2; ++b) {
    p.M.block(p.M.add_block(3)) = masses[b] * Matrix3d::Identity();
    p.J.add_band();
    p.J.entry(p.J.add_entry(b, 3)).setIdentity();
    p.mu.push_back(0);
    p.restitution.push_back(0);
  }
  p.v_minus = {-1, 0.5, 0, -2, 0, 1};
  p.offset.assign(6, 0.0);
  return Posed(p);
}

std::vector<double> cone_of(std::vector<double> x, double mu) {
  std::vector<double> out(3);
  project_on_friction_cone(x.data(), mu, out.data());
  return out;
}
void check_near(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(a[i] == Approx(b[i]).epsilon(1e-14).margin(1e-15));
}

}  // namespace

TEST_CASE("the nearest point of a cone is the point itself, the tip, or on the edge that it faces", "[ncp]") {
  check_near(cone_of({2, 0.6, -0.8}, 0.5), {2, 0.6, -0.8});
  check_near(cone_of({1, 1.2, -1.6}, 0.5), {1.6, 0.48, -0.64});  // (1 + mu 2) / (1 + mu^2), and mu of it along
  check_near(cone_of({-0.9, 1.2, -1.6}, 0.5), {0.08, 0.024, -0.032});
  check_near(cone_of({-1, 1.2, -1.6}, 0.5), {0, 0, 0});
  check_near(cone_of({3, 1, 2}, 0), {3, 0, 0});
  check_near(cone_of({-3, 1, 2}, 0), {0, 0, 0});
}

TEST_CASE("the natural map is what an impulse is off the cone's answer to its velocity, the slip's part within",
          "[ncp]") {
  // r - (u + mu |u_t| e_n) / w = (2 - 0.275, 0.5 - 0.2, 0.15), within the cone.
  const double r[] = {2, 0.5, 0}, u[] = {0.3, 0.4, -0.3};
  std::vector<double> e(3);
  natural_map(r, u, 0.5, 2, e.data());
  check_near(e, {0.275, 0.2, -0.15});
  // It parts: all of the impulse is wrong.
  const double parts[] = {9, 0, 0};
  natural_map(r, parts, 0.5, 2, e.data());
  check_near(e, {2, 0.5, 0});
}

TEST_CASE("the residual is the worst contact's: its map over impulse, velocity after or velocity before", "[ncp]") {
  const Posed posed = points();
  const NcpProblem problem = posed.view();
  NcpMeasure measure;
  std::vector<double> v, u;
  // What rounding makes of velocities a billion times as large is none of the next event's.
  Posed fast = points();
  for (double& of : fast.p.v_minus) of *= 1e9;
  const NcpProblem before = fast.view();
  measure.begin(before);
  measure.velocities(std::vector<double>(6, 0.0), v, u);
  CHECK(measure.residual(std::vector<double>(6, 0.0), u) > 0.1);
  measure.begin(problem);
  check_near(measure.q(), posed.p.v_minus);
  CHECK(measure.size_before() == Approx(std::sqrt(1.25 + 4 * 5)));
  const auto residual = [&](double r_1, double r_2) {
    measure.velocities(std::vector<double>{r_1, 0, 0, r_2, 0, 0}, v, u);
    check_near(u, {r_1 - 1, 0.5, 0, r_2 / 4 - 2, 0, 1});
    return measure.residual(std::vector<double>{r_1, 0, 0, r_2, 0, 0}, u);
  };
  CHECK(residual(1, 8) < 1e-15);
  // Half of what the first needs: 0.5 of its velocity before, sqrt(1.25).
  CHECK(residual(0.5, 8) == Approx(0.5 / std::sqrt(1.25)));
  // 12 in place of 8 on the second: 2 sqrt(J) of 6, which its impulse makes.
  CHECK(residual(1, 12) == Approx(4. / 12));
  CHECK(residual(0.99, 12) == Approx(4. / 12));
  // A pull makes the second approach at 4 m/s, 8 sqrt(J), where all velocities before were sqrt(21.25).
  CHECK(residual(1, -8) == Approx(8 / std::sqrt(21.25)));
  measure.velocities(std::vector<double>(6, 0.0), v, u);
  check_near(v, posed.p.v_minus);
}

TEST_CASE("each solver answers a sphere on a floor that moves: it sticks to it or slips over it", "[ncp]") {
  // About a point of its surface a solid sphere is 3.5 times as easily moved as by its middle.
  const double m = 4. / 3 * M_PI, W_n = 1 / m, W_t = 3.5 / m;
  for (const NcpSolverRow& row : ncp_solvers())
    for (const double mu : {0.9, 0.1}) {
      INFO(row.name << ", mu " << mu);
      ContactProblem p = sphere({1, -2, 0.5}, {0, 0, 0}, mu);
      p.offset = {-0.5, 3, -0.25};
      const double q_n = -2.5, q_1 = 4, q_2 = -0.75;  // n = y, t1 = x, t2 = -z
      const Posed posed(p);
      const NcpSolution answer = posed.solve(row.name);
      CHECK(answer.status == NcpStatus::solved);
      CHECK(answer.reason.empty());
      CHECK(answer.residual <= 1e-10);
      const double r_n = -q_n / W_n, stick = std::hypot(q_1, q_2) / W_t, share = std::min(1.0, mu * r_n / stick);
      CHECK(answer.r[0] == Approx(r_n).epsilon(1e-9));
      CHECK(answer.r[1] == Approx(-share * q_1 / W_t).epsilon(1e-9));
      CHECK(answer.r[2] == Approx(-share * q_2 / W_t).epsilon(1e-9));
      CHECK((share < 1) == (mu == 0.1));
      CHECK(answer.u[0] == Approx(0).margin(1e-9));
      CHECK(answer.u[1] == Approx((1 - share) * q_1).margin(1e-9));
      CHECK(answer.u[2] == Approx((1 - share) * q_2).margin(1e-9));
    }
}

TEST_CASE("Gauss and Seidel go as far towards a contact's answer as relaxation says, sweep after sweep", "[ncp]") {
  const Posed posed(sphere({1, -2, 0}, {0, 0, 0}, 0.1));
  const std::vector<double> answer = posed.solve("nsgs").r;
  for (const char* solver : {"nsgs", "bisection"})
    for (const double relaxation : {0.5, 1.5})
      for (const int sweeps : {1, 2}) {
        INFO(solver << ' ' << relaxation << ' ' << sweeps);
        NcpOptions options;
        options.relaxation = relaxation;
        options.sweeps = sweeps;
        const NcpSolution got = posed.solve(solver, options);
        CHECK(got.status == NcpStatus::inaccurate);
        CHECK(got.reason == "the sweeps that were asked for are done");
        CHECK(got.iterations == sweeps);
        CHECK(got.r[0] == Approx((1 - std::pow(1 - relaxation, sweeps)) * answer[0]));
        CHECK(got.u[0] == Approx(-2 * std::pow(1 - relaxation, sweeps)));
      }
  // With a start that is the answer no sweep is needed, of whatever solver.
  for (const NcpSolverRow& row : ncp_solvers()) {
    INFO(row.name);
    const NcpSolution again = posed.solve(row.name, {}, answer);
    CHECK(again.status == NcpStatus::solved);
    CHECK(again.iterations <= (row.name == "newton" || row.name == "cascade" ? 2 : 0));
    check_near(again.r, answer);
  }
}

TEST_CASE("no solver of exact friction takes what is no number, and all leave finite impulses", "[ncp]") {
  for (const NcpSolverRow& row : ncp_solvers())
    for (const double bad : {std::nan(""), HUGE_VAL}) {
      INFO(row.name << ' ' << bad);
      ContactProblem p = stack(2, 0.5, {0.1, -1, 0});
      p.offset[4] = bad;
      const NcpSolution got = Posed(p).solve(row.name);
      CHECK(got.status == NcpStatus::not_finite);
      CHECK(got.reason.find("NaN or infinity in the problem") == 0);
      CHECK(got.r == std::vector<double>(24, 0.0));
      CHECK(got.u.size() == 24);
    }
  // A contact of no body.
  ContactProblem p = sphere({1, -2, 0}, {0, 0, 0});
  p.J.add_band();
  p.offset.insert(p.offset.end(), {-1, 0, 0});
  p.mu.push_back(0.5);
  p.restitution.push_back(0);
  for (const char* solver : {"nsgs", "bisection"}) {
    Posed posed(p);
    posed.weight[1] = 1;
    const NcpSolution got = posed.solve(solver);
    CHECK(got.status == NcpStatus::not_finite);
    CHECK(got.reason.find("a contact that no impulse moves") != std::string::npos);
  }
}

TEST_CASE("solvers and their endings have the names that users see", "[ncp]") {
  std::vector<std::string_view> names;
  for (const NcpSolverRow& row : ncp_solvers()) {
    names.push_back(row.name);
    CHECK(find_ncp_solver(row.name) == &row);
    CHECK_FALSE(row.summary.empty());
    CHECK_FALSE(row.source.empty());
  }
  CHECK(names == std::vector<std::string_view>{"newton", "nsgs", "bisection", "admm", "cascade"});
  CHECK(find_ncp_solver("Newton") == nullptr);
  const std::pair<NcpStatus, const char*> endings[] = {{NcpStatus::solved, "solved"},
                                                       {NcpStatus::inaccurate, "inaccurate"},
                                                       {NcpStatus::nonconverged, "nonconverged"},
                                                       {NcpStatus::singular, "singular"},
                                                       {NcpStatus::not_finite, "not_finite"}};
  for (const auto& [status, expected] : endings) CHECK(name(status) == expected);
  NcpSolution solution;
  solution.status = NcpStatus::solved;
  solution.reason = "none";
  solution.r = solution.u = {1};
  solution.iterations = 3;
  solution.residual = 2;
  solution.who = "guess";
  solution.clear();
  CHECK(solution.status == NcpStatus::nonconverged);
  CHECK(solution.reason.empty());
  CHECK(solution.r.empty());
  CHECK(solution.u.empty());
  CHECK(solution.iterations == 0);
  CHECK(solution.residual == 0);
  CHECK(solution.who.empty());
}

TEST_CASE("the interior point's error is the worse of its products and of what its equations miss") {
  // A point of 1 kg that comes at 1 m/s: from r = s = x the product is x^2, and s is off u = -1 + x by 1.
  ContactProblem p;
  p.M.block(p.M.add_block(3)).setIdentity();
  p.J.add_band();
  p.J.entry(p.J.add_entry(0, 3)).setIdentity();
  p.mu.push_back(0);
  p.restitution.push_back(0);
  p.v_minus = {-1, 0, 0};
  p.offset.assign(3, 0.0);
  const Posed of(p);
  const NcpProblem view = of.view();
  VelocitySystem system;
  system.prepare(of.p.M, of.p.J);
  NcpMeasure measure;
  measure.begin(view);
  for (const auto& [x, error] : {std::pair(0.1, 1.0), {100.0, 100.0}}) {
    InteriorSystem interior;
    InteriorSystem::Options options;
    options.start = x;
    interior.begin(options, view, system, measure, 1);
    CHECK(interior.mean() == Approx(x * x).epsilon(1e-14));
    CHECK(interior.misses()[0].x() == Approx(1).epsilon(1e-13));
    CHECK(interior.error() == Approx(error).epsilon(1e-13));
  }
}

TEST_CASE("Gauss and Seidel that come to no answer say whether they rest or were cut off", "[ncp]") {
  const Posed posed(sphere({1, -2, 0}, {0, 0, 0}, 0.1));
  NcpOptions options;
  options.relaxation = 1e-6;  // a hundredth of the way in all sweeps
  const NcpSolution cut = posed.solve("nsgs", options);
  CHECK(cut.status == NcpStatus::nonconverged);
  CHECK(cut.reason == "limit of sweeps");
  CHECK(cut.iterations == 10000);
  std::vector<double> half = posed.solve("nsgs").r;
  for (double& r : half) r *= 0.5;
  options.relaxation = 1e-15;
  const NcpSolution rests = posed.solve("nsgs", options, half);
  CHECK(rests.status == NcpStatus::nonconverged);
  CHECK(rests.reason == "a sweep changes nothing any more");
  CHECK(rests.iterations == 1);
  options.sweeps = 10;  // of which one is enough to see that
  const NcpSolution early = posed.solve("nsgs", options, half);
  CHECK(early.status == NcpStatus::nonconverged);
  CHECK(early.reason == "a sweep changes nothing any more");
  CHECK(early.iterations == 1);
}

TEST_CASE("Gauss and Seidel that take all impulses away in a sweep need no other", "[ncp]") {
  Posed parting = points();
  parting.p.v_minus = {1, 0.5, 0, 2, 0, 1};
  const std::vector<double> start{1, 0, 0, 4, 0, 0};
  const NcpSolution got = parting.solve("nsgs", {}, start);
  CHECK(got.status == NcpStatus::solved);
  CHECK(got.r == std::vector<double>(6, 0.0));
  CHECK(got.u == parting.p.v_minus);
  CHECK(got.iterations == 1);
}
