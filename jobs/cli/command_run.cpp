// graze run: simulates a campaign, writes its archive, prints its table.
#include <spdlog/spdlog.h>

#include <memory>

#include "archive/files/parent_folders.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/run_request.h"
#include "jobs/cli/simulate.h"

namespace graze {
namespace {

int run(const RunArguments& arguments, const std::string& command_line) {
  const std::unique_ptr<Communicator> comm = make_communicator();
  if (comm->rank() > 0) return assist(*comm, arguments.threads);
  Start start(*comm);
  const RunRequest request = prepare_run(arguments, command_line);
  check_space(arguments, request, request.directory, request.packed.has_value());
  const ParentFolders folders(request.directory);
  CampaignWriter writer(request.directory, request.info, arguments.force && !request.packed);
  const std::filesystem::path made = request.packed.value_or(request.directory);
  Printing printing{arguments.json, arguments.quiet, request.packed ? made.string() : ""};
  if (request.packed) {
    printing.completed = [&] {
      pack(request.directory, made, arguments.force, PackedContent::trusted);
      writer.check_in_place();
      std::filesystem::remove_all(request.directory);
    };
  }
  const ExitCode code = simulate_into(writer, request.scenario, request.options, request.info, printing, start);
  if (!arguments.quiet) spdlog::info("archive: {}", made.string());
  return code;
}

}  // namespace

void add_run(CLI::App& app, Action& action, const std::string& command_line) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* verb = add_verb(app, "run", "Simulate a campaign, write its archive, print its table",
                            "  graze run data/scenarios/quadruped_curb.yaml -n 100\n"
                            "  graze run my.yaml -n 1000 --threads 8 --seed 7 -o out/first.graze\n"
                            "  graze run my.yaml --policy 'step/4cm' --set time.end='2 s' -o one.h5\n"
                            "  graze run my.yaml --until 'p >= 0.95' -n 5000       # exit 0 holds, 1 refuted, 4 open\n"
                            "  graze run my.yaml --until 'ci < 2 %' --until 'step/4cm: p >= 0.9' --confidence 99%\n"
                            "  graze run my.yaml --last '0.5 s' --every 1     # telemetry before failures\n");
  arguments->add_to(*verb);
  verb->callback([arguments, command_line, &action] {
    action = [arguments, command_line] { return run(*arguments, command_line); };
  });
}

}  // namespace graze
