// Files that are each broken in another way: one message with the place and what would be right.
// Each is data/scenes/small.xml (or robot.xml) with one change, so that the fault is the one named.

#include <catch2/catch.hpp>
#include <filesystem>
#include <set>

#include "scenario/xml_tree.h"
#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

struct Broken {
  const char* name;
  int line, column;
  const char* fragment;  ///< of the message
};
const Broken table[] = {
    {"absurd_count", 16, 19, "from 1 to 100000"},
    {"array_in_one_place", 16, 37, "in one place"},
    {"array_without_step", 16, 6, "needs an offset"},
    {"array_of_ground", 17, 8, "it repeats: box, sphere"},
    {"array_without_pattern", 23, 14, "box_* for all"},
    {"attribute_twice", 19, 50, "density is given twice"},
    {"axis_without_angle", 20, 66, "add angle="},
    {"bad_name", 19, 19, "is no name for a body"},
    {"blank", 1, 1, "<scenario title="},
    {"broken_k", 9, 43, "an integer from 4"},
    {"capsule_length", 19, 47, "length is -1; it has to be at least 0"},
    {"capsule_radius", 19, 34, "radius is -0.5; it has to be more than 0"},
    {"child_of_a_box", 17, 65, "holds no elements"},
    {"crossed_tags", 21, 3, "</bodies> first"},
    {"cylinder_length", 19, 48, "length is -1; it has to be at least 0"},
    {"decimal_comma", 9, 21, "decimal point"},
    {"default_no_choice", 6, 50, "they are: push, rest"},
    {"default_no_integer", 5, 53, "an integer, from 1 to 10"},
    {"default_out_of_range", 5, 53, "default of boxes is 20"},
    {"division_by_zero", 7, 38, "division by zero"},
    {"doctype", 2, 11, "no document type"},
    {"empty", 1, 1, "the file is empty"},
    {"empty_array", 16, 6, "one <box> or <sphere>"},
    {"empty_count", 16, 19, "count is 0"},
    {"entity", 2, 20, "write &amp;"},
    {"fixed_with_mass", 20, 49, "a fixed body has no mass"},
    {"flat_box", 17, 29, "more than 0"},
    {"force_on_nothing", 28, 18, "did you mean \"ball\"?"},
    {"force_on_the_ground", 28, 18, "needs a free body"},
    {"harmonic_twice", 13, 6,
     "second <harmonic> for this axis (first at " TEST_DATA "/broken/harmonic_twice.xml:12:6)"},
    {"heightfield_columns", 19, 174, "an integer from 2"},
    {"heightfield_depth", 19, 216, "depth is 0; it has to be more than 0"},
    {"heightfield_nan", 19, 204, "\"nan\" is no number"},
    {"heightfield_one_row", 19, 200, "2 heights are no two or more rows of 2 columns"},
    {"heightfield_rows", 19, 200, "5 heights are no two or more rows of 2 columns"},
    {"heightfield_spacing", 19, 186, "spacing is 1 0; both have to be more than 0"},
    {"heightfield_wall", 19, 200, "make it less steep"},
    {"hexadecimal", 19, 47, "\"0x10\" is no number"},
    {"hull_flat", 19, 31, "all points are in one plane"},
    {"hull_nan", 19, 53, "\"nan\" is no number"},
    {"hull_no_file", 19, 29, "nowhere.obj cannot be read"},
    {"hull_other_file", 19, 29, "named neither .obj nor .stl"},
    {"hull_points_and_file", 19, 56, "keep one"},
    {"hull_scale", 19, 63, "scale is 0; it has to be more than 0"},
    {"hull_three_points", 19, 31, "3 points; a solid has at least 4"},
    {"hull_two_coordinates", 19, 31, "it takes three for each point"},
    {"hull_without_points", 19, 6, "<hull> needs points="},
    {"infinity", 9, 37, "\"inf\" is no number"},
    {"mass_and_density", 17, 45, "keep one"},
    {"mesh_looks_down", 19, 164, "none of the 1 triangles"},
    {"mesh_no_face", 19, 164, "has no f line"},
    {"mesh_no_file", 19, 164, "nowhere.stl cannot be read"},
    {"mesh_other_point", 19, 164, "line 4: \"4/1\" names none of the 3 points before it"},
    {"missing_attribute", 19, 6, "needs the attribute radius"},
    {"missing_quote", 17, 54, "two quotes"},
    {"missing_section", 2, 2, "needs the element <reference>"},
    {"name_of_an_array", 19, 19, "a second body named box_2"},
    {"name_twice", 19, 19, "a second body named ground"},
    {"negative_duration", 9, 37, "at least 0"},
    {"negative_mass", 17, 42, "mass is -1; it has to be more than 0"},
    {"negative_mu", 25, 30, "at least 0"},
    {"nested_too_deep", 27, 54, "17 deep"},
    {"no_mass", 17, 8, "needs a mass or a density"},
    {"no_number", 9, 21, "\"small\" is no number"},
    {"no_root", 1, 1, "no element in this file"},
    {"normal_and_turn", 15, 45, "keep one"},
    {"not_a_number", 9, 37, "\"nan\" is no number"},
    {"not_utf8", 2, 21, "UTF-8"},
    {"odd_k", 9, 43, "even number of edges"},
    {"open_comment", 27, 3, "a comment that does not end"},
    {"open_expression", 19, 65, "is not closed"},
    {"open_parenthesis", 7, 49, "to close the parenthesis"},
    {"out_of_range_number", 19, 47, "\"1e999\" is no number"},
    {"pair_of_fixed", 25, 14, "both fixed to the world"},
    {"pair_twice", 26, 6, "box_1 and box_2 are a pair already (at " TEST_DATA "/broken/pair_twice.xml:24:6)"},
    {"pair_with_itself", 25, 23, "does not collide with itself"},
    {"parameter_twice", 5, 22, "gap is declared twice (first at " TEST_DATA "/broken/parameter_twice.xml:4:22)"},
    {"parameter_without_dollar", 19, 65, "write ${height}"},
    {"parameter_without_type", 4, 33, "number, integer, word"},
    {"pattern_without_match", 23, 14, "no body \"crate_*\""},
    {"reference_without_name", 10, 4, "needs the attribute name"},
    {"reserved_name", 7, 20, "take another name"},
    {"restitution_above_one", 24, 53, "from 0 to 1"},
    {"root_of_negative", 7, 37, "sqrt(-0.5)"},
    {"run_together", 19, 65, "all of it into one ${...}"},
    {"section_twice", 22, 4, "a second <gravity> (first at " TEST_DATA "/broken/section_twice.xml:11:4)"},
    {"text_inside", 27, 12, "<!-- ... -->"},
    {"truncated", 18, 13, "</bodies> first"},
    {"two_coordinates", 15, 38, "it takes 3"},
    {"two_roots", 31, 2, "one scenario"},
    {"unclosed_element", 21, 3, "close it with </box> first"},
    {"unknown_attribute", 17, 36, "did you mean \"mass\"?"},
    {"unknown_axis", 12, 21, "x, y, z"},
    {"unknown_body", 25, 14, "did you mean \"ball\"?"},
    {"unknown_element", 15, 6, "did you mean \"half_space\"?"},
    {"unknown_parameter", 7, 37, "did you mean \"gap\"?"},
    {"unknown_reference", 10, 20, "did you mean \"analytic\"?"},
    {"unknown_section", 27, 4, "it holds: parameters"},
    {"unknown_word", 19, 101, "its words are: push, rest"},
    {"unquoted_value", 9, 20, "with both quotes"},
    {"unused_parameter", 7, 20, "height is never used"},
    {"vanishing_inertia", 19, 50, "finite"},
    {"window_backwards", 28, 53, "before it begins"},
    {"word_as_number", 19, 90, "start is a word"},
    {"wrong_root", 2, 2, "the root element is <world>"},
    {"wrong_switch", 9, 65, "\"on\" or \"off\""},
    {"zero_bytes", 1, 1, "UTF-8"},
    {"zero_normal", 15, 53, "point somewhere"},
    {"zero_quaternion", 20, 78, "1 0 0 0"},
    {"zero_radius", 19, 33, "more than 0"},
    {"zero_step", 9, 21, "step is 0"},
    // Each is data/scenes/robot.xml with one change.
    {"robot_loop", 14, 61,
     "arm is the child of joint shoulder already (at " TEST_DATA "/broken/robot_loop.xml:13:20): that closes a loop"},
    {"robot_loop_apart", 13, 20, "is part of a loop"},
    {"robot_without_joint", 9, 19, "no joint has hand as its child"},
    {"robot_joint_without_parent", 14, 8, "needs the attribute parent"},
    {"robot_unknown_parent", 14, 51, "did you mean \"arm\"?"},
    {"robot_zero_inertia", 8, 19, "moments of inertia 0.1 0 0.2"},
    {"robot_not_definite", 9, 19, "all have to be more than 0"},
    {"robot_inertia_of_no_body", 8, 19, "at most the sum of the other two"},
    {"robot_inertia_of_no_body_turned", 9, 19, "at most the sum of the other two"},
    {"robot_two_links", 9, 19, "a second link named arm (first at " TEST_DATA "/broken/robot_two_links.xml:8:19)"},
    {"robot_nothing_moves", 7, 18, "nothing of robot can move"},
    {"robot_rate_without_limit", 14, 109, "limit_rate without a limit"},
    {"robot_start_outside", 13, 20, "outside its limits"},
    {"robot_limits_swapped", 13, 20, "swap them"},
    {"robot_zero_axis", 13, 94, "point somewhere"},
    {"robot_free_below", 14, 47, "has parent=\"world\""},
    {"robot_joint_kind", 13, 36, "did you mean \"revolute\"?"},
    {"robot_link_element", 10, 10, "did you mean \"box\"?"},
    {"robot_same_link_pair", 19, 24, "shapes of one link"},
    {"robot_moves_with", 16, 82, "did you mean \"hand\"?"},
    {"robot_damping", 14, 106, "at least 0"},
    {"controller_unknown", 22, 23, "did you mean \"computed_torque\"?"},
    {"controller_gain", 22, 58, "\"fast\" is no number"},
    {"controller_robot", 22, 47, "did you mean \"robot\"?"},
    {"controller_joint", 23, 21, "did you mean \"shoulder\"?"},
    {"controller_joint_twice", 24, 21,
     "shoulder is controlled already (at " TEST_DATA "/broken/controller_joint_twice.xml:23:21)"},
    {"controller_missing_gain", 24, 8, "needs the attribute acceleration"},
    {"controller_element", 24, 8, "did you mean \"close\"?"},
    {"controller_word", 22, 69, "it is one of: computed, torque"},
    {"controller_roles", 22, 6, "it takes 1"},
    {"controller_roles_more", 22, 6, "2 <left> in a figure_eight controller; it takes 1"},
};

}  // namespace

