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

void warn_as_it_stands(const std::string& message) {
  if (listening) listening->add(message);
}

void warn(const Settings& settings, const std::string& message) {
  if (!listening) return;
  const std::string path = settings.path();
  listening->add(fmt::format("{}: {}{}{}", settings.place(), path, path.empty() ? "" : ": ", message));
}

}  // namespace graze
