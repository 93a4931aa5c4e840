#pragma once

#include <Eigen/Cholesky>
#include <functional>
#include <utility>
#include <vector>

#include "contact/assemble.h"
#include "contact/islands.h"
#include "scenario/scenario.h"
#include "simulation/least_displacement.h"

namespace cb {

/// Takes away what shapes interpenetrate at the end of a step: the first order of the step leaves it wherever a point
/// of contact moves along a surface within it (a rim that rolls, a corner that slides over an edge).
///
/// With N the normal rows of the points whose gap is small, the poses are displaced by the d least in d.M d with
///   N d >= -gap   for points that are open, or deeper than closed,
///   N d >= 0      for points that are closed,
/// linearised anew until no point is deeper than closed, with the points that were held in sight. The limits of joints
/// are such points too, and hold where they and shapes contradict each other. Kinetic energy stays as it is
/// (displacement.h); the potential energy changes by the weight times d. Where nothing overlaps nothing is called.
class Overlap {
 public:
  /// Pairs whose bounding boxes, widened by a margin in m, overlap at the present `motions`.
  using FindPairs = std::function<const std::vector<std::pair<int, int>>&(double margin)>;

  /// `motions`: per shape, brought up to date. `tolerance`, `radius`: per shape, m: closed gap and reach from the
  /// centre of mass. `limit_tolerance`: rad or m, of joints. `depth`: m, the deepest overlap. Returns the furthest that
  /// a point of a body was moved, over all rounds, m.
  double remove(const Scenario& scenario, const std::vector<double>& tolerance, double limit_tolerance,
                const std::vector<double>& radius, double depth, const FindPairs& find_pairs,
                std::vector<Motion>& motions, State& state);

 private:
  double find_points(const Scenario& scenario, const std::vector<Motion>& motions, const std::vector<double>& tolerance,
                     const std::vector<std::pair<int, int>>& pairs, double reach);
  void recall(const Scenario& scenario, const std::vector<Motion>& motions, const std::vector<double>& tolerance,
              double reach);
  void remember(const Scenario& scenario, const std::vector<Motion>& motions);
  void add_limits(const Scenario& scenario, double tolerance, const State& state);
  void prepare(const Scenario& scenario, const State& state);
  void solve(int island);
  bool exchange_sets(std::span<const int> island);
  bool solve_working_set();
  void add_to_displacement(int c, double lambda);
  double opened(int c) const;
  double move(const Scenario& scenario, const std::vector<double>& radius, const std::vector<Motion>& motions,
              State& state);

  struct MaterialPoint {  // of both shapes
    int shape_a, shape_b;
    Vec3 on_a, on_b;  // in the frames of the shapes, m
    Vec3 normal;      // as it was found, world
  };
  std::vector<ContactPoint> points_;
  std::vector<MaterialPoint> earlier_;  // held in an earlier round, by pairs
  std::vector<LimitContact> limits_;    // rows after those of points_, and points in what follows
  std::vector<double> wanted_;          // per point: least N d, m
  std::vector<double> slack_;           // per point: what of it may be missed, m

  Assembler assembler_;
  ContactProblem problem_;
  std::vector<BlockOwner> owners_;
  std::vector<double> zeros_;
  Islands islands_;
  Groups of_island_, blocks_of_;  // points and blocks, per island
  LeastDisplacement least_;
  bool large_ = false;  // was it needed?
  BlockCholesky factor_;
  std::vector<double> row_, moved_;  // entries of N, and of N M^-1, as problem_.J's without tangents
  std::vector<double> scale_;        // per point: 1 / sqrt(N M^-1 N^T)
  std::vector<int> block_;           // per body that is free: its block; or whether it is a link that moves
  std::vector<char> in_;             // per point: is it held?
  std::vector<int> working_;         // those that are
  Eigen::MatrixXd G_;
  Eigen::VectorXd lambda_, d_;
  Eigen::LLT<Eigen::MatrixXd> llt_;
};

}  // namespace cb
