// Vertices and rays of a basis, judged on the original data.

#include "lcp/judge.h"

#include <algorithm>

namespace cb {

bool better(const Judgement& a, const Judgement& b, double tolerance) {
  const bool both = a.residual <= tolerance && b.residual <= tolerance;
  return both ? a.beyond_rounding < b.beyond_rounding : a.residual < b.residual;
}

Judgement PathJudge::vertex(Basis& basis, const ScaledLoad& load, Eigen::VectorXd& z) {
  const auto n = static_cast<int>(load.q.size());
  const auto& scales = load.scales;
  if (!basis.refresh()) return {};
  scratch_.resize(basis.padded());
  w_.resize(n);
  z_.resize(n);
  active_.clear();
  for (int i = 0; i < n; ++i)
    if (basis.is_basic(n + i)) active_.push_back(i);
  z.setZero(n);

  // M_aa z_a = -q_a through the inverse that the table holds; then residuals from the original M.
  double before = HUGE_VAL;
  for (const int i : active_) z_[i] = -load.original[i] * scales.rows[i];
  for (int step = 0;; ++step) {
    basis.solve_active(active_, z_.data(), scratch_.data());
    for (const int i : active_) z[i] += z_[i] * scales.columns[i];
    basis.multiply(z, w_);
    w_ += load.original;
    double worst = 0;
    for (const int i : active_) worst = std::max(worst, std::abs(z_[i] = -w_[i] * scales.rows[i]));
    if (step >= refinements || !(worst < 0.5 * before) || worst <= refined * load.size) break;
    before = worst;
  }

  bool clipped = false;
  for (const int i : active_)
    if (!(z[i] >= 0)) {
      z[i] = 0;
      clipped = true;
    }
  if (clipped) {
    basis.multiply(z, w_);
    w_ += load.original;
  }
  return judge(basis, load, z);
}

// Judges z, whose w = M z + q is in w_.
Judgement PathJudge::judge(Basis& basis, const ScaledLoad& load, const Eigen::VectorXd& z) {
  Judgement found = first_look(load, z);
  const double by_groups = std::max(found.beyond_rounding, overlap(load.of->groups, false));
  const bool in_doubt = by_groups > beyond_doubt || found.residual > natural_doubt;
  if (in_doubt && found.beyond_rounding < HUGE_VAL) {
    basis.magnitudes(z, product_);
    product_ += load.original.cwiseAbs();
    find_shared(basis, load, z);
    second_look(load, z, found);
  } else {
    found.residual = std::max(found.residual, by_groups);
  }
  return found;
}

// How far w_, of those that may not be negative, is below zero, as a fraction of what was before. Where it is asked
// for, what the data leave open is no error.
double PathJudge::overlap(const LcpGroups& groups, bool excused) const {
  double worst = 0;
  for (Eigen::Index i = 0; i < groups.before.size(); ++i) {
    if (!(w_[i] < 0)) continue;
    const double open = !excused ? 0 : groups.shares[i] ? shared_[groups.island[groups.of_pair[i]]] : open_[i];
    const double beyond = (-w_[i] - term_rounding * open) / groups.root[i];
    if (beyond > worst * groups.before[i]) worst = beyond / groups.before[i];  // nothing was before: infinite
  }
  return worst;
}

// What a group is about, what the data leave open of each row, and what of the rows of an island that share a unit.
void PathJudge::find_shared(Basis& basis, const ScaledLoad& load, const Eigen::VectorXd& z) {
  const LcpGroups& groups = load.of->groups;
  if (groups.of_pair.empty()) return;
  z_ = z;
  for (Eigen::Index i = 0; i < z.size(); ++i)
    if (groups.own[i]) z_[i] = 0;
  basis.magnitudes(z_, terms_);
  open_.setZero(z.size());
  if (groups.terms) groups.terms(open_);
  open_ = terms_ + open_.cwiseMax(load.original.cwiseAbs());
  terms_ += load.original.cwiseAbs();
  shared_.assign(groups.islands, 0.0);
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    double& shared = shared_[groups.island[groups.of_pair[i]]];
    if (groups.shares[i]) shared = std::max(shared, open_[i]);
  }
}

bool PathJudge::ray_holds(Basis& basis, const ScaledLoad& load, const Eigen::VectorXd& cover, int variable) {
  const auto n = static_cast<int>(load.q.size());
  const double* column = basis.column(variable);
  z_.setZero(n);
  w_.setZero(n);
  double artificial = 0, largest = 1;
  const auto put = [&](int v, double value) {
    largest = std::max(largest, std::abs(value));
    if (v == 2 * n)
      artificial = value;
    else if (v < n)
      w_[v] = value;
    else
      z_[v - n] = value * load.scales.columns[v - n];
  };
  for (int i = 0; i < n; ++i) put(basis.basic(i), column[i]);
  put(variable, 1);
  const double lowest = std::min({artificial, z_.minCoeff(), w_.minCoeff()});
  basis.multiply(z_, product_);
  double error = 0;
  for (int i = 0; i < n; ++i)
    error = std::max(error, std::abs(product_[i] * load.scales.rows[i] + cover[i] * artificial - w_[i]));
  return lowest >= -ray_tolerance * largest && error <= ray_tolerance * largest;
}

