// The checksum and the text filter that archives rely on.
#include "archive/files/seal.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string_view>

#include "archive/files/utf8.h"

namespace graze {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

std::uint64_t hash_of(std::string_view text) {
  Xxh64 hash;
  hash.update(bytes_of(text));
  return hash.digest();
}

// Claim: XXH64 as published (values of the reference implementation, and of one written anew from the specification),
// for all that can be left behind the last stripe: eights, fours and single bytes.
TEST(Seal, HashIsXxh64) {
  EXPECT_EQ(hash_of(""), 0xEF46DB3751D8E999u);
  EXPECT_EQ(hash_of("a"), 0xD24EC4F1A98C6E5Bu);
  EXPECT_EQ(hash_of("abc"), 0x44BC2CF5AD770999u);
  EXPECT_EQ(hash_of("abcd"), 0xDE0327B0D25D92CCu);
  EXPECT_EQ(hash_of("xxhash"), 0x32DD38952C4BC720u);
  EXPECT_EQ(hash_of("0123456789abcdef"), 0x5C5B90C34E376D0Bu);
  std::string rising;
  for (int i = 0; i <= 100; ++i) rising += static_cast<char>(i);
  EXPECT_EQ(hash_of(rising), 0xE99038495F85381Eu);
  EXPECT_EQ(hash_of("Nobody inspects the spammish repetition"), 0xFBCEA83C8A378BF1u);
}

// Claim: feeding in pieces of any size gives the hash of the whole.
TEST(Seal, HashDoesNotDependOnPieces) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += static_cast<char>(i * 31);
  for (const std::size_t piece : {1u, 7u, 31u, 32u, 33u, 100u}) {
    Xxh64 hash;
    for (std::size_t i = 0; i < text.size(); i += piece) hash.update(bytes_of(std::string_view(text).substr(i, piece)));
    EXPECT_EQ(hash.digest(), hash_of(text)) << piece;
  }
}

// Claim: valid UTF-8 stays; each byte that is not part of a well-formed sequence becomes U+FFFD.
TEST(Utf8, RepairsOnlyWhatIsBroken) {
  const std::string good = "a\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80";
  const std::string mark = "\xEF\xBF\xBD";
  EXPECT_EQ(valid_utf8(good), good);
  EXPECT_EQ(valid_utf8("\xC3"), mark);                                   // cut short
  EXPECT_EQ(valid_utf8("\xC0\x80"), mark + mark);                        // overlong
  EXPECT_EQ(valid_utf8("\xED\xA0\x80"), mark + mark + mark);             // surrogate
  EXPECT_EQ(valid_utf8("\xF4\x90\x80\x80"), mark + mark + mark + mark);  // beyond U+10FFFF
  EXPECT_EQ(valid_utf8(std::string_view("a\0b", 3)), "a" + mark + "b");
}

}  // namespace
}  // namespace graze
