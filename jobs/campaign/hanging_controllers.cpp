#include "jobs/campaign/hanging_controllers.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>

#include "archive/files/utf8.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/campaign/say.h"

namespace graze {
namespace {

[[noreturn]] void leave_hung(const LibraryCallHere& call) {
  const std::string when = std::isnan(call.time) ? "" : fmt::format(" at {:.6g} s", call.time);
  const std::string text = fmt::format(
      "graze: the controller {} did not come back from {}{} within {:g} s (its timeout), in the program itself, which "
      "cannot go on without it; {}\n",
      printable(call.file), name_of(call.call), when, call.limit,
      call.call == LibraryCall::destroy ? "what is on the disk is kept" : "'graze run' loses the particle alone");
  say_safely(text.c_str());
  _exit(kMachineFailed);
}

}  // namespace

EndHangingControllers::EndHangingControllers(WatchedCalls which)
    : watch_([which](const LibraryCallHere& call) {
        if (which == WatchedCalls::all || call.call == LibraryCall::destroy) leave_hung(call);
      }) {}

}  // namespace graze
