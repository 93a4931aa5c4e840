// A contact solver that shares no line with ours, as somebody else would write it: projected Gauss-Seidel on Coulomb's
// law (De Saxce and Feng's form), and the ways in which a program can let one down.
//   toy_solver text|binary [FAULT]     talks by the protocol of docs/external.md
//   toy_solver file PROBLEM ANSWER [FAULT]
// FAULT=N: crash, exit, hang, wrong, nan, short, long (text alone), garbage, fail, deaf or silent at the N-th problem;
// `near`: every answer is too small, that to the n-th problem by the share 1e-4 / n;
// `time` prints at the end, on standard error, the processor's seconds that it took, reading and writing with it, and
// the problems solved.

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "problem_text.h"

using namespace outside;

namespace {

void project(double* r, double mu) {
  const double t = std::hypot(r[1], r[2]);
  if (t <= mu * r[0]) return;
  if (mu * t <= -r[0]) {
    r[0] = r[1] = r[2] = 0;
    return;
  }
  const double n = (r[0] + mu * t) / (1 + mu * mu);
  r[1] *= mu * n / t;
  r[2] *= mu * n / t;
  r[0] = n;
}

/// r from the last problem's, where it has as many contacts. Returns the sweeps.
int answer(Problem& p, std::vector<double>& r) {
  if (r.size() != 3 * static_cast<std::size_t>(p.nc)) r.assign(3 * static_cast<std::size_t>(p.nc), 0.0);
  std::vector<double> weight(p.nc, 0.0), v = p.v;
  std::vector<std::vector<const Entry*>> of(p.nc);
  for (Entry& entry : p.entries) {
    const int n = p.first[entry.block + 1] - p.first[entry.block];
    entry.MinvJt.resize(3 * n);
    for (int row = 0; row < 3; ++row) {
      double* column = &entry.MinvJt[n * row];
      for (int j = 0; j < n; ++j) column[j] = entry.J[row + 3 * j];
      solve_in_place(p.M[entry.block], n, column);
      for (int j = 0; j < n; ++j) weight[entry.contact] += column[j] * entry.J[row + 3 * j] / 3;
      for (int j = 0; j < n; ++j) v[p.first[entry.block] + j] += column[j] * r[3 * entry.contact + row];
    }
    of[entry.contact].push_back(&entry);
  }
  constexpr int most = 100000;
  constexpr double enough = 1e-13;
  for (int sweep = 1; sweep <= most; ++sweep) {
    double change = 0, size = 0;
    for (int c = 0; c < p.nc; ++c) {
      double u[3] = {p.w[3 * c], p.w[3 * c + 1], p.w[3 * c + 2]};
      for (const Entry* entry : of[c])
        for (std::size_t j = 0; j < entry->J.size() / 3; ++j)
          for (int row = 0; row < 3; ++row) u[row] += entry->J[row + 3 * j] * v[p.first[entry->block] + j];
      const double slip = p.mu[c] * std::hypot(u[1], u[2]);
      double wanted[3];
      for (int row = 0; row < 3; ++row) wanted[row] = r[3 * c + row] - (u[row] + (row == 0 ? slip : 0)) / weight[c];
      project(wanted, p.mu[c]);
      double difference[3];
      for (int row = 0; row < 3; ++row) {
        difference[row] = wanted[row] - r[3 * c + row];
        change = std::max(change, std::abs(difference[row]));
        size = std::max(size, std::abs(wanted[row]));
        r[3 * c + row] = wanted[row];
      }
      for (const Entry* entry : of[c]) {
        const int n = p.first[entry->block + 1] - p.first[entry->block];
        for (int row = 0; row < 3; ++row)
          for (int j = 0; j < n; ++j) v[p.first[entry->block] + j] += entry->MinvJt[n * row + j] * difference[row];
      }
    }
    if (change <= enough * size) return sweep;
  }
  return most;
}

struct Faults {
  std::string what;
  long at = 0;
  bool time = false;
  bool now(const char* name, long number) const { return what == name && number == at; }
};

/// What a fault does to an answer; false where nothing is to be said.
bool spoil(const Faults& faults, long number, std::vector<double>& r, std::string& status) {
  if (faults.now("crash", number)) std::raise(SIGSEGV);
  if (faults.now("exit", number)) std::exit(7);
  if (faults.now("hang", number))
    for (;;) pause();
  if (faults.now("wrong", number)) std::fill(r.begin(), r.end(), 0.0);
  if (faults.what == "near")
    for (double& x : r) x *= 1 - 1e-4 / static_cast<double>(number);
  if (faults.now("nan", number)) r[1] = std::nan("");
  if (faults.now("short", number)) r.pop_back();
  if (faults.now("fail", number)) status = "nonconverged", r.clear();
  if (faults.now("garbage", number)) {
    std::puts("42 is the answer");
    std::fflush(stdout);
    return false;
  }
  return true;
}

int talk(bool binary, const Faults& faults) {
  if (faults.what == "deaf") return 3;
  std::ios::sync_with_stdio(false);
  std::string greeting;
  std::getline(std::cin, greeting);
  std::puts(faults.what == "silent" ? "hello" : binary ? "ready binary" : "ready text");
  std::fflush(stdout);
  Problem p;
  std::vector<double> r;
  const std::clock_t start = std::clock();
  long solved = 0;
  while (read(std::cin, binary, p)) {
    const int sweeps = answer(p, r);
    ++solved;
    std::vector<double> said = r;
    std::string status = "ok";
    if (!spoil(faults, p.number, said, status)) continue;
    std::printf("answer %s %d %zu%s\n", status.c_str(), sweeps, said.size(), status == "ok" ? "" : " it said so");
    if (binary) {
      std::fwrite(said.data(), sizeof(double), said.size(), stdout);
    } else {
      std::putchar('r');
      for (const double x : said) std::printf(" %.17g", x);
      if (faults.now("long", p.number)) std::printf(" 0");
      std::putchar('\n');
    }
    std::fflush(stdout);
  }
  if (faults.time) std::fprintf(stderr, "%.9g %ld\n", double(std::clock() - start) / CLOCKS_PER_SEC, solved);
  return 0;
}

int from_file(const char* in, const char* out, const Faults& faults) {
  std::ifstream file(in, std::ios::binary);
  Problem p;
  if (!read(file, false, p)) return 4;
  std::vector<double> r;
  answer(p, r);
  std::string status;
  spoil(faults, p.number, r, status);
  std::FILE* answer_file = std::fopen(out, "w");
  for (const double x : r) std::fprintf(answer_file, "%.17g\n", x);
  return std::fclose(answer_file);
}

}  // namespace

int main(int argc, char** argv) {
  Faults faults;
  const std::string way = argc > 1 ? argv[1] : "";
  for (int i = way == "file" ? 4 : 2; i < argc; ++i) {
    const std::string fault = argv[i];
    if (fault == "time") {
      faults.time = true;
      continue;
    }
    faults.what = fault.substr(0, fault.find('='));
    if (fault.find('=') != std::string::npos) faults.at = std::atol(fault.c_str() + fault.find('=') + 1);
  }
  if (way == "text" || way == "binary") return talk(way == "binary", faults);
  if (way == "file" && argc >= 4) return from_file(argv[2], argv[3], faults);
  return 2;
}
