#pragma once
// This folder answers "what is particle i?": counter-based random streams (stream.h), distributions (distribution.h)
// and, here, sampling designs: how the N points of a campaign lie in the unit cube of all parameters, and from there in
// the parameters' own space. In: a ParameterSpace and a seed. Out: one row of values per particle. Nothing here knows
// of robots; a value depends on the seed, the particle, the parameter's name and the step, and on nothing else, so
// threads, ranks, restarts and other parameters cannot change it. See docs/sampling.md.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sampling/distribution.h"

namespace graze {

/// One uncertain scalar.
struct UncertainParameter {
  std::string name;                                     // full path, "robot.link.LF_SHIN.length"
  std::string unit;                                     // SI, "m"
  double nominal = 0;                                   // what the controller believes
  Distribution persistent = Distribution::constant(0);  // Eq. 13, 15: drawn once per particle
  std::optional<Distribution> jitter;                   // Eq. 14: added afresh at every control step
  std::vector<std::string> labels;                      // for a choice: what index 0, 1, … mean
  std::string distribution_text;                        // as described to the user
};

/// Parameters that vary together: Gaussian copula with this correlation matrix (symmetric, unit diagonal, positive
/// definite), rows in the order of `members` (indices into ParameterSpace::parameters).
struct CorrelationGroup {
  std::vector<int> members;
  Eigen::MatrixXd correlation;
};

struct ParameterSpace {
  std::vector<UncertainParameter> parameters;
  std::vector<CorrelationGroup> groups;

  /// Throws std::invalid_argument when a group's matrix is not a correlation matrix (names the first leading minor that
  /// is not positive, or the entry out of range), or a parameter is in two groups, or a group member is a choice; or
  /// when two parameters have one name (they would share their draws).
  void validate() const;
  int size() const { return static_cast<int>(parameters.size()); }
};

enum class Design {
  random,           // independent draws, keyed by name
  latin_hypercube,  // needs the number of particles in advance: particle i depends on N
  sobol,            // scrambled Sobol; particle i is the same for every N. At most 3667 parameters
};

/// Draws particles of a space. Thread-safe once built; copies share their tables.
class Sampler {
 public:
  /// `count` matters to latin_hypercube only. Throws std::invalid_argument as ParameterSpace::validate() does, and when
  /// the design cannot serve so many parameters or particles. With latin_hypercube and correlation groups it takes time
  /// and memory in proportion to `count`, because the strata of correlated members are ranks among all particles.
  Sampler(ParameterSpace space, Design design, std::uint64_t seed, std::uint64_t count);

  const ParameterSpace& space() const { return space_; }
  Design design() const { return design_; }
  std::uint64_t seed() const { return seed_; }

  /// The point of particle i in the unit cube, before correlation. out: size() values. With latin_hypercube, i < count.
  void unit_point(std::uint32_t particle, std::span<double> out) const;
  /// The persistent values of particle i, in the order of the space's parameters.
  void draw(std::uint32_t particle, std::span<double> out) const;
  std::vector<double> draw(std::uint32_t particle) const;

 private:
  using Strata = std::vector<std::uint32_t>;  // per particle

  void stratify_groups();
  double in_cell(std::size_t parameter, std::uint32_t particle, std::uint64_t cell) const;

  ParameterSpace space_;
  Design design_;
  std::uint64_t seed_;
  std::uint64_t count_;
  std::vector<std::uint64_t> hashes_;      // per parameter: name hash
  std::vector<Eigen::MatrixXd> cholesky_;  // per group: lower factor
  // Per parameter: its cells in a Latin hypercube, where those follow from a correlation; null for others.
  std::vector<std::shared_ptr<const Strata>> strata_;
  std::vector<std::uint64_t> sobol_directions_;  // [parameter][bit], scrambled; empty for other designs
  std::vector<std::uint64_t> sobol_shifts_;      // [parameter]: digital shift
};

}  // namespace graze
