#pragma once
// JSON files by which a verb goes on after a kill: they say what they are and of which version, appear whole or not at
// all, and have a seal, so that one that was changed is refused rather than believed.

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/settings/settings.h"

namespace graze {

struct SealedKind {
  const char* format;  // "graze sweep"
  int version;         // the newest that this program knows
  const char* what;    // "description of a sweep", for messages
  std::size_t most;    // bytes
};

/// `content` with its format, version and seal, as text.
std::string sealed_text(const nlohmann::ordered_json& content, const SealedKind& kind);
/// Puts sealed_text() in the place of what was there. Throws MachineError.
void write_sealed(const std::filesystem::path& folder, const char* name, const nlohmann::ordered_json& content,
                  const SealedKind& kind);
/// Throws InputError and what JSON throws.
nlohmann::ordered_json parse_sealed(const std::string& file, const SealedKind& kind);

/// What `read` makes of a file's content. Throws InputError with the file's name: of another kind, newer, damaged,
/// changed, or what `read` throws.
template <class Read>
auto read_sealed(const std::string& file, const SealedKind& kind, const Read& read) {
  try {
    return read(parse_sealed(file, kind));
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: is damaged, or no {}: {}", file, kind.what, error.what()));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", file, error.what()));
  }
}

}  // namespace graze
