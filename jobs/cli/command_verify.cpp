// graze verify: whether an archive is whole, and what graze resume would mend.
#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/failures.h"
#include "analysis/text_table.h"
#include "archive/directory/campaign_files.h"
#include "archive/verify.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

ExitCode code_of(Soundness soundness) {
  return soundness == Soundness::whole ? kDone : soundness == Soundness::incomplete ? kMachineFailed : kInvalidInput;
}

/// "its seal, structure and content are whole: 400 of 400 traces"
std::string counts_of(const Verification& found) {
  std::string out = fmt::format("  {} of {} traces", found.traces, found.total);
  if (!found.packed) out += fmt::format(" in {} whole shard{}", found.shards, found.shards == 1 ? "" : "s");
  return out + "\n";
}

/// Whether the campaign's controllers need --trust; no, if that is not to be read: resume then says what is missing.
bool runs_outside_code(const std::string& archive) {
  try {
    return needs_trust(read_description(Directory(archive)));
  } catch (const std::exception&) {
    return false;
  }
}

/// What resume would do about the traces.
std::string mending_of(const std::string& archive, const Verification& found) {
  if (found.packed)
    return "  it was packed before the campaign was complete; a directory can go on, this file cannot\n";
  if (found.writer) return fmt::format("  {} is writing here\n", *found.writer);
  std::string out = fmt::format("  '{}' mends it", resume_command(archive, runs_outside_code(archive)));
  if (found.left() > 0) out += fmt::format(" and simulates {} trace{}", found.left(), found.left() == 1 ? "" : "s");
  if (found.lost > 0) out += fmt::format(", of which damaged or missing shards held {}", found.lost);
  if (found.unfinished > 0)
    out += fmt::format("; {} were left unfinished ('graze status' tells why)", found.unfinished);
  return out + "\n";
}

std::string text_of(const std::string& archive, const Verification& found) {
  std::string out = fmt::format("{}: {}\n", archive, soundness_name(found.soundness));
  if (found.total > 0) out += counts_of(found);
  if (found.soundness == Soundness::incomplete) out += mending_of(archive, found);
  for (const std::string& fault : found.faults) out += fmt::format("  {}\n", fault);
  std::vector<std::vector<std::string>> table = {{"file", "state", "traces", "what"}};
  for (const VerifiedFile& file : found.files) {
    if (file.state == VerifiedFile::State::whole) continue;
    table.push_back(
        {file.name, state_name(file.state), file.traces > 0 ? fmt::format("{}", file.traces) : "-", file.what});
  }
  return table.size() > 1 ? out + "\n" + text_table(table, table[0].size()) : out;
}

std::string json_of(const Verification& found) {
  nlohmann::ordered_json out = {{"verdict", soundness_name(found.soundness)},
                                {"packed", found.packed},
                                {"writer", nullptr},
                                {"traces", found.traces},
                                {"total", found.total},
                                {"left", found.left()},
                                {"lost", found.lost},
                                {"unfinished", found.unfinished},
                                {"faults", found.faults},
                                {"files", nlohmann::ordered_json::array()}};
  if (found.writer) out["writer"] = *found.writer;
  for (const VerifiedFile& file : found.files) {
    out["files"].push_back(
        {{"name", file.name}, {"state", state_name(file.state)}, {"traces", file.traces}, {"what", file.what}});
  }
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

void add_verify(CLI::App& app, Action& action) {
  struct Arguments {
    std::string archive;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      add_verb(app, "verify", "Check every seal and all content; say what resume would mend",
               "  graze verify quadruped_curb.graze\n"
               "  graze verify curb.h5 --json\n\n"
               "Reads everything and changes nothing. Exit code 0: whole; 3: incomplete, or damaged in a way "
               "that 'graze resume'\nmends; 2: damaged beyond that.\n");
  add_archive(*verb, arguments->archive);
  verb->add_flag("--json", arguments->json, "Print as JSON, with every file");
  verb->callback([arguments, &action] {
    action = [arguments] {
      const Verification found = verify(arguments->archive);
      std::cout << (arguments->json ? json_of(found) : text_of(arguments->archive, found));
      return code_of(found.soundness);
    };
  });
}

}  // namespace graze
