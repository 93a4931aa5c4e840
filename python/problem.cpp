// Contact problems from numpy arrays and files, and back.
#include "problem.h"

#include <fmt/format.h>

#include <cmath>

#include "contact/fclib_format.h"

namespace cb::python {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

Array numbers(const py::handle& object, const char* name) {
  Array array = Array::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw ArgumentError(fmt::format("{}: must be an array of numbers, not {}", name,
                                    py::str(py::type::of(object).attr("__name__")).cast<std::string>()));
  }
  for (py::ssize_t i = 0; i < array.size(); ++i)
    if (!std::isfinite(array.data()[i]))
      throw ArgumentError(fmt::format("{}: entry {} is not a finite number", name, i));
  return array;
}

/// numpy.ndarray or anything of scipy.sparse, rows x columns; -1: any.
Sparse matrix(const py::handle& object, const char* name, long rows, long columns) {
  std::vector<Eigen::Triplet<double>> entries;
  long m = 0, n = 0;
  if (py::hasattr(object, "tocoo")) {
    const py::object coo = object.attr("tocoo")();
    const auto shape = coo.attr("shape").cast<std::pair<long, long>>();
    m = shape.first;
    n = shape.second;
    const auto row = coo.attr("row").cast<py::array_t<long, py::array::forcecast>>(),
               column = coo.attr("col").cast<py::array_t<long, py::array::forcecast>>();
    const Array x = numbers(coo.attr("data"), name);
    for (py::ssize_t e = 0; e < x.size(); ++e)
      entries.emplace_back(static_cast<int>(row.at(e)), static_cast<int>(column.at(e)), x.data()[e]);
  } else {
    const Array x = numbers(object, name);
    if (x.ndim() != 2) throw ArgumentError(fmt::format("{}: has {} dimensions; a matrix has 2", name, x.ndim()));
    m = x.shape(0);
    n = x.shape(1);
    for (long i = 0; i < m; ++i)
      for (long j = 0; j < n; ++j)
        if (x.at(i, j) != 0) entries.emplace_back(static_cast<int>(i), static_cast<int>(j), x.at(i, j));
  }
  if ((rows >= 0 && m != rows) || (columns >= 0 && n != columns))
    throw ArgumentError(fmt::format("{}: is {} x {}; {} x {} belongs here", name, m, n, rows < 0 ? m : rows,
                                    columns < 0 ? n : columns));
  Sparse out(m, n);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

/// `size` numbers, in any shape that holds so many; one number stands for all of them.
std::vector<double> list(const py::object& object, const char* name, long size) {
  const Array x = numbers(object, name);
  if (x.ndim() == 0) return std::vector<double>(static_cast<std::size_t>(size), *x.data());
  if (x.size() != size) throw ArgumentError(fmt::format("{}: holds {} numbers; {} belong here", name, x.size(), size));
  return {x.data(), x.data() + size};
}

/// The reader's words for the arguments.
std::string in_words_of_arguments(std::string message) {
  for (const std::string_view part : {"Problem: ", "/fclib_global/vectors/", "/fclib_global/", "/fclib_local/"})
    for (std::size_t at = message.find(part); at != std::string::npos; at = message.find(part))
      message.erase(at, part.size());
  return message;
}

std::unique_ptr<Problem> make_problem(const py::object& M, const py::object& J, const py::object& v,
                                      const py::object& mu, const py::object& e, const py::object& offset,
                                      const py::object& W, const py::object& q, bool symmetrise) {
  const bool global = !M.is_none() || !J.is_none() || !v.is_none(), local = !W.is_none() || !q.is_none();
  if (global == local || (global && (M.is_none() || J.is_none() || v.is_none())) ||
      (local && (W.is_none() || q.is_none())))
    throw ArgumentError("Problem: give M, J, v, mu (e, offset), or W, q, mu (e), or read a file by Problem.read()");
  if (mu.is_none()) throw ArgumentError("Problem: mu is missing: one number for all contacts, or one each");
  FclibContent content;
  content.global = global;
  long rows = 0;
  if (global) {
    content.M = matrix(M, "M", -1, -1);
    const long nv = content.M.rows();
    if (content.M.cols() != nv)
      throw ArgumentError(fmt::format("M: is {} x {}; it must be square", nv, content.M.cols()));
    const Sparse jacobian = matrix(J, "J", -1, nv);
    rows = jacobian.rows();
    content.H = jacobian.transpose();
    content.v_minus = list(v, "v", nv);
    const Eigen::VectorXd f = content.M * Eigen::Map<const Eigen::VectorXd>(content.v_minus.data(), nv);
    content.f.assign(f.data(), f.data() + nv);
  } else {
    if (!offset.is_none()) throw ArgumentError("offset: belongs to M, J, v; q holds it already");
    content.W = matrix(W, "W", -1, -1);
    rows = content.W.rows();
    if (content.W.cols() != rows)
      throw ArgumentError(fmt::format("W: is {} x {}; it must be square", rows, content.W.cols()));
    content.q = list(q, "q", rows);
  }
  if (rows == 0 || rows % 3 != 0)
    throw ArgumentError(fmt::format("{}: has {} rows; three for each contact (n, t1, t2), and at least one contact",
                                    global ? "J" : "W", rows));
  const long nc = rows / 3;
  content.mu = list(mu, "mu", nc);
  content.restitution = e.is_none() ? std::vector<double>(static_cast<std::size_t>(nc), 0.0) : list(e, "e", nc);
  if (global)
    content.w =
        offset.is_none() ? std::vector<double>(static_cast<std::size_t>(rows), 0.0) : list(offset, "offset", rows);
  auto out = std::make_unique<Problem>();
  try {
    out->stored = to_problem(std::move(content), "Problem", {.symmetrise = symmetrise});
  } catch (const FileError& error) {
    throw ArgumentError(in_words_of_arguments(error.what()));
  }
  return out;
}

int row_of(const Problem& problem, int i) {
  return problem.stored.row_of_v.empty() ? i : problem.stored.row_of_v[static_cast<std::size_t>(i)];
}

py::array_t<double> mass(const Problem& problem) {
  const BlockDiagonalMatrix& M = problem.get().M;
  py::array_t<double> out({M.order(), M.order()});
  std::fill_n(out.mutable_data(), out.size(), 0.0);
  for (int b = 0; b < M.blocks(); ++b)
    for (int j = 0; j < M.block_size(b); ++j)
      for (int i = 0; i < M.block_size(b); ++i)
        out.mutable_at(row_of(problem, M.first[b] + i), row_of(problem, M.first[b] + j)) = M.block(b)(i, j);
  return out;
}

py::array_t<double> jacobian(const Problem& problem) {
  const ContactProblem& p = problem.get();
  py::array_t<double> out({3 * p.nc(), p.nv()});
  std::fill_n(out.mutable_data(), out.size(), 0.0);
  for (int c = 0; c < p.nc(); ++c)
    for (int e = p.J.band[c]; e < p.J.band[c + 1]; ++e) {
      const auto entry = p.J.entry(e);
      for (int j = 0; j < entry.cols(); ++j)
        for (int r = 0; r < 3; ++r)
          out.mutable_at(3 * c + r, row_of(problem, p.M.first[p.J.block[e]] + j)) = entry(r, j);
    }
  return out;
}

py::array_t<double> delassus_of(const Problem& problem) {
  const ContactProblem& p = problem.get();
  BlockCholesky factor;
  factor.factor(p.M);
  Eigen::MatrixXd W;
  delassus(p, factor, W);
  py::array_t<double> out({W.rows(), W.cols()});
  std::copy_n(W.data(), W.size(), out.mutable_data());  // symmetric
  return out;
}

py::array_t<double> velocity_before(const Problem& problem) {
  std::vector<double> u;
  contact_velocity(problem.get(), problem.get().v_minus, u);
  return array_of(u);
}

py::array_t<double> velocity_after(const Problem& problem, const py::object& impulses) {
  const ContactProblem& p = problem.get();
  BlockCholesky factor;
  factor.factor(p.M);
  std::vector<double> v, u;
  apply_impulse(p, factor, impulses_of(impulses, p.nc()), v);
  contact_velocity(p, v, u);
  return rows_of_three(u);
}

std::string shown(const Problem& problem) {
  return fmt::format("<contactbench.Problem: {} contacts, {} velocities{}>", problem.get().nc(), problem.get().nv(),
                     problem.t > 0 ? fmt::format(", t = {:.6g} s", problem.t) : "");
}

}  // namespace

