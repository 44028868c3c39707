// graze events: where behaviour divides, which contact sequences there are, what is new in some traces.
#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "analysis/events.h"
#include "archive/hdf5/reading_child.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/campaign/nominal_traces.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

constexpr const char* kNominal = "nominal";

struct EventsArguments {
  std::string archive, detail = "parts", table = "sequences", reference;
  std::vector<std::string> policies;
  EventsRequest request;
  std::uint64_t top = 5;
  bool json = false, csv = false;
};

/// Within [least, most]; as it is written on a command line.
double parse_share(const std::string& text, const std::string& option, double least, double most) {
  std::size_t read = 0;
  double value = std::numeric_limits<double>::quiet_NaN();
  try {
    value = std::stod(text, &read);
  } catch (const std::exception&) {
    read = 0;
  }
  if (read != text.size() || !(value >= least && value <= most)) {
    throw InputError(fmt::format("{} {}: must be a number within [{:g}, {:g}]", option, text, least, most));
  }
  return value;
}

std::string csv_of(const CampaignEvents& events, const std::string& table) {
  return table == "branches" ? branches_csv(events) : table == "causes" ? causes_csv(events) : sequences_csv(events);
}

int tell_events(const EventsArguments& arguments) {
  if (arguments.table != "sequences" && !arguments.csv) {
    throw InputError(fmt::format("--table {}: is for --csv, which was not given", arguments.table));
  }
  const Archive archive(arguments.archive);
  warn(archive.warnings());
  EventsRequest request = arguments.request;
  request.name = arguments.archive;
  request.policies = chosen_names(archive.info().policies, arguments.policies, arguments.archive);
  if (arguments.reference == kNominal) {
    check_results_version(arguments.archive, archive.info(), "tell novelties with that program, or run it anew");
    request.nominal = [&](const std::vector<std::string>& policies) {
      end_of_reading();
      const CampaignInfo& info = archive.info();
      check_effort(static_cast<double>(policies.size()) * info.end / info.step,
                   fmt::format("nominal traces of {} policies have", policies.size()));
      const ArchivedScenario reloaded(arguments.archive, info, "nothing can be simulated again");
      return nominal_traces(reloaded.scenario(), policies);
    };
  } else {
    request.reference = arguments.reference;
  }
  request.rules.detail = arguments.detail == "parts"      ? Detail::parts
                         : arguments.detail == "features" ? Detail::features
                                                          : Detail::modes;
  if (request.rules.from >= request.rules.to) {
    throw InputError(fmt::format("--from {:g} s lies at or after --to {:g} s", request.rules.from, request.rules.to));
  }
  const double end = archive.info().end;
  for (const auto& [option, value] : {std::pair{"--from", request.rules.from}, {"--cycle", request.cycle}}) {
    if (value >= end && value > 0) {
      throw InputError(fmt::format("{} {:g} s: traces last {:g} s; it must be less", option, value, end));
    }
  }
  const CampaignEvents events = campaign_events(archive, request);
  if (arguments.json) {
    std::cout << events_json(events) << "\n";
  } else {
    std::cout << (arguments.csv ? csv_of(events, arguments.table) : format_events(events, arguments.top));
  }
  return events.complete ? kDone : kMachineFailed;
}

/// How contacts are read, and what is looked for in them.
void add_reading_options(CLI::App& verb, EventsArguments& a) {
  add_choice(
      verb, "--detail", a.detail, {"parts", "features", "modes"},
      "How finely contacts are told apart: which parts touch, with what feature of them, or sticking, slipping or "
      "rolling, too");
  const auto seconds = [&verb](const char* names, double& value, double most, const char* description) {
    add_read_option(verb, names, description, [&value, most](const std::string& text, const std::string& option) {
      value = parse_seconds(text, option, 1e-9, most);
    })->type_name("TIME");
  };
  seconds("--from", a.request.rules.from, 1e9, "Only contacts that begin here or later");
  seconds("--to", a.request.rules.to, 1e9, "Only contacts that begin before");
  seconds("--simultaneous", a.request.rules.simultaneous, 1e9,
          "Contacts that begin within this time of each other have no order (20 ms)");
  add_read_option(verb, "--cycle", "Tell sequences by cycles of this duration, too",
                  [&a](const std::string& text, const std::string& option) {
                    a.request.cycle = parse_seconds(text, option, 1e-9, 1e9);
                    if (a.request.cycle == 0) throw InputError(option + " 0: a cycle lasts longer than 0 s");
                  })
      ->type_name("TIME");
  add_read_option(verb, "--light",
                  "A contact counts if it carries this share of what contacts of its two parts usually do "
                  "(0.1)",
                  [&a](const std::string& text, const std::string& option) {
                    a.request.rules.light = parse_share(text, option, 0, 1);
                  })
      ->type_name("SHARE");
  add_read_option(verb, "--error-rate", "How often a bifurcation may be told where there is none (0.01)",
                  [&a](const std::string& text, const std::string& option) {
                    a.request.tree.error_rate = parse_share(text, option, 1e-12, 0.5);
                  })
      ->type_name("SHARE");
}

}  // namespace

void add_events(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<EventsArguments>();
  CLI::App* verb = add_verb(app, "events", "Where behaviour divides, contact sequences, what is new in some traces",
                            "  graze events quadruped_curb.graze\n"
                            "  graze events curb.h5 --policy step/3cm --detail features\n"
                            "  graze events trot.h5 --cycle '0.3 s'             # what each step of a gait is like\n"
                            "  graze events new.h5 --reference old.h5           # new against last week's campaign\n"
                            "  graze events curb.h5 --reference nominal         # new against the nominal trace\n"
                            "  graze events curb.h5 --csv > sequences.csv\n"
                            "  graze events curb.h5 --csv --table branches      # where behaviour divides, and why\n");
  EventsArguments& a = *arguments;
  add_archive(*verb, a.archive);
  add_policies(*verb, a.policies);
  add_reading_options(*verb, a);
  verb->add_option(
          "--reference", a.reference,
          "Tell what is new against this archive, of the same robot and world, or against the nominal trace, simulated "
          "now, instead of against the successes")
      ->type_name("ARCHIVE|nominal");
  add_whole(*verb, "--top", a.top, 1, 1'000'000, "So many sequences and novelties of each kind (5)");
  CLI::Option* json = verb->add_flag("--json", a.json, "Print JSON: everything");
  verb->add_flag("--csv", a.csv, "Print a table as CSV")->excludes(json);
  add_choice(*verb, "--table", a.table, {"sequences", "branches", "causes"},
             "Which table --csv prints: sequences, branches of bifurcations, or all numbers of their causes");
  verb->callback([arguments, &action] {
    action = [arguments] {
      std::vector<std::string> archives = {arguments->archive};
      if (!arguments->reference.empty() && arguments->reference != kNominal) archives.push_back(arguments->reference);
      // Beside reading, causes of many bifurcations take time.
      return in_reading_child(
          archives, [&] { return tell_events(*arguments); }, 2);
    };
  });
}

}  // namespace graze
