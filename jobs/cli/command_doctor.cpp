// graze doctor: what of this machine is used, what is missing, and how to get it.
#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "archive/files/utf8.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/page.h"
#include "jobs/cli/shipped.h"
#include "jobs/cli/wrapped_text.h"
#include "jobs/machine/folder_trial.h"
#include "jobs/machine/installation.h"
#include "jobs/machine/machine_limits.h"
#include "jobs/machine/process_trial.h"

namespace graze {
namespace {

struct DoctorArguments {
  std::string folder = ".";
  bool json = false;
};

void append(std::vector<Finding>& all, std::vector<Finding> more) {
  all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

std::vector<Finding> examine(const std::string& folder) {
  std::vector<Finding> out;
  const std::vector<Finding> there = folder_findings(folder);  // refuses what is no folder
  append(out, program_findings({data_folder(), shipped_scenarios().size(), !page_template().head.empty()}));
  append(out, limit_findings(group_limits()));
  append(out, library_findings());
  append(out, there);
  append(out, process_findings());
  append(out, tool_findings());
  return out;
}

const char* health_word(Health health) {
  return health == Health::good ? "good" : health == Health::note ? "note" : "broken";
}

std::string findings_text(const std::vector<Finding>& findings, std::size_t width) {
  std::vector<std::vector<std::string>> rows;
  std::string out, group;
  const auto flush = [&] {
    if (!rows.empty()) out += fmt::format("{}{}\n{}", out.empty() ? "" : "\n", group, columns_text(rows, width));
    rows.clear();
  };
  for (const Finding& one : findings) {
    if (one.group != group) flush();
    group = one.group;
    const char* const mark = one.health == Health::broken ? "BROKEN: " : "";
    rows.push_back({one.name, mark + printable(one.text)});
    if (!one.advice.empty()) rows.push_back({"", "-> " + one.advice});
  }
  flush();
  return out;
}

std::string findings_json(const std::vector<Finding>& findings, bool sound) {
  nlohmann::ordered_json out = {{"sound", sound}, {"findings", nlohmann::ordered_json::array()}};
  for (const Finding& one : findings) {
    nlohmann::ordered_json row = {
        {"group", one.group}, {"name", one.name}, {"health", health_word(one.health)}, {"text", one.text}};
    if (!one.advice.empty()) row["advice"] = one.advice;
    for (const auto& [name, value] : one.numbers) row[name] = value;
    out["findings"].push_back(std::move(row));
  }
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

int examine_and_tell(const DoctorArguments& arguments) {
  const std::vector<Finding> findings = examine(arguments.folder);
  const auto broken =
      std::count_if(findings.begin(), findings.end(), [](const Finding& one) { return one.health == Health::broken; });
  if (arguments.json) {
    std::cout << findings_json(findings, broken == 0) << "\n";
  } else {
    std::cout << findings_text(findings, output_width());
    std::cout << (broken == 0   ? std::string("\nCampaigns can run and be kept here.\n")
                  : broken == 1 ? std::string("\nOne thing that campaigns need is broken.\n")
                                : fmt::format("\n{} things that campaigns need are broken.\n", broken));
  }
  return broken == 0 ? kDone : kMachineFailed;
}

}  // namespace

void add_doctor(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<DoctorArguments>();
  CLI::App* verb = add_verb(app, "doctor",
                            "What of this machine is used, whether campaigns can be kept in a folder, what is missing "
                            "(exit code 3: something that campaigns need is broken)",
                            "  graze doctor\n"
                            "  graze doctor /scratch/$USER     # the disk where campaigns shall lie\n"
                            "  graze doctor --json\n");
  verb->add_option("folder", arguments->folder, "Where campaigns shall lie")->default_str(".")->type_name("FOLDER");
  verb->add_flag("--json", arguments->json, "Print JSON");
  verb->callback([arguments, &action] { action = [arguments] { return examine_and_tell(*arguments); }; });
}

}  // namespace graze
