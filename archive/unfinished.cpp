#include "archive/unfinished.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <tuple>

#include "archive/files.h"
#include "archive/utf8.h"

namespace graze {
namespace {

/// Waits for its turn: on network file systems appending is only safe under a lock.
void lock(int descriptor) {
  struct flock whole {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  while (fcntl(descriptor, F_OFD_SETLKW, &whole) != 0 && errno == EINTR) {
  }
}

}  // namespace

void add_unfinished(const std::filesystem::path& directory, const UnfinishedTrace& trace) {
  const std::filesystem::path path = directory / kUnfinishedFile;
  nlohmann::ordered_json line;
  line["policy"] = trace.policy;
  line["particle"] = trace.particle;
  line["reason"] = valid_utf8(trace.reason);
  const std::string text = line.dump() + "\n";
  const Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (file.number() < 0) fail_writing(path, errno);
  lock(file.number());
  if (const int error = write_all(file.number(), std::as_bytes(std::span(text)))) fail_writing(path, error);
  if (fsync(file.number()) != 0) fail_writing(path, errno);
}

std::vector<UnfinishedTrace> read_unfinished(const std::filesystem::path& directory) {
  std::vector<UnfinishedTrace> traces;
  std::ifstream in(directory / kUnfinishedFile);
  for (std::string line; std::getline(in, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object()) continue;
    try {
      traces.push_back({json.at("policy"), json.at("particle"), json.at("reason")});
    } catch (const nlohmann::json::exception&) {
      continue;
    }
  }
  const auto key = [](const UnfinishedTrace& trace) { return std::tie(trace.policy, trace.particle); };
  std::stable_sort(traces.begin(), traces.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  traces.erase(
      std::unique(traces.begin(), traces.end(), [&](const auto& a, const auto& b) { return key(a) == key(b); }),
      traces.end());
  return traces;
}

void forget_unfinished(const std::filesystem::path& directory) {
  const std::filesystem::path path = directory / kUnfinishedFile;
  if (unlink(path.c_str()) != 0 && errno != ENOENT) fail_writing(path, errno);
}

}  // namespace graze
