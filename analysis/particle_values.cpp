#include "analysis/particle_values.h"

#include <algorithm>
#include <utility>

namespace graze {

std::size_t ParticleValues::row_of(std::uint32_t particle) const {
  const auto at = std::lower_bound(particles.begin(), particles.end(), particle);
  return at != particles.end() && *at == particle ? static_cast<std::size_t>(at - particles.begin()) : particles.size();
}

std::string ParticleValues::none() const {
  if (table.columns.empty()) return "the scenario has no uncertain parameters";
  return table.rows() == 0 ? "the archive does not keep the particles' values" : "";
}

ParticleValues read_particle_values(const Archive& archive, std::uint64_t end) {
  const CampaignInfo& info = archive.info();
  const std::size_t width = info.parameters.size();
  std::vector<std::pair<std::uint32_t, std::size_t>> found;  // particle, place in `values`
  std::vector<double> values;
  archive.scan_values([&](std::uint32_t particle, std::span<const double> row) {
    if (particle >= end || row.size() != width) return;
    found.emplace_back(particle, values.size());
    values.insert(values.end(), row.begin(), row.end());
  });
  std::sort(found.begin(), found.end());
  ParticleValues out;
  for (const auto& [particle, place] : found) out.particles.push_back(particle);
  for (std::size_t k = 0; k < width; ++k) {
    const CampaignInfo::ParameterRow& parameter = info.parameters[k];
    ParticleTable::Column& column = out.table.columns.emplace_back();
    column.name = parameter.name;
    column.unit = parameter.unit;
    column.labels = parameter.labels;
    column.values.reserve(found.size());
    for (const auto& [particle, place] : found) column.values.push_back(values[place + k]);
  }
  return out;
}

}  // namespace graze
