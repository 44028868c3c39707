#pragma once
// Several files in one input: each begins with a line "=== NAME".

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace graze::fuzz {

inline constexpr std::string_view kMark = "=== ";

/// Names and contents, in order; what stands before the first mark is lost. A name is made of letters, digits and
/// ._- (anything else would be a place elsewhere).
inline std::vector<std::pair<std::string, std::string>> files_of(std::string_view bundle) {
  std::vector<std::pair<std::string, std::string>> out;
  while (!bundle.empty()) {
    const std::size_t end = std::min(bundle.find('\n'), bundle.size());
    const std::string_view line = bundle.substr(0, end);
    bundle.remove_prefix(std::min(end + 1, bundle.size()));
    if (line.substr(0, kMark.size()) == kMark) {
      std::string name;
      for (const char c : line.substr(kMark.size())) {
        if (std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || (c == '.' && !name.empty()))
          name += c;
      }
      out.emplace_back(name.empty() ? "x" : name.substr(0, 50), "");
    } else if (!out.empty()) {
      out.back().second += line;
      out.back().second += '\n';
    }
  }
  return out;
}

inline std::string bundle_of(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string out;
  for (const auto& [name, content] : files) {
    out.append(kMark).append(name).append("\n").append(content);
    if (!out.empty() && out.back() != '\n') out += '\n';
  }
  return out;
}

}  // namespace graze::fuzz
