#include "jobs/cli/help_format.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>
#include <utility>

#include "jobs/cli/wrapped_text.h"

namespace graze {
namespace {

class WrappedHelp : public CLI::Formatter {
 public:
  WrappedHelp(std::size_t width, std::string usage) : width_(width), usage_(std::move(usage)) {}

  std::string make_usage(const CLI::App* app, std::string name) const override {
    return usage_.empty() ? Formatter::make_usage(app, name) : usage_ + "\n";
  }

  std::string make_option_desc(const CLI::Option* option) const override {
    return in_column(Formatter::make_option_desc(option));
  }

  std::string make_subcommand(const CLI::App* verb) const override {
    std::stringstream out;
    CLI::detail::format_help(out, verb->get_display_name(true), in_column(verb->get_description()), get_column_width());
    return out.str();
  }

  std::string make_description(const CLI::App* app) const override {
    return wrapped(Formatter::make_description(app), width_);
  }

  std::string make_footer(const CLI::App* app) const override {
    std::istringstream lines(Formatter::make_footer(app));
    std::string out;
    for (std::string line; std::getline(lines, line);) {
      out += (line.starts_with(" ") ? line : wrapped(line, width_)) + "\n";
    }
    return out;
  }

 private:
  /// Lines of the right column; the parser indents them.
  std::string in_column(const std::string& text) const {
    const std::size_t column = get_column_width();
    if (width_ == kUnlimited) return text;
    return fmt::format("{}", fmt::join(lines_of(text, width_ > column ? width_ - column : 1), "\n"));
  }

  std::size_t width_;
  std::string usage_;
};

}  // namespace

std::shared_ptr<CLI::Formatter> help_format(std::size_t width, const std::string& usage) {
  return std::make_shared<WrappedHelp>(width, usage);
}

}  // namespace graze
