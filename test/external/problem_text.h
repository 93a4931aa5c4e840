#pragma once

// Problems as contactbench hands them to other programs (docs/external.md), read by a program of somebody else's:
// nothing here is ours.

#include <cctype>
#include <cstdlib>
#include <cstring>
#include <istream>
#include <string>
#include <vector>

namespace outside {

struct Entry {
  int contact, block;
  std::vector<double> J, MinvJt;  // 3 x n and n x 3, column by column
};

struct Problem {
  long number = 0;
  int nc = 0, nv = 0;
  std::vector<int> first;  // of each block
  std::vector<std::vector<double>> M;
  std::vector<Entry> entries;
  std::vector<double> v, w, mu, e;
};

/// x <- A^-1 x for a small positive definite A (n x n), in place of A.
inline void solve_in_place(std::vector<double> A, int n, double* x) {
  for (int k = 0; k < n; ++k)
    for (int i = k + 1; i < n; ++i) {
      const double f = A[i + n * k] / A[k + n * k];
      for (int j = k; j < n; ++j) A[i + n * j] -= f * A[k + n * j];
      x[i] -= f * x[k];
    }
  for (int i = n - 1; i >= 0; --i) {
    for (int j = i + 1; j < n; ++j) x[i] -= A[i + n * j] * x[j];
    x[i] /= A[i + n * i];
  }
}

template <class Next>
void read_arrays(Problem& p, int blocks, int entries, Next next) {
  p.first = {0};
  p.M.resize(blocks);
  p.entries.resize(entries);
  next("size");
  for (int b = 0; b < blocks; ++b) p.first.push_back(p.first.back() + static_cast<int>(next.integer()));
  const auto orders = [&](int b) { return p.first[b + 1] - p.first[b]; };
  next("entry");
  for (Entry& entry : p.entries) {
    entry.contact = static_cast<int>(next.integer());
    entry.block = static_cast<int>(next.integer());
  }
  next("M");
  for (int b = 0; b < blocks; ++b) {
    p.M[b].resize(static_cast<std::size_t>(orders(b)) * orders(b));
    for (double& x : p.M[b]) x = next.number();
  }
  next("J");
  for (Entry& entry : p.entries) {
    entry.J.resize(3 * static_cast<std::size_t>(orders(entry.block)));
    for (double& x : entry.J) x = next.number();
  }
  const auto list = [&](const char* key, std::vector<double>& to, int size) {
    next(key);
    to.resize(size);
    for (double& x : to) x = next.number();
  };
  list("v", p.v, p.nv);
  list("w", p.w, 3 * p.nc);
  list("mu", p.mu, p.nc);
  list("e", p.e, p.nc);
}

struct TextNext {
  const char* at;
  void operator()(const char* key) {
    while (std::isspace(static_cast<unsigned char>(*at))) ++at;
    if (std::strncmp(at, key, std::strlen(key)) != 0) std::abort();
    at += std::strlen(key);
  }
  double number() {
    char* end = nullptr;
    const double x = std::strtod(at, &end);
    at = end;
    return x;
  }
  double integer() { return number(); }
};

struct BinaryNext {
  const char* at;
  void operator()(const char*) const {}
  double number() { return take<double>(); }
  int integer() { return take<int>(); }
  template <class T>
  T take() {
    T x;
    std::memcpy(&x, at, sizeof x);
    at += sizeof x;
    return x;
  }
};

/// One problem from `in`; false at its end.
inline bool read(std::istream& in, bool binary, Problem& p) {
  std::string word;
  int blocks = 0, entries = 0;
  std::size_t bytes = 0;
  if (!(in >> word >> p.number >> p.nc >> p.nv >> blocks >> entries >> bytes) || word != "problem") return false;
  in.get();
  std::string body(bytes, '\0');
  in.read(body.data(), static_cast<long>(bytes));
  if (binary)
    read_arrays(p, blocks, entries, BinaryNext{body.data()});
  else
    read_arrays(p, blocks, entries, TextNext{body.c_str()});
  return true;
}

}  // namespace outside
