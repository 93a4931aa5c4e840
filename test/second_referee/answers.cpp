// Problems, answers, and what the first referee finds of them: a line of JSON each, for a second referee to judge
// (second_referee.py).
//
//   second_referee_answers stored FILE...          every method's answer to stored problems
//   second_referee_answers random COUNT SEED       answers to random problems, right ones and wrong ones
//   second_referee_answers run SCENE METHOD STEPS  every event of a run
//
// A problem is a line of its own; answers are about the last one. What is not finite is null.

#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "contact/problem_files.h"
#include "contact/referee.h"
#include "methods/registry.h"
#include "problems.h"
#include "simulation/simulation.h"

using namespace cb;
using nlohmann::json;

namespace {

constexpr double accepted_residual = 1e-9;

void print(const json& line) { std::puts(line.dump().c_str()); }

json number(const std::optional<double>& x) { return x ? json(*x) : json("none"); }

void print(const std::string& name, const ContactProblem& p) {
  json blocks = json::array(), entries = json::array();
  for (int b = 0; b < p.M.blocks(); ++b) {
    const Eigen::MatrixXd block = p.M.block(b);
    blocks.push_back(std::vector<double>(block.data(), block.data() + block.size()));
  }
  for (int c = 0; c < p.nc(); ++c)
    for (int e = p.J.band[c]; e < p.J.band[c + 1]; ++e) {
      const Eigen::MatrixXd entry = p.J.entry(e);
      entries.push_back({{"contact", c},
                         {"block", p.J.block[e]},
                         {"columns", std::vector<double>(entry.data(), entry.data() + entry.size())}});
    }
  print(json{{"problem", name},
             {"M", blocks},
             {"J", entries},
             {"v", p.v_minus},
             {"w", p.offset},
             {"mu", p.mu},
             {"e", p.restitution}});
}

std::string_view law_name(const Law& law) {
  for (const MethodRow& row : methods())
    if (row.law == law) return row.name;
  return "";
}

void print(const std::string& name, const ContactSolution& s, const Law& law, const Residuals& out) {
  const auto& polygon = s.as<PolygonWitness>();
  const auto& work = s.as<WorkWitness>();
  const auto& proof = s.as<ConvexWitness>();
  const Softness& soft = s.as<SoftWitness>().softness;
  print(json{{"answer", name},
             {"law", law_name(law)},
             {"r", s.impulse},
             {"k", polygon.k},
             {"z", polygon.z},
             {"compression", work.compression},
             {"restitution", work.restitution},
             {"friction", work.friction},
             {"bounded", proof.bounded},
             {"eta", proof.eta},
             {"f", proof.frictionless},
             {"kappa_dual", proof.kappa_dual},
             {"epsilon", proof.epsilon},
             {"softness",
              {{"rule", soft.rule == Softness::Rule::sap ? "sap" : "mujoco"},
               {"beta", soft.beta},
               {"sigma", soft.sigma},
               {"compliance", soft.compliance},
               {"impedance", soft.impedance},
               {"impratio", soft.impratio}}},
             {"first",
              {{"holds", Referee::holds(out, accepted_residual)},
               {"finite", out.finite},
               {"model", out.model},
               {"law", number(out.law)},
               {"gap", number(out.gap)},
               {"infeasibility", number(out.infeasibility)},
               {"island_gap", out.island_gap},
               {"allowed_gap", out.allowed_gap},
               {"approach", out.approach},
               {"cone_violation", out.cone_violation},
               {"dissipation_gap", out.dissipation_gap},
               {"energy_gain", out.energy_gain},
               {"energy_before", out.energy_before}}}});
}

struct Asked {
  std::string name;
  Law law;
  ContactMethod solve;
};
std::vector<Asked> all_methods() {
  std::vector<Asked> out;
  for (const MethodRow& row : methods()) {
    MethodOptions options;
    out.push_back({std::string(row.name), row.law, row.make(options)});
    if (row.law == convex_law()) {
      options.compression_bound = false;
      out.push_back({std::string(row.name) + " without the bound", row.law, row.make(options)});
      options.epsilon_relative = 1e-14;
      out.push_back({std::string(row.name) + " to a fraction of the energy", row.law, row.make(options)});
    } else if (row.law == soft_law()) {
      options.variant = "mujoco";
      out.push_back({std::string(row.name) + " mujoco", row.law, row.make(options)});
      options.variant = "sap";
      options.beta = 0;
      options.sigma = 0.1;
      options.compliance = 0.01;
      out.push_back({std::string(row.name) + " of one compliance", row.law, row.make(options)});
    }
  }
  return out;
}

void judge(const std::string& name, const ContactProblem& p, const ContactSolution& s, const Law& law) {
  std::vector<double> v_plus;
  print(name, s, law, Referee().check(p, s, law, v_plus));
}

/// Contacts up to which `newton` and `mirtich`, whose cost grows fastest, are asked.
constexpr int few = 20;

void stored(int count, char** files) {
  const std::vector<Asked> asked = all_methods();
  for (int i = 0; i < count; ++i) {
    ContactProblem p;
    try {
      p = read_contact_problem(files[i]).problem;
    } catch (const FileError&) {
      continue;  // a linear complementarity problem, or one that is broken on purpose
    }
    print(files[i], p);
    for (const Asked& method : asked) {
      if (p.nc() > few && (method.law == newton_law() || method.law == mirtich_law())) continue;
      ContactSolution s;
      method.solve(p, s);
      judge(method.name, p, s, method.law);
    }
  }
}

/// One to five bodies that touch each other and the world, some of them fast, and a joint at its limit now and then.
ContactProblem random_problem(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1), both(-1, 1);
  const auto direction = [&] { return Eigen::Vector3d(both(random), both(random), both(random)).normalized(); };
  ContactProblem p;
  const int bodies = 1 + static_cast<int>(random() % 5), contacts = 1 + static_cast<int>(random() % 6);
  const double decades = 3 * unit(random);
  const double speed = random() % 3 == 0 ? std::pow(10, 6 * unit(random)) : 0;
  const Eigen::Vector3d common = speed * direction();
  const int elastic = static_cast<int>(random() % 4);  // no contact, no contact, one in two, all
  const auto restitution = [&] {
    const double e = unit(random);
    return elastic == 3 || (elastic == 2 && random() % 2 == 0) ? e : 0;
  };
  for (int b = 0; b < bodies; ++b) {
    const double mass = std::pow(10, decades * both(random));
    test::add_body(p, mass, mass * Eigen::Vector3d(0.1 + unit(random), 0.1 + unit(random), 0.1 + unit(random)),
                   common + direction(), direction());
  }
  const double mus[] = {0, 0.1, 0.5, 2};
  for (int c = 0; c < contacts; ++c) {
    const int a = static_cast<int>(random() % bodies), other = static_cast<int>(random() % (bodies + 1)) - 1;
    const Eigen::Vector3d n = direction(), t = n.unitOrthogonal();
    Eigen::Matrix3d axes;
    axes << n.transpose(), t.transpose(), n.cross(t).transpose();
    test::add_contact(p, a, direction(), other == a ? -1 : other, direction(), axes, mus[random() % 4], restitution());
  }
  if (random() % 8 == 0)
    for (double& w : p.offset) w = 0.1 * both(random);
  if (random() % 6 == 0) {  // a joint of its own tree that meets its stop
    const int b = p.M.add_block(1);
    p.M.block(b)(0, 0) = 0.1 + unit(random);
    p.v_minus.push_back(-unit(random));
    p.J.add_band();
    p.J.entry(p.J.add_entry(b, 1))(0, 0) = 1;
    p.offset.insert(p.offset.end(), 3, 0.0);
    p.mu.push_back(0);
    p.restitution.push_back(restitution());
  }
  return p;
}

