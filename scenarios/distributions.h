#pragma once
// The table of distributions of a scenario: how each is written, and what sampling/distribution.h makes of it.

#include <functional>
#include <string>
#include <vector>

#include "engine/model/fabrication.h"
#include "engine/settings/description.h"
#include "scenarios/registered.h"
#include "scenarios/spread.h"

namespace graze {

/// What a distribution is drawn for.
struct DrawnFor {
  const Parameter& parameter;
  double center;  // default middle: the nominal value, or 0 of jitter
  double whole;   // what "5 %" is of
  Standing standing;
};

/// Makes `persistent`, and `labels` if there are any, of what is written; its keys are known to be described ones. May
/// throw std::invalid_argument, whose place is that of the distribution.
using DistributionReader = std::function<Spread(const Described&, const DrawnFor&)>;

struct DistributionKind {
  std::string name;
  Description text;
  DistributionReader read;
  bool of_words = false;  // draws the named values of a parameter like contact.model, too; is no jitter
};

/// Those that come with the program, and behind them those that were registered.
const std::vector<DistributionKind>& distribution_kinds();
using DistributionRegistration = Registration<DistributionKind>;

/// `choice` of a parameter's named values, and a value alone, are indices into Parameter::choices.
int label_index(const Settings& value, const Parameter& parameter);

/// Beside distributions: `jitter: {noise: …}`, and the conical error of an axis, `{cone: …}`.
const Description& noise_description();
const Description& cone_description();

}  // namespace graze
