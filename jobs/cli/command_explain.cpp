// graze explain: which parameters cause failures, whether behaviour bifurcates, how long traces last.
#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "analysis/explanation.h"
#include "archive/files/csv.h"
#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct ExplainArguments {
  std::string archive, csv;
  std::vector<std::string> policies;
  bool json = false, force = false;
};

fs::path file_of(const ExplainArguments& arguments, const std::string& table) {
  return fs::path(arguments.csv) / (table + ".csv");
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) line += (i > 0 ? "," : "") + csv_cell(cells[i]);
  return line + "\n";
}

void write_csv(const ExplainArguments& arguments, const Explanation& explanation) {
  const std::vector<ExplanationTable> tables = explanation_tables(explanation);
  const ParentFolders folders(file_of(arguments, tables[0].name));
  // All are written before the first takes its name, so that a full disk leaves none of them.
  std::vector<std::unique_ptr<NewFile>> files;
  for (const ExplanationTable& table : tables) {
    const fs::path path = file_of(arguments, table.name);
    std::string text = csv_line(table.head);
    for (const auto& row : table.rows) text += csv_line(row);
    files.push_back(std::make_unique<NewFile>(path, arguments.force));
    const int error = write_all(files.back()->descriptor(), std::as_bytes(std::span(text)));
    if (error != 0) fail_writing(path, error);
  }
  for (const auto& file : files) file->publish();
}

/// Before anything is read: options that cannot be meant, files that must stay.
void check(const ExplainArguments& arguments) {
  if (arguments.csv.empty()) {
    if (arguments.force) throw InputError("--force: is for --csv FOLDER, which was not given");
    return;
  }
  if (!ending_of(arguments.csv).empty() && !fs::is_directory(arguments.csv)) {
    throw InputError(
        fmt::format("--csv {}: names a file; it takes a folder, which gets a file for each table: --csv {}",
                    arguments.csv, fs::path(arguments.csv).replace_extension().string()));
  }
  for (const ExplanationTable& table : explanation_tables({})) {
    const fs::path file = file_of(arguments, table.name);
    if (fs::is_directory(file)) {
      throw InputError(fmt::format("--csv {}: {} is a directory; choose another folder", arguments.csv, file.string()));
    }
    if (fs::exists(fs::symlink_status(file)) && !arguments.force) {  // a link that leads nowhere, too
      throw InputError(fmt::format("--csv {}: {} is there already; choose another folder, or give --force",
                                   arguments.csv, file.string()));
    }
    check_new_file(file, arguments.force, {arguments.archive}, NamedBy::word);  // not by --output
  }
}

int explain_archive(const ExplainArguments& arguments) {
  check(arguments);
  const Archive archive(arguments.archive);
  warn(archive.warnings());
  const std::vector<std::string> policies =
      chosen_names(archive.info().policies, arguments.policies, arguments.archive);
  const Explanation explanation = explain(archive, policies);
  if (!arguments.csv.empty()) write_csv(arguments, explanation);
  if (arguments.json) {
    std::cout << explanation_json(explanation) << "\n";
  } else {
    std::cout << format_explanation(explanation);
  }
  return explanation.complete ? kDone : kMachineFailed;
}

}  // namespace

void add_explain(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ExplainArguments>();
  CLI::App* verb =
      add_verb(app, "explain", "Which parameters cause failures, whether behaviour bifurcates, how long traces last",
               "  graze explain quadruped_curb.graze\n"
               "  graze explain curb.h5 --policy step/3cm          # one policy\n"
               "  graze explain curb.h5 --json                     # every number\n"
               "  graze explain curb.h5 --csv why                  # why/causes.csv, rules, spread, modes, …\n\n"
               "Says 'no parameter explains it' where nothing is significant. docs/statistics.md tells what is tested "
               "and how often it is wrong.\n");
  add_archive(*verb, arguments->archive);
  add_policies(*verb, arguments->policies);
  verb->add_flag("--json", arguments->json, "Print JSON");
  verb->add_option("--csv", arguments->csv, "Also write the tables into this folder, a CSV file each")
      ->type_name("FOLDER");
  verb->add_flag("--force", arguments->force, "Replace CSV files that exist");
  verb->callback([arguments, &action] {
    // Beside reading, the tests of a large campaign take a second for some megabytes.
    action = [arguments] {
      return in_reading_child(
          {arguments->archive}, [&] { return explain_archive(*arguments); }, 2);
    };
  });
}

}  // namespace graze
