#include "output/tally.h"

#include <catch2/catch.hpp>
#include <limits>

#include "problems.h"

using namespace cb;

namespace {

/// What one event is made of, for RunTally.
struct Event {
  double t = 0;
  ContactProblem problem;
  ContactSolution solution;
  Residuals residuals;
  std::vector<double> v_plus;
  std::vector<ContactPoint> contacts;

  EventRecord record() const { return {t, problem, solution, residuals, v_plus, contacts}; }
};

Event with_contacts(int count) {
  Event event;
  test::add_body(event.problem, 1, {1, 1, 1}, {0, -1, 0});
  for (int c = 0; c < count; ++c)
    test::add_contact(event.problem, 0, {0.5 * c, -1, 0}, -1, {}, test::ground_axes(), 0.5);
  return event;
}

StepRecord record_at(long step, double t) {
  StepRecord record;
  record.step = step;
  record.t = t;
  return record;
}

}  // namespace

TEST_CASE("of events a tally counts those that do not hold, and keeps their largest gains and most contacts",
          "[output]") {
  RunTally tally;
  const auto see = [&](int contacts, double residual, double gain, double before, bool holds) {
    Event event = with_contacts(contacts);
    event.residuals.model = residual;
    event.residuals.energy_gain = gain;
    event.residuals.energy_before = before;
    tally.observe_event(event.record(), holds);
  };
  CHECK_FALSE(tally.gain_max.has_value());
  see(2, 1e-3, -5, 10, false);
  // Every event loses: the least loss, and the least fraction, which is another event's.
  see(5, 4e-3, -2, 2.5, true);
  CHECK(tally.gain_max == -2);
  CHECK(tally.gain_relative_max == -0.5);
  see(3, 2e-3, 0.5, 100, false);
  see(1, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1, false);
  see(1, 3e-3, 0.25, 0, true);  // from rest: no fraction
  CHECK(tally.inaccurate_events == 3);
  CHECK(tally.contacts_max == 5);
  CHECK(tally.gain_max == 0.5);
  CHECK(tally.gain_relative_max == 0.005);
  CHECK(*tally.residuals.median() == Approx(2.5e-3));  // of 1, 2, 3 and 4
  CHECK(tally.scaled_events == 0);
  CHECK_FALSE(tally.restitution_scale_min.has_value());
}

TEST_CASE("events whose restitution was scaled are counted, and the least that was left of it is kept", "[output]") {
  RunTally tally;
  for (const double scale : {1.0, 0.75, 0.25, 0.5, 1.0}) {
    Event event = with_contacts(1);
    event.solution.restitution_scale = scale;
    tally.observe_event(event.record(), true);
  }
  CHECK(tally.scaled_events == 3);
  CHECK(tally.restitution_scale_min == 0.25);
}

TEST_CASE("events of a try count once a step takes it, and those of one that is not taken never do", "[output]") {
  RunTally tally;
  const auto see = [&](double gain, bool trial) {
    Event event = with_contacts(2);
    event.residuals.model = 1e-3;
    event.residuals.energy_gain = gain;
    event.residuals.energy_before = 1;
    event.solution.restitution_scale = 0.5;
    EventRecord record = event.record();
    record.trial = trial;
    tally.observe_event(record, false);
  };
  see(1, false);  // an impact
  see(8, true);
  see(9, true);
  CHECK(tally.inaccurate_events == 1);
  CHECK(tally.gain_max == 1);
  CHECK(tally.scaled_events == 1);
  tally.forget_tried();
  see(2, true);
  tally.observe_step(record_at(1, 0.5), true);
  CHECK(tally.inaccurate_events == 2);
  CHECK(tally.gain_max == 2);
  CHECK(tally.gain_relative_max == 2);
  CHECK(tally.scaled_events == 2);
  see(3, true);
  tally.forget_tried();
  tally.observe_step(record_at(2, 1), true);
  CHECK(tally.inaccurate_events == 2);
  CHECK(tally.gain_max == 2);
}

