#include "scenario/xml_tree.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <pugixml.hpp>

#include "scenario/scenario.h"

namespace cb {

namespace {

constexpr std::size_t size_limit = std::size_t{16} << 20U;  // bytes; a scene of a few lines needs no more
constexpr int depth_limit = 16;                             // elements within elements; the format needs four

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
/// Does a byte go on with a character that began before it?
bool continues(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

/// Offset of the first byte that is not UTF-8 text, npos where there is none.
std::size_t first_bad_byte(const std::string& text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == 0) return i;
    const std::size_t length = c < 0x80U ? 1 : (c >> 5U) == 6U ? 2 : (c >> 4U) == 14U ? 3 : (c >> 3U) == 30U ? 4 : 0;
    if (length == 0 || i + length > text.size() || c == 0xC0U || c == 0xC1U || c > 0xF4U) return i;
    for (std::size_t k = 1; k < length; ++k)
      if (!continues(text[i + k])) return i;
    const auto next = length > 1 ? static_cast<unsigned char>(text[i + 1]) : 0U;
    if ((c == 0xE0U && next < 0xA0U) || (c == 0xEDU && next > 0x9FU) || (c == 0xF0U && next < 0x90U) ||
        (c == 0xF4U && next > 0x8FU))
      return i;  // longer than need be, half a surrogate pair, or past the last character
    i += length;
  }
  return std::string::npos;
}

struct OpenElement {
  std::string name;
  std::size_t at;
};
/// The elements that are open at `end`; the text before it is well formed.
std::vector<OpenElement> open_elements(const std::string& text, std::size_t end) {
  std::vector<OpenElement> open;
  std::size_t i = 0;
  const auto skip_past = [&](const char* mark) {
    const std::size_t found = text.find(mark, i);
    i = found == std::string::npos ? end : found + std::strlen(mark);
  };
  while (true) {
    i = text.find('<', i);
    if (i == std::string::npos || i + 1 >= end) return open;
    if (text.compare(i, 4, "<!--") == 0) {
      skip_past("-->");
    } else if (text.compare(i, 9, "<![CDATA[") == 0) {
      skip_past("]]>");
    } else if (text[i + 1] == '?' || text[i + 1] == '!') {
      skip_past(">");
    } else {
      const bool closes = text[i + 1] == '/';
      const std::size_t name_at = i + (closes ? 2 : 1);
      std::size_t name_end = name_at;
      while (name_end < end && !is_space(text[name_end]) && text[name_end] != '>' && text[name_end] != '/') ++name_end;
      char quote = 0;
      for (i = name_end; i < end && (quote != 0 || text[i] != '>'); ++i) {
        if (quote != 0 ? text[i] == quote : text[i] == '"' || text[i] == '\'') quote = quote != 0 ? '\0' : text[i];
      }
      if (i >= end) return open;
      if (closes) {
        if (!open.empty()) open.pop_back();
      } else if (text[i - 1] != '/') {
        open.push_back({text.substr(name_at, name_end - name_at), name_at});
      }
    }
  }
}

[[noreturn]] void fail_malformed(const SourceText& source, const pugi::xml_parse_result& result) {
  const std::string& text = source.text;
  std::size_t at = std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0)), text.size());
  switch (result.status) {
    case pugi::status_end_element_mismatch: {
      // The offset may lie inside the end tag: look from its beginning.
      if (at < text.size()) {
        const std::size_t tag = text.rfind("</", at + 1);
        if (tag != std::string::npos && text.find('>', tag) >= at) at = tag;
      }
      while (at > 0 && at >= text.size() && is_space(text[at - 1])) --at;
      const std::vector<OpenElement> open = open_elements(text, at);
      if (open.empty())
        source.fail(at, "an end tag that closes nothing; remove it or write the element that it closes");
      const OpenElement& inner = open.back();
      source.fail(at, fmt::format("<{0}> (opened at {1}) is still open; close it with </{0}> first", inner.name,
                                  source.where(inner.at)));
    }
    case pugi::status_bad_attribute:
      source.fail(at, "an attribute that is not well formed; write name=\"value\" with both quotes");
    case pugi::status_bad_start_element:
      source.fail(at,
                  "a start tag that is not well formed; write <name attribute=\"value\"> with each value between two "
                  "quotes");
    case pugi::status_bad_end_element:
      source.fail(at, "an end tag that is not well formed; write </name>");
    case pugi::status_bad_comment:
      source.fail(std::min(at, text.rfind("<!--")), "a comment that does not end; write <!-- ... -->");
    case pugi::status_bad_doctype:
      source.fail(at, "a document type that does not end; scenarios have none: remove it");
    case pugi::status_out_of_memory:
      source.fail(0, "not enough memory to read the file");
    default:
      source.fail(at, fmt::format("not well formed XML ({}); see docs/scenarios.md", result.description()));
  }
}

/// References to characters are fine; others would need a document type.
void check_references(const SourceText& source, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    if (source.text[i] != '&') continue;
    const std::string rest = source.text.substr(i + 1, std::min<std::size_t>(end - i - 1, 12));
    const std::string name = rest.substr(0, rest.find(';'));
    const bool known = name.size() < rest.size() && (name == "amp" || name == "lt" || name == "gt" || name == "quot" ||
                                                     name == "apos" || (name.size() > 1 && name[0] == '#'));
    if (!known) source.fail(i, "an entity that is not one of &amp; &lt; &gt; &quot; &apos;; write &amp; for a plain &");
  }
}

