#include "engine/library/library_use.h"

#include <fmt/format.h>
#include <pthread.h>

#include <array>
#include <utility>

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

}  // namespace

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

LibraryCallHere& library_call_here() {
  thread_local LibraryCallHere here;
  return here;
}

const char* name_of(LibraryCall call) {
  constexpr std::array<const char*, 6> kNames = {"nothing", "its loading", "create()", "start()", "act()", "destroy()"};
  return kNames.at(static_cast<std::size_t>(call));
}

const Description& library_description() {
  static const Description text = {
      "asks a controller of your own in a shared object, by the C interface graze/policy.h",
      {{"file", {Form::text("FILE")}, Default::required(), "the shared object, relative to the scenario"},
       {"settings",
        {Form::named_numbers("SETTING")},
        {},
        "whatever the controller takes: it gets the map as JSON, numbers without units"},
       {"isolation",
        {Form::word({kOwnProcess, "none"})},
        Default::value(kOwnProcess),
        "`process`: its blocks run in processes of their own, whose crash costs one particle; `none`: in the program"},
       {"timeout",
        {Form::number(Quantity::time, Bound::positive)},
        Default::value("10 s"),
        "longest time on the clock that start() or act() may take (loading and create() 60 s more); then its particle "
        "is "
        "left unfinished"}},
      {},
      {},
      "It fills joint positions, velocities and torques; `control` says what becomes of them. It runs with your "
      "rights, "
      "so no library is loaded without --trust. docs/controllers.md tells more."};
  return text;
}

LibraryUse read_library_use(const Described& own) {
  const Settings typed = own.at("file");
  LibraryUse out{own.settings(), input_path(typed.resolve_file(typed.text())), {}, true, own.number("timeout")};
  out.isolated = own.word("isolation") == kOwnProcess;
  // Kept by archives as a file beside the library's own name, and not computed anew from what they keep.
  const auto sha256 = derived_input(out.file + ".sha256", [&] { return sha256_of_file(out.file); });
  if (!sha256)
    typed.fail(
        fmt::format("{}: there is no such file that can be read{}", out.file, path_suggestion(out.file, {".so"})));
  out.sha256 = *sha256;
  return out;
}

std::optional<LibraryUse> library_use(const Settings& policy) {
  const auto found = policy.is_map() ? policy.find("library") : std::nullopt;
  if (!found) return std::nullopt;
  return read_library_use(Described(*found, library_description()));
}

void check_library_file(const LibraryUse& use) {
  const auto now = sha256_of_file(use.file);
  const Settings place = use.place.at("file");
  if (!now)
    place.fail(fmt::format("{}: the library is not there, or cannot be read; it had SHA-256 {}", use.file, use.sha256));
  if (*now == use.sha256) return;
  place.fail(
      fmt::format("{}: is another library than the one that was meant: SHA-256 {} now, {} then; put that one in "
                  "its place, or run the scenario anew",
                  use.file, *now, use.sha256));
}

}  // namespace graze
