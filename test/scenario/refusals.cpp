// What a scene is refused for beside the broken files, at the place of ^, which is no part of the text; and limits.

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstddef>
#include <utility>

#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

const std::string ball = "<sphere name=\"ball\" radius=\"1\" mass=\"1\" position=\"0 9 0\"/>";
const std::string ground = "<half_space name=\"ground\" point=\"0 0 0\" normal=\"0 1 0\"/>";

/// A robot of one hinge, of which this is said, too.
std::string robot(const std::string& hinge = "") {
  return "<robot name=\"r\"><link name=\"bar\" mass=\"1\" position=\"0 0 0\" inertia=\"1 1 1\"/><joint name=\"hinge\" "
         "kind=\"revolute\" parent=\"world\" child=\"bar\" anchor=\"0 0 0\" axis=\"0 0 1\" " +
         hinge + "/></robot>";
}

/// Parameters stand on line 2, bodies on 4, the sections after them on 6.
std::string scene(const std::string& bodies, const std::string& after = "", const std::string& parameters = "") {
  return "<scenario title=\"t\">\n" + parameters +
         "\n<simulation step=\"1e-3\" duration=\"1\"/><reference kind=\"missing\"/><gravity constant=\"0 -9.8 "
         "0\"/><bodies>\n" +
         bodies + "\n</bodies>\n" + after + "\n</scenario>";
}

void refused_at_mark(std::string text, const std::string& words) {
  const std::size_t mark = text.find('^'), column = mark - text.rfind('\n', mark);
  text.erase(mark, 1);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(mark), '\n');
  const TextFile file(text);
  const std::string message = message_of(file.path());
  INFO(text);
  CHECK_THAT(message, Catch::StartsWith(fmt::format("{}:{}:{}: ", file.path(), line, column)));
  CHECK_THAT(message, Catch::Contains(words));
}

}  // namespace

TEST_CASE("A body that says too much, too little, or what none can be is refused where it says so") {
  const std::string box = "<box name=\"b\" size=\"1 1 1\" mass=\"1\" position=\"0 0 0\" ";
  const std::pair<std::string, const char*> rows[] = {
      {"<^half_space name=\"g\" point=\"0 0 0\"/>" + ball, "<half_space> needs a normal"},
      {"<half_space name=\"g\" point=\"0 0 0\" ^normal=\"0 1 0\" quaternion=\"1 0 0 0\"/>" + ball,
       "normal beside an orientation"},
      {robot() + "<box name=\"b\" size=\"1 1 1\" fixed=\"yes\" position=\"0 0 0\" ^moves_with=\"bar\"/>",
       "a fixed body has no moves_with"},
      {robot() + box + "moves_with=\"bar\" ^velocity=\"1 0 0\"/>", "velocity beside moves_with"},
      {robot() + box + "moves_with=\"bar\" ^angular_velocity=\"1 0 0\"/>", "angular_velocity beside moves_with"},
      {box + "axis=\"0 1 0\" angle=\"1\" ^quaternion=\"1 0 0 0\"/>", "a quaternion beside axis and angle"},
      {"<array count=\"2\" offset=\"0 3 0\">" + ball +
           "<^sphere name=\"other\" radius=\"1\" mass=\"1\" position=\"9 0 0\"/></array>",
       "a second element in <array>"},
      {ball + "<heightfield name=\"g\" position=\"0 0 0\" columns=\"2\" spacing=\"^0 1\" heights=\"0 0 0 0\"/>",
       "spacing is 0 1; both have to be more than 0"},
      {"<sphere name=\"s\" radius=\"1\" mass=\"1\" position=\"0 0 0\" ^contact_grid=\"5\"/>",
       "<sphere> has no attribute \"contact_grid\""},
      {robot("stiffness=\"^-1\""), "stiffness is -1; it has to be at least 0"},
      {robot("torque_limit=\"^-1\""), "torque_limit is -1; it has to be at least 0"},
      {"<half_space name=\"g\" point=\"0 0 0\" ^angle=\"1\"/>" + ball, "an angle without an axis"},
      {box + "moves_with=\"^bar\"/>", "there is no robot before this body"},
      {"<sphere name=\"s\" radius=\"1e10\" mass=\"^1e308\" position=\"0 0 0\"/>", "moment of inertia to inf kg m^2"},
      {"<sphere name=\"s\" radius=\"1e-3\" density=\"^1e-300\" position=\"0 0 0\"/>", "both have to be more than 0"},
      {"<array count=\"2\"><^sphere name=\"s\" radius=\"1\" mass=\"1\"/></array>", "needs the attribute position"},
      {"<sphere name=\"s\" radius=\"1\" mass=\"1\" position=\"^0\"/>", "position has 1 number; it takes 3"},
      {"<sphere name=\"s\" radius=\"^1 2\" mass=\"1\" position=\"0 0 0\"/>", "radius has 2 numbers; it takes one"},
      // Where a reference to a character shifts the text, the whole value is meant.
      {"<sphere name=\"s\" radius=\"^&#49; 1x\" mass=\"1\" position=\"0 0 0\"/>", "\"1x\" is no number"},
      {replaced(robot(), "<joint name=\"hinge\" kind=\"revolute\"", "<^joint name=\"hinge\""),
       "<joint> needs a kind; it is one of: fixed, revolute, prismatic, free"},
      {replaced(robot(), "\"bar\" mass=\"1\"", "\"^bar\" mass=\"${1e-300*1e-10}\""),
       "have to be more than 0 and finite"},
      {ball + "<heightfield name=\"g\" position=\"0 0 0\" columns=\"2\" spacing=\"1e-60 1e-60\" depth=\"1e-250\" "
              "heights=\"^0 0 0 0\"/>",
       "the volume below it is out of a number's range"},
  };
  for (const auto& [bodies, words] : rows) refused_at_mark(scene(bodies), words);
  // What is right beside these.
  for (const std::string& bodies : {"<array count=\"1\" offset=\"0 0 0\">" + ball + "</array>",
                                    "<array count=\"1\">" + ball + "</array>", robot("limit_rate=\"1\" upper=\"1\"")})
    CHECK(message_of(TextFile(scene(bodies)).path()).empty());
  refused_at_mark(replaced(scene(ground), "<bodies>", "<^bodies>"), "no body that can move");
}

