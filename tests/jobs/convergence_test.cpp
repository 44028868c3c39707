// Steps in which contact was not solved, from the scenario's limit to what run, score and replay say of them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "scenarios/scenario.h"
#include "tests/jobs/ball_campaign.h"
#include "tests/jobs/traces.h"
#include "tests/sanitized.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Parsed = nlohmann::json;

/// A snake of so many boxes on joints that turn freely, up and down and sideways by turns.
std::string snake(int boxes) {
  std::string out = "<robot name='snake'>";
  for (int i = 0; i < boxes; ++i) {
    out += fmt::format(
        "<link name='l{}'><inertial><mass value='0.2'/><origin xyz='0.05 0 0'/><inertia ixx='1e-4' iyy='3e-4' "
        "izz='3e-4' ixy='0' ixz='0' iyz='0'/></inertial><collision><origin xyz='0.05 0 0'/><geometry><box "
        "size='0.08 0.04 0.04'/></geometry></collision></link>",
        i);
    if (i == 0) continue;
    out += fmt::format(
        "<joint name='j{0}' type='continuous'><parent link='l{1}'/><child link='l{0}'/><origin xyz='0.1 0 0'/><axis "
        "xyz='0 {2} {3}'/></joint>",
        i, i - 1, i % 2, 1 - i % 2);
  }
  return out + "</robot>";
}

constexpr const char* kSnake = R"(graze: 1
name: Lying
robot: {urdf: snake.urdf, initial: {height: on_ground, clearance: 1 cm}}
environment: {ground: {plane: z}}
contact: {solver: sweeps}
time: {end: 0.4 s}
uncertain: {"initial.base.{roll,pitch}": {normal: {std: 2 deg}}}
policies: {limp: {hold: {}, control: {joint_pd: {kp: 0}}}}
task: {objective: {rests: {speed: {link: "*", below: 50 cm/s}}}}
)";

struct Lying {
  testing::TemporaryFolder folder;
  Lying() {
    testing::write_file(folder / "snake.urdf", snake(30));
    testing::write_file(folder / "snake.yaml", kSnake);
  }
  testing::Result graze(const std::string& arguments) const { return testing::graze(folder.path(), arguments); }
};

/// Share of its steps by particle.
std::vector<double> shares(const std::filesystem::path& archive, const std::string& policy) {
  std::vector<double> out;
  for (const SolverLog& log : table_of(Archive(archive), policy).solver) out.push_back(log.unconverged_share());
  return out;
}

// Claim: what lies on its belly on many boxes, where sweeps creep, is flagged under the default limit; run, score and
// replay tell the same numbers, and the trace stays in its class. (A solver that converges even there wants a harder
// robot here, not a lower limit.)
TEST(Convergence, OfWhatLiesOnItsBellyIsFlagged) {
  const Lying lying;
  const testing::Result run = lying.graze("run snake.yaml -n 8 --quiet -o a.graze");
  ASSERT_EQ(run.code, 0) << run.err;
  const std::vector<double> found = shares(lying.folder / "a.graze", "limp");
  ASSERT_EQ(found.size(), 8u);
  const auto flagged = std::count_if(found.begin(), found.end(), [](double x) { return x > kUnconvergedShare; });
  EXPECT_GT(flagged, 0);
  EXPECT_THAT(run.out, HasSubstr("Steps whose contacts did not converge (flagged: traces with more than 5 % of them)"));
  EXPECT_EQ(lying.graze("score a.graze").out, run.out);
  const Parsed score = Parsed::parse(lying.graze("score a.graze --json").out)["policies"][0];
  EXPECT_EQ(score["success"].get<int>() + score["known_failure"].get<int>() + score["unknown_failure"].get<int>(), 8);
  EXPECT_EQ(score["convergence"]["flagged"]["all"], flagged);
  const int first = score["convergence"]["flagged"]["first_particle"];
  const testing::Result replay = lying.graze(fmt::format("replay a.graze --particle {} -o one.csv", first));
  EXPECT_THAT(replay.out, HasSubstr("FLAGGED    more than 5 % of its steps did not converge"));
  EXPECT_THAT(testing::read_file(lying.folder / "one.trace.csv"), HasSubstr("\nflagged,1,"));
  const Parsed solver =
      Parsed::parse(lying.graze(fmt::format("replay a.graze --particle {} --json", first)).out)["convergence"];
  EXPECT_EQ(solver["unconverged_steps"].get<double>() / solver["steps"].get<double>(), found.at(first));
  EXPECT_EQ(solver["flagged"], true);
}

