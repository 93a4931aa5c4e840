// One step of size h from t = n h, in which every contact is met when it comes:
//   1. velocities from the forces at the start, explicit Euler
//   2. contacts at the present configuration; if any approaches, one event with all of the islands in which one does
//      (event_islands.h)
//   3. positions with the new velocity up to the first time of contact of a feature that was open, or the step's end;
//      links that whirl, and free bodies that whirl on what they touch, in pieces on which gaps hardly change
//   4. at a time of contact, or where a piece ends and what overlaps is taken away: 2 again
//   5. at the end: what overlaps is taken away (overlap.h); the contacts found there are the next step's first
#include "simulation/stepping/events.h"

#include <algorithm>

#include "linalg/stop.h"

namespace cb {

bool step_by_events(BaseStep& base, double h) {
  base.kick(h);
  double remaining = h;
  bool arrived = false, pieces = false, whole = true;  // has a time of contact split this step? has what whirls?
  while (base.going_on()) {
    poll_stop();
    base.look(remaining);
    const bool event = base.approaching();
    if (event && !base.event(arrived ? remaining : 0)) break;
    if (event && base.rests()) {
      base.wait();
      return whole;
    }
    const double piece = std::min(remaining, base.longest_move());
    pieces = pieces || piece < remaining;
    const double dt = base.until_contact(piece, arrived && !pieces, event);
    base.move(dt);
    remaining -= dt;
    arrived = dt < piece;
    whole = whole && !arrived;
    if (remaining <= 0 || (arrived && !base.arrive(dt))) break;
    base.find_contacts();
    if (!arrived) base.part();
  }
  if (base.going_on()) base.settle();
  return whole;
}

}  // namespace cb
