#include "jobs/machine/folder_trial.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <sstream>

#include "archive/files/directory.h"
#include "archive/files/files.h"
#include "archive/files/lock.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr const char* kElsewhere = "keep campaigns in another folder (-o), on a local disk or one that has this";

/// A folder in a folder, removed with all that is in it.
class TrialFolder {
 public:
  explicit TrialFolder(const fs::path& parent) : path_((parent / ".graze-doctor-XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) throw MachineError(std::strerror(errno));
  }
  ~TrialFolder() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  TrialFolder(const TrialFolder&) = delete;
  TrialFolder& operator=(const TrialFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Writes a file as all files of an archive are: temporary name, sync, rename, sync of the folder. Returns seconds.
double write_whole(const Directory& folder, const std::string& name) {
  const auto begin = std::chrono::steady_clock::now();
  NewFile file(folder, name);
  const std::string text = "graze doctor tries whether files last\n";
  if (const int error = write_all(file.descriptor(), std::as_bytes(std::span(text))))
    fail_writing(folder / name, error);
  file.publish();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Finding writing_finding(const Directory& folder) {
  Finding out{"folder", "write, fsync", Health::good, ""};
  try {
    write_whole(folder, "a");
    const double seconds = write_whole(folder, "a");  // over one that is there
    out.text = fmt::format("work; {:.1f} ms for a file that survives a power cut", seconds * 1e3);
    out.numbers = {{"seconds", seconds}};
    constexpr double kSlow = 1;  // s; a shard is written every few seconds
    if (seconds > kSlow) {
      out.health = Health::note;
      out.advice = "that is slow: threads wait for it now and then";
    }
  } catch (const std::runtime_error& error) {
    out = {"folder", "write, fsync", Health::broken, error.what(), kElsewhere};
  }
  return out;
}

Finding rename_finding(const Directory& folder) {
  const auto broken = [](const char* what, int error) {
    return Finding{"folder", "renames", Health::broken, fmt::format("{}: {}", what, std::strerror(error)), kElsewhere};
  };
  const auto make = [&](const char* name) { folder.open_to_change(name, O_RDWR); };
  try {
    make("from"), make("to");
    if (const int error = folder.rename("from", "to")) return broken("over a file that is there", error);
    make("from");
    if (const int error = folder.rename_new("from", "to"); error != EEXIST) {
      return broken("a file that must not be replaced was", error);
    }
    if (const int error = folder.rename_new("from", "new")) return broken("to a new name", error);
  } catch (const std::runtime_error& error) {
    return {"folder", "renames", Health::broken, error.what(), kElsewhere};
  }
  return {"folder", "renames", Health::good, "work, and replace nothing that they must not"};
}

/// Network file systems whose locks end at the node, by their options.
bool locks_of_one_node(const Mount& mount) {
  const auto has = [&](const std::string& word) {
    return ("," + mount.options + ",").find("," + word + ",") != std::string::npos;
  };
  const bool network = mount.type.starts_with("nfs") || mount.type == "lustre";
  return network && (has("nolock") || has("localflock") || has("local_lock=all") || has("local_lock=posix"));
}

Finding lock_finding(const Directory& folder, const Mount& mount) {
  Finding out{"folder", "locks", Health::good, "work"};
  try {
    const std::string problem = why_no_locks(folder);
    if (!problem.empty()) {
      out.health = Health::note;
      out.text = problem;
      out.advice = "take care yourself that only one program writes to a campaign (run, resume)";
    } else if (locks_of_one_node(mount)) {
      out.health = Health::note;
      out.text = fmt::format("work on this node alone ({} is mounted without those of others)", mount.point);
      out.advice = "take care yourself that only one job writes to a campaign";
    }
  } catch (const std::runtime_error& error) {
    out = {"folder", "locks", Health::broken, error.what(), kElsewhere};
  }
  return out;
}

Finding space_finding(const fs::path& folder, const Mount& mount) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  const std::string where = mount.type.empty() ? "" : fmt::format(" on {} ({})", mount.point, mount.type);
  if (error) return {"folder", "space", Health::note, "cannot be told" + where};
  const auto free = static_cast<double>(space.available);
  Finding out{"folder", "space", Health::good, fmt::format("{:.1f} GB free{}", free / 1e9, where), "", {}};
  out.numbers = {{"free_bytes", free}};
  constexpr double kLittle = 1e8;
  if (free < kLittle) {
    out.health = Health::note;
    out.advice = "that is little; graze check SCENARIO -n N tells how much a campaign takes";
  }
  return out;
}

/// "\040" is a blank, and so on.
std::string unescaped(const std::string& word) {
  constexpr int kOctal = 8, kDigits = 3;
  std::string out;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (word[i] == '\\' && i + kDigits < word.size()) {
      out += static_cast<char>(std::stoi(word.substr(i + 1, kDigits), nullptr, kOctal));
      i += kDigits;
    } else {
      out += word[i];
    }
  }
  return out;
}

std::string mount_table() {
  std::ifstream in("/proc/self/mountinfo");
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

Mount mount_of(const fs::path& path, const std::string& table) {
  Mount out;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    // "36 35 98:0 /root /mnt rw,noatime master:1 - ext3 /dev/sda1 rw,errors=continue"
    std::istringstream words(line);
    std::string skipped, point, options, type, more;
    words >> skipped >> skipped >> skipped >> skipped >> point >> options;
    while (words >> skipped && skipped != "-") {
    }
    if (!(words >> type >> skipped >> more)) continue;
    point = unescaped(point);
    const std::string text = path.string(), folder = point == "/" ? "/" : point + "/";
    const bool within = text == point || text.starts_with(folder);
    if (within && point.size() >= out.point.size())
      out = {type, options + "," + more, point};  // the last covers others
  }
  return out;
}

std::vector<Finding> folder_findings(const fs::path& folder) {
  const Directory given(folder);
  const fs::path whole = fs::canonical(folder);
  const Mount mount = mount_of(whole, mount_table());
  std::vector<Finding> out = {{"folder", "path", Health::good, whole.string()}, space_finding(whole, mount)};
  std::optional<TrialFolder> trial;
  try {
    trial.emplace(whole);
  } catch (const MachineError& error) {
    out.push_back({"folder", "write, fsync", Health::broken,
                   fmt::format("no folder can be made here: {}", error.what()),
                   "name a folder where you may write: graze doctor FOLDER"});
    return out;
  }
  const Directory scratch(trial->path());
  out.push_back(writing_finding(scratch));
  out.push_back(rename_finding(scratch));
  out.push_back(lock_finding(scratch, mount));
  return out;
}

}  // namespace graze
