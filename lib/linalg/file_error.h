#pragma once

#include <stdexcept>

namespace cb {

/// A file that cannot be read or written, or that holds what it should not. what() is one message with the file, the
/// line or dataset, and what would be right.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace cb
