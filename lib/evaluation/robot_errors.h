#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/measure.h"
#include "evaluation/no_slip_drive.h"

namespace cb {

/// How well a robot on two wheels drives its figure eight, against the same robot on wheels that never slip.
/// Cross-track errors count from 5 s on, when the start is over; slip and loads from the beginning.
class DriveErrors : public Measure {
 public:
  DriveErrors(const Scenario& scenario, const SimulationOptions& options, const WheeledRobot& robot);
  void observe_event(const EventRecord& event) override;
  void observe_step(const State& state, const StepRecord& record) override;
  void report(Values& out) const override;

 private:
  struct Mean {
    double sum2 = 0, largest = 0;
    long samples = 0;
    void add(double x);
    double rms() const;
  };
  WheeledRobot robot_;
  NoSlipDrive no_slip_;
  CrossTrack track_, no_slip_track_;
  std::vector<int> body_of_shape_;
  double duration_, step_, t_ = 0, last_distance_ = 0;
  Mean cross_, no_slip_cross_, from_no_slip_, along_[2], across_[2];  ///< m, m, m, m/s, m/s
  bool loads_known_;         ///< has each step its events? Extrapolated ones have none
  double load_[2] = {0, 0};  ///< N s, of this step: left, right
  double asymmetry_sum_ = 0, asymmetry_largest_ = 0;
  long steps_ = 0, loaded_steps_ = 0, unloaded_[2] = {0, 0};
};

/// How well two fingers hold a body: its motion in the fingers' frames, and the arm's on its wanted path.
class GraspErrors : public Measure {
 public:
  /// None where the scene is another: a computed_torque controller that closes two joints, and one free body.
  static std::optional<GraspErrors> of(const Scenario& scenario, const SimulationOptions& options);
  void observe_step(const State& state, const StepRecord& record) override;
  void report(Values& out) const override;

 private:
  GraspErrors() = default;
  struct InFinger {
    Vec3 p = Vec3::Zero();
    Quat q = Quat::Identity();
  };
  InFinger in_finger(const State& state, int finger) const;

  struct Tracked {
    double offset, amplitude, frequency, phase;
    int q;  ///< index into State::q
    double sum2 = 0, largest = 0;
  };
  std::vector<Tracked> tracked_;
  int finger_[2] = {-1, -1}, object_ = -1;  ///< indices into Model::bodies
  double size_ = 0, duration_ = 0, step_ = 0, t_ = 0;
  Halfway halfway_;
  InFinger start_[2], now_[2];
  std::optional<Vec3> half_[2];
  double creep_ = 0, creep_largest_ = 0, rotation_ = 0;
  std::optional<double> dropped_;
  long steps_ = 0;
};

}  // namespace cb
