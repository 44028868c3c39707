// Claim: whatever a stranger has made of a campaign's directory or file, every verb that reads it ends, with a message
// or without, and changes nothing outside. The input is a list of changes to a small campaign: to the content of its
// files (sealed anew), to their bytes, to what stands in the directory under which name, links to places outside and
// around in circles included.
//
// Where the files are sound HDF5, the verb runs in this process, whose coverage libFuzzer sees. Where bytes behind a
// seal were changed, or a file cut, it runs in a child with limits, as the program reads files of strangers
// (archive/hdf5/reading_child.h): the HDF5 library may crash on them, anything else may not.

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "archive/hdf5/reading_child.h"
#include "jobs/campaign/signals.h"
#include "tests/fuzz/archive_edits.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/verbs.h"

/// The sanitizers' runtime, if there is one.
extern "C" [[gnu::weak]] void __sanitizer_set_death_callback(void (*callback)());

namespace {

namespace fs = std::filesystem;
using graze::fuzz::Edit;

/// 16 bytes of input, behind one for the verb and one for the campaign.
struct Change {
  std::uint8_t kind, file, name, spare;
  Edit edit;
};
static_assert(sizeof(Change) == 16);
enum Kind : std::uint8_t {
  kContent,   // of an HDF5 file, by the library
  kByte,      // of any file
  kByteSeal,  // of any file, which is sealed again
  kCut,       // a file, sealed again or not
  kLink,      // stands in the place of a file
  kCopy,      // a file to another name
  kMove,
  kRemove,
  kFolder,
  kFifo,
  kKinds
};
constexpr std::size_t kMostChanges = 6;

/// One folder per process, since targets run side by side.
const fs::path& scratch() {
  static const fs::path folder = fs::temp_directory_path() / ("graze_fuzz_campaign_" + std::to_string(getpid()));
  return folder;
}
fs::path seeds() { return scratch() / "seeds"; }
fs::path work() { return scratch() / "work"; }
fs::path outside() { return scratch() / "outside"; }

/// Names that the program itself uses in a campaign's directory.
const std::vector<std::string>& names() {
  static const std::vector<std::string> all = {"campaign.h5",
                                               "campaign.copy.h5",
                                               "shards",
                                               "shards/000001.h5",
                                               "shards/000002.h5",
                                               "shards/000003.h5",
                                               "shards/000001.h5.tmp",
                                               "manifest",
                                               "manifest/shards.jsonl",
                                               "manifest/shards.jsonl.tmp",
                                               "lock",
                                               "damaged",
                                               "damaged/000001.h5",
                                               "replacing",
                                               "replaced",
                                               "replaced/campaign.h5",
                                               "unfinished.jsonl",
                                               "x"};
  return all;
}

/// Where links lead.
const std::vector<std::string>& targets() {
  static const std::vector<std::string> all = {outside().string(),
                                               (outside() / "file.h5").string(),
                                               (outside() / "folder").string(),
                                               (outside() / "none").string(),
                                               (outside() / "folder/file").string(),
                                               "..",
                                               ".",
                                               "shards",
                                               "campaign.h5",
                                               "000001.h5",
                                               "x",
                                               "/dev/null",
                                               "/proc/self/mem",
                                               "/dev/full"};
  return all;
}

/// Contents by path of all that stands below a folder; links and pipes by their kind.
std::map<std::string, std::string> listing(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    std::string& content = out[entry.path().string()];
    if (!entry.is_regular_file()) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    content.assign(std::istreambuf_iterator<char>(stream), {});
  }
  return out;
}

/// Two campaigns of two policies: a directory that is complete, one that was stopped, and one file.
void make_seeds() {
  fs::remove_all(scratch());
  fs::create_directories(outside() / "folder");
  fs::create_directories(seeds());
  std::ofstream(outside() / "folder/file") << "text";
  std::ofstream(seeds() / "a.yaml") << "graze: 1\nrobot: {urdf: " GRAZE_SOURCE_DIR
                                       "/data/robots/pendulum.urdf, base: fixed}\n"
                                       "time: {end: 20 ms, step: 1 ms}\n"
                                       "uncertain: {robot.joint.*.zero: {normal: {std: 1 deg}}}\n"
                                       "policies: {a: {hold: {}, control: {joint_pd: {kp: 1}}, over: "
                                       "{control.joint_pd.kp: [1, 2]}}}\n"
                                       "record: {telemetry: all, every: 5}\n";
  const auto run = [](const std::string& name) {
    if (graze::fuzz::run_verb({"run", (seeds() / "a.yaml").string(), "-n", "10", "--threads", "1", "--quiet", "-o",
                               (seeds() / name).string()})) {
      return;
    }
    std::abort();
  };
  run("whole");
  run("file.h5");
  run("stopped");
  // A shard more, which is taken away again.
  if (!graze::fuzz::run_verb({"resume", (seeds() / "stopped").string(), "-n", "20", "--threads", "1", "--quiet"})) {
    std::abort();
  }
  fs::path last;
  for (const auto& entry : fs::directory_iterator(seeds() / "stopped/shards")) last = std::max(last, entry.path());
  fs::remove(last);
  fs::copy_file(seeds() / "file.h5", outside() / "file.h5");
}

