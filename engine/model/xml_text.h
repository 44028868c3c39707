#pragma once
// XML as other people write it, before the library takes it apart.

#include <tinyxml2.h>

#include <optional>
#include <string>

namespace graze {

/// What keeps a text from being read as XML.
struct XmlFault {
  int line;          // from 1
  std::string what;  // "not XML (…)" and the like
};

/// Parses `text` into `document`, or tells what is wrong: what the library says of it, in words; an element of more
/// than kMaxXmlAttributes attributes, since the library's time grows with the square of their number; and entities that
/// the document declares, which the library would leave as they are written.
std::optional<XmlFault> read_xml(const std::string& text, tinyxml2::XMLDocument& document);

}  // namespace graze
