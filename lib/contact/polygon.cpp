#include "contact/polygon.h"

#include <algorithm>
#include <cmath>

namespace cb {

FrictionPolygon::FrictionPolygon(int edges) {
  for (int i = 0; i < edges; ++i) {
    const int opposite = i - edges / 2;
    double c = std::cos(2 * M_PI * i / edges), s = std::sin(2 * M_PI * i / edges);
    if (4 * i == edges) c = 0, s = 1;
    if (edges % 2 == 0 && opposite >= 0) c = -cosine[opposite], s = -sine[opposite];
    cosine.push_back(c);
    sine.push_back(s);
  }
}

double FrictionPolygon::least_slip_bound(const double* u) const {
  double lam = 0;
  for (std::size_t i = 0; i < cosine.size(); ++i) lam = std::max(lam, -(cosine[i] * u[1] + sine[i] * u[2]));
  return lam;
}

}  // namespace cb
