#include "output/contact_file.h"

#include <algorithm>
#include <cmath>

#include "output/number.h"

namespace cb {

namespace {

char* cells(char* out, const Vec3& v) {
  for (int i = 0; i < 3; ++i) {
    out = print_number(out, v[i]);
    *out++ = ',';
  }
  return out;
}

// errno of the first failure, or 0.
int write_shapes(const std::filesystem::path& path, const Scenario& scenario) {
  RowFile file(path, shapes_header);
  for (const Shape& shape : scenario.shapes) {
    const std::string body =
        shape.body < 0 ? "" : csv_cell(scenario.model.bodies[static_cast<std::size_t>(shape.body)].name);
    const std::string shape_name = csv_cell(shape.name);
    char* out = file.begin_row(shape_name.size() + body.size() + 13 * number_room);
    out = print_text(print_text(out, shape_name), ",");
    out = print_text(print_text(out, body), ",");
    out = print_text(print_text(out, name(shape.kind)), ",");
    out = cells(out, shape.local.p);
    const Quat& q = shape.local.q;
    for (const double x : {q.w(), q.x(), q.y(), q.z(), shape.radius}) *(out = print_number(out, x))++ = ',';
    out = cells(out, shape.half_extents);
    out[-1] = '\n';
    file.end_row(out);
  }
  file.flush();
  return file.error();
}

// A row for each corner of each face, counter-clockwise seen from outside, in the shape's frame; no file without hulls.
int write_hulls(const std::filesystem::path& path, const Scenario& scenario) {
  std::optional<RowFile> file;
  for (const Shape& shape : scenario.shapes) {
    if (shape.kind != ShapeKind::hull) continue;
    if (!file) file.emplace(path, hulls_header);
    const std::string shape_name = csv_cell(shape.name);
    const Polytope& hull = shape.hull->polytope;
    for (std::size_t f = 0; f < hull.faces.size(); ++f)
      for (int k = 0; k < hull.faces[f].count; ++k) {
        char* out = file->begin_row(shape_name.size() + 5 * number_room);
        out = print_text(print_text(out, shape_name), ",");
        *(out = print_number(out, static_cast<double>(f)))++ = ',';
        out = cells(out, hull.vertices[static_cast<std::size_t>(hull.corner(hull.faces[f], k))]);
        out[-1] = '\n';
        file->end_row(out);
      }
  }
  if (!file) return 0;
  file->flush();
  return file->error();
}

double largest(const std::vector<double>& numbers, std::size_t count) {
  double most = 0;
  for (std::size_t i = 0; i < count; ++i) most = std::max(most, std::abs(numbers[i]));
  return most;
}

}  // namespace

std::string_view name(ContactMode mode) {
  return mode == ContactMode::open ? "open" : mode == ContactMode::stick ? "stick" : "slip";
}

ContactMode contact_mode(const double* r, const double* u, double largest_impulse, double largest_speed) {
  if (!(r[0] > mode_tolerance * largest_impulse)) return ContactMode::open;
  return std::hypot(u[1], u[2]) <= mode_tolerance * largest_speed ? ContactMode::stick : ContactMode::slip;
}

ContactFile::ContactFile(const std::filesystem::path& directory, const Scenario& scenario, bool wanted, long every)
    : scenario_(scenario), every_(every) {
  const auto contacts = directory / "contacts.csv", shapes = directory / "shapes.csv", hulls = directory / "hulls.csv";
  std::error_code ignored;
  std::filesystem::remove(hulls, ignored);
  if (!wanted || every_ <= 0) {
    std::filesystem::remove(contacts, ignored);
    std::filesystem::remove(shapes, ignored);
    return;
  }
  for (const Shape& shape : scenario.shapes) names_.push_back(csv_cell(shape.name));
  contacts_.emplace(contacts, contacts_header);
  for (const auto& [path, write] : {std::pair(shapes, &write_shapes), std::pair(hulls, &write_hulls)}) {
    if (error_ != 0) break;
    failed_path_ = path.string();
    error_ = write(path, scenario);
  }
}

void ContactFile::event(const EventRecord& event) {
  if (!contacts_ || step_ % every_ != 0) return;
  const std::size_t rows = 3 * event.contacts.size();  // limits of joints come after them
  const std::vector<double>& r = event.solution.impulse;
  if (r.size() < rows) return;
  contact_velocity(event.problem, event.problem.v_minus, u_before_);
  contact_velocity(event.problem, event.v_plus, u_);
  for (std::size_t c = 0; c < event.gap_speed.size(); ++c)
    for (std::vector<double>* u : {&u_before_, &u_}) (*u)[3 * c] -= event.gap_speed[c];
  const double speed = std::max(largest(u_before_, rows), largest(u_, rows)), impulse = largest(r, rows);
  for (std::size_t c = 0; c < event.contacts.size(); ++c) {
    const ContactPoint& contact = event.contacts[c];
    const std::string& a = names_[static_cast<std::size_t>(contact.shape_a)];
    const std::string& b = names_[static_cast<std::size_t>(contact.shape_b)];
    Vec3 t1, t2;
    contact_tangents(contact, scenario_.rotate_cone, t1, t2);
    const auto in_world = [&](const double* x) -> Vec3 { return x[0] * contact.normal + x[1] * t1 + x[2] * t2; };
    char* out = contacts_->begin_row(a.size() + b.size() + 17 * number_room);
    *(out = print_number(out, event.t))++ = ',';
    *(out = print_number(out, step_))++ = ',';
    out = print_text(print_text(out, a), ",");
    out = print_text(print_text(out, b), ",");
    out = cells(cells(out, contact.position), contact.normal);
    out = cells(cells(out, in_world(&u_[3 * c])), in_world(&r[3 * c]));
    out = print_text(out, name(contact_mode(&r[3 * c], &u_[3 * c], impulse, speed)));
    *out++ = '\n';
    contacts_->end_row(out);
  }
}

}  // namespace cb
