#include "archive/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/campaign_files.h"
#include "archive/directory/damaged.h"
#include "archive/directory/finished.h"
#include "archive/directory/newer_format.h"
#include "archive/directory/set_aside.h"
#include "archive/files/directory.h"
#include "archive/files/seal.h"
#include "archive/files/shell_word.h"
#include "archive/hdf5/file_driver.h"
#include "archive/hdf5/reading_child.h"
#include "archive/schema/info.h"
#include "archive/schema/part_check.h"
#include "archive/schema/trace_scan.h"
#include "engine/settings/paths.h"

namespace graze {
namespace {

namespace fs = std::filesystem;
using FileState = VerifiedFile::State;

std::string without_name(const std::string& message, const fs::path& file) {
  const std::string name = file.string() + ": ";
  return message.rfind(name, 0) == 0 ? message.substr(name.size()) : message;
}

/// Facts of a packed campaign, from a file whose seal fits. Throws InputError.
StoredInfo info_of(const Descriptor& file, const fs::path& path) {
  const hdf5::Lock lock;
  const ReadingNote note(path);
  try {
    StoredInfo stored = read_info(hdf5::open_for_reading(file.number()));
    if (stored.layout == Layout::packed) return stored;
    throw hdf5::Error("only describes a campaign; give the directory that it lies in");
  } catch (const hdf5::Error& error) {
    throw InputError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

/// Counts the traces of sound parts, each once.
void count_sound(Parts parts, const CampaignInfo& info, Verification& out) {
  const hdf5::Lock lock;
  out.total = info.part.count(info.particles) * info.policies.size();
  try {
    for (const std::string& policy : info.policies) out.traces += count_traces(parts, policy, info);
  } catch (const InputError& error) {
    out.faults.push_back(error.what());
    out.soundness = Soundness::damaged;
  }
  parts = Parts({}, {}, 0);  // closed under the lock
}

class DirectoryCheck {
 public:
  explicit DirectoryCheck(const fs::path& path) : directory_(path) {}

  Verification check() {
    out_.writer = writer_of(directory_);
    check_lock();
    ReplacingState state = interrupted_replacing(directory_);
    list_newer();
    if (state.what == Replacing::comes_back || state.what == Replacing::stuck) return half_replaced(std::move(state));
    check_descriptions();
    check_list();
    list_others();
    const std::vector<fs::path> shards = check_shards();
    if (!info_) return std::move(out_);
    count_sound(Parts(shards, counting(*info_), kInShards), *info_, out_);
    check_damaged_folder();
    const bool mendable = std::any_of(out_.files.begin(), out_.files.end(), [](const VerifiedFile& file) {
      // Older archives have no copy of their description, and are whole without.
      return file.state == FileState::damaged || (file.state == FileState::missing && file.name != kDescriptionCopy);
    });
    if (out_.soundness == Soundness::whole && (mendable || out_.traces < out_.total || !complete_)) {
      out_.soundness = Soundness::incomplete;
    }
    return std::move(out_);
  }

 private:
  void add(const std::string& name, FileState state, std::string what, std::uint64_t traces = 0) {
    out_.files.push_back({name, state, traces, std::move(what)});
  }

  void fault(std::string text) {
    out_.faults.push_back(std::move(text));
    out_.soundness = Soundness::damaged;
  }

  /// What a newer program has written: for its sake resume refuses.
  void list_newer() {
    for (NewerFile& one : newer_files(directory_)) {
      add(one.name, FileState::newer, std::move(one.why) + "; 'graze resume' refuses it");
      out_.soundness = Soundness::damaged;
    }
  }
  bool is_newer(const std::string& name) const {
    return std::any_of(out_.files.begin(), out_.files.end(),
                       [&](const VerifiedFile& file) { return file.state == FileState::newer && file.name == name; });
  }

  /// Between an old campaign and the one that was to replace it: resume decides first, if it can.
  Verification half_replaced(ReplacingState state) {
    const char* const name = directory_.has(kReplacedFolder) ? kReplacedFolder : kReplacingFolder;
    const bool stuck = state.what == Replacing::stuck;
    add(name, FileState::set_aside,
        stuck ? "stays as it is" : without_name(replacing_text(directory_), directory_.path()));
    if (stuck) fault(std::move(state.why));
    if (!stuck && !comes_back_described(*directory_.find(name))) fault(kUndescribed);
    if (out_.soundness == Soundness::whole || out_.writer) out_.soundness = Soundness::incomplete;
    return std::move(out_);
  }

  /// Whether what comes back from a folder has a description that is of use.
  bool comes_back_described(const Directory& folder) {
    for (const Directory& place : {folder, directory_}) {
      // What the new campaign in the directory itself is described by goes.
      if (place.path() == directory_.path() && folder.path().filename() == kReplacedFolder) continue;
      for (const DescriptionFile& file : description_files(place)) {
        if (file.stored) return true;
      }
    }
    return false;
  }

  /// What resume could not write into.
  void check_lock() {
    if (std::string text = lock_fault(directory_); !text.empty()) fault(std::move(text));
  }

  /// Of unfinished traces.
  void check_list() {
    const std::string why = why_no_list(directory_);
    if (why.empty()) {
      out_.unfinished = read_unfinished(directory_).size();
    } else {
      add(kUnfinishedFile, FileState::damaged, fmt::format("{}; {}", why, kPutThere));
      puts_aside_ = true;
    }
  }

  /// Where resume puts what is damaged.
  void check_damaged_folder() {
    const std::string why = why_not_put_aside(directory_);
    if (puts_aside_ && !why.empty()) fault(fmt::format("{}; 'graze resume' needs the place: move it away", why));
  }

  void check_descriptions() {
    if (!directory_.has(kDescriptionFile) && !directory_.has(kDescriptionCopy) && shard_names(directory_).empty()) {
      throw InputError(no_campaign_text(directory_));
    }
    std::vector<DescriptionFile> files = description_files(directory_);
    const auto described = std::find_if(files.begin(), files.end(), [](const auto& file) { return !!file.stored; });
    for (const DescriptionFile& file : files) {
      if (is_newer(file.name)) continue;
      std::string what = file.why;
      if (described != files.end() && !file.stored) {
        what += fmt::format("; {}", file.in_the_way() ? kPutThereAndAnew : kAnew);
        puts_aside_ |= file.in_the_way();
      }
      add(file.name, file.stored ? FileState::whole : file.there ? FileState::damaged : FileState::missing, what);
    }
    if (described == files.end()) {
      const bool newer = is_newer(kDescriptionFile) || is_newer(kDescriptionCopy);  // a newer program has its facts
      return newer ? void() : fault(kUndescribed);
    }
    complete_ = described->stored->complete;
    info_ = std::move(described->stored->info);
  }

  /// What is neither description nor shard.
  void list_others() {
    if (interrupted_replacing(directory_).what == Replacing::goes) {
      add(kReplacedFolder, FileState::set_aside, "what --force replaced; 'graze resume' removes it");
    }
    if (out_.writer) return;  // it is at work on these
    list_leftovers(directory_, "");
    for (const char* name : {kShardFolder, kManifestFolder}) {
      if (const auto folder = directory_.find(name)) list_leftovers(*folder, std::string(name) + "/");
    }
  }

  void list_leftovers(const Directory& folder, const std::string& prefix) {
    for (const std::string& name : folder.names()) {
      if (!final_name(name)) continue;
      const bool is_folder = S_ISDIR(folder.status(name).st_mode);
      add(prefix + name, FileState::leftover,
          is_folder ? "is a directory, which no write has left; it stays"
                    : "of a write that was cut off; 'graze resume' removes it");
    }
  }

  void lost(const std::string& shard, FileState state, const std::string& what) {
    std::uint64_t traces = 0;
    if (const auto entry = manifest_.find(shard); entry != manifest_.end()) {
      for (const ShardEntry::Traces& one : entry->second.traces) traces += one.count;
    }
    out_.lost += traces;
    add(std::string(kShardFolder) + "/" + shard, state, what, traces);
  }

  void check_content(const fs::path& shard) {
    const hdf5::Lock lock;
    const Descriptor file = folder_->open(shard.filename().string());
    OpenPart part(shard, file);
    check_identity(part);
    check_part(part, *info_);
  }

  void check_identity(const OpenPart& part) {
    try {
      check_shard_identity(part.file(), *info_);
    } catch (const hdf5::Error& error) {
      part.fail(error.what());
    }
  }

  /// Whether `graze resume` finds fault with a shard, too: it does not read all of it.
  bool resume_notices(const fs::path& shard) {
    return !unreadable(std::vector<fs::path>{shard}, [&](const fs::path& path) {
              check_as_resume(path, *info_);
            }).empty();
  }

  /// Those that are whole.
  std::vector<fs::path> check_shards() {
    std::vector<ManifestFault> faults;
    manifest_ = read_manifest(directory_, &faults);
    for (const ManifestFault& fault : faults) {
      add(std::string(kManifestFolder) + "/" + fault.file, FileState::damaged,
          fault.no_file() ? fmt::format("{}; {}", fault_text(fault), kPutThere)
                          : fmt::format("line {}: {}; {}", fault.line, fault_text(fault), kAnew));
      puts_aside_ |= fault.no_file();
    }
    for (const MissingShard& one : missing_shards(directory_, manifest_)) {
      if (one.now.empty()) {
        lost(one.entry.shard, FileState::missing, "is gone; 'graze resume' simulates again what it held");
      } else {
        add(std::string(kShardFolder) + "/" + one.entry.shard, FileState::missing,
            fmt::format("is {}/{} now; nothing is lost, and 'graze resume' has the manifest say so", kShardFolder,
                        one.now));
      }
    }
    folder_ = directory_.find(kShardFolder);
    std::vector<fs::path> sealed;
    for (const std::string& name : shard_names(directory_)) {
      const fs::path path = directory_ / kShardFolder / name;
      try {
        seals_[name] = check_seal(folder_->open(name).number(), path);
        sealed.push_back(path);
      } catch (const InputError& error) {
        lost(name, FileState::damaged, without_name(error.what(), path) + std::string("; ") + kPutAside);
        puts_aside_ = true;
      }
    }
    if (!info_) return {};
    std::map<std::size_t, std::string> bad;
    for (const Unreadable& one : unreadable(sealed, [&](const fs::path& path) { check_content(path); })) {
      bad[one.file] = without_name(one.why, sealed[one.file]);
    }
    std::vector<fs::path> whole;
    for (std::size_t i = 0; i < sealed.size(); ++i) {
      const std::string name = sealed[i].filename().string();
      if (is_newer(std::string(kShardFolder) + "/" + name)) continue;
      if (const auto found = bad.find(i); found == bad.end()) {
        whole.push_back(sealed[i]);
        add_whole(name);
      } else if (resume_notices(sealed[i])) {
        lost(name, FileState::damaged, found->second + "; " + kPutAside);
        puts_aside_ = true;
      } else {
        lost(name, FileState::damaged,
             found->second + "; 'graze resume' does not see it: remove the file, and it simulates again what it held");
        out_.soundness = Soundness::damaged;
      }
    }
    check_all_told(whole);
    return whole;
  }

  /// A campaign that is complete has told its manifest of each shard.
  void check_all_told(const std::vector<fs::path>& whole) {
    if (!complete_ || out_.writer) return;
    const auto untold =
        std::ranges::count_if(whole, [&](const fs::path& shard) { return !manifest_.contains(shard.filename()); });
    if (untold == 0) return;
    const std::string which =
        whole.size() == 1 ? std::string("the shard holds") : fmt::format("{} of {} shards hold", untold, whole.size());
    add(kManifestFolder,
        manifest_.empty() && !directory_.has(kManifestFolder) ? FileState::missing : FileState::damaged,
        fmt::format("does not say what {}: if one is lost, nothing tells; {}", which, kAnew));
  }

  /// Whether the manifest says of a whole shard what it is. A writer that is at work may not have told it yet.
  void check_told(ShardEntry has) {
    const auto told = manifest_.find(has.shard);
    if (out_.writer || told == manifest_.end()) return;
    ShardEntry said = told->second;
    if (said.bytes != has.bytes || said.digest != has.digest) {
      differs(has.shard, fmt::format("{} bytes of xxh64 {:016x}", said.bytes, said.digest),
              fmt::format("{} of {:016x}", has.bytes, has.digest));
      return;
    }
    const std::vector<ShardEntry::Traces> all = said.traces;  // what both say is no matter
    std::erase_if(said.traces, [&](const auto& one) { return std::ranges::count(has.traces, one) > 0; });
    std::erase_if(has.traces, [&](const auto& one) { return std::ranges::count(all, one) > 0; });
    if (!said.traces.empty() || !has.traces.empty()) differs(has.shard, held_text(said), held_text(has));
  }
  void differs(const std::string& shard, const std::string& said, const std::string& has) {
    add(kManifestFolder, FileState::damaged,
        fmt::format("says {} of {}/{}, which has {}; {}", said, kShardFolder, shard, has, kAnew));
  }

  void add_whole(const std::string& shard) {
    ShardEntry entry = shard_entry(*folder_, shard, seals_.at(shard), *info_);
    std::uint64_t traces = 0;
    for (const ShardEntry::Traces& one : entry.traces) traces += one.count;
    check_told(std::move(entry));
    add(std::string(kShardFolder) + "/" + shard, FileState::whole, "", traces);
    ++out_.shards;
  }

  static constexpr const char* kUndescribed =
      "nothing is left that describes the campaign: its shards cannot be used without";
  static constexpr const char* kAnew = "'graze resume' writes it anew";
  static constexpr const char* kPutThere = "'graze resume' puts it into damaged/";
  static constexpr const char* kPutThereAndAnew = "'graze resume' puts it into damaged/ and writes it anew";
  static constexpr const char* kPutAside = "'graze resume' puts it into damaged/ and simulates again what it held";

  Directory directory_;
  std::optional<Directory> folder_;    // of the shards
  std::map<std::string, Seal> seals_;  // of those whose seals fit
  Manifest manifest_;
  std::optional<CampaignInfo> info_;
  bool complete_ = false;    // says the description
  bool puts_aside_ = false;  // would resume do with something
  Verification out_;
};

/// Throws ForeignFile if a file with an intact seal is another one of this program's than a packed campaign: it is not
/// damaged, and nothing of it can be counted.
void check_kind(const fs::path& path, const Descriptor& file) {
  const auto told = [&] {
    const hdf5::Lock lock;
    const ReadingNote note(path);
    try {
      return why_no_campaign(hdf5::open_for_reading(file.number()));
    } catch (const hdf5::Error&) {
      return std::string();  // the reader of all of it says what is wrong
    }
  };
  if (!unreadable(std::vector<fs::path>{path}, [&](const fs::path&) { told(); }).empty()) return;
  if (const std::string why = told(); !why.empty()) {
    throw ForeignFile(fmt::format("{}: has an intact seal, and {}", path.string(), why));
  }
}

Verification check_packed(const fs::path& path) {
  Verification out;
  out.packed = true;
  const Descriptor file = open_archive_file(path);
  try {
    check_seal(file.number(), path);
    check_kind(path, file);
    const auto bad = unreadable(std::vector<fs::path>{path}, [&](const fs::path&) {
      const StoredInfo stored = info_of(file, path);
      const hdf5::Lock lock;
      OpenPart part(path, file);
      check_part(part, stored.info);
    });
    if (!bad.empty()) throw InputError(bad[0].why);
    const StoredInfo stored = info_of(file, path);
    count_sound(Parts({path}, counting(stored.info), 0), stored.info, out);
    out.files.push_back({path.string(), FileState::whole, out.traces});
    if (out.soundness == Soundness::whole && !stored.complete) out.soundness = Soundness::incomplete;
    if (stored.complete && out.traces < out.total) {
      out.faults.push_back(fmt::format("{}: says that it is complete", path.string()));
      out.soundness = Soundness::damaged;
    }
  } catch (const ForeignFile&) {
    throw;  // nothing here was ever whole
  } catch (const InputError& error) {
    out.files.push_back({path.string(), FileState::damaged, 0, without_name(error.what(), path)});
    out.soundness = Soundness::damaged;
  }
  return out;
}

}  // namespace

const char* state_name(FileState state) {
  constexpr const char* kNames[] = {"whole", "damaged", "missing", "leftover", "set aside", "newer"};
  return kNames[static_cast<int>(state)];
}

const char* soundness_name(Soundness soundness) {
  constexpr const char* kNames[] = {"whole", "incomplete", "damaged"};
  return kNames[static_cast<int>(soundness)];
}

Verification verify(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) {
    throw InputError(
        fmt::format("{}: is not there{}", path.string(), path_suggestion(path.string(), {".graze", ".h5"})));
  }
  return fs::is_directory(status) ? DirectoryCheck(path).check() : check_packed(path);
}

}  // namespace graze