TEST_CASE("The files that the broken ones are made from are sound") {
  CHECK(message_of(std::string(TEST_DATA) + "/scenes/small.xml").empty());
  CHECK(message_of(std::string(TEST_DATA) + "/scenes/robot.xml").empty());
}

TEST_CASE("A broken scenario ends in one line that names file, line, column and remedy") {
  for (const Broken& broken : table) {
    INFO(broken.name);
    const std::string path = std::string(TEST_DATA) + "/broken/" + broken.name + ".xml";
    const std::string message = message_of(path);
    CHECK_THAT(message, Catch::StartsWith(path + ":" + std::to_string(broken.line) + ":" +
                                          std::to_string(broken.column) + ": "));
    CHECK_THAT(message, Catch::Contains(broken.fragment));
    CHECK(message.find('\n') == std::string::npos);
  }
}

TEST_CASE("Every broken file is in the table, and every row has its file") {
  std::set<std::string> files, rows;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(TEST_DATA) + "/broken"))
    files.insert(entry.path().stem().string());
  for (const Broken& broken : table) rows.insert(broken.name);
  CHECK(files == rows);
}

TEST_CASE("A scenario that is cut off anywhere is refused with a place") {
  const std::string text = file_text(std::string(TEST_DATA) + "/scenes/small.xml");
  const std::size_t whole = text.rfind('>') + 1;
  for (std::size_t length = 0; length < whole; ++length) {
    INFO(length);
    std::string message;
    try {
      parse_xml({"cut.xml", text.substr(0, length)});
    } catch (const InputError& error) {
      message = error.what();
    }
    REQUIRE_THAT(message, Catch::StartsWith("cut.xml:"));
  }
}

