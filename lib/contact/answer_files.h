#pragma once

#include <string>
#include <vector>

#include "linalg/file_error.h"

namespace cb {

/// Impulses of an answer from a file: n, t1, t2 contact by contact, N s. FCLIB HDF5 (/solution/r), a Matrix Market
/// vector (3 nc x 1, or nc x 3), or plain text, numbers with white space between them: which, the file's first bytes
/// say. NaN and infinity are refused like any word that is no number. Throws FileError, also where there are not 3 nc.
std::vector<double> read_impulses(const std::string& path, int nc);

}  // namespace cb