TEST_CASE("a tally adds up all times and counts, and keeps the worst of each residual with the time of the first",
          "[output]") {
  RunTally tally;
  for (int n = 1; n <= 3; ++n) {
    StepRecord record = record_at(n, 0.5 * n);
    record.events = 2;
    record.contacts = 7;  // of both events: not one's
    record.solves = n;
    record.bounces_left_out = 10 * n;
    record.residual = n == 2 ? 0.5 : 0.25;
    record.claimed_residual = n == 1 ? 4 : 3;
    record.law_residual = n == 3 ? 6.0 : 5.0;
    record.infeasibility = n == 2 ? 8.0 : 7.0;
    record.gap = n == 1 ? 1.0 : n == 2 ? -2.0 : std::numeric_limits<double>::infinity();
    record.times = {1.0 * n, 10.0 * n, 100.0 * n, 1000.0 * n, 10000.0 * n};
    if (n == 2) record.penetration_displacement = 1;
    tally.observe_step(record, true);
  }
  CHECK(tally.steps == 3);
  CHECK(tally.t_reached == 1.5);
  CHECK(tally.events == 6);
  CHECK(tally.solves == 6);
  CHECK(tally.contacts_max == 0);
  CHECK(tally.bounces_left_out == 60);
  CHECK(tally.residual_max == 0.5);
  CHECK(tally.residual_max_t == 1);
  CHECK(tally.claimed_max == 4);
  CHECK(tally.law_max == 6);
  CHECK(tally.infeasibility_max == 8);
  CHECK(tally.gap_max == -2);
  CHECK(tally.penetration_removals == 1);
  CHECK(tally.times.dynamics_s == 6);
  CHECK(tally.times.collision_s == 60);
  CHECK(tally.times.assembly_s == 600);
  CHECK(tally.times.solve_s == 6000);
  CHECK(tally.times.step_s == 60000);
}

TEST_CASE("the worst condition met is kept with its time; problems of the same size are measured now and then",
          "[output]") {
  // A body of masses 1, 1, 4 along its contact's directions has W = diag(1, 1, 1/4): condition 4. Of 16: condition 16.
  const auto event = [](double t, double heavy) {
    Event met;
    met.t = t;
    met.problem.M.add_block(3);
    met.problem.M.block(0).diagonal() << 1, 1, heavy;
    met.problem.J.add_band();
    met.problem.J.entry(met.problem.J.add_entry(0, 3)).setIdentity();
    met.problem.v_minus.assign(3, 0.0);
    met.problem.offset.assign(3, 0.0);
    met.problem.mu = {0.5};
    met.problem.restitution = {0};
    return met;
  };
  RunTally tally;
  ConditioningEstimate estimate;
  tally.observe_conditioning(event(0.25, 4).record(), estimate);
  REQUIRE(tally.conditioning.has_value());
  CHECK(tally.conditioning->condition == Approx(4));
  CHECK(tally.conditioning->rank == 3);
  CHECK(tally.conditioning_t == 0.25);
  tally.observe_conditioning(event(0.5, 16).record(), estimate);  // the first of the same size
  CHECK(tally.conditioning->condition == Approx(16));
  CHECK(tally.conditioning_t == 0.5);
  for (int i = 0; i < 99; ++i) tally.observe_conditioning(event(0.75, 64).record(), estimate);
  CHECK(tally.measured_events == 2);
  tally.observe_conditioning(event(1, 9).record(), estimate);  // the hundredth after it
  CHECK(tally.measured_events == 3);
  CHECK(tally.conditioning->condition == Approx(16));
  CHECK(tally.conditioning_t == 0.5);
  // Another number of contacts, or of freedoms, is another problem; one beyond the estimate's limit is counted so.
  Event wider = event(1.25, 9);
  wider.problem.M.block(wider.problem.M.add_block(3)).setIdentity();
  wider.problem.v_minus.resize(6, 0.0);
  tally.observe_conditioning(wider.record(), estimate);
  CHECK(tally.measured_events == 4);
  tally.observe_conditioning(with_contacts(2).record(), estimate);
  tally.observe_conditioning(with_contacts(3).record(), estimate);
  CHECK(tally.measured_events == 6);
  CHECK(tally.too_large == 0);
  tally.observe_conditioning(with_contacts(501).record(), estimate);
  CHECK(tally.measured_events == 6);
  CHECK(tally.too_large == 1);
}
