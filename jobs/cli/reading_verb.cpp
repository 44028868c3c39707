#include "jobs/cli/reading_verb.h"

#include <sys/wait.h>

#include <new>

#include "archive/archive.h"
#include "archive/hdf5/reading_child.h"

namespace graze {
int in_reading_child(const std::vector<std::string>& archives, const std::function<int()>& act,
                     double seconds_per_megabyte) {
  if (may_not_fork()) return act();
  const ReadingLimits limits = reading_limits({archives.begin(), archives.end()}, seconds_per_megabyte);
  if (const std::optional<ReaderEnd> end = go_on_in_child(limits)) {
    if (!WIFEXITED(end->status) && died_of_reading(*end)) throw InputError(death_text(*end, limits));
    return WEXITSTATUS(end->status);
  }
  try {
    return act();
  } catch (const std::bad_alloc&) {
    throw InputError(too_large_text());
  }
}

}  // namespace graze