/// Regular files of the campaign, sorted.
std::vector<fs::path> files_of(const fs::path& campaign) {
  std::vector<fs::path> out;
  const fs::file_type type = fs::symlink_status(campaign).type();
  if (type == fs::file_type::regular) out.push_back(campaign);
  if (type != fs::file_type::directory) return out;
  for (const auto& entry : fs::recursive_directory_iterator(campaign)) {
    if (!entry.is_symlink() && entry.is_regular_file()) out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

void change_byte(const fs::path& file, const Edit& edit) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  const auto size = static_cast<std::streamoff>(fs::file_size(file));
  if (size == 0) return;
  stream.seekp((std::streamoff{edit.position} * 257 + edit.object) % size);
  stream.write(reinterpret_cast<const char*>(edit.value), edit.kind % 8 + 1);
}

/// Whether a link stands on the way from the campaign to a name in it. The changes themselves must not lead outside.
bool through_link(const fs::path& campaign, fs::path name) {
  while (name != campaign) {
    name = name.parent_path();
    if (fs::is_symlink(fs::symlink_status(name))) return true;
  }
  return false;
}

void apply(const fs::path& campaign, const Change& change) {
  const std::vector<fs::path> files = files_of(campaign);
  if (files.empty()) return;
  const fs::path file = files[change.file % files.size()];
  const bool directory = fs::symlink_status(campaign).type() == fs::file_type::directory;
  const fs::path name = directory ? campaign / names()[change.name % names().size()] : campaign;
  if (directory && through_link(campaign, name)) return;
  std::error_code error;
  fs::create_directories(name.parent_path(), error);
  switch (change.kind % kKinds) {
    case kContent:
      if (file.extension() == ".h5") graze::fuzz::edit_archive(file, {&change.edit, 1});
      return;
    case kByte:
    case kByteSeal:
      change_byte(file, change.edit);
      if (change.kind % kKinds == kByteSeal && file.extension() == ".h5") graze::fuzz::seal_again(file);
      return;
    case kCut:
      fs::resize_file(file, fs::file_size(file) * change.edit.object / 256, error);
      if (change.edit.kind % 2 == 0 && file.extension() == ".h5") graze::fuzz::seal_again(file);
      return;
    case kLink:
      fs::remove_all(name, error);
      fs::create_symlink(targets()[change.file % targets().size()], name, error);
      return;
    case kCopy:
      if (fs::is_symlink(fs::symlink_status(name))) fs::remove(name, error);
      fs::copy_file(file, name, fs::copy_options::overwrite_existing, error);
      return;
    case kMove:
      fs::rename(file, name, error);
      return;
    case kRemove:
      fs::remove_all(name, error);
      return;
    case kFolder:
      fs::remove_all(name, error);
      fs::create_directory(name, error);
      return;
    case kFifo:
      fs::remove_all(name, error);
      mkfifo(name.c_str(), 0600);
      return;
  }
}

bool run(unsigned verb, const std::string& campaign) {
  const std::string out = (scratch() / "out.h5").string();
  const std::vector<std::vector<std::string>> verbs = {
      {"status", campaign},
      {"status", campaign, "--json"},
      {"score", campaign},
      {"score", campaign, "--json", "--failures"},
      {"pack", campaign, "-o", out, "--force"},
      {"replay", campaign, "--particle", "1", "--policy", "a/1"},
      {"replay", campaign, "--particle", "3", "--policy", "a/2", "-o", out, "--force"},
      {"resume", campaign, "--threads", "1", "--quiet"},
      {"resume", campaign, "--threads", "1", "--quiet", "-n", "12"},
  };
  return graze::fuzz::run_verb(verbs[verb % verbs.size()]);
}

/// Whether the HDF5 library may crash on what this makes.
bool damages(const Change& change) {
  const int kind = change.kind % kKinds;
  return kind == kByte || kind == kByteSeal || kind == kCut;
}

/// The verb in a child. What dies there outside the HDF5 library, dies here too.
void run_apart(unsigned verb, const std::string& campaign) {
  constexpr int kThrough = 10, kRefused = 11;
  const auto end = graze::go_on_in_child(graze::reading_limits({campaign}));
  if (!end) {
    for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE})
      std::signal(signal, SIG_DFL);  // not libFuzzer's
    if (__sanitizer_set_death_callback) __sanitizer_set_death_callback(nullptr);
    _exit(run(verb, campaign) ? kThrough : kRefused);
  }
  if (WIFEXITED(end->status) && (WEXITSTATUS(end->status) == kThrough || WEXITSTATUS(end->status) == kRefused)) return;
  if (end->inside || (WIFSIGNALED(end->status) && WTERMSIG(end->status) == SIGXCPU)) return;
  std::fprintf(stderr, "the verb ended with status %x, not in the HDF5 library\n", static_cast<unsigned>(end->status));
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  constexpr std::uint64_t kAnything = std::uint64_t{1} << 40;
  if (const auto end = graze::go_on_in_child({kAnything, kAnything})) {
    _exit(WIFEXITED(end->status) ? WEXITSTATUS(end->status) : 1);
  }
  graze::end_of_reading();  // libFuzzer has limits of its own
  make_seeds();
  std::atexit([] { fs::remove_all(scratch()); });
  // From now on every campaign is asked to stop as soon as it begins: what is tried is what comes before and after,
  // and a changed number of particles does not run for days.
  graze::heed_signals(work().string());
  std::raise(SIGTERM);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::map<std::string, std::string> before = listing(outside());
  if (size < 2) return 0;
  static const std::array<const char*, 3> kSeeds = {"whole", "stopped", "file.h5"};
  fs::remove_all(work());
  fs::copy(seeds() / kSeeds[data[1] % kSeeds.size()], work(), fs::copy_options::recursive);
  const std::size_t count = std::min((size - 2) / sizeof(Change), kMostChanges);
  std::vector<Change> changes(count);
  if (count > 0) std::memcpy(changes.data(), data + 2, count * sizeof(Change));
  // First what the library does, which does not survive what the others do.
  std::stable_partition(changes.begin(), changes.end(),
                        [](const Change& change) { return change.kind % kKinds == kContent; });
  for (const Change& change : changes) apply(work(), change);
  if (std::any_of(changes.begin(), changes.end(), damages)) {
    run_apart(data[0], work().string());
  } else {
    run(data[0], work().string());
  }
  if (listing(outside()) != before) {
    std::fputs("files outside the campaign were changed\n", stderr);
    std::abort();
  }
  return 0;
}

