// Reads a scenario file into a Scenario: docs/scenarios.md is the reference of the format.
// What is not written down there is refused: one message with file, line, column and what would be right.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "scenario/near_name.h"
#include "scenario/reading.h"

namespace cb {

namespace {

constexpr int edge_limit = 4096;  // edges of a friction polygon

void read_simulation(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {"step", "duration"}, {"k", "compression_bound", "rotate_cone", "joint_forces"});
  check_empty(in.source, element);
  in.scenario.step = in.values.number(*element.find("step"), positive);
  in.scenario.duration = in.values.number(*element.find("duration"), not_negative);
  if (const XmlAttribute* k = element.find("k")) {
    in.scenario.k = static_cast<int>(in.values.integer(*k, 4, edge_limit));
    if (*in.scenario.k % 2 != 0)
      in.values.fail(
          *k, fmt::format("k is {}; the friction polygon has an even number of edges, at least 4", *in.scenario.k));
  }
  if (const XmlAttribute* bound = element.find("compression_bound"))
    in.scenario.compression_bound = in.one_of(*bound, {"on", "off"}) == "on";
  if (const XmlAttribute* forces = element.find("joint_forces"))
    in.scenario.implicit_joints = in.one_of(*forces, {"explicit", "implicit"}) == "implicit";
  if (const XmlAttribute* turn = element.find("rotate_cone"))
    in.scenario.rotate_cone = in.values.number(*turn, any_number);
}

void read_reference(Reading& in, const XmlElement& element) {
  check_empty(in.source, element);
  check_attributes(in.source, element, {"kind"}, {"name"});
  const std::string kind = in.one_of(*element.find("kind"), {"analytic", "certified", "missing"});
  const XmlAttribute* name = element.find("name");
  if (kind == "analytic") {
    in.scenario.reference.kind = ReferenceKind::analytic;
    check_attributes(in.source, element, {"kind", "name"}, {});
    in.scenario.reference.name = name->value;
    in.scenario.reference.where = in.source.where(name->value_at);
    if (!is_name(name->value))
      in.source.fail(name->value_at,
                     fmt::format("\"{}\" is no name of a reference; see `contactbench list references`", name->value));
  } else {
    in.scenario.reference.kind = kind == "certified" ? ReferenceKind::certified : ReferenceKind::missing;
    if (name != nullptr)
      in.source.fail(name->name_at,
                     fmt::format("a {} reference has no name; remove it, or set kind=\"analytic\"", kind));
  }
}

void read_gravity(Reading& in, const XmlElement& element) {
  check_attributes(in.source, element, {"constant"}, {});
  in.scenario.gravity.constant = in.vector(*element.find("constant"), "x y z in m/s^2");
  std::size_t seen[3] = {0, 0, 0};
  for (const XmlElement& child : element.children) {
    if (child.name != "harmonic") in.fail_child(child, "<gravity>", {"harmonic"});
    check_attributes(in.source, child, {"axis", "amplitude", "frequency"}, {"phase"});
    check_empty(in.source, child);
    const int axis = in.one_of(*child.find("axis"), {"x", "y", "z"})[0] - 'x';
    if (seen[axis] != 0)
      in.source.fail(child.at, fmt::format("a second <harmonic> for this axis (first at {}); keep one",
                                           in.source.where(seen[axis])));
    seen[axis] = child.at;
    Harmonic& harmonic = in.scenario.gravity.harmonic[axis];
    harmonic.amplitude = in.values.number(*child.find("amplitude"), any_number);
    harmonic.frequency = in.values.number(*child.find("frequency"), not_negative);
    if (const XmlAttribute* phase = child.find("phase")) harmonic.phase = in.values.number(*phase, any_number);
  }
}

/// The sections of a file by their names.
class Sections {
 public:
  Sections(const SourceText& source, const XmlElement& root);
  /// Null where there is none.
  const XmlElement* find(std::string_view name) const;
  const XmlElement& operator[](std::string_view name) const { return *find(name); }

 private:
  std::vector<const XmlElement*> all_;
};

Sections::Sections(const SourceText& source, const XmlElement& root) {
  static const std::vector<std::string> known{"parameters", "simulation", "reference", "gravity",
                                              "bodies",     "contacts",   "forces",    "controllers"};
  for (const XmlElement& child : root.children) {
    if (std::find(known.begin(), known.end(), child.name) == known.end())
      source.fail(child.at, fmt::format("<{}> in <scenario>; {}", child.name, suggest(child.name, known, "it holds:")));
    if (const XmlElement* first = find(child.name))
      source.fail(child.at,
                  fmt::format("a second <{}> (first at {}); put both into one", child.name, source.where(first->at)));
    all_.push_back(&child);
  }
  for (const char* needed : {"simulation", "reference", "gravity", "bodies"})
    if (find(needed) == nullptr)
      source.fail(root.at, fmt::format("<scenario> needs the element <{}>; it holds: {}", needed, join(known)));
}

const XmlElement* Sections::find(std::string_view name) const {
  for (const XmlElement* candidate : all_)
    if (candidate->name == name) return candidate;
  return nullptr;
}

}  // namespace

Scenario load_scenario(const std::string& path, const Overrides& overrides) {
  const SourceText source = read_text(path);
  const XmlElement root = parse_xml(source);
  if (root.name != "scenario")
    source.fail(root.at,
                fmt::format("the root element is <{}>; a scenario starts with <scenario title=\"...\">", root.name));
  check_attributes(source, root, {"title"}, {});
  Reading in(source, overrides);
  in.scenario.file = source.file;
  in.scenario.files.push_back(source.file);
  in.scenario.name = std::filesystem::path(source.file).stem().string();
  in.scenario.title = root.find("title")->value;

  const Sections sections(source, root);
  in.values.declare(sections.find("parameters"));
  read_simulation(in, sections["simulation"]);
  read_reference(in, sections["reference"]);
  read_gravity(in, sections["gravity"]);
  read_bodies(in, sections["bodies"]);
  read_contacts(in, sections.find("contacts"));
  if (const XmlElement* forces = sections.find("forces")) read_forces(in, *forces);
  if (const XmlElement* control = sections.find("controllers")) read_controllers(in, *control);
  in.values.check_all_used();
  in.values.report(in.scenario);
  return std::move(in.scenario);
}

}  // namespace cb
