#include "engine/settings/warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace graze {
namespace {

/// The record that is alive on this thread.
thread_local Warnings* listening = nullptr;

}  // namespace

Warnings::Warnings() : outer_(std::exchange(listening, this)) {}
Warnings::~Warnings() { listening = outer_; }

void Warnings::add(const std::string& text) {
  if (std::find(texts_.begin(), texts_.end(), text) == texts_.end()) texts_.push_back(text);
}

void warn(const Settings& settings, const std::string& message) {
  if (!listening) return;
  const std::string path = settings.path();
  listening->add(fmt::format("{}: {}{}{}", settings.place(), path, path.empty() ? "" : ": ", message));
}

std::string clipped(const std::string& text) {
  constexpr std::size_t kShown = 80;
  if (text.size() <= kShown) return text;
  std::size_t cut = kShown;
  while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xc0) == 0x80) --cut;  // not inside a UTF-8 character
  return text.substr(0, cut) + "…";
}

}  // namespace graze
