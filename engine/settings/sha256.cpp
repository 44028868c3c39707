#include "engine/settings/sha256.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <nettle/sha2.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>

#include "engine/settings/regular_file.h"

namespace graze {
namespace {

class Sha256 {
 public:
  Sha256() { sha256_init(&context_); }
  void add(const char* bytes, std::size_t count) {
    sha256_update(&context_, count, reinterpret_cast<const std::uint8_t*>(bytes));
  }
  std::string digits() {
    std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest{};
    sha256_digest(&context_, digest.size(), digest.data());
    std::string out;
    for (const std::uint8_t byte : digest) out += fmt::format("{:02x}", byte);
    return out;
  }

 private:
  sha256_ctx context_;
};

}  // namespace

std::string sha256_of(const std::string& text) {
  Sha256 sum;
  sum.add(text.data(), text.size());
  return sum.digits();
}

std::optional<std::string> sha256_of_file(const std::string& file) {
  const OpenedFile opened = open_regular(AT_FDCWD, file.c_str(), O_RDONLY, Links::followed);
  if (!opened.file) return std::nullopt;
  Sha256 sum;
  std::array<char, 1 << 16> piece;
  while (true) {
    const ssize_t got = read(opened.file.number(), piece.data(), piece.size());
    if (got == 0) return sum.digits();
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    sum.add(piece.data(), static_cast<std::size_t>(got));
  }
}

}  // namespace graze
