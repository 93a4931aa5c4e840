#include "methods/lcp_status.h"

namespace cb {

Status status_of(LcpStatus status) {
  switch (status) {
    case LcpStatus::solved:
      return Status::ok;
    case LcpStatus::inaccurate:
      return Status::inaccurate;
    case LcpStatus::ray:
      return Status::ray;
    case LcpStatus::nonconverged:
      return Status::nonconverged;
    case LcpStatus::cycling:
      return Status::cycling;
    case LcpStatus::singular:
      return Status::singular;
    case LcpStatus::not_finite:
      return Status::not_finite;
    case LcpStatus::memory_limit:
      return Status::memory_limit;
    case LcpStatus::unavailable:
      return Status::unavailable;
  }
  return Status::nonconverged;
}

}  // namespace cb
