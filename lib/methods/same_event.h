#pragma once

#include <memory>

#include "methods/registry.h"

namespace cb {

/// The method, but for events that are the previous one again (a body at rest, one that slides steadily): they get the
/// previous answer. Two events are the same where the blocks of M and the entries of J differ by no more than rounding
/// (1e-15 of the largest of their kind; of trees: by nothing), mu, restitution and offset by nothing, and the velocity
/// of each block by at most 4e-15 of it in the norm of M. What is compared with is always the event that was solved, so
/// that small differences do not add up. The referee checks the answer on the present problem like any other. Only
/// answers with status ok are used again, and of what moves from event to event none is kept. `reused` counts them.
/// Part of --warm-start.
ContactMethod reuse_same_event(ContactMethod method, std::shared_ptr<Counter> reused);

}  // namespace cb
