#pragma once

// The tableau of Dormand and Prince's embedded method of order 5(4), J. Comput. Appl. Math. 6 (1980): what is made of
// the slopes k1, k2, ... of its stages. T: a number or a vector of Eigen. Stage 7 is at the end of the step, and the
// next one's first.

namespace cb::dormand_prince {

/// Places of stages 2 to 5 within the step; 6 and 7 are at its end.
inline constexpr double c2 = 1.0 / 5, c3 = 3.0 / 10, c4 = 4.0 / 5, c5 = 8.0 / 9;

/// Mean slopes from the start of the step to stages 2 to 6.
template <class T>
T second(const T& k1) {
  return 1.0 / 5 * k1;
}
template <class T>
T third(const T& k1, const T& k2) {
  return 3.0 / 40 * k1 + 9.0 / 40 * k2;
}
template <class T>
T fourth(const T& k1, const T& k2, const T& k3) {
  return 44.0 / 45 * k1 - 56.0 / 15 * k2 + 32.0 / 9 * k3;
}
template <class T>
T fifth(const T& k1, const T& k2, const T& k3, const T& k4) {
  return 19372.0 / 6561 * k1 - 25360.0 / 2187 * k2 + 64448.0 / 6561 * k3 - 212.0 / 729 * k4;
}
template <class T>
T sixth(const T& k1, const T& k2, const T& k3, const T& k4, const T& k5) {
  return 9017.0 / 3168 * k1 - 355.0 / 33 * k2 + 46732.0 / 5247 * k3 + 49.0 / 176 * k4 - 5103.0 / 18656 * k5;
}
/// Over the whole step, of order 5.
template <class T>
T whole(const T& k1, const T& k3, const T& k4, const T& k5, const T& k6) {
  return 35.0 / 384 * k1 + 500.0 / 1113 * k3 + 125.0 / 192 * k4 - 2187.0 / 6784 * k5 + 11.0 / 84 * k6;
}
/// The same less that of order 4: the local error over the step's length.
template <class T>
T error(const T& k1, const T& k3, const T& k4, const T& k5, const T& k6, const T& k7) {
  return 71.0 / 57600 * k1 - 71.0 / 16695 * k3 + 71.0 / 1920 * k4 - 17253.0 / 339200 * k5 + 22.0 / 525 * k6 -
         1.0 / 40 * k7;
}

}  // namespace cb::dormand_prince
