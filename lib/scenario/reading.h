#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "scenario/scenario.h"
#include "scenario/values.h"
#include "scenario/xml_tree.h"

namespace cb {

/// A scenario while it is read: what the readers of its sections share. All functions throw InputError.
struct Reading {
  /// A body as it was declared; its index is that of its shape.
  struct Declared {
    std::string name;
    std::size_t at = 0;  ///< offset of the name
    int array = -1;      ///< which array it belongs to, -1: none
  };

  Reading(const SourceText& text, const Overrides& overrides) : source(text), values(text, overrides) {}

  // Values of attributes, beyond those of `values`.
  Vec3 vector(const XmlAttribute& attribute, std::string_view meaning);
  Vec3 direction(const XmlAttribute& attribute);  ///< unit
  /// From `quaternion`, or from `axis` and `angle`; none: as the world.
  Quat orientation(const XmlElement& element);
  std::string one_of(const XmlAttribute& attribute, const std::vector<std::string>& words) const;
  std::string name_of(const XmlElement& element, std::string_view what) const;

  /// Refuses a child element: "<child> in `where`; `intro` `known`".
  [[noreturn]] void fail_child(const XmlElement& child, std::string_view where, const std::vector<std::string>& known,
                               std::string_view intro = "it holds:") const;

  /// Declares a shape of <bodies>, named after the element with `suffix`; refuses the name of a link.
  void declare_body(const XmlElement& element, const std::string& suffix, int array, Shape shape);
  void declare_shape(Shape shape, std::size_t at, int array);
  bool is_free(int body) const { return scenario.shapes[body].body >= 0; }
  /// The bodies that a name, or a pattern with one *, stands for; at least one.
  std::vector<int> find_bodies(const XmlAttribute& attribute) const;

  /// A file that the scene names, from its folder on.
  std::string beside_scene(const std::string& file) const;
  /// Adds it to those that were read.
  void note_file(const std::string& path);

  const SourceText& source;
  Values values;
  Scenario scenario;
  std::vector<Declared> declared;
  std::map<std::string, int> index;  ///< of a body's name in `declared`
  int arrays = 0;
  /// Hulls that were read, by their points (m) or by file and scale: shapes that are alike share one.
  std::map<std::vector<double>, std::shared_ptr<const Hull>> hull_of_points;
  std::map<std::pair<std::string, double>, std::shared_ptr<const Hull>> hull_of_file;
  std::vector<Pose> zero_pose;  ///< of links, by body: in the robot's zero pose

 private:
  [[noreturn]] void fail_no_body(const XmlAttribute& attribute) const;
};

// A section of the file each, in the order in which they are read.
void read_bodies(Reading& in, const XmlElement& element);
void read_robot(Reading& in, const XmlElement& element);  ///< one of the bodies
void read_heightfield(Reading& in, const XmlElement& element);
void read_mesh(Reading& in, const XmlElement& element);
void read_contacts(Reading& in, const XmlElement* element);  ///< null: there is none
void read_forces(Reading& in, const XmlElement& element);
void read_controllers(Reading& in, const XmlElement& element);

}  // namespace cb
