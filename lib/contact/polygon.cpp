#include "contact/polygon.h"

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

}  // namespace cb
