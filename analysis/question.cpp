// Questions of --until and --require as text: `[POLICY:] p >= RATE`, `p < RATE`, `ci < WIDTH`.
#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "analysis/sequential.h"

namespace graze {
namespace {

/// Walks through a text; complaints name the option, the text and the place (characters, from 1).
/// Of an interval: 4e9 particles, the most of a campaign, bring one to 3e-5.
constexpr double kLeastWidth = 1e-5;

class Words {
 public:
  Words(const std::string& text, const std::string& option, std::size_t at) : text_(text), option_(option), at_(at) {}

  /// The next run of letters, or of signs of relation.
  std::string letters() { return take("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"); }
  std::string relation() { return take("<>=!~"); }

  /// A number, in percent if it says so.
  double fraction(const std::string& example, bool narrow) {
    skip_blanks();
    double value = 0;
    const char* const begin = text_.data() + at_;
    const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (error != std::errc{} || !std::isfinite(value)) fail("a number is missing", example);
    const std::string number(begin, end);
    const std::size_t place = at_;
    at_ += number.size();
    skip_blanks();
    const bool percent = at_ < text_.size() && text_[at_] == '%';
    if (percent) ++at_;
    skip_blanks();
    if (at_ < text_.size()) fail(fmt::format("'{}' behind the number", text_.substr(at_)), example);
    const double out = percent ? value / 100 : value;
    at_ = place;
    if (narrow && out > 0 && out < kLeastWidth) {
      fail(fmt::format("{} is narrower than any number of particles makes an interval", number),
           example.substr(0, example.find_last_of(' ') + 1) + fmt::format("{:g}", kLeastWidth));
    }
    if (out > 0 && out < 1) {
      go_to(text_.size());
      return out;
    }
    // 95 was meant as 95 %, and so was a width of 1.5; a rate of 1.5 is anything.
    const bool forgot = !percent && value > 1 && value < 100 && (narrow || value >= 2);
    fail(fmt::format("{}{} is not between 0 and 1, both excluded", number, percent ? " %" : ""),
         forgot ? example.substr(0, example.find_last_of(' ') + 1) + number + "%" : example);
  }

  [[noreturn]] void fail(const std::string& what, const std::string& nearest) const {
    throw InputError(fmt::format("{} '{}':{}: {}; nearest right answer: '{}'", option_, text_, at_ + 1, what, nearest));
  }

  std::size_t at() const { return at_; }
  void go_to(std::size_t place) { at_ = place; }
  void skip_blanks() { at_ = std::min(text_.find_first_not_of(" \t", at_), text_.size()); }

 private:
  std::string take(const char* kind) {
    skip_blanks();
    const std::size_t end = std::min(text_.find_first_not_of(kind, at_), text_.size());
    const std::string word = text_.substr(at_, end - at_);
    at_ = end;
    return word;
  }

  const std::string& text_;
  const std::string& option_;
  std::size_t at_;
};

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

/// The number of a question as it was typed, "0.9" or "90%", if it can be a rate; else empty.
std::string rate_in(const std::string& body) {
  const std::size_t first = body.find_first_of("0123456789");
  if (first == std::string::npos || (first > 0 && body[first - 1] == '-')) return "";
  const std::size_t begin = first > 0 && body[first - 1] == '.' ? first - 1 : first;
  double value = 0;
  const auto [end, error] = std::from_chars(body.data() + begin, body.data() + body.size(), value);
  if (error != std::errc{}) return "";
  const std::string number(body.data() + begin, end);
  const std::size_t behind = body.find_first_not_of(" \t", begin + number.size());
  const bool percent = behind != std::string::npos && body[behind] == '%';
  const double rate = percent ? value / 100 : value;
  if (rate > 0 && rate < 1) return number + (percent ? "%" : "");
  return !percent && value >= 2 && value < 100 ? number + "%" : "";
}

/// The right question that is nearest to a wrong one: its policy, kind, direction and number, as far as they can be
/// told.
std::string repaired(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::string selector = trimmed(text.substr(0, colon == std::string::npos ? 0 : colon));
  std::string body = trimmed(colon == std::string::npos ? text : text.substr(colon + 1));
  // "soft p >= 0.9": the colon was forgotten.
  const std::size_t relation = body.find_first_of("<>=!~");
  const std::string left = trimmed(body.substr(0, relation));
  const std::size_t blank = left.find_last_of(" \t");
  const std::string last = blank == std::string::npos ? left : left.substr(blank + 1);
  if (blank != std::string::npos && (last == "p" || last == "ci") && selector.empty()) {
    selector = trimmed(left.substr(0, blank));
    body = last + body.substr(relation == std::string::npos ? body.size() : relation);
  }
  const bool narrow = body.starts_with("ci");
  const std::size_t sign_at = body.find_first_of("<>=!~");
  const std::string number = rate_in(sign_at == std::string::npos ? body : body.substr(sign_at));
  const std::string sign = narrow || body.find('<') != std::string::npos ? " < " : " >= ";
  return (selector.empty() ? "" : selector + ": ") + (narrow ? "ci" : "p") + sign +
         (!number.empty() ? number
          : narrow        ? "0.02"
                          : "0.95");
}

}  // namespace

std::vector<Question> questions_of(const CampaignInfo& info) {
  std::vector<Question> out;
  for (const std::string& text : info.until.questions) out.push_back(parse_question(text, "--until"));
  return out;
}

double parse_fraction(const std::string& text, const std::string& option) {
  return Words(text, option, 0).fraction("0.95", false);
}

double parse_width(const std::string& text, const std::string& option) {
  return Words(text, option, 0).fraction("0.1", true);
}

Question parse_question(const std::string& text, const std::string& option) {
  Question out;
  out.text = trimmed(text);
  const std::size_t colon = text.rfind(':');
  const std::string right = repaired(text);
  Words words(text, option, colon == std::string::npos ? 0 : colon + 1);
  if (colon != std::string::npos) out.selector = trimmed(text.substr(0, colon));
  if (out.selector.empty()) {
    words.go_to(0);
    words.fail("no policy before ':'", right);
  }
  words.skip_blanks();
  const std::size_t start = words.at();
  const std::string what = words.letters();
  if (what != "p" && what != "ci") {
    words.go_to(start);
    words.fail(fmt::format("'{}' is neither p (the success rate) nor ci (the width of its interval)", what), right);
  }
  words.skip_blanks();
  const std::size_t place = words.at();
  const std::string relation = words.relation();
  const bool above = relation == ">=" || relation == ">", below = relation == "<" || relation == "<=";
  if (what == "ci" ? !below : !above && !below) {
    words.go_to(place);
    const std::string rule = what == "ci" ? "an interval can only be asked to be narrow: ci < WIDTH"
                                          : "a rate is asked to be at least (>=) or below (<) a bound";
    words.fail(fmt::format("'{}': {}", relation, rule), right);
  }
  out.kind = what == "ci" ? Question::Kind::narrow : above ? Question::Kind::rate_above : Question::Kind::rate_below;
  out.bound = words.fraction(right, right.find("ci <") != std::string::npos);
  return out;
}

}  // namespace graze
