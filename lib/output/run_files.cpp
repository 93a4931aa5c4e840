#include "output/run_files.h"

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

RunFiles::RunFiles(const std::filesystem::path& directory, const Model& model, long every) : every_(every) {
  const auto trajectory = directory / "trajectory.csv", steps = directory / "steps.csv";
  const auto joints = directory / "joints.csv";
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
}

int RunFiles::error() const {
  if (trajectory_ && !trajectory_->ok()) return trajectory_->error();
  if (joints_ && !joints_->ok()) return joints_->error();
  return steps_ ? steps_->error() : 0;
}

const std::string& RunFiles::failed_path() const {
  if (trajectory_ && !trajectory_->ok()) return trajectory_->path();
  return joints_ && !joints_->ok() ? joints_->path() : steps_->path();
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

void RunFiles::start(const State& state) {
  if (every_ > 0) {
    write_bodies(state);
    write_joints(state, {});
  }
  flush();
}

void RunFiles::step(const State& state, const StepRecord& record, std::span<const double> torque) {
  if (every_ == 0 || record.step % every_ != 0) return;
  write_bodies(state);
  write_joints(state, torque);
  last_step(record);
}

void RunFiles::last_step(const StepRecord& record) {
  if (steps_) steps_->end_row(print_step(steps_->begin_row(steps_row_room), record));
}

void RunFiles::flush() {
  if (trajectory_) trajectory_->flush();
  if (steps_) steps_->flush();
  if (joints_) joints_->flush();
}

}  // namespace cb
