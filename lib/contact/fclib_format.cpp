// What: the HDF5 layout of FCLIB 3.1, read and written through the C library of HDF5.
// Layout: one of /fclib_global {spacedim, M, H, [G], vectors {f, w, mu, [b]}} and /fclib_local {spacedim, W, [V, R],
//   vectors {q, mu, [s]}}. A matrix is a group {m, n, nz, nzmax, p, i, x}: nz >= 0 triplets, -1 compressed columns,
//   -2 compressed rows. A problem's /solution is never read with it: it is often a placeholder of zeros; an answer is
//   what read_fclib_impulses() is asked for. /guesses are never read.
// Source: FCLIB 3.1, fclib.h and its library. Differences from the source's own words: 1. in triplets p holds the
//   columns and i the rows, as in the files there are. 2. nzmax may exceed what is stored. 3. Entries given twice
//   add up. 4. /contactbench {v_minus, restitution, first} is ours, beside the problem's group.
// Fails with FileError: file, dataset, and what would be right. HDF5's own error printing is off meanwhile.
#include "contact/fclib_format.h"

#include "contact/problem_files.h"
#include "linalg/text_file.h"

#ifdef CONTACTBENCH_HAVE_HDF5
#include <hdf5.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>
#endif

namespace cb {

#ifndef CONTACTBENCH_HAVE_HDF5

bool fclib_available() { return false; }
std::string_view fclib_unavailable_reason() {
  return "built without HDF5: install libhdf5-dev and configure again with -DCONTACTBENCH_HDF5=ON";
}
FclibContent read_fclib(const std::string& path) {
  throw FileError(path + ": cannot be read: " + std::string(fclib_unavailable_reason()));
}
std::vector<double> read_fclib_impulses(const std::string& path) {
  throw FileError(path + ": cannot be read: " + std::string(fclib_unavailable_reason()));
}
void write_fclib(const std::string& path, const FclibContent&, const std::string&, const std::string&) {
  throw FileError(path + ": cannot be written: " + std::string(fclib_unavailable_reason()));
}

#else

bool fclib_available() { return true; }
std::string_view fclib_unavailable_reason() { return ""; }

namespace {

using Sparse = Eigen::SparseMatrix<double>;

// An open HDF5 object; closed at the end of its scope.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// Keeps HDF5 from printing its error stack.
class Silence {
 public:
  Silence() {
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Silence() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

// ---- reading

class Reader {
 public:
  explicit Reader(const std::string& path)
      : path_(path), file_(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose) {
    if (!file_.good()) throw FileError(path + ": is not a complete HDF5 file (truncated or damaged?)");
  }

  [[noreturn]] void fail(const std::string& where, const std::string& message) const {
    throw FileError(path_ + ": " + where + ": " + message);
  }

  // Asked level by level: HDF5 takes a missing group on the way for an error.
  bool exists(const std::string& where) const {
    for (std::size_t at = where.find('/', 1);; at = where.find('/', at + 1)) {
      if (H5Lexists(file_, where.substr(0, at).c_str(), H5P_DEFAULT) <= 0) return false;
      if (at == std::string::npos) return true;
    }
  }

  std::vector<double> numbers(const std::string& where) const {
    const Handle data = open(where, H5T_FLOAT, "floating-point numbers");
    std::vector<double> out(count(data, where));
    if (!out.empty() && H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, out.data()) < 0)
      fail(where, "cannot be read (truncated or damaged?)");
    for (std::size_t i = 0; i < out.size(); ++i)
      if (!std::isfinite(out[i])) fail(where, "entry " + std::to_string(i) + " is not a finite number");
    return out;
  }

  std::vector<double> numbers(const std::string& where, long size) const {
    std::vector<double> out = numbers(where);
    if (static_cast<long>(out.size()) != size)
      fail(where, "holds " + std::to_string(out.size()) + " numbers; " + std::to_string(size) + " belong here");
    return out;
  }

  // Whole numbers, each in [least, most]: read wide, so that none is cut to fit.
  std::vector<int> integers(const std::string& where, long least, long most) const {
    const Handle data = open(where, H5T_INTEGER, "whole numbers");
    std::vector<long long> wide(count(data, where));
    if (!wide.empty() && H5Dread(data, H5T_NATIVE_LLONG, H5S_ALL, H5S_ALL, H5P_DEFAULT, wide.data()) < 0)
      fail(where, "cannot be read (truncated or damaged?)");
    std::vector<int> out(wide.size());
    for (std::size_t i = 0; i < wide.size(); ++i) {
      if (wide[i] < least || wide[i] > most)
        fail(where, "entry " + std::to_string(i) + " is " + std::to_string(wide[i]) + "; it must be from " +
                        std::to_string(least) + " to " + std::to_string(most));
      out[i] = static_cast<int>(wide[i]);
    }
    return out;
  }

  int integer(const std::string& where, long least, long most) const {
    const std::vector<int> one = integers(where, least, most);
    if (one.size() != 1) fail(where, "holds " + std::to_string(one.size()) + " numbers; one belongs here");
    return one[0];
  }

  Sparse matrix(const std::string& where) const {
    const int m = integer(where + "/m", 0, file_limits.dimension), n = integer(where + "/n", 0, file_limits.dimension);
    const int nz = integer(where + "/nz", -2, file_limits.entries);
    const int nzmax = integer(where + "/nzmax", 0, file_limits.entries);
    std::vector<Eigen::Triplet<double> > triplets;
    if (nz >= 0) {
      // p holds the columns, i the rows.
      const std::vector<int> col = integers(where + "/p", 0, n - 1), row = integers(where + "/i", 0, m - 1);
      const std::vector<double> x = numbers(where + "/x");
      enough(where, nz, nzmax, {{"p", col.size()}, {"i", row.size()}, {"x", x.size()}});
      triplets.reserve(nz);
      for (int e = 0; e < nz; ++e) triplets.emplace_back(row[e], col[e], x[e]);
    } else {
      const bool columns = nz == -1;
      const int outer = columns ? n : m, inner = columns ? m : n;
      const std::vector<int> start = integers(where + "/p", 0, file_limits.entries);
      if (static_cast<int>(start.size()) != outer + 1)
        fail(where + "/p", "holds " + std::to_string(start.size()) + " numbers; compressed " +
                               (columns ? "columns" : "rows") + " need " + std::to_string(outer + 1));
      if (start[0] != 0) fail(where + "/p", "must begin with 0");
      for (int j = 0; j < outer; ++j)
        if (start[j + 1] < start[j]) fail(where + "/p", "falls after entry " + std::to_string(j) + "; it must not");
      const std::vector<int> index = integers(where + "/i", 0, inner - 1);
      const std::vector<double> x = numbers(where + "/x");
      enough(where, start[outer], nzmax, {{"i", index.size()}, {"x", x.size()}});
      triplets.reserve(start[outer]);
      for (int j = 0; j < outer; ++j)
        for (int e = start[j]; e < start[j + 1]; ++e)
          triplets.emplace_back(columns ? index[e] : j, columns ? j : index[e], x[e]);
    }
    Sparse out(m, n);
    out.setFromTriplets(triplets.begin(), triplets.end());
    return out;
  }

  // A matrix that must be absent, or without columns.
  void refuse(const std::string& where, const std::string& meaning) const {
    if (exists(where) && !(exists(where + "/n") && integer(where + "/n", 0, file_limits.dimension) == 0))
      fail(where, meaning + " are not supported; only contacts are");
  }

  void check_space(const std::string& root) const {
    const int dimension = integer(root + "/spacedim", 2, 3);
    if (dimension != 3) fail(root + "/spacedim", "is 2: plane problems are not supported; 3 is");
  }

 private:
  Handle open(const std::string& where, H5T_class_t type, const char* described) const {
    if (!exists(where)) fail(where, "is missing");
    Handle data(H5Dopen2(file_, where.c_str(), H5P_DEFAULT), H5Dclose);
    if (!data.good()) fail(where, "is not a dataset that can be opened");
    const Handle stored(H5Dget_type(data), H5Tclose);
    if (!stored.good() || H5Tget_class(stored) != type) fail(where, std::string("must hold ") + described);
    return data;
  }

  std::size_t count(hid_t data, const std::string& where) const {
    const Handle space(H5Dget_space(data), H5Sclose);
    const int rank = space.good() ? H5Sget_simple_extent_ndims(space) : -1;
    const hssize_t points = space.good() ? H5Sget_simple_extent_npoints(space) : -1;
    if (rank < 0 || rank > 1 || points < 0) fail(where, "must be a list (one dimension)");
    if (points > file_limits.entries)
      fail(where, "claims " + std::to_string(points) + " numbers; at most " + std::to_string(file_limits.entries) +
                      " are read");
    if (points > 0 && H5Dget_storage_size(data) == 0) fail(where, "was never written");
    return static_cast<std::size_t>(points);
  }

  void enough(const std::string& where, int entries, int nzmax,
              std::initializer_list<std::pair<const char*, std::size_t> > lists) const {
    for (const auto& [list, size] : lists)
      if (size < static_cast<std::size_t>(entries))
        fail(where + "/" + list,
             "holds " + std::to_string(size) + " numbers; the matrix has " + std::to_string(entries) + " entries");
    if (nzmax < entries)
      fail(where + "/nzmax",
           "is " + std::to_string(nzmax) + ", less than the " + std::to_string(entries) + " entries of the matrix");
  }

  std::string path_;
  Handle file_;
};

// ---- writing

class Writer {
 public:
  explicit Writer(const std::string& path)
      : path_(path),
        file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose),
        dataset_(H5Pcreate(H5P_DATASET_CREATE), H5Pclose) {
    if (!file_.good()) throw FileError(path + ": cannot be created; give a path in a folder that exists");
    // No times of writing: the same problem gives the same bytes.
    H5Pset_obj_track_times(dataset_, false);
  }

