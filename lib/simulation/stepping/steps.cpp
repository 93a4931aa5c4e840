// Time stepping: one problem a step, whatever meets within it (docs/stepping.md).
//
// Problem: from the poses at the start of a step h (s), velocities after its forces, and all points that touch or can
// come to touch within it, with gaps g (m); find v+ of the contact model with u = J v + w and w_n = g / h for an open
// point, so that u_n >= 0 says that the gap, taken as linear in the velocity, is not negative at the end of the step.
// Poses move by h v+. Source: Stewart and Trinkle, Int. J. Numer. Meth. Engng 39 (1996) 2673; Anitescu and Potra,
// Nonlinear Dynamics 14 (1997) 231. Differences from the source:
//   1. Points that touch have w_n = 0, however their gap is rounded; what overlaps at the end is taken away as in
//      stepping by events (overlap.h).
//   2. Restitution: a point of a pair with e > 0 whose gap would close within the step counts as touching, w_n = 0, so
//      that u_n+ >= -e u_n- holds for the speed with which it comes. It parts by up to h u_n- early. Others have
//      nothing to part with but what laws of Poisson's give back of the impulse that closes them.
//   3. "Can come to touch" is asked of the velocities before the event, and again of those after it: where impulses
//      send something further, through points that were not looked ahead at, the problem is solved again with these.
// When it fails: points that are looked ahead at are linear in the step. What turns far in one meets other points: it
// overlaps at the end, up to the penetration limit, and is moved apart there.
#include "simulation/stepping/steps.h"

#include "linalg/stop.h"

namespace cb {

void step_by_steps(BaseStep& base, double h) {
  poll_stop();
  base.kick(h);
  base.look_ahead(h);
  const bool event = base.approaching();
  if (event && !base.event(0)) return;
  if (event && base.rests()) return base.wait();
  base.update_motions();
  base.move(h);
  if (base.going_on()) base.settle();
}

}  // namespace cb
