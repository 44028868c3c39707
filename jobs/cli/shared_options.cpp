#include "jobs/cli/shared_options.h"

#include "jobs/workers/controllers.h"

namespace graze {

CLI::Option* add_archive(CLI::App& verb, std::string& archive, const std::string& name) {
  return verb.add_option(name, archive, "Campaign directory or packed file")->required();
}

CLI::Option* add_policies(CLI::App& verb, std::vector<std::string>& policies) {
  return verb.add_option("--policy", policies, "Only these policies (globs; may be repeated; default: all)")
      ->allow_extra_args(false);
}

void add_trust(CLI::App& verb) {
  verb.add_flag_callback(
      "--trust", trust_controllers,
      "Run controllers that the scenario names (policies library and python): code with your rights");
}

}  // namespace graze
