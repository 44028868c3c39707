// graze resume: finishes a campaign that was stopped or killed, or makes it larger.
#include <memory>

#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/resume_campaign.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

int resume(const ResumeArguments& arguments) {
  const std::unique_ptr<Communicator> comm = make_communicator();
  if (comm->rank() > 0) return assist(*comm, arguments.threads);
  Start start(*comm);
  return resume_campaign(arguments, start);
}

}  // namespace

void add_resume(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<ResumeArguments>();
  CLI::App* verb = add_verb(app, "resume", "Finish a campaign that was stopped or killed, or make it larger",
                            "  graze resume quadruped_curb.graze\n"
                            "  graze resume quadruped_curb.graze -n 1000\n"
                            "  graze resume quadruped_curb.graze --policy 'step/4cm'\n\n"
                            "What is finished stays; the result has the same bits as a campaign that was never "
                            "interrupted. The scenario's files\nare taken from the archive.\n");
  verb->add_option("directory", arguments->directory, "Campaign directory")->required();
  add_whole(*verb, "-n,--particles", arguments->particles, 1, kParticleLimit,
            "Particles in all, if there shall be more");
  add_threads(*verb, arguments->threads);
  add_watchdog(*verb, arguments->watchdog);
  verb->add_option("--policy", arguments->policies, "Add these policies of the scenario (globs; may be repeated)")
      ->allow_extra_args(false);
  verb->add_flag("--ignore-space", arguments->ignore_space, "Go on even if the archive will not fit on the disk");
  add_trust(*verb);
  verb->add_flag("--json", arguments->json, "Print the table as JSON");
  verb->add_flag("--quiet", arguments->quiet, "No progress");
  verb->callback([arguments, &action] { action = [arguments] { return resume(*arguments); }; });
}

}  // namespace graze
