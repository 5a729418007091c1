// XML as photometric files use it: elements, attributes and text, in UTF-8, ISO-8859-1, or UTF-16
// with its mark. A document type is refused, and with
// it every entity that a file could define for itself; so are files of more than 2^21 elements, or
// nested more than 64 deep. Names are without their namespace's prefix.
//
// "Extensible Markup Language (XML) 1.0", W3C, fifth edition.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace luxfield::formats {

struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string text;  // its own, without what lies in children; trimmed, UTF-8
  std::vector<XmlElement> children;
  std::size_t line = 1;

  // The first child of that name, or none.
  const XmlElement* child(std::string_view name) const;
  // The same of children's children; none where one is missing.
  const XmlElement* at(std::initializer_list<std::string_view> path) const;
  // Text of a child, or "".
  std::string text_of(std::string_view name) const;
  // Value of an attribute, or "".
  std::string attribute(std::string_view name) const;
};

// The document's element. Throws InputError naming file and line.
XmlElement ParseXml(std::string_view text, const std::string& file);

// Text as the content of an element: markup escaped, what XML does not have shown as core::Visible
// does.
std::string XmlEscaped(std::string_view utf8);

}  // namespace luxfield::formats
