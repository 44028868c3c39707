#include "archive/files/text_lines.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>

namespace graze {

void for_each_line(int descriptor, std::uint64_t most_bytes, const std::function<void(const std::string&)>& take) {
  constexpr std::size_t kLongest = std::size_t{1} << 20, kPiece = std::size_t{1} << 16;
  std::string piece(kPiece, '\0'), line;
  bool too_long = false;
  const auto end_line = [&] {
    if (!too_long) take(line);
    line.clear();
    too_long = false;
  };
  for (std::uint64_t done = 0; done < most_bytes;) {
    const ssize_t got =
        pread(descriptor, piece.data(), std::min<std::uint64_t>(kPiece, most_bytes - done), static_cast<off_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::uint64_t>(got);
    std::string_view rest(piece.data(), static_cast<std::size_t>(got));
    for (std::size_t at = rest.find('\n'); !rest.empty(); at = rest.find('\n')) {
      const std::string_view part = rest.substr(0, at);
      too_long = too_long || line.size() + part.size() > kLongest;
      if (!too_long) line += part;
      rest.remove_prefix(std::min(rest.size(), part.size() + (at == std::string_view::npos ? 0 : 1)));
      if (at != std::string_view::npos) end_line();
    }
  }
  if (!line.empty()) end_line();
}

bool ends_torn(int descriptor) {
  const off_t size = lseek(descriptor, 0, SEEK_END);
  char last = '\n';
  return size > 0 && pread(descriptor, &last, 1, size - 1) == 1 && last != '\n';
}

}  // namespace graze
