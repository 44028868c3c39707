#include "tests/fuzz/verbs.h"

#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>

#include <iostream>
#include <streambuf>

#include "archive/archive.h"
#include "jobs/cli/commands.h"

// Assimp's importers forget what they had allocated when a mesh turns out to be broken.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp\n"; }

namespace graze::fuzz {
namespace {

class Nowhere : public std::streambuf {
  int overflow(int c) override { return c == EOF ? 0 : c; }
  std::streamsize xsputn(const char*, std::streamsize n) override { return n; }
};

/// What verbs print is made, and forgotten. (std::cerr stays: sanitizers and libFuzzer write past it.)
void print_nowhere() {
  static const bool once = [] {
    static Nowhere nowhere;
    std::cout.rdbuf(&nowhere);
    std::cerr.rdbuf(&nowhere);
    spdlog::set_default_logger(spdlog::null_logger_mt("graze"));
    return true;
  }();
  (void)once;
}

}  // namespace

bool run_verb(const std::vector<std::string>& words) {
  print_nowhere();
  CLI::App app;
  Action action;
  add_check(app, action);
  add_run(app, action, "graze run");
  add_resume(app, action);
  add_status(app, action);
  add_score(app, action);
  add_explain(app, action);
  add_plot(app, action);
  add_replay(app, action);
  add_pack(app, action);
  app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  try {
    action();
  } catch (const InputError&) {
    return false;
  } catch (const MachineError&) {
    return false;
  }
  return true;
}

}  // namespace graze::fuzz
