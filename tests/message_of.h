#pragma once
// What a refusal says.

#include <functional>
#include <string>

#include "engine/settings/settings.h"

namespace graze::testing {

/// The message of the InputError that `action` throws; "(accepted)" if it throws none.
inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& e) {
    return e.what();
  }
  return "(accepted)";
}

}  // namespace graze::testing