TEST_CASE("Without any one of its attributes a scenario is refused, or the attribute is one that may be left out") {
  const std::string text = file_text(std::string(TEST_DATA) + "/scenes/small.xml");
  // These have defaults, and nothing else hangs on them.
  const std::set<std::string> optional{"unit",  "minimum",     "maximum", "k",        "compression_bound",
                                       "phase", "restitution", "fixed",   "velocity", "rotate_cone"};
  int attributes = 0;
  for (std::size_t equals = text.find("=\"", text.find("<scenario")); equals != std::string::npos;
       equals = text.find("=\"", equals + 1)) {
    const std::size_t begin = text.rfind(' ', equals) + 1, end = text.find('"', equals + 2) + 1;
    const std::string name = text.substr(begin, equals - begin);
    const TextFile file(std::string(text).erase(begin, end - begin));
    const std::string message = message_of(file.path());
    INFO(text.substr(begin, end - begin));
    ++attributes;
    if (optional.count(name) == 0) CHECK_THAT(message, Catch::StartsWith(file.path() + ":"));
    if (message.empty()) CHECK(optional.count(name) == 1);
  }
  CHECK(attributes > 60);
}

TEST_CASE("No element takes an attribute, or an element within it, that the format does not know") {
  int elements = 0;
  for (const char* name : {"small", "robot"}) {
    const std::string text = file_text(std::string(TEST_DATA) + "/scenes/" + name + ".xml");
    for (std::size_t at = text.find("<scenario"); at != std::string::npos; at = text.find('<', at + 1)) {
      if (text[at + 1] == '/') continue;
      const std::size_t end = text.find_first_of(" />", at), tag_end = text.find('>', end);
      const std::string element = text.substr(at + 1, end - at - 1);
      INFO(name << ": <" << element << ">");
      ++elements;
      CHECK_THAT(message_of(TextFile(std::string(text).insert(end, " zz=\"1\"")).path()),
                 Catch::Contains("<" + element + "> has no attribute \"zz\""));
      const std::string with_child = text[tag_end - 1] == '/'
                                         ? std::string(text).replace(tag_end - 1, 2, "><zz/></" + element + ">")
                                         : std::string(text).insert(tag_end + 1, "<zz/>");
      CHECK_THAT(message_of(TextFile(with_child).path()), Catch::Contains("<zz> in"));
    }
  }
  CHECK(elements > 35);
}

