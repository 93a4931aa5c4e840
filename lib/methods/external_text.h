#pragma once

#include <string>

#include "contact/problem.h"

namespace cb {

/// A problem as another program gets it (docs/external.md): a line
///   problem NUMBER CONTACTS VELOCITIES BLOCKS ENTRIES BYTES
/// and BYTES bytes. In text a line each of: size, entry, M, J, v, w, mu, e, and `end`.
void append_text(const ContactProblem& problem, long number, std::string& out);
/// In binary int32: orders of the blocks of M, contact and block of each entry of J; then float64: M, J, v, w, mu, e;
/// in the order of this machine's bytes.
void append_binary(const ContactProblem& problem, long number, std::string& out);
/// The text as a file. Throws FileError.
void write_external_text(const std::string& path, const ContactProblem& problem, long number);

}  // namespace cb
