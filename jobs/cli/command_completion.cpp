// graze completion: the scripts by which shells complete words of graze.
#include <iostream>
#include <memory>

#include "jobs/cli/commands.h"
#include "jobs/cli/completion.h"

namespace graze {

void add_completion(CLI::App& app, Action& action) {
  auto shell = std::make_shared<std::string>();
  CLI::App* verb = add_verb(app, "completion",
                            "Print the script by which bash, zsh or fish completes verbs, options, files, policies and "
                            "paths of scenarios",
                            "  source <(graze completion bash)                       # in this shell; for good:\n"
                            "  graze completion bash > ~/.local/share/bash-completion/completions/graze\n"
                            "  graze completion zsh > ~/.zfunc/_graze                # a folder of $fpath\n"
                            "  graze completion fish > ~/.config/fish/completions/graze.fish\n");
  verb->add_option("shell", *shell, "Which")->required()->type_name("bash|zsh|fish");
  verb->callback([shell, &action] {
    action = [shell] {
      std::cout << completion_script(*shell);
      return kDone;
    };
  });
}

}  // namespace graze