TEST_CASE("A message stays one line of bearable length, whatever it has to quote") {
  const std::string text = file_text(std::string(TEST_DATA) + "/scenes/small.xml");
  for (const std::string& value : {std::string("two\nlines"), std::string("bell\a"), std::string(1000000, 'x')}) {
    for (const char* attribute : {"step=\"1e-3", "name=\"ball", "body=\"ball", "type=\"number", "kind=\"missing"}) {
      const TextFile file(std::string(text).insert(text.find(attribute) + std::string(attribute).size(), value));
      const std::string message = message_of(file.path());
      CHECK_THAT(message, Catch::StartsWith(file.path() + ":"));
      CHECK(message.size() < 1000);
      for (const char c : message) REQUIRE(static_cast<unsigned char>(c) >= ' ');
    }
  }
  const std::string set = message_of(std::string(TEST_DATA) + "/scenes/small.xml", {{"gap", "1\n+?\x1b"}});
  CHECK_THAT(set, Catch::StartsWith("--set gap=1 +? : '?' is not expected here"));
}

TEST_CASE("A folder, a missing file and one that is far too long are refused by name") {
  CHECK_THAT(message_of(TEST_DATA), Catch::Contains("is a folder"));
  CHECK_THAT(message_of(std::string(TEST_DATA) + "/nowhere.xml"), Catch::Contains("nowhere.xml: cannot be read"));
  CHECK_THAT(message_of("/proc/self/mem"), Catch::StartsWith("/proc/self/mem: reading it failed ("));
  const TextFile file("");
  std::filesystem::resize_file(file.path(), std::size_t{17} << 20U);
  CHECK_THAT(message_of(file.path()), Catch::Contains("16 MB"));
}
