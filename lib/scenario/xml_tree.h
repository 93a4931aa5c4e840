#pragma once

#include <string>
#include <vector>

namespace cb {

/// A message on one line: what it quotes may have line ends and control characters, or be very long.
std::string one_line(std::string message);

/// The text of a scenario file, kept whole so that every message can say where.
struct SourceText {
  std::string file;  ///< as the user named it
  std::string text;  ///< UTF-8

  /// "file:line:column", both from 1; columns count characters.
  std::string where(std::size_t at) const;
  /// Throws InputError "file:line:column: message".
  [[noreturn]] void fail(std::size_t at, const std::string& message) const;
};

struct XmlAttribute {
  std::string name, value;
  std::size_t name_at = 0, value_at = 0;  ///< offsets into the text
};
struct XmlElement {
  std::string name;
  std::size_t at = 0;  ///< offset of the name
  std::vector<XmlAttribute> attributes;
  std::vector<XmlElement> children;

  const XmlAttribute* find(const std::string& attribute) const;
};

/// Reads a file of UTF-8 text of at most 16 MB. Throws InputError.
SourceText read_text(const std::string& path);

/// Parses a document made of elements and attributes alone: text between elements, document types, entities of one's
/// own and attributes given twice are errors. Throws InputError.
XmlElement parse_xml(const SourceText& source);

}  // namespace cb
