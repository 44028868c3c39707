// graze compare: two campaigns on the same particles: who was fixed, who broke.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>

#include "analysis/compare.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

struct CompareArguments {
  std::string a, b, with;
  std::vector<std::string> policies;
  std::uint64_t top = 5;
  bool json = false, csv = false;
};

CompareRequest request_of(const CompareArguments& arguments, const Archive& a, const Archive& b) {
  CompareRequest out{arguments.a, arguments.b, {}, "", ""};
  if (!arguments.with.empty()) {
    const std::vector<std::string> of_a = chosen_names(a.info().policies, arguments.policies, arguments.a);
    const std::vector<std::string> of_b = chosen_names(b.info().policies, {arguments.with}, arguments.b, "--with");
    if (of_a.size() != 1 || of_b.size() != 1) {
      throw InputError(fmt::format("--with {}: compares one policy of each; --policy chooses {} of {}, --with {} of {}",
                                   arguments.with, of_a.size(), arguments.a, of_b.size(), arguments.b));
    }
    out.policy_a = of_a.front();
    out.policy_b = of_b.front();
    return out;
  }
  if (arguments.policies.empty()) return out;
  std::vector<std::string> both;
  for (const std::string& policy : a.info().policies) {
    const auto& others = b.info().policies;
    if (std::find(others.begin(), others.end(), policy) != others.end()) both.push_back(policy);
  }
  out.policies = chosen_names(both, arguments.policies, fmt::format("both {} and {}", arguments.a, arguments.b));
  return out;
}

int compare_archives(const CompareArguments& arguments) {
  const Archive a(arguments.a), b(arguments.b);
  warn(a.warnings());
  warn(b.warnings());
  const Comparison comparison = compare_campaigns(a, b, request_of(arguments, a, b));
  if (arguments.json) {
    std::cout << comparison_json(comparison) << "\n";
  } else {
    std::cout << (arguments.csv ? changes_csv(comparison) : format_comparison(comparison, arguments.top));
  }
  return comparison.complete_a && comparison.complete_b ? kDone : kMachineFailed;
}

}  // namespace

void add_compare(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* verb = add_verb(app, "compare", "Two campaigns on the same particles: who was fixed, who broke",
                            "  graze compare before.h5 after.h5\n"
                            "  graze compare curb.h5 curb.h5 --policy step/3cm --with step/4cm\n"
                            "  graze compare before.h5 after.h5 --csv > changes.csv\n");
  CompareArguments& a = *arguments;
  add_archive(*verb, a.a, "a");
  verb->add_option("b", a.b, "The one to compare it with")->required();
  add_policies(*verb, a.policies);
  verb->add_option("--with", a.with, "Compare the one --policy of the first with this policy of the second")
      ->type_name("POLICY");
  add_whole(*verb, "--top", a.top, 1, 1'000'000, "So many fixed and broken particles (5)");
  CLI::Option* json = verb->add_flag("--json", a.json, "Print JSON: everything");
  verb->add_flag("--csv", a.csv, "Print the particles that end otherwise as CSV")->excludes(json);
  verb->callback([arguments, &action] {
    action = [arguments] {
      return in_reading_child({arguments->a, arguments->b}, [&] { return compare_archives(*arguments); });
    };
  });
}

}  // namespace graze
