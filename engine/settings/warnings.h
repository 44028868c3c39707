#pragma once
// What a scenario may say and hardly means: a warning goes to the listener, and reading goes on.

#include <string>
#include <vector>

#include "engine/settings/settings.h"

namespace graze {

/// Keeps what is warned of on this thread while it is alive, each text once, in order. Of several the youngest keeps;
/// without one, warnings go nowhere.
class Warnings {
 public:
  Warnings();
  ~Warnings();
  Warnings(const Warnings&) = delete;
  Warnings& operator=(const Warnings&) = delete;
  void add(const std::string& text);
  const std::vector<std::string>& texts() const { return texts_; }

 private:
  std::vector<std::string> texts_;
  Warnings* outer_;
};

/// Warns with "place: path: message", as Settings::fail.
void warn(const Settings& settings, const std::string& message);
/// Warns with the message as it stands, which names its place.
void warn_as_it_stands(const std::string& message);

}  // namespace graze
