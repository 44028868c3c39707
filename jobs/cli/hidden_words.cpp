#include "jobs/cli/hidden_words.h"

#include <iostream>

#include "jobs/campaign/exit_code.h"
#include "jobs/cli/completion.h"
#include "jobs/cli/manual.h"
#include "jobs/cli/reading_verb.h"

namespace graze {

std::optional<int> hidden_words(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.size() == 2 && words[0] == "manual") {
    write_manual(app, words[1]);
    return kDone;
  }
  if (words.size() < 3 || words[0] != "complete" || words[1] != "--") return std::nullopt;
  const std::vector<std::string> typed(words.begin() + 2, words.end());
  // One of them may be an archive, and that anybody's.
  return in_reading_child(typed, [&] {
    std::cout << offer_lines(offer(app, typed));
    return kDone;
  });
}

}  // namespace graze