// Claim: whatever reads such an archive tells of it with the numbers that score has: status, explain, compare and
// report; score lists the flagged traces, successes among them, and no other.
TEST(Convergence, IsToldByEveryVerb) {
  const Lying lying;
  ASSERT_EQ(lying.graze("run snake.yaml -n 8 --quiet -o a.graze").code, 0);
  const Parsed score = Parsed::parse(lying.graze("score a.graze --json --flagged").out);
  const Parsed want = score["policies"][0]["convergence"];
  ASSERT_GT(want["flagged"]["all"], 0);
  const std::vector<double> found = shares(lying.folder / "a.graze", "limp");
  ASSERT_EQ(score["flagged"].size(), want["flagged"]["all"].get<std::size_t>());
  for (const Parsed& one : score["flagged"]) {
    EXPECT_GT(found.at(one["particle"].get<std::size_t>()), kUnconvergedShare);
    EXPECT_EQ(one["flagged"], true);
  }
  EXPECT_EQ(Parsed::parse(lying.graze("status a.graze --json").out)["policies"]["limp"]["convergence"], want);
  EXPECT_EQ(Parsed::parse(lying.graze("explain a.graze --json").out)["policies"][0]["convergence"], want);
  const Parsed compared = Parsed::parse(lying.graze("compare a.graze a.graze --json").out)["policies"][0];
  EXPECT_EQ(compared["a"]["convergence"], want);
  EXPECT_EQ(compared["b"]["convergence"], want);
  const Parsed report = Parsed::parse(lying.graze("report a.graze --json").out);
  EXPECT_EQ(report["score"]["policies"][0]["convergence"], want);
  EXPECT_THAT(report["notes"].dump(), HasSubstr("flagged: contacts of more than 5 % of the steps did not converge"));
  const std::string first = std::to_string(want["flagged"]["first_particle"].get<int>());
  EXPECT_THAT(lying.graze("score a.graze --flagged").out,
              AllOf(HasSubstr("\nFlagged traces\n"), HasSubstr("graze replay a.graze --particle " + first + " ")));
  EXPECT_THAT(lying.graze("status a.graze").out,
              HasSubstr("Steps whose contacts did not converge (flagged: traces with"));
  EXPECT_THAT(lying.graze("explain a.graze").out, HasSubstr("FLAGGED"));
  EXPECT_THAT(lying.graze("compare a.graze a.graze").out, HasSubstr("\nlimp, B "));
}

// Claim: the limit is the scenario's; whatever it is, the traces are the same.
TEST(Convergence, TheLimitIsTheScenarios) {
  const Lying lying;
  const auto run = [&](const std::string& limit, const std::string& name) {
    const testing::Result out =
        lying.graze("run snake.yaml -n 8 --quiet --json -o " + name + " --set contact.unconverged='" + limit + "'");
    EXPECT_EQ(out.code, 0) << out.err;
    return Parsed::parse(out.out);
  };
  const Parsed all = run("0", "a.graze"), none = run("100 %", "b.graze");
  EXPECT_EQ(none["unconverged_limit"], 1);
  EXPECT_EQ(none["policies"][0]["convergence"]["flagged"]["all"], 0);
  EXPECT_GT(all["policies"][0]["convergence"]["flagged"]["all"], 0);
  EXPECT_EQ(all["policies"][0]["convergence"]["flagged"]["all"],
            all["policies"][0]["convergence"]["unconverged_traces"]);
  EXPECT_EQ(testing::digests(lying.folder / "a.graze"), testing::digests(lying.folder / "b.graze"));
  const testing::Result wrong = lying.graze("check snake.yaml --set contact.unconverged=2");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("contact.unconverged: 2: must lie within [0, 1]"));
  EXPECT_THAT(lying.graze("check snake.yaml --set contact.unconverge=2").err, HasSubstr("unconverged"));
}

