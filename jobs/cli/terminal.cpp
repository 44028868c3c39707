#include "jobs/cli/terminal.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <mutex>
#include <utility>

#include "archive/files/utf8.h"

namespace graze {
namespace {

/// How many bytes at the end of a text begin a character of UTF-8 that goes on.
std::size_t unfinished_bytes(std::string_view text) {
  constexpr std::size_t kLongest = 4;
  for (std::size_t back = 1; back <= std::min(kLongest - 1, text.size()); ++back) {
    const auto byte = static_cast<unsigned char>(text[text.size() - back]);
    if ((byte & 0xC0u) == 0x80u) continue;
    const std::size_t length = byte >= 0xF0 ? 4 : byte >= 0xE0 ? 3 : byte >= 0xC0 ? 2 : 1;
    return length > back ? back : 0;
  }
  return 0;
}

/// What log_beneath() was told, once.
struct Title {
  std::mutex mutex;
  std::string text;
};
Title& title_of_log() {
  static Title title;
  return title;
}

/// What goes on is told from what ends a command, whose message has no such word.
class EscapedMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    std::string text = message.level == spdlog::level::warn ? "warning: " : "";
    text += printable_message({message.payload.data(), message.payload.size()});
    Title& title = title_of_log();
    const std::lock_guard lock(title.mutex);
    if (!title.text.empty()) text = printable_message(std::exchange(title.text, {})) + "\ngraze: " + text;
    out.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override { return std::make_unique<EscapedMessage>(); }
};

}  // namespace

EscapedOutput::~EscapedOutput() {
  give(true);
  stream_.rdbuf(to_);
}

bool EscapedOutput::give(bool all) {
  const std::size_t size = held_.size() - (all ? 0 : unfinished_bytes(held_));
  const std::string text = printable_lines(std::string_view(held_).substr(0, size));
  held_.erase(0, size);
  return to_->sputn(text.data(), static_cast<std::streamsize>(text.size())) ==
         static_cast<std::streamsize>(text.size());
}

EscapedOutput::int_type EscapedOutput::overflow(int_type c) {
  if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
  held_ += traits_type::to_char_type(c);
  return give(false) ? c : traits_type::eof();
}

std::streamsize EscapedOutput::xsputn(const char* text, std::streamsize size) {
  held_.append(text, static_cast<std::size_t>(size));
  return give(false) ? size : 0;
}

int EscapedOutput::sync() { return give(true) ? to_->pubsync() : -1; }

void log_beneath(std::string title) {
  const std::lock_guard lock(title_of_log().mutex);
  title_of_log().text = std::move(title);
}

void log_to_stderr() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("graze"));
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<EscapedMessage>('*').set_pattern("%n: %*");
  spdlog::set_formatter(std::move(formatter));
}

}  // namespace graze
