#include "sampling/design.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "sampling/copula.h"
#include "sampling/permutation.h"
#include "sampling/sobol.h"
#include "sampling/stream.h"

namespace graze {
namespace {

void check_design(Design design, int parameters, std::uint64_t count) {
  if (design == Design::sobol && parameters > kSobolMaxDimensions)
    throw std::invalid_argument(
        fmt::format("{} parameters; the sobol design has directions for {}: use latin_hypercube or random", parameters,
                    kSobolMaxDimensions));
  if (design == Design::latin_hypercube && (count < 1 || count > std::uint64_t{1} << 32))
    throw std::invalid_argument(
        fmt::format("{} particles; a latin_hypercube needs a count from 1 to 2^32, known in advance", count));
}

/// Doubles that ranking correlated parameters may take: half a gigabyte.
constexpr std::uint64_t kMostScores = std::uint64_t{1} << 26;

void check_groups(const ParameterSpace& space, std::uint64_t count) {
  for (const CorrelationGroup& group : space.groups) {
    if (group.members.empty() || count <= kMostScores / group.members.size()) continue;
    throw std::invalid_argument(fmt::format(
        "{} particles with {} correlated parameters ({}, …): a latin_hypercube ranks them all, and holds at "
        "most {} numbers; use sobol or random",
        count, group.members.size(), space.parameters[group.members[0]].name, kMostScores));
  }
}

}  // namespace

Sampler::Sampler(ParameterSpace space, Design design, std::uint64_t seed, std::uint64_t count)
    : space_(std::move(space)), design_(design), seed_(seed), count_(count) {
  space_.validate();
  check_design(design_, space_.size(), count_);
  for (const auto& p : space_.parameters) hashes_.push_back(name_hash(p.name));
  cholesky_.resize(space_.groups.size());
  for (std::size_t g = 0; g < space_.groups.size(); ++g) correlation_factor(space_.groups[g].correlation, cholesky_[g]);
  strata_.resize(hashes_.size());
  if (design_ == Design::latin_hypercube) stratify_groups();
  if (design_ != Design::sobol || hashes_.empty()) return;
  sobol_directions_ = sobol_directions(space_.size());
  for (std::size_t p = 0; p < hashes_.size(); ++p) {
    scramble_directions(&sobol_directions_[p * kSobolBits], seed_, hashes_[p]);
    sobol_shifts_.push_back(sobol_shift(seed_, hashes_[p]));
  }
}

double Sampler::in_cell(std::size_t parameter, std::uint32_t particle, std::uint64_t cell) const {
  const double within = uniform(seed_, particle, hashes_[parameter], kPersistent);
  return std::clamp((static_cast<double>(cell) + within) / static_cast<double>(count_), kSmallestUniform,
                    kLargestUniform);
}

/// Every member keeps one particle per cell: it takes the cells in the order of the correlated normal scores (Stein,
/// Technometrics 29 (1987) 143).
void Sampler::stratify_groups() {
  check_groups(space_, count_);
  for (std::size_t g = 0; g < cholesky_.size(); ++g) {
    const std::vector<int>& members = space_.groups[g].members;
    std::vector<std::vector<double>> scores(members.size(), std::vector<double>(count_));
    for (std::size_t k = 0; k < members.size(); ++k) {
      const std::size_t p = members[k];
      for (std::uint32_t i = 0; i < count_; ++i) {
        scores[k][i] = normal_quantile(in_cell(p, i, permute(i, count_, seed_, hashes_[p])));
      }
    }
    correlate_scores(cholesky_[g], scores);
    // The first member's scores are its own, and so are its cells.
    for (std::size_t k = 1; k < members.size(); ++k) {
      strata_[members[k]] = std::make_shared<const Strata>(ranks_of(scores[k]));
    }
  }
}

void Sampler::unit_point(std::uint32_t particle, std::span<double> out) const {
  assert(out.size() == hashes_.size());
  for (std::size_t p = 0; p < hashes_.size(); ++p) {
    switch (design_) {
      case Design::random:
        out[p] = uniform(seed_, particle, hashes_[p], kPersistent);
        break;
      case Design::latin_hypercube:
        out[p] = in_cell(p, particle, permute(particle, count_, seed_, hashes_[p]));
        break;
      case Design::sobol:
        out[p] = to_uniform(sobol_digits(&sobol_directions_[p * kSobolBits], particle) ^ sobol_shifts_[p]);
        break;
    }
  }
}

void Sampler::draw(std::uint32_t particle, std::span<double> out) const {
  unit_point(particle, out);
  for (std::size_t g = 0; g < cholesky_.size(); ++g) {
    if (design_ != Design::latin_hypercube) correlate(cholesky_[g], space_.groups[g].members, out);
  }
  for (std::size_t p = 0; p < out.size(); ++p) {
    if (strata_[p]) out[p] = in_cell(p, particle, (*strata_[p])[particle]);
  }
  for (std::size_t p = 0; p < out.size(); ++p) out[p] = space_.parameters[p].persistent.quantile(out[p]);
}

std::vector<double> Sampler::draw(std::uint32_t particle) const {
  std::vector<double> values(hashes_.size());
  draw(particle, values);
  return values;
}

}  // namespace graze
