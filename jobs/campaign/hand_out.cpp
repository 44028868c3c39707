#include "jobs/campaign/hand_out.h"

#include <algorithm>

namespace graze {

std::uint64_t even_unit(std::uint64_t particles, std::uint64_t policies, std::uint64_t workers, std::uint64_t most) {
  constexpr std::uint64_t kFew = 8;  // units per worker: beyond, the last round is a small part of all
  const std::uint64_t full = (particles + most - 1) / most;  // units per policy
  if (full == 0 || policies == 0 || full * policies >= kFew * workers) return most;
  const std::uint64_t rounds = (full * policies + workers - 1) / workers;
  const std::uint64_t units = rounds * workers / policies;  // as many as take no more rounds
  return std::clamp((particles + units - 1) / units, (most + 1) / 2, most);
}

HandOut::HandOut(std::uint64_t units, std::uint64_t workers, std::uint64_t most) : units_(units) {
  workers = std::max<std::uint64_t>(workers, 1);
  std::uint64_t ticket = 0, unit = 0;
  while (unit < units) {
    const std::uint64_t left = units - unit;
    const std::uint64_t half = (left + 2 * workers - 1) / (2 * workers);
    const std::uint64_t size = std::clamp<std::uint64_t>(half, 1, std::max<std::uint64_t>(most, 1));
    phases_.push_back({ticket, unit, size});
    if (size == 1) break;  // all that is left, one by one
    // As many rounds as the bound `most` decides the size; one otherwise.
    const std::uint64_t round = workers * size;
    const std::uint64_t rounds = half > size ? (left - 2 * round) / round + 1 : 1;
    ticket += rounds * workers;
    unit += rounds * round;
  }
}

HandOut::Range HandOut::range(std::uint64_t ticket) const {
  const auto after = std::upper_bound(phases_.begin(), phases_.end(), ticket,
                                      [](std::uint64_t t, const Phase& phase) { return t < phase.ticket; });
  if (after == phases_.begin()) return {units_, units_};
  const Phase& phase = *std::prev(after);
  // Divided first: a ticket far beyond the end must not wrap around.
  const std::uint64_t skipped = ticket - phase.ticket;
  if (skipped >= (units_ - phase.unit + phase.size - 1) / phase.size) return {units_, units_};
  const std::uint64_t begin = phase.unit + skipped * phase.size;
  return {begin, std::min(begin + phase.size, units_)};
}

}  // namespace graze
