// Claim: whatever call of the operating system fails, once or from then on, in whatever verb: the old or the new
// campaign is whole, or goes on to be; nothing else is touched; the message names file and reason; no verb that ends
// with exit code 0 has kept silent about something.
#include <gmock/gmock.h>

#include <cstring>
#include <regex>

#include "tests/faults/stage.h"

namespace graze::faults {
namespace {

using testing::Digests;

const std::string kRun = "run ball.yaml -n 16 --threads 1 --quiet ";

/// What an undisturbed verb finds and leaves.
struct Undisturbed {
  Tree before, after;
  Outcome outcome;
};

/// One verb under trial.
struct Verb {
  std::string name;
  std::vector<std::string> before;  // verbs that make what is there
  std::string arguments;
  /// Fails the test unless all is well after the trial, which ended so.
  std::function<void(const Stage&, const Undisturbed&, const Outcome&)> judge;
};

void PrintTo(const Verb& verb, std::ostream* out) { *out << verb.arguments; }

/// Without how much of the disk is free, which changes and cannot always be asked.
std::string lasting(const std::string& text) {
  return std::regex_replace(text, std::regex("; [^;\n]* (is|are) free"), "");
}

void only_read(const Stage& stage, const Undisturbed& good, const Outcome& outcome) {
  EXPECT_TRUE(tree_of(stage.folder()) == good.before) << "something was changed";
  if (outcome.code == 0) {
    EXPECT_EQ(lasting(outcome.out), lasting(good.outcome.out));
  }
}

/// Of the files that the verb makes each is the old or the new one, all new if it says so; nothing else is touched.
void old_or_new(const Stage& stage, const Undisturbed& good, const Outcome& outcome) {
  const Tree now = tree_of(stage.folder());
  for (const auto& [name, content] : now) {
    if (outcome.code != 0 && name.ends_with(".tmp")) continue;  // where removing fails, too; judged by trials()
    const auto old = good.before.find(name), fresh = good.after.find(name);
    const bool is_old = old != good.before.end() && old->second == content;
    const bool is_new = fresh != good.after.end() && fresh->second == content;
    EXPECT_TRUE(is_new || (is_old && outcome.code != 0)) << name << " is neither the old nor the new one";
  }
  for (const auto& [name, content] : good.before) EXPECT_TRUE(now.count(name)) << name << " is gone";
}

/// Two campaigns of equal size and other seeds.
const Digests& digests_of(int seed, int particles) {
  static std::map<std::pair<int, int>, Digests> known;
  Digests& out = known[{seed, particles}];
  if (out.empty()) {
    const Stage stage;
    stage.must("run ball.yaml --threads 1 --quiet -o r.graze -n " + std::to_string(particles) + " --seed " +
               std::to_string(seed));
    out = stage.whole("r.graze");
  }
  return out;
}

bool exists(const Stage& stage, const std::string& name) { return fs::exists(fs::symlink_status(stage / name)); }

/// Makes a campaign whole as a user would: resume, or, if there is none, run again.
void mend(const Stage& stage, const std::string& directory, const std::string& again) {
  const Outcome resumed = run(stage.folder(), "resume --threads 1 --quiet " + directory);
  if (resumed.code == 0) return;
  const Outcome anew = run(stage.folder(), again);
  EXPECT_EQ(anew.code, 0) << "resume: " << resumed.err << "run again: " << anew.err;
}

std::vector<Verb> verbs() {
  std::vector<Verb> out;
  out.push_back({"run", {}, kRun + "-o a.graze", [](const Stage& stage, const Undisturbed&, const Outcome& outcome) {
                   if (outcome.code != 0) mend(stage, "a.graze", kRun + "-o a.graze");
                   EXPECT_EQ(stage.whole("a.graze"), digests_of(1, 16));
                 }});
  const auto replaced = [](const Stage& stage, const Undisturbed&, const Outcome& outcome) {
    if (outcome.code == 0) {
      EXPECT_EQ(stage.whole("a.graze"), digests_of(3, 16));
      return;
    }
    Digests now = stage.whole("a.graze");
    if (now.empty()) {
      const Outcome resumed = run(stage.folder(), "resume --threads 1 --quiet a.graze");
      EXPECT_EQ(resumed.code, 0) << "neither the old campaign is whole nor the new one can go on: " << resumed.err;
      now = stage.whole("a.graze");
    }
    EXPECT_TRUE(now == digests_of(1, 16) || now == digests_of(3, 16)) << "neither the old campaign nor the new one";
  };
  out.push_back({"run --force", {kRun + "-o a.graze"}, kRun + "--force --seed 3 -o a.graze", replaced});
  out.push_back({"resume",
                 {kRun + "-o a.graze"},
                 "resume a.graze -n 24 --threads 1 --quiet",
                 [](const Stage& stage, const Undisturbed& good, const Outcome& outcome) {
                   const Tree now = tree_of(stage.folder());
                   const std::string shard = "a.graze/shards/000001.h5";
                   EXPECT_TRUE(now.count(shard) && now.at(shard) == good.before.at(shard)) << "a shard was lost";
                   if (outcome.code != 0) mend(stage, "a.graze -n 24", "");
                   EXPECT_EQ(stage.whole("a.graze"), digests_of(1, 24));
                 }});
  out.push_back({"pack",
                 {kRun + "-o a.graze", kRun + "--seed 3 -o b.graze", "pack b.graze -o a.h5"},
                 "pack a.graze -o a.h5 --force",
                 [](const Stage& stage, const Undisturbed&, const Outcome& outcome) {
                   EXPECT_EQ(stage.whole("a.graze"), digests_of(1, 16));
                   const Digests now = stage.whole("a.h5");
                   EXPECT_TRUE(now == digests_of(1, 16) || (outcome.code != 0 && now == digests_of(3, 16)));
                 }});
  const auto packed = [](const Stage& stage, const Undisturbed& good, const Outcome& outcome) {
    if (outcome.code == 0) {
      EXPECT_EQ(stage.whole("x.h5"), digests_of(1, 16));
      return;
    }
    if (good.before.count("x.h5")) {
      const Digests now = stage.whole("x.h5");
      EXPECT_TRUE(now == digests_of(1, 16) || now == digests_of(3, 16)) << "neither the old file nor the new one";
    }
    if (stage.whole("x.h5") == digests_of(1, 16)) return;
    if (exists(stage, "x.graze")) {
      mend(stage, "x.graze", kRun + "-o x.graze");
      EXPECT_EQ(stage.whole("x.graze"), digests_of(1, 16));
    } else if (!good.before.count("x.h5")) {
      mend(stage, "x.graze", kRun + "-o x.h5");
      EXPECT_EQ(stage.whole("x.h5"), digests_of(1, 16));
    }
  };
  out.push_back({"run into a file", {}, kRun + "-o x.h5", packed});
  out.push_back({"run into a file --force", {kRun + "--seed 3 -o x.h5"}, kRun + "--force -o x.h5", packed});
  for (const char* arguments : {"score a.graze --failures", "score a.h5", "status a.graze", "status a.h5",
                                "replay a.graze --particle 5", "replay a.h5 --particle 5"}) {
    out.push_back({arguments, {kRun + "-o a.graze", "pack a.graze -o a.h5"}, arguments, only_read});
  }
  for (const char* arguments : {"check ball.yaml", "sample ball.yaml -n 16", "submit ball.yaml --time 10 --dry-run"}) {
    out.push_back({arguments, {}, arguments, only_read});
  }
  const std::vector<std::string> campaign = {kRun + "-o a.graze"};
  out.push_back({"replay into a file",
                 {campaign[0], "replay a.graze --particle 3 -o p.h5"},
                 "replay a.graze --particle 5 -o p.h5 --force",
                 old_or_new});
  out.push_back({"replay into tables",
                 {campaign[0], "replay a.graze --particle 3 -o p.csv"},
                 "replay a.graze --particle 5 -o p.csv --force",
                 old_or_new});
  out.push_back({"sample into a file",
                 {"sample ball.yaml -n 8 -o s.csv"},
                 "sample ball.yaml -n 16 -o s.csv --force",
                 old_or_new});
  out.push_back({"submit", {}, "submit ball.yaml --time 10 -o a.graze", old_or_new});
  return out;
}

/// "a.graze/shards/000001.h5" of a path in the folder; without what names are temporary.
std::string told_as(const Stage& stage, const std::string& path) {
  fs::path name = fs::path(path).lexically_relative(fs::canonical(stage.folder()));
  return name.begin() == name.end() ? "" : name.begin()->string();
}

void check_message(const Stage& stage, const Plan& plan, const Outcome& outcome) {
  if (outcome.code == 0) return;
  EXPECT_THAT(outcome.err, ::testing::HasSubstr("graze: ")) << "nothing is said";
  // Who only asks whether a file is there may take a failure for a no; what is lost by that is judged elsewhere.
  if (outcome.failed.starts_with("stat ") || outcome.failed.starts_with("access ")) return;
  EXPECT_THAT(outcome.err, ::testing::HasSubstr(std::strerror(plan.error))) << "the reason is not said";
  std::string name = told_as(stage, outcome.failed_path);
  EXPECT_THAT(outcome.err, ::testing::HasSubstr(name.substr(0, name.find('.')))) << "the file is not named";
  EXPECT_THAT(outcome.err, ::testing::Not(::testing::HasSubstr("internal error")));
}

/// A stand-in for sbatch, first in PATH.
class Slurm {
 public:
  Slurm() : path_(std::getenv("PATH")) {
    testing::write_file(folder_ / "sbatch", "#!/bin/sh\necho 1\n");
    fs::permissions(folder_ / "sbatch", fs::perms::owner_all);
    setenv("PATH", (folder_.path().string() + ":" + path_).c_str(), 1);
  }
  ~Slurm() { setenv("PATH", path_.c_str(), 1); }