// Errors of z, whose w is in w_, as they stand.
Judgement PathJudge::first_look(const ScaledLoad& load, const Eigen::VectorXd& z) {
  const auto n = static_cast<int>(z.size());
  const LcpGroups& groups = load.of->groups;
  error_.resize(n);
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    error_[i] = std::abs(std::min(w_[i] / load.root[i], z[i] * load.root[i]));  // a NaN of w stays
    if (!(error_[i] < HUGE_VAL)) return {};
    worst = std::max(worst, error_[i]);
  }
  Judgement found{worst / load.judged, worst / load.judged};
  if (groups.of_pair.empty()) return found;
  size_ = groups.size;
  excused_.setZero(size_.size());
  for (int i = 0; i < n; ++i) {
    const double of_z = z[i] * groups.root[i];
    error_[i] = std::abs(std::min(of_z, w_[i] / groups.root[i]));
    double& size = size_[groups.of_pair[i]];
    size = std::max(size, of_z);
  }
  found.beyond_rounding = worst_of_groups(load);
  return found;
}

// The same without what rounding of the terms may be: first what a solver can do, then what the data leave open.
void PathJudge::second_look(const ScaledLoad& load, const Eigen::VectorXd& z, Judgement& found) {
  const LcpGroups& groups = load.of->groups;
  const bool grouped = !groups.of_pair.empty();
  const auto n = static_cast<int>(error_.size());
  for (int i = 0; i < n; ++i) {
    const double root = grouped ? groups.root[i] : load.root[i];
    error_[i] = std::max(0.0, error_[i] - round_off * product_[i] / root);
  }
  found.beyond_rounding = worst_of_groups(load);
  if (!grouped) return;
  found.residual = std::max(natural(load, z), overlap(groups, true));
  if (found.beyond_rounding <= beyond_doubt) {
    found.residual = std::max(found.residual, found.beyond_rounding);
    return;
  }
  excused_.setZero(size_.size());
  for (int i = 0; i < n; ++i) {
    const int group = groups.of_pair[i];
    const double root = groups.root[i];
    if (groups.shares[i]) {
      excused_[group] = term_rounding * shared_[groups.island[group]] / root;
      size_[group] = std::max(size_[group], terms_[i] / root);
    } else {
      const double more = std::max(0.0, term_rounding * open_[i] - round_off * product_[i]);
      error_[i] = std::max(0.0, error_[i] - more / root);
    }
  }
  found.residual = std::max(found.residual, worst_of_groups(load));
}

// The natural residual without what the data leave open.
double PathJudge::natural(const ScaledLoad& load, const Eigen::VectorXd& z) const {
  double worst = 0;
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const double error = std::abs(std::min(z[i] * load.root[i], w_[i] / load.root[i]));
    worst = std::max(worst, error - term_rounding * open_[i] / load.root[i]);
  }
  return worst / load.judged;
}

// Of error_ less what is excused of a group, over size_, or over all that the problem is about where it has no groups.
double PathJudge::worst_of_groups(const ScaledLoad& load) {
  const std::vector<int>& group = load.of->groups.of_pair;
  if (group.empty()) return error_.maxCoeff() / load.judged;
  squares_.setZero(size_.size());
  for (Eigen::Index i = 0; i < error_.size();) {
    const int g = group[i];
    double square = squares_[g];  // not through memory from pair to pair
    for (; i < error_.size() && group[i] == g; ++i) square += error_[i] * error_[i];
    squares_[g] = square;
  }
  double worst = 0;
  for (Eigen::Index g = 0; g < size_.size(); ++g) {
    const double error = std::sqrt(squares_[g]) - excused_[g];
    if (error > worst * size_[g]) worst = size_[g] > 0 ? error / size_[g] : HUGE_VAL;
  }
  return worst;
}

void set_own_cover(Basis& basis, const ScaledLoad& load, const std::vector<int>& active, const Eigen::VectorXd& p,
                   Eigen::VectorXd& p_z, Eigen::VectorXd& cover) {
  p_z.setZero(p.size());
  for (const int i : active) p_z[i] = p[i] * load.scales.columns[i];
  basis.multiply(p_z, cover);
  cover = p - cover.cwiseProduct(load.scales.rows);
  for (const int i : active) cover[i] -= p[i];
}

}  // namespace cb
