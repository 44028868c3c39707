#include "archive/directory/unfinished.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <span>
#include <tuple>

#include "archive/files/files.h"
#include "archive/files/text_lines.h"
#include "archive/files/utf8.h"

namespace graze {
namespace {

constexpr std::uint64_t kMostUnfinishedBytes = std::uint64_t{64} << 20;  // some 400,000 lines

/// Waits for its turn: on network file systems appending is only safe under a lock.
void lock(int descriptor) {
  struct flock whole {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  while (fcntl(descriptor, F_OFD_SETLKW, &whole) != 0 && errno == EINTR) {
  }
}

}  // namespace

void add_unfinished(const Directory& directory, const UnfinishedTrace& trace) {
  nlohmann::ordered_json line;
  line["policy"] = trace.policy;
  line["particle"] = trace.particle;
  line["reason"] = valid_utf8(trace.reason);
  if (trace.by_controller) line["by"] = "controller";
  std::string text = line.dump() + "\n";
  const Descriptor file = directory.open_to_change(kUnfinishedFile, O_RDWR | O_APPEND);
  lock(file.number());
  if (ends_torn(file.number())) text.insert(text.begin(), '\n');
  if (const int error = write_all(file.number(), std::as_bytes(std::span(text)))) {
    fail_writing(directory / kUnfinishedFile, error);
  }
  if (fsync(file.number()) != 0) fail_writing(directory / kUnfinishedFile, errno);
  directory.sync();
}

std::vector<UnfinishedTrace> read_unfinished(const Directory& directory) {
  std::vector<UnfinishedTrace> traces;
  const auto file = directory.find_file(kUnfinishedFile);
  if (!file) return traces;
  for_each_line(file->number(), kMostUnfinishedBytes, [&](const std::string& line) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object()) return;
    try {
      const bool by_controller = json.contains("by") && json.at("by") == "controller";
      traces.push_back({json.at("policy"), json.at("particle"), json.at("reason"), by_controller});
    } catch (const nlohmann::json::exception&) {
      return;
    }
  });
  const auto key = [](const UnfinishedTrace& trace) { return std::tie(trace.policy, trace.particle); };
  std::stable_sort(traces.begin(), traces.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  traces.erase(
      std::unique(traces.begin(), traces.end(), [&](const auto& a, const auto& b) { return key(a) == key(b); }),
      traces.end());
  return traces;
}

void forget_unfinished(const Directory& directory) {
  const int error = directory.remove(kUnfinishedFile);
  if (error != 0 && error != ENOENT) fail_writing(directory / kUnfinishedFile, error);
}

}  // namespace graze
