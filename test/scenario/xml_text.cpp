// The text of a scene file before it means anything: which bytes are text, what an end tag closes, how long a message
// is.

#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "scenario/xml_tree.h"
#include "scenario_text.h"

using namespace cb;
using namespace cb::test;

namespace {

std::string refusal(const std::string& text) {
  try {
    parse_xml({"a.xml", text});
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string hex(const std::string& bytes) {
  std::string out;
  for (const char c : bytes) out += fmt::format("{:02X} ", static_cast<unsigned char>(c));
  return out;
}

}  // namespace

TEST_CASE("Text is UTF-8 as it was defined: shortest forms, no halves of pairs, nothing beyond the last character") {
  const auto is_text = [](const std::string& bytes) {
    return message_of(TextFile("<scenario title=\"" + bytes + "\"/>").path()).find(":1:18: this is no UTF-8 text") ==
           std::string::npos;
  };
  // The first and the last character of each length, and those about the gap of pairs.
  for (const char* good : {"\x7F", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
                           "\xEF\xBF\xBD", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    INFO(hex(good));
    CHECK(is_text(good));
  }
  for (const char* bad :
       {"\x80", "\xBF", "\xC0\x80", "\xC1\xBF", "\xC2", "\xC2x", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xED\xBF\xBF",
        "\xE2\x82x", "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xF8\x88\x80\x80\x80", "\xFF"}) {
    INFO(hex(bad));
    CHECK_FALSE(is_text(bad));
  }
}

TEST_CASE("What is still open is told past remarks, values with brackets, and elements that are closed") {
  CHECK(refusal("<a><!-- <b> --><c x=\">/\" y='\"<'/><d></d><e></a>") ==
        "a.xml:1:44: <e> (opened at a.xml:1:42) is still open; close it with </e> first");
  CHECK(refusal("<a>\n<b>\n</c>\n</a>") ==
        "a.xml:3:1: <b> (opened at a.xml:2:2) is still open; close it with </b> first");
  CHECK_THAT(refusal("<a/></b>"), Catch::Contains("closes nothing"));
  CHECK_THAT(refusal("<a x=\"1\" x=\"2\"/>"),
             Catch::Contains("a.xml:1:10: x is given twice in <a> (first at a.xml:1:4)"));
}

TEST_CASE("Characters may be written as references, others than those that XML has may not") {
  const XmlElement root = parse_xml({"a.xml", "<a x=\"&lt;&gt;&amp;&quot;&apos;&#65;&#x42;\"/>"});
  CHECK(root.find("x")->value == "<>&\"'AB");
  for (const char* bad : {"&nbsp;", "&amp", "&;", "& ", "&ampere;"}) {
    INFO(bad);
    CHECK_THAT(refusal("<a x=\"1" + std::string(bad) + "\"/>"),
               Catch::Contains("a.xml:1:8: an entity that is not one of"));
  }
}

TEST_CASE("Elements within elements are read to a depth of 16, in their order, with all attributes") {
  std::string deep;
  for (int i = 0; i < 16; ++i) deep = "<e>" + deep + "</e>";
  CHECK_THAT(refusal("<e>" + deep + "</e>"), Catch::Contains("17 deep"));
  CHECK(refusal(deep).empty());
  const XmlElement root = parse_xml({"a.xml", "<a p=\"1\" q=\"2\"><b/><c r=\"3\"><d/></c><b/></a>"});
  REQUIRE(root.attributes.size() == 2);
  CHECK(root.find("q")->value == "2");
  CHECK(root.find("r") == nullptr);
  REQUIRE(root.children.size() == 3);
  CHECK(root.children[1].name == "c");
  CHECK(root.children[1].find("r")->value == "3");
  CHECK(root.children[1].children.at(0).name == "d");
  CHECK(root.children[2].name == "b");
}

TEST_CASE("Of a message that is too long its beginning and its end are kept, and no character is cut in two") {
  CHECK(one_line("a\tb\nc\x7F") == "a b c ");
  const std::string fits(700, 'x');
  CHECK(one_line(fits) == fits);
  CHECK(one_line(std::string(400, 'a') + "b" + std::string(300, 'c')) ==
        std::string(400, 'a') + " ... " + std::string(300, 'c'));
  // Of three bytes each: 133 of them begin within the first 400 bytes, 100 end within the last 300.
  std::string euros;
  for (int i = 0; i < 300; ++i) euros += "\xE2\x82\xAC";
  const std::string cut = one_line(euros + "x");
  CHECK(cut == euros.substr(0, 3 * 133) + " ... " + euros.substr(0, 3 * 99) + "x");
}
