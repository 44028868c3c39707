#pragma once
// Controllers that `isolation: none` has put into the program, where nothing but the program itself can end them.

#include "engine/library/call_watch.h"

namespace graze {

/// Which of a controller's calls are watched: all, or the end of it alone, where a campaign watches over its traces.
enum class WatchedCalls { all, ends };

/// While it lives a controller in this process that does not come back from a call within its `timeout` ends the
/// process, by a message that names it and the exit code of a machine that failed. For verbs that simulate outside of
/// campaigns, which give up the thread instead. It costs a thread that looks twenty times a second.
class EndHangingControllers {
 public:
  explicit EndHangingControllers(WatchedCalls which = WatchedCalls::all);

 private:
  CallWatch watch_;
};

}  // namespace graze
