#include "scenarios/design_totals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scenarios/design_block.h"
#include "scenarios/keys.h"
#include "scenarios/names.h"

namespace graze {
namespace {

/// Of the least share that counts: shares that cancel leave rounding behind.
constexpr double kCancels = 1e-12;

class TotalsReader {
 public:
  explicit TotalsReader(const std::vector<DesignVariable>& variables)
      : variables_(variables), total_of_(variables.size()) {}

  FixedTotal read(const Settings& settings) {
    const Described own(settings, section_of("design_total"));
    const Settings sum = own.at("sum");
    ++totals_;
    if (sum.is_null() || sum.items().empty()) sum.fail_key("names no variable");
    for (const Settings& glob : sum.items()) add(glob);
    FixedTotal out;
    for (std::size_t i = 0; i < variables_.size(); ++i) {
      if (total_of_[i] != totals_) continue;
      out.variables.push_back(static_cast<int>(i));
      out.weights.push_back(weight(variables_[i], sum));
    }
    check(out, sum);
    return out;
  }

 private:
  void add(const Settings& glob) {
    const std::string pattern = glob.glob();
    bool any = false;
    for (std::size_t i = 0; i < variables_.size(); ++i) {
      if (!matches(pattern, variables_[i].name)) continue;
      any = true;
      if (total_of_[i] != 0 && total_of_[i] != totals_) {
        glob.fail(
            fmt::format("'{}' is in another sum already; a variable belongs to one sum at most", variables_[i].name));
      }
      total_of_[i] = totals_;
    }
    if (any) return;
    std::vector<std::string> names;
    for (const DesignVariable& one : variables_) names.push_back(one.name);
    glob.fail(fmt::format("{}: no design variable of that name; {}", pattern, nearest_or_all(pattern, names)));
  }

  static double weight(const DesignVariable& one, const Settings& sum) {
    if (!one.choices.empty()) sum.fail(fmt::format("'{}' is a choice, which has no sum", one.name));
    const double out = std::accumulate(one.share.begin(), one.share.end(), 0.0);
    if (std::abs(out) > kCancels) return out;
    sum.fail(
        fmt::format("the numbers of '{}' cancel each other, so that it adds nothing to a sum; leave it out", one.name));
  }

  void check(const FixedTotal& total, const Settings& sum) const {
    const DesignVariable& first = variables_[static_cast<std::size_t>(total.variables.front())];
    if (total.variables.size() == 1) {
      sum.fail(
          fmt::format("'{}' alone could not change any more; name the variables that may make up for it, or leave "
                      "it out of design.variables",
                      first.name));
    }
    for (const int i : total.variables) {
      const DesignVariable& one = variables_[static_cast<std::size_t>(i)];
      if (one.unit == first.unit) continue;
      const auto unit = [](const DesignVariable& of) { return of.unit.empty() ? "no unit" : of.unit; };
      sum.fail(
          fmt::format("'{}' is in {} and '{}' in {}: they have no sum", first.name, unit(first), one.name, unit(one)));
    }
  }

  const std::vector<DesignVariable>& variables_;
  std::vector<int> total_of_;  // per variable: which total, from 1; 0: none
  int totals_ = 0;
};

}  // namespace

double total_at(const FixedTotal& total, const std::vector<double>& design) {
  double out = 0;
  for (std::size_t k = 0; k < total.variables.size(); ++k) {
    out += total.weights[k] * design[static_cast<std::size_t>(total.variables[k])];
  }
  return out;
}

std::string total_name(const FixedTotal& total, const std::vector<DesignVariable>& variables) {
  std::string out;
  for (const int i : total.variables) {
    out += (out.empty() ? "" : " + ") + variables[static_cast<std::size_t>(i)].name;
  }
  return out;
}

std::vector<FixedTotal> read_totals(const Settings& fixed, const std::vector<DesignVariable>& variables) {
  if (!fixed.is_list()) fixed.fail("must be a list of sums; e.g. [{sum: [thigh, shin]}]");
  TotalsReader reader(variables);
  std::vector<FixedTotal> out;
  for (const Settings& one : fixed.items()) out.push_back(reader.read(one));
  return out;
}

}  // namespace graze