/// Whole changes, one field at a time: bytes out of step would mean nothing.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  graze::fuzz::Dice dice(seed);
  std::string input(reinterpret_cast<const char*>(data), size);
  input.resize(std::max<std::size_t>(2, 2 + (size < 2 ? 0 : (size - 2) / sizeof(Change)) * sizeof(Change)));
  const std::size_t count = (input.size() - 2) / sizeof(Change);
  const std::size_t at = 2 + dice.below(count) * sizeof(Change);
  switch (dice.below(6)) {
    case 0:
      input[0] = static_cast<char>(dice.below(9));
      break;
    case 1:
      input[1] = static_cast<char>(dice.below(3));
      break;
    case 2:
      if (count > 0) input.erase(at, sizeof(Change));
      break;
    case 3:
    case 4: {
      Change change{};
      for (std::size_t i = 0; i < sizeof change; ++i) {
        reinterpret_cast<std::uint8_t*>(&change)[i] = static_cast<std::uint8_t>(dice.below(256));
      }
      change.kind = static_cast<std::uint8_t>(dice.one_in(2) ? std::size_t{kContent} : dice.below(kKinds));
      if (dice.one_in(3)) std::memset(change.edit.value, dice.one_in(2) ? 0 : 255, sizeof change.edit.value);
      if (count < kMostChanges) input.append(reinterpret_cast<const char*>(&change), sizeof change);
      break;
    }
    default:
      if (count > 0) input[at + dice.below(sizeof(Change))] = static_cast<char>(dice.below(256));
  }
  return graze::fuzz::put(input, data, size, most);
}
