#pragma once
// Which units of work a ticket stands for. Many units at once while there are many, one at a time towards the end
// (factoring: Hummel, Schonberg & Flynn, Comm. ACM 35(8), 1992, each round hands out half of what is left), so that few
// tickets are drawn and yet all workers end together. The table is the same everywhere: a ticket's number is all that
// has to be agreed on.

#include <cstdint>
#include <vector>

namespace graze {

/// Particles per unit of work, at most `most` and at least half of that, so that where units are few all workers have
/// equally many: 40 particles for two workers are six units of seven, not five of eight, of which one worker has three.
std::uint64_t even_unit(std::uint64_t particles, std::uint64_t policies, std::uint64_t workers, std::uint64_t most);

class HandOut {
 public:
  struct Range {
    std::uint64_t begin, end;
    bool empty() const { return begin >= end; }
  };

  /// `units` of work for so many workers, no more than `most` of them per ticket.
  HandOut(std::uint64_t units, std::uint64_t workers, std::uint64_t most);
  /// Units of a ticket (0, 1, …); empty when there are none left.
  Range range(std::uint64_t ticket) const;

 private:
  /// Tickets of equal size.
  struct Phase {
    std::uint64_t ticket, unit, size;  // first ticket, its first unit, units per ticket
  };
  std::uint64_t units_;
  std::vector<Phase> phases_;  // O(log units)
};

}  // namespace graze
