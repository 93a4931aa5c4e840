#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "output/row_file.h"
#include "simulation/simulation.h"

namespace cb {

/// Header rows of the files of a run (docs/interface.md), line break included; fixed once published.
inline constexpr std::string_view trajectory_header = "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";
inline constexpr std::string_view steps_header =
    "step,t,events,contacts,size,iterations,status,claimed_residual,residual,law_residual,gap,infeasibility,"
    "event_energy_gain,max_penetration,kinetic_energy,potential_energy,dynamics_s,collision_s,assembly_s,solve_s,"
    "step_s\n";

inline constexpr std::string_view stepping_header = "step,t,kind,impact,length,refused,estimate\n";
inline constexpr std::string_view joints_header = "t,joint,q,qd,tau\n";
inline constexpr std::string_view loads_header = "t,a,b,normal,friction_x,friction_y,friction_z\n";

/// One row of steps.csv, line break included; `out` needs `steps_row_room`. Residuals of a step without an event are
/// empty cells.
char* print_step(char* out, const StepRecord& record);
inline constexpr std::size_t steps_row_room = 22 * 32;

/// trajectory.csv and steps.csv of one run, and where the model has robots joints.csv (joints that move) and loads.csv
/// (what the shapes that collide bear in a step); of
/// stepping to an accuracy stepping.csv, every step. Does not allocate after the first contact of a pair.
class RunFiles {
 public:
  /// Empties or creates the files in `directory`; `every` = 0 leaves all out and removes those of an earlier run.
  /// `shapes`, `rotate_cone`: of the scenario, for loads.csv. `to_accuracy`: are there rows for stepping.csv?
  RunFiles(const std::filesystem::path& directory, const Model& model, long every,
           const std::vector<Shape>& shapes = {}, double rotate_cone = 0, bool to_accuracy = false);

  bool ok() const { return error() == 0; }
  /// errno of the first failure, 0 where there is none.
  int error() const;
  /// The file that failed first.
  const std::string& failed_path() const;

  /// Bodies and joints at t = 0.
  void start(const State& state);
  /// An event: its impulses count in the loads of the step that it is part of.
  void event(const EventRecord& event);
  /// A step that was completed: rows for each `every`-th. `torque`: of the motors in that step, indexed as State::qd.
  void step(const State& state, const StepRecord& record, std::span<const double> torque = {});
  /// A step that ended the run: its row of steps.csv, whatever `every` is. Its state is not the end of a step and is
  /// left out.
  void last_step(const StepRecord& record);
  /// Whole rows to the disk, where a killed run leaves them.
  void flush();

 private:
  void write_bodies(const State& state);
  void write_joints(const State& state, std::span<const double> torque);
  void write_loads(double t);
  void write_stepping(const StepRecord& record);

  long every_;
  double rotate_cone_;              // rad, turns the contacts' tangents
  std::vector<std::string> names_;  // per body, as a cell between commas
  /// A revolute or prismatic joint: its name as a cell between commas, and where it is in q and qd.
  struct JointRow {
    std::string name;
    std::size_t q, v;
  };
  std::vector<JointRow> joint_rows_;
  /// Impulses on shape a from shape b in the present step, N s, world axes.
  struct Load {
    int a, b;
    std::string name;  // "a,b" as cells between commas
    double normal = 0;
    Vec3 friction = Vec3::Zero();
    bool met = false;  // was there a contact in an event of this step?
  };
  std::vector<Load> loads_;  // in the order in which the pairs first met
  std::vector<std::string> shape_names_;
  std::optional<RowFile> trajectory_, steps_, joints_, loads_file_, stepping_;
};

}  // namespace cb