TEST_CASE("A parameter that contradicts itself or has another's name is refused where it says so") {
  const auto number = [](const std::string& name, const std::string& more) {
    return "<parameter name=\"" + name + "\" type=\"number\" description=\"d\" " + more + "/>";
  };
  const auto word = [](const std::string& choices) {
    return "<parameter name=\"a\" type=\"word\" default=\"rest\" description=\"d\" choices=\"" + choices + "\"/>";
  };
  const std::pair<std::string, const char*> rows[] = {
      {number("a", "default=\"1\" minimum=\"2\" maximum=\"^1\""), "the maximum 1 of a is less than its minimum 2"},
      {number("a", "default=\"1\" minimum=\"^1 2\""), "minimum takes one number"},
      {number("a", "default=\"^1 2\""), "the default of a has to be one number"},
      {"<derived name=\"a\" value=\"^1 2\"/>", "the value of a has to be one number"},
      {word("^"), "no choices; list the words"},
      {word("^rest 2go"), "\"2go\" is no word"},
      {word("^rest push rest"), "the choice rest is listed twice"},
      {"<parameter name=\"a\" type=\"^real\" default=\"1\" description=\"d\"/>", "there is no type \"real\""},
      {number("^index", "default=\"1\""), "index means something else in expressions"},
      {number("^pi", "default=\"1\""), "pi means something else in expressions"},
      {number("^deg", "default=\"1\""), "deg means something else in expressions"},
  };
  for (const auto& [parameter, words] : rows)
    refused_at_mark(scene(ball, "", "<parameters>" + parameter + "</parameters>"), words);
}

TEST_CASE("A force does not begin before the run, and a controller is of some kind") {
  refused_at_mark(scene(ball, "<forces><force body=\"ball\" force=\"1 0 0\" from=\"^-1\" to=\"1\"/></forces>"),
                  "from is -1; it has to be at least 0");
  refused_at_mark(scene(robot(), "<controllers><^controller robot=\"r\"/></controllers>"), "<controller> needs a kind");
  refused_at_mark(scene(ball, "<controllers><controller kind=\"computed_torque\" robot=\"^r\"/></controllers>"),
                  "there is no robot in <bodies> to control");
}

