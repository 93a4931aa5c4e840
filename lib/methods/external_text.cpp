#include "methods/external_text.h"

#include <fmt/compile.h>

#include <cstdio>
#include <iterator>

#include "linalg/file_error.h"

namespace cb {

namespace {

template <class Numbers>
void line(const char* key, const Numbers& numbers, fmt::memory_buffer& out) {
  out.append(std::string_view(key));
  for (const auto x : numbers) fmt::format_to(std::back_inserter(out), FMT_COMPILE(" {}"), x);
  out.push_back('\n');
}

/// int32: orders of the blocks.
std::vector<int> sizes(const ContactProblem& problem) {
  std::vector<int> out;
  for (int b = 0; b < problem.M.blocks(); ++b) out.push_back(problem.M.block_size(b));
  return out;
}

/// int32: contact and block of each entry of J.
std::vector<int> pairs(const ContactProblem& problem) {
  std::vector<int> out;
  for (int c = 0; c < problem.nc(); ++c)
    for (int e = problem.J.band[c]; e < problem.J.band[c + 1]; ++e) out.insert(out.end(), {c, problem.J.block[e]});
  return out;
}

void append_head(const ContactProblem& problem, long number, std::size_t bytes, std::string& out) {
  fmt::format_to(std::back_inserter(out), "problem {} {} {} {} {} {}\n", number, problem.nc(), problem.nv(),
                 problem.M.blocks(), problem.J.block.size(), bytes);
}

template <class Number>
void append_raw(const std::vector<Number>& numbers, std::string& out) {
  out.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
}

}  // namespace

void append_text(const ContactProblem& problem, long number, std::string& out) {
  fmt::memory_buffer body;
  line("size", sizes(problem), body);
  line("entry", pairs(problem), body);
  line("M", problem.M.values, body);
  line("J", problem.J.values, body);
  line("v", problem.v_minus, body);
  line("w", problem.offset, body);
  line("mu", problem.mu, body);
  line("e", problem.restitution, body);
  body.append(std::string_view("end\n"));
  append_head(problem, number, body.size(), out);
  out.append(body.data(), body.size());
}

void append_binary(const ContactProblem& problem, long number, std::string& out) {
  const std::vector<int> size = sizes(problem), pair = pairs(problem);
  const std::vector<double>* lists[] = {&problem.M.values, &problem.J.values, &problem.v_minus,
                                        &problem.offset,   &problem.mu,       &problem.restitution};
  std::size_t bytes = (size.size() + pair.size()) * sizeof(int);
  for (const auto* list : lists) bytes += list->size() * sizeof(double);
  append_head(problem, number, bytes, out);
  append_raw(size, out);
  append_raw(pair, out);
  for (const auto* list : lists) append_raw(*list, out);
}

void write_external_text(const std::string& path, const ContactProblem& problem, long number) {
  std::string text;
  append_text(problem, number, text);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) throw FileError(path + ": cannot be opened for writing");
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  if ((std::fclose(file) != 0) || !written)
    throw FileError(path + ": could not be written to its end; is the disk full?");
}

}  // namespace cb
