#pragma once
// Controllers that `isolation: none` has put into the program, where nothing but the program itself can end them.

#include "engine/library/call_watch.h"

namespace graze {

/// While it lives a controller in this process that does not come back from a call within its `timeout` ends the
/// process, by a message that names it and the exit code of a machine that failed. For verbs that simulate outside of
/// campaigns, which give up the thread instead. Only where there are such controllers at all.
class EndHangingControllers {
 public:
  EndHangingControllers();

 private:
  CallWatch watch_;
};

}  // namespace graze