py::array_t<double> array_of(const std::vector<double>& x) {
  return py::array_t<double>(static_cast<py::ssize_t>(x.size()), x.data());
}

py::array_t<double> rows_of_three(const std::vector<double>& x) {
  return py::array_t<double>({static_cast<py::ssize_t>(x.size() / 3), py::ssize_t(3)}, x.data());
}

std::vector<double> given_order(const Problem& problem, const std::vector<double>& v) {
  std::vector<double> out(v.size());
  for (std::size_t i = 0; i < v.size(); ++i) out[static_cast<std::size_t>(row_of(problem, static_cast<int>(i)))] = v[i];
  return out;
}

std::vector<double> impulses_of(const py::handle& object, int nc) {
  const Array x = object.is_none() ? Array() : Array::ensure(object);
  if (!x || object.is_none()) {
    PyErr_Clear();
    throw ArgumentError(fmt::format("impulses: must be an array of numbers, not {}",
                                    py::str(py::type::of(object).attr("__name__")).cast<std::string>()));
  }
  const bool flat = x.ndim() == 1 && x.shape(0) == 3 * nc;
  const bool rows = x.ndim() == 2 && x.shape(0) == nc && x.shape(1) == 3;
  if (!flat && !rows)
    throw ArgumentError(fmt::format("impulses: have shape {}; {} contacts need ({}, 3) or ({},)",
                                    py::str(x.attr("shape")).cast<std::string>(), nc, nc, 3 * nc));
  return {x.data(), x.data() + x.size()};
}