/// One number of the answer, or three, wrong by 1e-13 to 1 of the largest beside it.
void spoil(ContactSolution& s, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1), both(-1, 1);
  std::vector<std::vector<double>*> there;
  const auto add = [&](std::vector<double>& part) {
    if (!part.empty()) there.push_back(&part);
  };
  add(s.impulse);
  if (auto* polygon = std::get_if<PolygonWitness>(&s.witness)) add(polygon->z);
  if (auto* work = std::get_if<WorkWitness>(&s.witness))
    for (auto* part : {&work->compression, &work->restitution, &work->friction}) add(*part);
  if (auto* proof = std::get_if<ConvexWitness>(&s.witness))
    for (auto* part : {&proof->eta, &proof->frictionless, &proof->kappa_dual}) add(*part);
  for (int times = random() % 2 == 0 ? 1 : 3; times > 0; --times) {
    std::vector<double>& part = *there[random() % there.size()];
    double largest = 0;
    for (const double x : part) largest = std::max(largest, std::abs(x));
    if (largest == 0) largest = 1;
    part[random() % part.size()] += std::pow(10, -13 * unit(random)) * both(random) * largest;
  }
  if (random() % 50 == 0) s.impulse[0] = std::nan("");
}

void random_answers(int count, unsigned seed) {
  const std::vector<Asked> asked = all_methods();
  std::mt19937_64 random(seed);
  for (int made = 0; made < count;) {
    const ContactProblem p = random_problem(random);
    print("random " + std::to_string(made), p);
    for (const Asked& method : asked) {
      ContactSolution s;
      method.solve(p, s);
      judge(method.name, p, s, method.law);
      ++made;
      if (static_cast<int>(s.impulse.size()) != 3 * p.nc()) continue;
      spoil(s, random);
      judge(method.name + ", spoiled", p, s, method.law);
      ++made;
    }
  }
}

void run(const std::string& scene, const std::string& method, long steps) {
  const Scenario scenario = load_scenario(scene, {});
  const MethodRow& row = *find_method(method);
  SimulationOptions options;
  options.step = scenario.step;
  Simulation simulation(scenario, options, row.make({}), row.law);
  simulation.on_event = [&](const EventRecord& event) {
    const std::string name = scene + ", " + method + " at " + std::to_string(event.t) + " s";
    print(name, event.problem);
    print(name, event.solution, row.law, event.residuals);
  };
  for (long i = 0; i < steps; ++i) simulation.step();
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 2 ? argv[1] : "";
  if (what == "stored")
    stored(argc - 2, argv + 2);
  else if (what == "random" && argc == 4)
    random_answers(std::stoi(argv[2]), static_cast<unsigned>(std::stoul(argv[3])));
  else if (what == "run" && argc == 5)
    run(argv[2], argv[3], std::stol(argv[4]));
  else
    return 2;
  return 0;
}
