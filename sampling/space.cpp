// Checks of a ParameterSpace.

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <map>
#include <stdexcept>

#include "sampling/copula.h"
#include "sampling/design.h"
#include "sampling/refuse.h"

namespace graze {
namespace {

void check_names(const std::vector<UncertainParameter>& parameters) {
  std::map<std::string, int> seen;
  for (const auto& p : parameters) {
    if (p.name.empty()) refuse("a parameter has no name; its name keys its random stream");
    if (++seen[p.name] > 1)
      refuse("parameter {} is given twice; one name has one random stream, so keep one of the two", p.name);
  }
}

class GroupCheck {
 public:
  GroupCheck(const ParameterSpace& space, const CorrelationGroup& group) : space_(space), group_(group) {}

  void run(std::vector<int>& owner, int index) const {
    check_members(owner, index);
    check_entries();
    check_definite();
  }

 private:
  const std::string& name(int row) const { return space_.parameters[group_.members[row]].name; }

  void check_members(std::vector<int>& owner, int index) const {
    const auto n = static_cast<Eigen::Index>(group_.members.size());
    if (group_.correlation.rows() != n || group_.correlation.cols() != n)
      refuse("the correlation matrix is {} x {} for {} parameters; it must have one row and column for each",
             group_.correlation.rows(), group_.correlation.cols(), n);
    for (const int m : group_.members) {
      if (m < 0 || m >= space_.size()) refuse("correlated parameter {} of {} does not exist", m, space_.size());
      const auto& parameter = space_.parameters[m];
      if (parameter.persistent.is_choice())
        refuse("parameter {} is a choice; only parameters with a continuous distribution can be correlated",
               parameter.name);
      if (owner[m] == index) refuse("parameter {} stands twice in one correlation group", parameter.name);
      if (owner[m] >= 0) refuse("parameter {} is in two correlation groups; join them into one matrix", parameter.name);
      owner[m] = index;
    }
  }

  void check_entries() const {
    const auto& c = group_.correlation;
    for (int i = 0; i < c.rows(); ++i) {
      if (c(i, i) != 1) refuse("the correlation of {} with itself is {}; the diagonal must be 1", name(i), c(i, i));
      for (int j = 0; j < i; ++j) {
        if (!(std::abs(c(i, j)) <= 1))
          refuse("the correlation of {} and {} is {}; it must lie in [-1, 1]", name(i), name(j), c(i, j));
        if (c(i, j) != c(j, i))
          refuse("the correlation of {} and {} is {} below the diagonal and {} above it; the matrix must be symmetric",
                 name(i), name(j), c(i, j), c(j, i));
      }
    }
  }

  void check_definite() const {
    Eigen::MatrixXd factor;
    const int failed = correlation_factor(group_.correlation, factor);
    if (failed < 0) return;
    std::string names = name(0);
    for (int i = 1; i <= failed; ++i) names += ", " + name(i);
    // (1 - s) I + s C has the eigenvalues 1 - s (1 - lambda): all positive for s < 1 / (1 - lambda_min).
    const double smallest =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(group_.correlation, Eigen::EigenvaluesOnly).eigenvalues()(0);
    refuse(
        "the correlation matrix is not positive definite: its leading minor of order {} ({}) is not positive, so these "
        "correlations contradict each other; they would agree if all were multiplied by {:.2f} or less",
        failed + 1, names, std::floor(99 / (1 - smallest)) / 100);
  }

  const ParameterSpace& space_;
  const CorrelationGroup& group_;
};

}  // namespace

void ParameterSpace::validate() const {
  check_names(parameters);
  std::vector<int> owner(parameters.size(), -1);  // group of each parameter
  for (std::size_t g = 0; g < groups.size(); ++g) GroupCheck(*this, groups[g]).run(owner, static_cast<int>(g));
}

}  // namespace graze
