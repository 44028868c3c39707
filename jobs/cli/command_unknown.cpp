// graze unknown: kinds of unknown failures, a typical trace of each, and a requirement that would have caught it.
#include <iostream>
#include <memory>

#include "analysis/unknown_failures.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

struct UnknownArguments {
  std::string archive;
  std::vector<std::string> policies;
  bool json = false;
};

int tell_unknown(const UnknownArguments& arguments) {
  const Archive archive(arguments.archive);
  warn(archive.warnings());
  std::vector<UnknownFailures> all;
  for (const std::string& policy : chosen_names(archive.info().policies, arguments.policies, arguments.archive)) {
    all.push_back(unknown_failures(archive, policy));
  }
  const bool complete = archive.complete();
  if (arguments.json) {
    std::cout << unknown_failures_json(all, arguments.archive, complete) << "\n";
  } else {
    std::cout << format_unknown_failures(all, arguments.archive, complete);
  }
  return complete ? kDone : kMachineFailed;
}

}  // namespace

void add_unknown(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<UnknownArguments>();
  CLI::App* verb = add_verb(app, "unknown", "Kinds of unknown failures, and requirements that would have caught them",
                            "  graze unknown curb.h5\n"
                            "  graze unknown curb.h5 --policy step/3cm --json\n");
  add_archive(*verb, arguments->archive);
  add_policies(*verb, arguments->policies);
  verb->add_flag("--json", arguments->json, "Print JSON");
  verb->callback([arguments, &action] {
    action = [arguments] {
      return in_reading_child(
          {arguments->archive}, [&] { return tell_unknown(*arguments); }, 1);
    };
  });
}

}  // namespace graze