TEST_CASE("A pair that is one already, or means an array as if it were one body, is told by what it should name") {
  const std::string balls =
      "<array count=\"2\" offset=\"0 3 0\"><sphere name=\"my_ball\" radius=\"1\" mass=\"1\" position=\"0 1 0\"/>"
      "</array>";
  const auto contacts = [](const std::string& pairs) { return "<contacts>" + pairs + "</contacts>"; };
  refused_at_mark(scene(ground + balls, contacts("<pair a=\"^my_ball\" b=\"ground\" mu=\"0.5\"/>")),
                  "write my_ball_1 for the first, my_ball_* for all");
  // Of one kind, the first two of it.
  const std::string among = "pair a=\"my_*\" b=\"my_*\" mu=\"0.5\"/>";
  refused_at_mark(scene(ground + balls, contacts("<" + among + "<^" + among)),
                  "my_ball_1 and my_ball_2 are a pair already (at ");
}

TEST_CASE("The word of a controller may be that of a parameter, which has words") {
  const std::string control =
      "<controllers><controller kind=\"computed_torque\" robot=\"r\" gains=\"${mode}\"><track joint=\"hinge\"/>"
      "</controller></controllers>";
  const std::string text = scene(robot(), control,
                                 "<parameters><parameter name=\"mode\" type=\"word\" default=\"torque\" "
                                 "choices=\"computed torque\" description=\"d\"/></parameters>");
  CHECK(load_text(text).controllers.at(0).words == std::vector<int>{1});
  CHECK(load_text(text, {{"mode", "computed"}}).controllers.at(0).words == std::vector<int>{0});
  refused_at_mark(scene(robot(), replaced(control, "${mode}", "^${mode}"),
                        "<parameters><parameter name=\"mode\" type=\"number\" default=\"1\" description=\"d\"/>"
                        "</parameters>"),
                  "mode is no parameter of type word; gains takes one of: computed, torque");
  for (const auto& [value, words] :
       {std::pair("^${mood}", "mood is no parameter of type word; gains takes one of: computed, torque"),
        {"^${mode", "gains is \"${mode\"; "},
        {"^${}", "gains is \"${}\"; "}})
    refused_at_mark(scene(robot(), replaced(control, "${mode}", value)), words);
}

TEST_CASE("A scene cannot do without any of simulation, reference, gravity and bodies") {
  const std::string text = scene(ball);
  CHECK(message_of(TextFile(text).path()).empty());
  for (const auto& [section, element] :
       {std::pair<std::string, std::string>{"simulation", "<simulation step=\"1e-3\" duration=\"1\"/>"},
        {"reference", "<reference kind=\"missing\"/>"},
        {"gravity", "<gravity constant=\"0 -9.8 0\"/>"},
        {"bodies", "<bodies>\n" + ball + "\n</bodies>"}})
    refused_at_mark(replaced(replaced(text, element, ""), "<scenario", "<^scenario"),
                    "<scenario> needs the element <" + section + ">");
}

TEST_CASE("Pairs may tell 2000 kinds of bodies apart, and no more") {
  const auto said = [](int balls) {  // each with a pair of its own, and the ground
    std::string pairs;
    for (int i = 1; i <= balls; ++i) pairs += fmt::format("<pair a=\"s_{}\" b=\"ground\" mu=\"0.5\"/>", i);
    const std::string bodies = ground + fmt::format("<array count=\"{}\" offset=\"3 0 0\">", balls) +
                               "<sphere name=\"s\" radius=\"1\" mass=\"1\" position=\"0 1 0\"/></array>";
    return message_of(TextFile(scene(bodies, "<contacts>" + pairs + "</contacts>")).path());
  };
  CHECK(said(1999).empty());
  CHECK_THAT(said(2000), Catch::Contains(":6:2: more than 2000 kinds of bodies by their pairs"));
}

TEST_CASE("A ground of more than 100000 triangles is refused before it is made") {
  const auto field = [](int columns, int rows) {
    std::string heights;
    for (int i = 0; i < columns * rows; ++i) heights += "0 ";
    return scene(ball + "<heightfield name=\"g\" position=\"0 0 0\" spacing=\"1 1\" columns=\"" +
                 std::to_string(columns) + "\" heights=\"^" + heights + "\"/>");
  };
  refused_at_mark(field(25002, 3), "100004 triangles, more than 100000");
}