  void group(const std::string& where) {
    const Handle made(H5Gcreate2(file_, where.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    check(made.good());
  }
  void numbers(const std::string& where, const double* x, std::size_t count) {
    list(where, count, H5T_NATIVE_DOUBLE, x);
  }
  void numbers(const std::string& where, const std::vector<double>& x) { numbers(where, x.data(), x.size()); }
  void integers(const std::string& where, const int* x, std::size_t count) { list(where, count, H5T_NATIVE_INT, x); }
  void integer(const std::string& where, int x) { integers(where, &x, 1); }
  void text(const std::string& where, const std::string& words) {
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    check(type.good() && H5Tset_size(type, words.size() + 1) >= 0);
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    put(where, type, space, words.c_str());
  }
  void matrix(const std::string& where, const Sparse& A) {
    group(where);
    const auto entries = static_cast<int>(A.nonZeros());
    integer(where + "/m", static_cast<int>(A.rows()));
    integer(where + "/n", static_cast<int>(A.cols()));
    integer(where + "/nz", -1);
    integer(where + "/nzmax", entries);
    integers(where + "/p", A.outerIndexPtr(), static_cast<std::size_t>(A.cols()) + 1);
    integers(where + "/i", A.innerIndexPtr(), entries);
    numbers(where + "/x", A.valuePtr(), entries);
  }
  void flush() { check(H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0); }

 private:
  void check(bool good) const {
    if (!good) throw FileError(path_ + ": could not be written to its end; is the disk full?");
  }
  void list(const std::string& where, std::size_t count, hid_t type, const void* x) {
    const hsize_t size = count;
    const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
    put(where, type, space, x);
  }
  void put(const std::string& where, hid_t type, const Handle& space, const void* x) {
    const Handle data(
        space.good() ? H5Dcreate2(file_, where.c_str(), type, space, H5P_DEFAULT, dataset_, H5P_DEFAULT) : -1,
        H5Dclose);
    check(data.good() &&
          (H5Sget_simple_extent_npoints(space) == 0 || H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, x) >= 0));
  }

  std::string path_;
  Handle file_;
  Handle dataset_;
};

}  // namespace

FclibContent read_fclib(const std::string& path) {
  const Silence silence;
  const Reader file(path);
  const bool global = file.exists("/fclib_global"), local = file.exists("/fclib_local");
  if (global == local)
    throw FileError(path + (global ? ": holds both /fclib_global and /fclib_local; exactly one must be there"
                                   : ": holds neither /fclib_global nor /fclib_local; this is no FCLIB problem"));
  FclibContent out;
  out.global = global;
  const std::string root = global ? "/fclib_global" : "/fclib_local";
  file.check_space(root);
  long rows = 0;
  if (global) {
    file.refuse(root + "/G", "bilateral constraints (G, b)");
    out.M = file.matrix(root + "/M");
    out.H = file.matrix(root + "/H");
    const long nv = out.M.rows();
    if (out.M.cols() != nv) file.fail(root + "/M", "is not square");
    if (out.H.rows() != nv)
      file.fail(root + "/H", "has " + std::to_string(out.H.rows()) + " rows; M has " + std::to_string(nv));
    rows = out.H.cols();
    out.f = file.numbers(root + "/vectors/f", nv);
    out.w = file.numbers(root + "/vectors/w", rows);
  } else {
    file.refuse(root + "/V", "bilateral constraints (V, R, s)");
    out.W = file.matrix(root + "/W");
    rows = out.W.rows();
    if (out.W.cols() != rows) file.fail(root + "/W", "is not square");
    out.q = file.numbers(root + "/vectors/q", rows);
  }
  if (rows == 0 || rows % 3 != 0)
    file.fail(root + (global ? "/H/n" : "/W/m"),
              "is " + std::to_string(rows) + "; three for each contact, and at least one contact, belong here");
  out.mu = file.numbers(root + "/vectors/mu", rows / 3);
  if (file.exists("/contactbench")) {
    if (global && file.exists("/contactbench/v_minus"))
      out.v_minus = file.numbers("/contactbench/v_minus", out.M.rows());
    if (file.exists("/contactbench/restitution")) out.restitution = file.numbers("/contactbench/restitution", rows / 3);
    if (global && file.exists("/contactbench/first")) out.first = file.integers("/contactbench/first", 0, out.M.rows());
  }
  return out;
}

std::vector<double> read_fclib_impulses(const std::string& path) {
  const Silence silence;
  const Reader file(path);
  if (!file.exists("/solution"))
    throw FileError(path + ": holds no /solution; an answer has its impulses in /solution/r");
  return file.numbers("/solution/r");
}

void write_fclib(const std::string& path, const FclibContent& content, const std::string& title,
                 const std::string& description) {
  const Silence silence;
  const std::string part = path + ".part";
  try {
    Writer file(part);
    const std::string root = "/fclib_global";
    file.group(root);
    file.integer(root + "/spacedim", 3);
    file.matrix(root + "/M", content.M);
    file.matrix(root + "/H", content.H);
    file.group(root + "/vectors");
    file.numbers(root + "/vectors/f", content.f);
    file.numbers(root + "/vectors/w", content.w);
    file.numbers(root + "/vectors/mu", content.mu);
    file.group(root + "/info");
    file.text(root + "/info/title", title);
    file.text(root + "/info/description", description);
    file.text(root + "/info/math_info", "");
    if (!content.r.empty()) {
      file.group("/solution");
      file.numbers("/solution/v", content.v);
      file.numbers("/solution/u", content.u);
      file.numbers("/solution/r", content.r);
    }
    file.group("/contactbench");
    file.numbers("/contactbench/v_minus", content.v_minus);
    file.numbers("/contactbench/restitution", content.restitution);
    if (!content.first.empty()) file.integers("/contactbench/first", content.first.data(), content.first.size());
    file.flush();
  } catch (const FileError&) {
    std::remove(part.c_str());
    throw;
  }
  std::error_code error;
  std::filesystem::rename(part, path, error);
  if (error) {
    std::remove(part.c_str());
    throw FileError(path + ": cannot be written: " + error.message());
  }
}

#endif

}  // namespace cb
