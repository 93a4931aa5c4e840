#include "output/run_files.h"

#include <algorithm>

#include "output/number.h"

namespace cb {

char* print_step(char* out, const StepRecord& record) {
  const bool event = record.events > 0;
  const auto cell = [&](auto value) {
    out = print_number(out, value);
    *out++ = ',';
  };
  cell(record.step);
  cell(record.t);
  cell(record.events);
  cell(record.contacts);
  cell(record.size);
  cell(record.iterations);
  out = print_text(out, name(record.status));
  *out++ = ',';
  cell(event ? std::optional(record.claimed_residual) : std::nullopt);
  cell(event ? std::optional(record.residual) : std::nullopt);
  cell(record.law_residual);
  cell(record.gap);
  cell(record.infeasibility);
  cell(record.event_energy_gain);
  cell(record.max_penetration);
  cell(record.kinetic_energy);
  cell(record.potential_energy);
  cell(record.times.dynamics_s);
  cell(record.times.collision_s);
  cell(record.times.assembly_s);
  cell(record.times.solve_s);
  cell(record.times.step_s);
  out[-1] = '\n';
  return out;
}

RunFiles::RunFiles(const std::filesystem::path& directory, const Model& model, long every,
                   const std::vector<Shape>& shapes, double rotate_cone, bool to_accuracy)
    : every_(every), rotate_cone_(rotate_cone) {
  const auto trajectory = directory / "trajectory.csv", steps = directory / "steps.csv";
  const auto joints = directory / "joints.csv", loads = directory / "loads.csv", stepping = directory / "stepping.csv";
  std::error_code ignored;
  if (every_ > 0) {
    trajectory_.emplace(trajectory, trajectory_header);
    steps_.emplace(steps, steps_header);
    for (const Body& body : model.bodies) names_.push_back(',' + csv_cell(body.name) + ',');
    for (const Tree& tree : model.trees)
      for (const Joint& joint : tree.joints)
        if (joint.q >= 0)
          joint_rows_.push_back(
              {',' + csv_cell(joint.name) + ',', static_cast<std::size_t>(joint.q), static_cast<std::size_t>(joint.v)});
  } else {
    std::filesystem::remove(trajectory, ignored);
    std::filesystem::remove(steps, ignored);
  }
  if (joint_rows_.empty())
    std::filesystem::remove(joints, ignored);
  else
    joints_.emplace(joints, joints_header);
  if (every_ > 0 && to_accuracy)
    stepping_.emplace(stepping, stepping_header);
  else
    std::filesystem::remove(stepping, ignored);
  if (every_ > 0 && !model.trees.empty() && !shapes.empty()) {
    loads_file_.emplace(loads, loads_header);
    for (const Shape& shape : shapes) shape_names_.push_back(csv_cell(shape.name));
  } else {
    std::filesystem::remove(loads, ignored);
  }
}

int RunFiles::error() const {
  for (const auto* file : {&trajectory_, &joints_, &loads_file_, &stepping_})
    if (*file && !(*file)->ok()) return (*file)->error();
  return steps_ ? steps_->error() : 0;
}

const std::string& RunFiles::failed_path() const {
  for (const auto* file : {&trajectory_, &joints_, &loads_file_, &stepping_})
    if (*file && !(*file)->ok()) return (*file)->path();
  return steps_->path();
}

void RunFiles::write_bodies(const State& state) {
  char t[number_room];
  const std::string_view time(t, static_cast<std::size_t>(print_number(t, state.t) - t));
  for (std::size_t b = 0; b < names_.size(); ++b) {
    char* out = trajectory_->begin_row(names_[b].size() + 15 * number_room);
    const auto cell = [&](double value) {
      out = print_number(out, value);
      *out++ = ',';
    };
    out = print_text(print_text(out, time), names_[b]);
    const Pose& pose = state.pose[b];
    for (int i = 0; i < 3; ++i) cell(pose.p[i]);
    cell(pose.q.w());
    cell(pose.q.x());
    cell(pose.q.y());
    cell(pose.q.z());
    for (std::size_t i = 0; i < 6; ++i) cell(state.v[6 * b + i]);
    out[-1] = '\n';
    trajectory_->end_row(out);
  }
}

void RunFiles::write_joints(const State& state, std::span<const double> torque) {
  char t[number_room];
  const std::string_view time(t, static_cast<std::size_t>(print_number(t, state.t) - t));
  for (const JointRow& row : joint_rows_) {
    char* out = joints_->begin_row(row.name.size() + 4 * number_room + 4);
    out = print_text(print_text(out, time), row.name);
    out = print_number(out, state.q[row.q]);
    *out++ = ',';
    out = print_number(out, state.qd[row.v]);
    *out++ = ',';
    out = print_number(out, torque.empty() ? 0.0 : torque[row.v]);
    *out++ = '\n';
    joints_->end_row(out);
  }
}

void RunFiles::event(const EventRecord& event) {
  if (!loads_file_) return;
  for (std::size_t c = 0; c < event.contacts.size(); ++c) {
    const ContactPoint& contact = event.contacts[c];
    auto load = std::find_if(loads_.begin(), loads_.end(),
                             [&](const Load& l) { return l.a == contact.shape_a && l.b == contact.shape_b; });
    if (load == loads_.end()) {
      const std::string name = ',' + shape_names_[contact.shape_a] + ',' + shape_names_[contact.shape_b] + ',';
      load = loads_.insert(loads_.end(), {contact.shape_a, contact.shape_b, name});
    }
    const double* impulse = &event.solution.impulse[3 * c];
    Vec3 t1, t2;
    contact_tangents(contact, rotate_cone_, t1, t2);
    load->normal += impulse[0];
    load->friction += impulse[1] * t1 + impulse[2] * t2;
    load->met = true;
  }
}

void RunFiles::write_loads(double t) {
  for (Load& load : loads_) {
    if (!load.met) continue;
    char* out = loads_file_->begin_row(load.name.size() + 5 * number_room + 5);
    out = print_text(print_number(out, t), load.name);
    out = print_number(out, load.normal);
    for (int i = 0; i < 3; ++i) {
      *out++ = ',';
      out = print_number(out, load.friction[i]);
    }
    *out++ = '\n';
    loads_file_->end_row(out);
  }
}

void RunFiles::write_stepping(const StepRecord& record) {
  constexpr const char* kinds[] = {"macro", "switch", "first_order"};
  const AccuracyStep& taken = *record.accuracy;
  char* out = stepping_->begin_row(7 * number_room);
  const auto cell = [&](auto value) {
    out = print_number(out, value);
    *out++ = ',';
  };
  cell(record.step);
  cell(record.t);
  out = print_text(out, kinds[taken.kind]);
  *out++ = ',';
  cell(taken.impact ? 1 : 0);
  cell(taken.length);
  cell(taken.refused);
  cell(taken.estimate);
  out[-1] = '\n';
  stepping_->end_row(out);
}

void RunFiles::start(const State& state) {
  if (every_ > 0) {
    write_bodies(state);
    write_joints(state, {});
  }
  flush();
}

void RunFiles::step(const State& state, const StepRecord& record, std::span<const double> torque) {
  if (every_ > 0 && record.step % every_ == 0) {
    write_bodies(state);
    write_joints(state, torque);
    // No event says what presses while steps are extrapolated; what an impact before it does is no load of the step.
    if (!record.accuracy || record.accuracy->kind != AccuracyStep::macro) write_loads(state.t);
    last_step(record);
  }
  if (stepping_ && record.accuracy) write_stepping(record);
  for (Load& load : loads_) {
    load.normal = 0;
    load.friction.setZero();
    load.met = false;
  }
}

void RunFiles::last_step(const StepRecord& record) {
  if (steps_) steps_->end_row(print_step(steps_->begin_row(steps_row_room), record));
}

void RunFiles::flush() {
  if (trajectory_) trajectory_->flush();
  if (steps_) steps_->flush();
  if (joints_) joints_->flush();
  if (loads_file_) loads_file_->flush();
  if (stepping_) stepping_->flush();
}

}  // namespace cb