 private:
  const std::string path_;
  testing::TemporaryFolder folder_;
};

class Io : public ::testing::TestWithParam<Verb> {};

void trials(const Verb& verb, const Plan& base, long most) {
  const Slurm slurm;
  const Stage stage;
  for (const std::string& arguments : verb.before) stage.must(arguments);
  Undisturbed good;
  good.before = tree_of(stage.folder());
  good.outcome = stage.must(verb.arguments);
  good.after = tree_of(stage.folder());
  ASSERT_GT(good.outcome.calls, 5);
  for (const long at : some_of(good.outcome.calls, most)) {
    put(good.before, stage.folder());
    Plan plan = base;
    plan.at = at;
    const Outcome outcome = run(stage.folder(), verb.arguments, plan);
    if (outcome.failed.empty()) continue;  // a thread was faster this time
    SCOPED_TRACE(verb.name + ": " + outcome.failed + " fails" + (plan.for_good ? " for good" : " once") + ", call " +
                 std::to_string(at) + " of " + std::to_string(good.outcome.calls) + ": exit code " +
                 std::to_string(outcome.code) + "\n" + outcome.err);
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 2 || outcome.code == 3);
    check_message(stage, plan, outcome);
    for (const char* name : {"bystander.txt", "ball.yaml", "ball.urdf"}) {
      EXPECT_EQ(testing::read_file(stage / name), good.before.at(name));
    }
    if (!plan.for_good) {
      for (const auto& [name, content] : tree_of(stage.folder())) EXPECT_FALSE(name.ends_with(".tmp")) << name;
    }
    verb.judge(stage, good, outcome);
  }
}

TEST_P(Io, EachCallFailsOnce) { trials(GetParam(), {What::fail}, 14); }
TEST_P(Io, EachCallAndAllAfterItFail) { trials(GetParam(), {What::fail, 0, true}, 7); }
TEST_P(Io, EachWriteIsCutShort) { trials(GetParam(), {What::shrink, 0, false, ENOSPC}, 7); }

INSTANTIATE_TEST_SUITE_P(Verbs, Io, ::testing::ValuesIn(verbs()), [](const auto& info) {
  std::string name;
  for (const char c : info.param.name) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
});

}  // namespace
}  // namespace graze::faults
