#pragma once
// What is printed may quote files that anybody wrote: names of policies and links, reasons, texts of archives. One
// place for each way to the terminal takes out what would act on it (archive/files/utf8.h).

#include <ostream>
#include <streambuf>
#include <string>

namespace graze {

/// In place of a stream's buffer while it lives: passes on what is written, escaped.
class EscapedOutput : private std::streambuf {
 public:
  explicit EscapedOutput(std::ostream& stream) : stream_(stream), to_(stream.rdbuf(this)) {}
  ~EscapedOutput() override;
  EscapedOutput(const EscapedOutput&) = delete;
  EscapedOutput& operator=(const EscapedOutput&) = delete;

 private:
  int_type overflow(int_type c) override;
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int sync() override;
  bool give(bool all);

  std::ostream& stream_;
  std::streambuf* to_;
  std::string held_;  // the beginning of a character that is not whole yet
};

/// The program's log on stderr: "graze: message", messages escaped.
void log_to_stderr();
/// What the messages that follow are about: a line of its own before the first of them, and nothing if none follows.
void log_beneath(std::string title);

}  // namespace graze
