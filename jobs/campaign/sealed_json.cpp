#include "jobs/campaign/sealed_json.h"

#include <span>

#include "archive/files/files.h"
#include "engine/settings/inputs.h"
#include "engine/settings/sha256.h"

namespace graze {
namespace {

using Document = nlohmann::ordered_json;

std::string text_of(const Document& json, int indent) {
  return json.dump(indent, ' ', false, Document::error_handler_t::replace);
}

/// Of all that the file says, but for its seal.
std::string seal_of(Document json) {
  json.erase("seal");
  return sha256_of(text_of(json, -1));
}

}  // namespace

std::string sealed_text(const Document& content, const SealedKind& kind) {
  Document json = {{"format", kind.format}, {"format_version", kind.version}};
  json.update(content);
  json["seal"] = seal_of(json);
  return text_of(json, 1) + "\n";
}

void write_sealed(const std::filesystem::path& folder, const char* name, const Document& content,
                  const SealedKind& kind) {
  const std::string text = sealed_text(content, kind);
  NewFile file(Directory(folder), name);
  const int error = write_all(file.descriptor(), std::as_bytes(std::span(text)));
  if (error != 0) fail_writing(folder / name, error);
  file.publish();
}

Document parse_sealed(const std::string& file, const SealedKind& kind) {
  Document json = Document::parse(read_input(file, "", kind.most));
  if (json.at("format") != kind.format) throw InputError(fmt::format("is no {}", kind.what));
  if (const int version = json.at("format_version").get<int>(); version > kind.version) {
    throw InputError(
        fmt::format("has format version {}, newer than version {}, which this program knows; use a newer Graze",
                    version, kind.version));
  }
  if (json.at("seal") != seal_of(json)) throw InputError("is damaged: it is not as it was written (its seal differs)");
  return json;
}

}  // namespace graze
