#pragma once
// The values of the particles' parameters, read from an archive into the table that causes are looked for in.

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/causes.h"
#include "archive/archive.h"

namespace graze {

struct ParticleValues {
  ParticleTable table;                   // a column for each parameter of the archive
  std::vector<std::uint32_t> particles;  // by row, rising

  /// particles.size(): it has no row.
  std::size_t row_of(std::uint32_t particle) const;
  /// Why no causes can be told; empty: they can.
  std::string none() const;
};

/// Of particles below `end`. Memory: 16 bytes for each value.
ParticleValues read_particle_values(const Archive& archive, std::uint64_t end);

}  // namespace graze
