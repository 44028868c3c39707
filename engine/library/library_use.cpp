#include "engine/library/library_use.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>

#include <array>
#include <filesystem>
#include <list>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "engine/library/meant_files.h"
#include "engine/library/python_use.h"
#include "engine/settings/inputs.h"
#include "engine/settings/paths.h"
#include "engine/settings/sha256.h"

namespace graze {

namespace {

std::atomic<LibraryLoading> allowed_libraries{LibraryLoading::refused};
std::atomic<LibraryCalls*> page_of_calls{nullptr};
std::atomic<bool> forked_copy{false};

std::string& briefed_urdf() {
  static std::string text;
  return text;
}

std::map<std::string, std::string>& meant_sums() {
  static std::map<std::string, std::string> sums;
  return sums;
}

}  // namespace

void mean_library_files(std::map<std::string, std::string> sums) { meant_sums() = std::move(sums); }

void allow_libraries(LibraryLoading what) {
  [[maybe_unused]] static const int registered = pthread_atfork(nullptr, nullptr, [] { forked_copy = true; });
  allowed_libraries = what;
}
LibraryLoading libraries_allowed() { return allowed_libraries; }
void brief_libraries(std::string urdf) { briefed_urdf() = std::move(urdf); }
std::string library_urdf() { return briefed_urdf(); }
void show_library_calls(LibraryCalls* page) { page_of_calls = page; }
LibraryCalls* shown_library_calls() { return page_of_calls.load(std::memory_order_relaxed); }
bool is_forked_copy() { return forked_copy.load(std::memory_order_relaxed); }

namespace {
std::atomic<const char*> loaded_names{nullptr};
}

const char* libraries_loaded() { return loaded_names.load(std::memory_order_acquire); }

void add_loaded_library(const std::string& name) {
  // Never destroyed: whoever handles exit() reads them after the static objects are gone, and a handler of signals may
  // be reading an older text.
  struct Loaded {
    std::mutex changing;
    std::set<std::string> names;
    std::list<std::string> texts;
  };
  static auto& loaded = *new Loaded;
  const std::lock_guard<std::mutex> lock(loaded.changing);
  if (!loaded.names.insert(name).second) return;
  loaded.texts.push_back(fmt::format("{}", fmt::join(loaded.names, ", ")));
  loaded_names.store(loaded.texts.back().c_str(), std::memory_order_release);
}

const char* name_of(LibraryCall call) {
  constexpr std::array<const char*, 6> kNames = {"nothing", "its loading", "create()", "start()", "act()", "destroy()"};
  return is_call(call) ? kNames[static_cast<std::size_t>(call)] : "no call that there is";
}
bool is_call(LibraryCall call) { return call <= LibraryCall::destroy; }

Key isolation_key() {
  return {"isolation",
          {Form::word({kOwnProcess, "none"})},
          Default::value(kOwnProcess),
          "`process`: its blocks run in processes of their own, whose crash costs one particle; `none`: in the "
          "program"};
}

Key timeout_key(std::string help) {
  return {
      "timeout", {Form::number(Quantity::time, Bound::positive)}, Default::value("10 s"), help + "; 1 ms at the least"};
}

const Description& library_description() {
  static const Description text = {
      "asks a controller of your own in a shared object, by the C interface graze/policy.h",
      {{"file", {Form::text("FILE")}, Default::required(), "the shared object, relative to the scenario"},
       {"settings",
        {Form::named_values("SETTING")},
        {},
        "whatever the controller takes: it gets the map as JSON, numbers without units; graze_setting() reads numbers, "
        "true (1) and false (0) of the map itself"},
       isolation_key(),
       timeout_key(
           "longest time on the clock that start() or act() may take (loading and create() 60 s more); then its "
           "particle is left unfinished")},
      {},
      {},
      "It fills joint positions, velocities and torques; `control` says what becomes of them. It runs with your "
      "rights, "
      "so no library is loaded without --trust. docs/controllers.md tells more."};
  return text;
}

namespace {

/// "; 'make -C walk' builds it from walk.c" for a shared object whose source and Makefile stand where it is missed.
std::string way_to_build(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  if (fs::path(path).extension() != ".so" || !fs::is_regular_file(folder / "Makefile", error)) return "";
  for (const char* ending : {".c", ".cpp", ".cc"}) {
    const fs::path source = fs::path(path).replace_extension(ending);
    if (fs::is_regular_file(source, error)) {
      return fmt::format("; make in {} builds it from {}", folder.string(), source.filename().string());
    }
  }
  return "";
}

}  // namespace

OutsideFile read_outside_file(const Settings& typed, const std::string& ending) {
  OutsideFile out{input_path(typed.resolve_file(typed.text())), {}};
  // Kept by archives as a file beside the controller's own name, and not computed anew from what they keep.
  const auto sha256 = derived_input(out.path + ".sha256", [&] { return sha256_of_file(out.path); });
  if (!sha256) {
    if (const std::string why = why_no_file(out.path); !why.empty()) typed.fail(fmt::format("{}: {}", out.path, why));
    const std::vector<std::string> endings = ending.empty() ? std::vector<std::string>() : std::vector{ending};
    const std::string way = way_to_build(out.path);
    typed.fail(fmt::format("{}: there is no such file that can be read{}", out.path,
                           way.empty() ? path_suggestion(out.path, endings) : way));
  }
  out.sha256 = *sha256;
  return out;
}

LibraryUse read_outside_use(const Described& own, const std::string& ending) {
  OutsideFile file = read_outside_file(own.at("file"), ending);
  const bool isolated = own.word("isolation") == kOwnProcess;
  constexpr double kShortest = 1e-3, kLongest = 1e7;  // s: what is told apart, and four months
  const double timeout = own.number("timeout");
  if (timeout < kShortest || timeout > kLongest) {
    own.settings().at("timeout").fail(
        fmt::format("{:g} s: must be from {:g} s to {:g} s", timeout, kShortest, kLongest));
  }
  return {own.settings(), std::move(file.path), std::move(file.sha256), isolated, timeout};
}

LibraryUse read_library_use(const Described& own) { return read_outside_use(own, ".so"); }

std::optional<LibraryUse> library_use(const Settings& policy) {
  if (!policy.is_map()) return std::nullopt;
  if (const auto found = policy.find("library")) return read_library_use(Described(*found, library_description()));
  if (const auto found = policy.find("python")) return read_python_use(Described(*found, python_description()));
  return std::nullopt;
}

bool is_from_outside(const Settings& policy) { return policy.has("library") || policy.has("python"); }

bool is_isolated(const Settings& policy) {
  const auto isolated = [](const Settings& own, const Description& text) {
    return Described(own, text).word("isolation") == kOwnProcess;
  };
  if (const auto found = policy.find("library")) return isolated(*found, library_description());
  const auto found = policy.find("python");
  return found && isolated(*found, python_description());
}

namespace {

/// `kind`: what it is, in words.
void check_outside_file(OutsideFile file, const Settings& place, const char* kind) {
  const auto meant = meant_sums().find(file.path);
  if (meant != meant_sums().end()) file.sha256 = meant->second;
  const auto now = sha256_of_file(file.path);
  if (!now) {
    place.fail(
        fmt::format("{}: the {} is not there, or cannot be read; it had SHA-256 {}", file.path, kind, file.sha256));
  }
  if (*now == file.sha256) return;
  place.fail(
      fmt::format("{}: is another {} than the one that was meant: SHA-256 {} now, {} then; put that one in "
                  "its place, or run the scenario anew",
                  file.path, kind, *now, file.sha256));
}

}  // namespace

void check_library_file(const LibraryUse& use) {
  check_outside_file({use.file, use.sha256}, use.place.at("file"), use.is_python() ? "controller" : "library");
  for (const OutsideFile& file : use.files) check_outside_file(file, use.place.at("files"), "file");
}

}  // namespace graze