/// pugixml knows where elements are but not their attributes: find these in the text.
void read_attributes(const SourceText& source, const pugi::xml_node& node, XmlElement& element) {
  const std::string& text = source.text;
  std::size_t i = element.at + element.name.size();
  for (const pugi::xml_attribute& attribute : node.attributes()) {
    while (i < text.size() && is_space(text[i])) ++i;
    XmlAttribute read{attribute.name(), attribute.value(), i, i};
    i = text.find('=', i);
    i = i == std::string::npos ? i : text.find_first_of("\"'", i);
    const std::size_t end = i == std::string::npos ? i : text.find(text[i], i + 1);
    if (end == std::string::npos) source.fail(read.name_at, "an attribute that is not well formed");
    read.value_at = i + 1;
    check_references(source, read.value_at, end);
    i = end + 1;
    if (i < text.size() && !is_space(text[i]) && text[i] != '/' && text[i] != '>')
      source.fail(i, "attributes run together; put a space between them");
    if (const XmlAttribute* first = element.find(read.name))
      source.fail(read.name_at, fmt::format("{} is given twice in <{}> (first at {}); keep one", read.name,
                                            element.name, source.where(first->name_at)));
    element.attributes.push_back(std::move(read));
  }
}

XmlElement read_element(const SourceText& source, const pugi::xml_node& node, int depth);

void read_children(const SourceText& source, const pugi::xml_node& node, int depth, std::vector<XmlElement>& children) {
  for (const pugi::xml_node& child : node.children()) {
    auto at = static_cast<std::size_t>(std::max<std::ptrdiff_t>(child.offset_debug(), 0));
    switch (child.type()) {
      case pugi::node_element:
        children.push_back(read_element(source, child, depth + 1));
        break;
      case pugi::node_doctype:
        source.fail(at, "scenarios have no document type and no entities; remove the <!DOCTYPE ...>");
      default:  // text
        while (at < source.text.size() && is_space(source.text[at])) ++at;
        source.fail(at, "text where only elements are expected; values are attributes, remarks go into <!-- ... -->");
    }
  }
}

XmlElement read_element(const SourceText& source, const pugi::xml_node& node, int depth) {
  XmlElement element;
  element.name = node.name();
  element.at = static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0));
  if (depth > depth_limit)
    source.fail(element.at, fmt::format("elements within elements, {} deep; a scenario needs four", depth));
  read_attributes(source, node, element);
  read_children(source, node, depth, element.children);
  return element;
}

}  // namespace

std::string one_line(std::string message) {
  constexpr unsigned char del = 0x7F;
  for (char& c : message)
    if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) == del) c = ' ';
  constexpr std::size_t head = 400, tail = 300;  // bytes kept of a long message: what is wrong, what would be right
  if (message.size() <= head + tail) return message;
  std::size_t begin = head, end = message.size() - tail;
  while (begin > 0 && continues(message[begin])) --begin;
  while (end < message.size() && continues(message[end])) ++end;
  return message.substr(0, begin) + " ... " + message.substr(end);
}

std::string SourceText::where(std::size_t at) const {
  at = std::min(at, text.size());
  int line = 1, column = 1;
  const bool marked = text.compare(0, 3, "\xEF\xBB\xBF") == 0;  // a byte order mark takes no column
  for (std::size_t i = marked ? 3 : 0; i < at; ++i) {
    if (text[i] == '\n') {
      ++line;
      column = 1;
    } else if (!continues(text[i])) {
      ++column;
    }
  }
  return fmt::format("{}:{}:{}", file, line, column);
}

void SourceText::fail(std::size_t at, const std::string& message) const {
  throw InputError(where(at) + ": " + one_line(message));
}

const XmlAttribute* XmlElement::find(const std::string& attribute) const {
  for (const XmlAttribute& candidate : attributes)
    if (candidate.name == attribute) return &candidate;
  return nullptr;
}

SourceText read_text(const std::string& path) {
  SourceText source{path, {}};
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw InputError(path + ": is a folder; name the scenario's .xml file in it");
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream)
    throw InputError(fmt::format("{}: cannot be read ({}); name a scenario's .xml file", path, std::strerror(errno)));
  char block[4096];
  while (stream.read(block, sizeof block), stream.gcount() > 0) {
    source.text.append(block, static_cast<std::size_t>(stream.gcount()));
    if (source.text.size() > size_limit)
      throw InputError(path + ": longer than 16 MB; a scenario is a few lines of XML");
  }
  if (stream.bad()) throw InputError(fmt::format("{}: reading it failed ({})", path, std::strerror(errno)));
  if (const std::size_t bad = first_bad_byte(source.text); bad != std::string::npos)
    source.fail(bad, "this is no UTF-8 text; save the file as UTF-8");
  return source;
}

XmlElement parse_xml(const SourceText& source) {
  // parse_fragment keeps text outside the root, so that it can be refused; a missing root is told below.
  constexpr unsigned int options = pugi::parse_escapes | pugi::parse_cdata | pugi::parse_doctype | pugi::parse_fragment;
  pugi::xml_document document;
  const pugi::xml_parse_result result =
      document.load_buffer(source.text.data(), source.text.size(), options, pugi::encoding_utf8);
  if (!result && result.status != pugi::status_no_document_element) fail_malformed(source, result);

  std::vector<XmlElement> roots;
  read_children(source, document, 0, roots);
  if (source.text.empty()) source.fail(0, "the file is empty; a scenario starts with <scenario title=\"...\">");
  if (roots.empty()) source.fail(0, "no element in this file; a scenario starts with <scenario title=\"...\">");
  if (roots.size() > 1) source.fail(roots[1].at, "a second root element; a file holds one scenario");
  return std::move(roots.front());
}

}  // namespace cb