void add_problem(py::module_& module) {
  py::class_<Problem>(module, "Problem", R"(One contact event, the same data for every method (docs/judging.md):

    v+ = v + M^-1 J^T r,   u = J v + offset,   r, u: n, t1, t2 contact by contact

Problem(M=, J=, v=, mu=, e=0, offset=0)
    M       (nv, nv)    mass matrix, symmetric positive definite; numpy or scipy.sparse
    J       (3 nc, nv)  rows n, t1, t2 of each contact; u_n < 0 approaches; numpy or scipy.sparse
    v       (nv,)       velocity before the event, m/s (rad/s)
    mu      (nc,)       Coulomb coefficient, or one number for all
    e       (nc,)       restitution, 0 to 1
    offset  (3 nc,)     m/s, added to J v
Problem(W=, q=, mu=, e=0)
    W       (3 nc, 3 nc)  Delassus matrix J M^-1 J^T, 1/kg, symmetric positive semidefinite
    q       (3 nc,)       u before the event, m/s
symmetrise=True takes an unsymmetric W for its nearest symmetric positive semidefinite matrix.
Arrays that are read from a problem are copies.)")
      .def(py::init(&make_problem), py::kw_only(), py::arg("M") = py::none(), py::arg("J") = py::none(),
           py::arg("v") = py::none(), py::arg("mu") = py::none(), py::arg("e") = py::none(),
           py::arg("offset") = py::none(), py::arg("W") = py::none(), py::arg("q") = py::none(),
           py::arg("symmetrise") = false)
      .def_static(
          "read",
          [](const py::object& path, bool symmetrise) {
            Problem out;
            out.stored = read_contact_problem(py::str(path).cast<std::string>(), {.symmetrise = symmetrise});
            return out;
          },
          py::arg("path"), py::arg("symmetrise") = false,
          "A stored problem: FCLIB HDF5 (local or global) or Siconos friction text (docs/files.md).")
      .def(
          "write",
          [](const Problem& problem, const py::object& path) {
            write_contact_problem(py::str(path).cast<std::string>(), problem.get(), {}, problem.stored.row_of_v);
          },
          py::arg("path"), "As FCLIB HDF5, global: what `contactbench solve` and `judge` read.")
      .def_property_readonly(
          "nc", [](const Problem& p) { return p.get().nc(); }, "contacts")
      .def_property_readonly(
          "nv", [](const Problem& p) { return p.get().nv(); }, "velocities")
      .def_property_readonly("M", &mass, "(nv, nv) mass matrix")
      .def_property_readonly("J", &jacobian, "(3 nc, nv) contact Jacobian, rows n, t1, t2")
      .def_property_readonly(
          "v", [](const Problem& p) { return array_of(given_order(p, p.get().v_minus)); }, "(nv,) velocity before, m/s")
      .def_property_readonly(
          "mu", [](const Problem& p) { return array_of(p.get().mu); }, "(nc,) Coulomb coefficients")
      .def_property_readonly(
          "e", [](const Problem& p) { return array_of(p.get().restitution); }, "(nc,) restitution")
      .def_property_readonly(
          "offset", [](const Problem& p) { return array_of(p.get().offset); }, "(3 nc,) m/s")
      .def_property_readonly("W", &delassus_of, "(3 nc, 3 nc) Delassus matrix J M^-1 J^T, 1/kg")
      .def_property_readonly("q", &velocity_before, "(3 nc,) contact velocities before, J v + offset, m/s")
      .def_readonly("t", &Problem::t, "s, the event's time in its run; 0 where it is of none")
      .def_property_readonly(
          "notes",
          [](const Problem& p) {
            py::list notes;
            for (const std::string& note : p.stored.notes) notes.append(note);
            return notes;
          },
          "what was noticed when it was read")
      .def("velocity", &velocity_after, py::arg("impulses"),
           "(nc, 3) contact velocities after impulses (nc, 3) in N s: J (v + M^-1 J^T r) + offset, m/s")
      .def("__repr__", &shown);
}

}  // namespace cb::python