// Claim: the shipped robot that stands and walks on its feet is not flagged, and where all its steps converge the table
// does not speak of them.
TEST(Convergence, OfWhatStandsOnItsFeetIsNotFlagged) {
  const testing::TemporaryFolder folder;
  const testing::Result run =
      testing::graze(folder.path(), "run '" + testing::data("scenarios/quadruped_walk.yaml") +
                                        "' -n 16 --quiet --policy walk --set time.end='1 s' -o walk.graze");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, Not(HasSubstr("flagged")));
  EXPECT_THAT(run.out, Not(HasSubstr("did not converge")));
  const Parsed json = Parsed::parse(testing::graze(folder.path(), "score walk.graze --json").out)["policies"][0];
  EXPECT_EQ(json["convergence"]["steps"], 16000);
  EXPECT_EQ(json["convergence"]["flagged"]["all"], 0);
}

// Claim: what is told of the solver is the same for any number of threads, ranks of lanes' widths and neighbours.
TEST(Convergence, DependsOnTheTraceAlone) {
  const Lying lying;
  std::map<std::string, std::string> out;
  for (const char* how : {"--threads 1", "--threads 2", "--threads 5"}) {
    if (GRAZE_SANITIZED && !out.empty() && how != std::string("--threads 5")) continue;
    const std::string name = fmt::format("{}.graze", out.size());
    ASSERT_EQ(lying.graze(fmt::format("run snake.yaml -n 19 --quiet {} -o {}", how, name)).code, 0);
    const TraceTable table = table_of(Archive(lying.folder / name), "limp");
    ASSERT_EQ(table.size(), 19u);
    double unconverged = 0;
    for (const SolverLog& log : table.solver) {
      testing::add_bits({log.mean_sweeps, log.most_sweeps, log.largest_residual, log.unconverged_steps, log.steps,
                         log.median_residual, log.braked_steps, log.most_braked},
                        out[how]);
      unconverged += log.unconverged_steps;
    }
    EXPECT_GT(unconverged, 0);
    EXPECT_EQ(out[how], out["--threads 1"]) << how;
  }
  const Scenario scenario = load_scenario(lying.folder / "snake.yaml");
  const testing::Traces many = testing::simulate(scenario, 11, 1, 2);
  for (const auto& [key, trace] : testing::simulate(scenario, 3, 1, 1)) {
    EXPECT_EQ(testing::all_bits_of(trace), testing::all_bits_of(many.at(key)));
  }
}

// Claim: a box of 1 g under 1000 kg jams, and the jam's spring lets it sink into the ground: that is not counted as
// solved. Under 1 kg it stands.
TEST(Convergence, IsNotSaidOfWhatIsPressedIntoTheGround) {
  const testing::TemporaryFolder folder;
  const auto flagged_under = [&](const char* mass) {
    constexpr auto kBox = "environment.{}={{box: [0.1, 0.1, 0.1], position: [3, 0, {}], movable: true, mass: {}}}";
    const testing::Result run = testing::graze(
        folder.path(),
        fmt::format("run drop_and_stand -n 1 --force -o x.graze --json --set time.end='0.3 s' --set '{}' --set '{}'",
                    fmt::format(kBox, "low", 0.05, "1 g"), fmt::format(kBox, "high", 0.15, mass)));
    EXPECT_EQ(run.code, 0) << run.err;
    const testing::Result score = testing::graze(folder.path(), "score x.graze --json");
    return Parsed::parse(score.out)["policies"][0]["convergence"]["flagged"]["all"].get<int>();
  };
  EXPECT_EQ(flagged_under("1e6 kg"), 1);
  EXPECT_EQ(flagged_under("1000 kg"), 0);
}

}  // namespace
}  // namespace graze
