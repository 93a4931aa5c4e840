#pragma once

#include <Eigen/Core>
#include <cmath>
#include <span>

#include "cone/cone_program.h"

namespace cb {

/// The numbers at x, as a vector or a matrix.
inline Eigen::Map<Eigen::Vector3d> vec3(double* x) { return Eigen::Map<Eigen::Vector3d>(x); }
inline Eigen::Map<const Eigen::Vector3d> vec3(const double* x) { return Eigen::Map<const Eigen::Vector3d>(x); }
inline Eigen::Map<Eigen::Matrix3d> mat3(double* x) { return Eigen::Map<Eigen::Matrix3d>(x); }

/// Of a contact's three numbers n, t1, t2: |t|.
inline double tangential(const double* x) { return std::sqrt(x[1] * x[1] + x[2] * x[2]); }

/// Are these in the cone |t| <= mu n? With mu = 0 what pulls is not.
inline bool in_cone(const double* x, double mu) { return x[0] >= 0 && tangential(x) <= mu * x[0]; }

/// y += N^T x, x one number a band; N: the first rows of the bands of J.
void add_normals(const ConeProgram& program, std::span<const double> x, std::span<double> y);
/// x = N v, one number a band.
void normals(const ConeProgram& program, std::span<const double> v, std::span<double> x);
/// d . r, as the bound counts it.
double sum_of_shares(const ConeProgram& program, std::span<const double> r);

}  // namespace cb
