// Text that may be anybody's: what terminals, CSV cells, files of lines and dictionaries get of it.
#include <fcntl.h>
#include <gmock/gmock.h>

#include <map>

#include "archive/files/csv.h"
#include "archive/files/text_lines.h"
#include "archive/files/utf8.h"
#include "archive/hdf5/file_driver.h"
#include "archive/hdf5/text_spool.h"
#include "tests/archive/compare.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::ElementsAre;

// Claim: the bounds of what is well formed are those of Unicode 15, table 3-7.
TEST(Utf8, KnowsTheBoundsOfWellFormedText) {
  const std::string mark = "\xEF\xBF\xBD";
  for (const std::string good :
       {"\x7F", "\xC2\x80", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF", "\xEF\xBF\xBF"}) {
    EXPECT_EQ(valid_utf8(good), good);
  }
  EXPECT_EQ(valid_utf8("\xC1\xBF"), mark + mark);
  EXPECT_EQ(valid_utf8("\xE0\x9F\xBF"), mark + mark + mark);
  EXPECT_EQ(valid_utf8("\xF0\x8F\xBF\xBF"), mark + mark + mark + mark);
  EXPECT_EQ(valid_utf8("\xF5\x80\x80\x80"), mark + mark + mark + mark);
  EXPECT_EQ(valid_utf8("\xE2\x82z"), mark + mark + "z");
}

// Claim: whatever acts on a terminal is escaped, its neighbours are not.
TEST(Printable, EscapesWhatActs) {
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\u0000b");
  EXPECT_EQ(printable("\x1f \x7e\x7f"), "\\u001f ~\\u007f");
  EXPECT_EQ(printable("\u0080\u009f\u00a0"), "\\u0080\\u009f\u00a0");
  EXPECT_EQ(printable("\u061b\u061c\u061d"), "\u061b\\u061c\u061d");
  EXPECT_EQ(printable("\u200d\u200e\u200f\u2010"), "\u200d\\u200e\\u200f\u2010");
  EXPECT_EQ(printable("\u2027\u2028\u202e\u202f"), "\u2027\\u2028\\u202e\u202f");
  EXPECT_EQ(printable("\u2065\u2066\u2069\u206a"), "\u2065\\u2066\\u2069\u206a");
  EXPECT_EQ(printable("\xff\xC3"), "\\xff\\xc3");
  EXPECT_EQ(printable("a\n\tb"), "a\\u000a\\u0009b");
  EXPECT_EQ(printable_lines("a\n\tb\r\x1b"), "a\n\tb\\u000d\\u001b");
}

// Claim: no line of a message begins where another message would.
TEST(Printable, IndentsTheLinesOfAMessage) {
  EXPECT_EQ(printable_message("a: b\nc: d\n  e\n\nf"), "a: b\n  c: d\n  e\n\n  f");
  EXPECT_EQ(printable_message("\x1b[2J\nx"), "\\u001b[2J\n  x");
}

TEST(Csv, QuotesWhatWouldEndACell) {
  EXPECT_EQ(csv_cell("plain text"), "plain text");
  EXPECT_EQ(csv_cell("a,b"), "\"a,b\"");
  EXPECT_EQ(csv_cell("say \"a\""), "\"say \"\"a\"\"\"");
  EXPECT_EQ(csv_cell("a\nb"), "\"a\nb\"");
  EXPECT_EQ(csv_cell("a\rb"), "\"a\rb\"");
}

/// The lines of a text, of which `most` bytes are read; of long ones their first letter and length.
std::vector<std::string> lines_of(const std::string& text, std::uint64_t most = std::uint64_t{1} << 30) {
  const Folder folder;
  put(folder / "f", text);
  const Descriptor file(open((folder / "f").c_str(), O_RDONLY | O_CLOEXEC));
  std::vector<std::string> out;
  for_each_line(file.number(), most, [&](const std::string& line) {
    out.push_back(line.size() < 100 ? line : line.substr(0, 1) + std::to_string(line.size()));
  });
  return out;
}

// Claim: lines come whole across the pieces in which they are read; one beyond a mebibyte, or beyond the bound on the
// file, is left out, and those around it are not.
TEST(TextLines, ComeWholeAndWithinLimits) {
  EXPECT_THAT(lines_of(""), ElementsAre());
  EXPECT_THAT(lines_of("a\n\nb"), ElementsAre("a", "", "b"));
  constexpr std::size_t kLongest = std::size_t{1} << 20;
  const std::string longest(kLongest, 'x'), longer(kLongest + 1, 'y'), piece(65'535, 'p');
  EXPECT_THAT(lines_of("a\n" + longest + "\n" + longer + "\nb\n"), ElementsAre("a", "x1048576", "b"));
  EXPECT_THAT(lines_of("a\n" + longer), ElementsAre("a"));
  EXPECT_THAT(lines_of(piece + "\n" + piece + "q\nb"), ElementsAre("p65535", "p65536", "b"));
  EXPECT_THAT(lines_of("a\nbcd\nef\n", 4), ElementsAre("a", "bc"));
}

TEST(TextLines, KnowATornEnd) {
  const Folder folder;
  for (const auto& [text, torn] :
       std::map<std::string, bool>{{"", false}, {"a", true}, {"a\n", false}, {"\n", false}}) {
    put(folder / "f", text);
    const Descriptor file(open((folder / "f").c_str(), O_RDONLY | O_CLOEXEC));
    EXPECT_EQ(ends_torn(file.number()), torn) << text;
  }
}

// Claim: a dictionary numbers texts by first appearance and writes each once, also when it is larger than what is held
// and written at a time; what a killed process has left goes, and nothing stays beside the file.
TEST(TextSpool, WritesEachTextOnce) {
  const Folder folder;
  const std::filesystem::path left = folder / "o.h5.texts.0123456789abcdef.tmp";
  put(left, "x");
  std::vector<std::string> want = {"", "µ"};
  for (int i = 0; i < 9000; ++i)
    want.push_back(std::to_string(i) + std::string(static_cast<std::size_t>(i % 500), 'z'));
  TextSpool spool(folder / "o.h5");
  EXPECT_FALSE(std::filesystem::exists(left));
  for (const int round : {0, 1}) {
    for (std::size_t i = 0; i < want.size(); ++i) ASSERT_EQ(spool.number(want[i]), i) << round;
  }
  publish_hdf5(folder / "o.h5", false, [&](const hdf5::Handle& file) { spool.write(file, "texts"); });
  EXPECT_EQ(Directory(folder.path()).names(), std::vector<std::string>{"o.h5"});
  const hdf5::Lock lock;
  EXPECT_TRUE(hdf5::read_strings(hdf5::open_for_reading(folder / "o.h5").id(), "texts") == want);
}

}  // namespace
}  // namespace graze
