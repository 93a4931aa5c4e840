#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace cb {

/// A number of about 32 digits as the unevaluated sum of two doubles, |low| at most half an ulp of |high|: for small
/// systems whose condition leaves nothing of a double. Errors of +, -, * and / are a few 2^-104 of the result.
/// Source: T. J. Dekker, A floating-point technique for extending the available precision, Numerische Mathematik 18,
/// 1971; Y. Hida, X. Li, D. Bailey, Algorithms for quad-double precision floating point arithmetic, ARITH-15, 2001.
/// The build contracts no a * b + c, which these sums would not survive.
struct DoubleDouble {
  double high = 0, low = 0;

  DoubleDouble() = default;
  DoubleDouble(double x) : high(x) {}  // NOLINT(google-explicit-constructor): every double is one
  DoubleDouble(double a, double b) : high(a), low(b) {}
  explicit operator double() const { return high + low; }

  /// a + b exactly; the second where |a| >= |b|.
  static DoubleDouble sum(double a, double b) {
    const double s = a + b, t = s - a;
    return {s, (a - (s - t)) + (b - t)};
  }
  static DoubleDouble ordered_sum(double a, double b) {
    const double s = a + b;
    return {s, b - (s - a)};
  }
  /// a b exactly.
  static DoubleDouble product(double a, double b) {
    const double p = a * b;
    return {p, __builtin_fma(a, b, -p)};
  }

  DoubleDouble operator-() const { return {-high, -low}; }
  friend DoubleDouble operator+(const DoubleDouble& x, const DoubleDouble& y) {
    const DoubleDouble s = sum(x.high, y.high), t = sum(x.low, y.low);
    const DoubleDouble u = ordered_sum(s.high, s.low + t.high);
    return ordered_sum(u.high, u.low + t.low);
  }
  friend DoubleDouble operator-(const DoubleDouble& x, const DoubleDouble& y) { return x + (-y); }
  friend DoubleDouble operator*(const DoubleDouble& x, const DoubleDouble& y) {
    const DoubleDouble p = product(x.high, y.high);
    return ordered_sum(p.high, p.low + (x.high * y.low + x.low * y.high));
  }
  friend DoubleDouble operator/(const DoubleDouble& x, const DoubleDouble& y) {
    const double q = x.high / y.high;
    if (!std::isfinite(q) || y.high == 0) return q;
    const DoubleDouble left = x - y * DoubleDouble(q);
    const double more = left.high / y.high;
    const DoubleDouble rest = left - y * DoubleDouble(more);
    return sum(q, more) + DoubleDouble(rest.high / y.high);
  }
  DoubleDouble& operator+=(const DoubleDouble& y) { return *this = *this + y; }
  DoubleDouble& operator-=(const DoubleDouble& y) { return *this = *this - y; }
  DoubleDouble& operator*=(const DoubleDouble& y) { return *this = *this * y; }
  DoubleDouble& operator/=(const DoubleDouble& y) { return *this = *this / y; }

  friend bool operator==(const DoubleDouble& x, const DoubleDouble& y) { return x.high == y.high && x.low == y.low; }
  friend bool operator<(const DoubleDouble& x, const DoubleDouble& y) {
    return x.high < y.high || (x.high == y.high && x.low < y.low);
  }
  friend bool operator>(const DoubleDouble& x, const DoubleDouble& y) { return y < x; }
  friend bool operator<=(const DoubleDouble& x, const DoubleDouble& y) {
    return x.high < y.high || (x.high == y.high && x.low <= y.low);
  }
  friend bool operator>=(const DoubleDouble& x, const DoubleDouble& y) { return y <= x; }

  friend DoubleDouble sqrt(const DoubleDouble& x) {
    const double root = std::sqrt(x.high);
    if (!(root > 0) || !std::isfinite(root)) return root;
    const DoubleDouble left = x - product(root, root);
    return ordered_sum(root, left.high / (2 * root));
  }
  friend DoubleDouble pow(const DoubleDouble& x, int n) {
    DoubleDouble power = 1;
    for (int i = 0; i < n; ++i) power *= x;
    return power;
  }
  friend DoubleDouble abs(const DoubleDouble& x) { return x.high < 0 ? -x : x; }
  friend bool isfinite(const DoubleDouble& x) { return std::isfinite(x.high); }
};

}  // namespace cb

template <>
class std::numeric_limits<cb::DoubleDouble> : public std::numeric_limits<double> {
 public:
  static cb::DoubleDouble infinity() { return std::numeric_limits<double>::infinity(); }
  static cb::DoubleDouble epsilon() { return 0x1p-104; }
  static cb::DoubleDouble min() { return std::numeric_limits<double>::min(); }
  static cb::DoubleDouble max() { return std::numeric_limits<double>::max(); }
  static cb::DoubleDouble lowest() { return std::numeric_limits<double>::lowest(); }
  static constexpr int digits = 104, digits10 = 31;
};

template <>
struct Eigen::NumTraits<cb::DoubleDouble> : Eigen::GenericNumTraits<cb::DoubleDouble> {
  using Real = cb::DoubleDouble;
  using NonInteger = cb::DoubleDouble;
  using Nested = cb::DoubleDouble;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 2,
    AddCost = 20,
    MulCost = 10
  };
  static Real epsilon() { return 0x1p-104; }
  static Real dummy_precision() { return 1e-28; }
  static int digits10() { return 31; }
};

template <class Operation>
struct Eigen::ScalarBinaryOpTraits<double, cb::DoubleDouble, Operation> {
  using ReturnType = cb::DoubleDouble;
};
template <class Operation>
struct Eigen::ScalarBinaryOpTraits<cb::DoubleDouble, double, Operation> {
  using ReturnType = cb::DoubleDouble;
};
