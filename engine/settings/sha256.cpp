#include "engine/settings/sha256.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <stdexcept>

#include "engine/settings/regular_file.h"

namespace graze {
namespace {

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    check(context_ && EVP_DigestInit_ex(get(), EVP_sha256(), nullptr));
  }
  void add(const char* bytes, std::size_t count) { check(EVP_DigestUpdate(get(), bytes, count)); }
  std::string digits() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int size = 0;
    check(EVP_DigestFinal_ex(get(), digest.data(), &size));
    std::string out;
    for (unsigned int i = 0; i < size; ++i) out += fmt::format("{:02x}", digest[i]);
    return out;
  }

 private:
  EVP_MD_CTX* get() const { return context_.get(); }
  static void check(int well) {
    if (well != 1) throw std::runtime_error("SHA-256 is not available in this OpenSSL");
  }
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
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
