#include "engine/library/kept_place.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>

namespace graze {

namespace {

struct Place {
  int folder = ::open(".", O_PATH | O_DIRECTORY | O_CLOEXEC);
  mode_t mask = ::umask(0);
  Place() { ::umask(mask); }
};
std::atomic<const Place*> kept{nullptr};

}  // namespace

void keep_place() {
  static const Place place;
  kept = &place;
}

void put_place_back() noexcept {
  const Place* const place = kept;
  if (!place) return;
  ::umask(place->mask);
  if (place->folder < 0) return;
  [[maybe_unused]] const int back = ::fchdir(place->folder);
}

}  // namespace graze
