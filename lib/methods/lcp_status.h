#pragma once

#include "contact/problem.h"
#include "lcp/lcp.h"

namespace cb {

/// How a linear complementarity problem ended, among the endings of an event.
Status status_of(LcpStatus status);

}  // namespace cb
