#include "engine/model/xml_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "engine/model/limits.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

/// Looks at tags only: what is within them is the library's.
class TagScan {
 public:
  explicit TagScan(std::string_view text) : text_(text) {}

  std::optional<XmlFault> run() {
    while ((at_ = text_.find('<', at_)) != std::string_view::npos) {
      if (skip("<!--", "-->") || skip("<![CDATA[", "]]>") || skip("<?", "?>")) continue;
      const std::size_t begin = at_++;
      if (auto fault = text_.substr(begin, 2) == "<!" ? declaration(begin) : element(begin)) return fault;
    }
    return std::nullopt;
  }

 private:
  bool skip(std::string_view open, std::string_view close) {
    if (text_.substr(at_, open.size()) != open) return false;
    const std::size_t end = text_.find(close, at_ + open.size());
    at_ = end == std::string_view::npos ? text_.size() : end + close.size();
    return true;
  }

  std::optional<XmlFault> declaration(std::size_t begin) {
    const std::size_t end = std::min(text_.find("]>", begin), text_.size()), close = text_.find('>', begin);
    const std::string_view whole = text_.substr(begin, end - begin);
    const std::size_t entity = whole.find("<!ENTITY");
    if (whole.find('[') < close - begin && entity != std::string_view::npos) {
      return XmlFault{line_of(begin + entity),
                      "<!ENTITY>: entities are not read; write what they stand for in their places"};
    }
    return std::nullopt;
  }

  std::optional<XmlFault> element(std::size_t begin) {
    std::size_t attributes = 0;
    for (char quote = 0; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (quote != 0) {
        if (c == quote) quote = 0;
      } else if (c == '"' || c == '\'') {
        quote = c;
      } else if (c == '=' && ++attributes > kMaxXmlAttributes) {
        const std::string_view rest = text_.substr(begin + 1);
        return XmlFault{line_of(begin),
                        fmt::format("<{}> has more than {} attributes",
                                    clipped(rest.substr(0, rest.find_first_of(" \t\r\n=/>")), 40), kMaxXmlAttributes)};
      } else if (c == '>' || c == '<') {
        return std::nullopt;
      }
    }
    return std::nullopt;
  }

  int line_of(std::size_t at) const {
    return 1 + static_cast<int>(std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

std::string in_words(tinyxml2::XMLError error) {
  switch (error) {
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE:
      return "an attribute that is there twice, or is not name=\"value\"";
    case tinyxml2::XML_ERROR_PARSING_ELEMENT:
      return "a tag that does not end";
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT:
      return "an element that is closed by another's name, or not at all";
    case tinyxml2::XML_ERROR_PARSING_COMMENT:
      return "a comment that does not end";
    case tinyxml2::XML_ERROR_PARSING_CDATA:
      return "CDATA that do not end";
    case tinyxml2::XML_ERROR_PARSING_DECLARATION:
      return "<?…?> after the first element, or one that does not end";
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT:
      return "there is nothing in it";
    case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED:
      return "elements too deep in each other";
    default:
      return tinyxml2::XMLDocument::ErrorIDToName(error);
  }
}

}  // namespace

std::optional<XmlFault> read_xml(const std::string& text, tinyxml2::XMLDocument& document) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    return XmlFault{1, "not XML that can be read (it is UTF-16; save it as UTF-8)"};
  }
  if (auto fault = TagScan(text).run()) return fault;
  if (document.Parse(text.data(), text.size()) == tinyxml2::XML_SUCCESS) return std::nullopt;
  return XmlFault{std::max(document.ErrorLineNum(), 1), fmt::format("not XML ({})", in_words(document.ErrorID()))};
}

}  // namespace graze
