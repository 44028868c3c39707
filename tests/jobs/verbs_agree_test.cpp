// Claim: check, sample, submit --dry-run and run agree on every scenario: whatever one of them refuses all refuse, with
// the same message, which names file, line and column; and what check takes runs. Scenarios are put together from all
// registered policies, trackers, back ends, contact models, distributions, designs and witnesses, with settings that
// are right and settings that are wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <iostream>
#include <random>
#include <sstream>

#include "archive/archive.h"
#include "engine/control/policy.h"
#include "engine/physics.h"
#include "jobs/cli/commands.h"
#include "scenarios/keys.h"
#include "scenarios/task.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

using Choices = std::map<std::string, std::vector<std::string>>;

/// Settings by component, those that are right first. A component that is not listed is tried with none.
const std::vector<std::string>& settings_of(const std::string& component) {
  static const Choices known = {
      {"hold", {"{}", "{x: 1}"}},
      {"joint_trajectory",
       {"{sinusoid: {amplitude: {hip: 0.1}, frequency: 5}}", "{sinusoid: {amplitude: 0.1 s, frequency: 5}}",
        "{table: none.csv}", "{}"}},
      {"gait_switch",
       {"{at: 0.01, from: {velocity: [0, 0, 0], duration: 0.3, duty: 75 %, liftoff: 0, step_height: 1 cm, feet: "
        "[foot]}, "
        "to: {velocity: [0, 0, 0], duration: 0.3, duty: 75 %, liftoff: 0, step_height: 0, feet: [foot]}}",
        "{at: 1}"}},
      {"tool_path", {"{link: foot, speed: 1, path: [{wait: 0.1}]}", "{link: foot, speed: 1, path: [{to: [9, 9, 9]}]}"}},
      {"torque", {"{}", "{constant: {hip: 0.1}}", "{constant: {knee: 1}}"}},
      {"gait",
       {"{velocity: [0, 0, 0], duration: 0.3, duty: 75 %, liftoff: 0, step_height: 1 cm, feet: [foot]}",
        "{velocity: [0, 0, 0], duration: 0.3, duty: 55, liftoff: 0, step_height: 1 cm, feet: [foot]}",
        "{feet: [disc]}"}},
      {"joint_pd", {"{kp: 10}", "{kp: 10, kd: 0.1, ki: 1}", "{kp: -1}", "{kd: 1}", "{kp: {knee: 1}}"}},
      {"operational_pd", {"{kp: 100, kd: 1}", "{kp: 1 s}"}},
      {"prescribed", {"{}", "{limited: false}", "{limited: maybe}"}},
      {"normal", {"{std: 1 %}", "{std: 0.001}", "{std: -1}", "{mean: 1}"}},
      {"uniform", {"[0.9, 1]", "{spread: 1 %}", "[2, 1]", "[1, 2, 3]"}},
      {"log_normal", {"{log_std: 0.01}", "{median: -1, log_std: 0.1}"}},
      {"log_uniform", {"[0.9, 1]", "[0, 1]"}},
      {"triangular", {"[0.5, 0.8, 1]", "[2, 1, 0]"}},
      {"choice", {"[0.5, 1]", "{values: [1], weights: [1, 2]}", "[]"}},
      {"empirical", {"[0.5, 1]", "{file: none.csv, column: a}", "{}"}},
      {"tilt", {"{link: base, below: 1}", "{link: base, below: 90}", "{link: base}", "{link: bse, below: 1}"}},
      {"height", {"{link: base, above: -1}", "{link: base, above: 1, below: 0}"}},
      {"position", {"{link: foot, x: {above: -1}}", "{link: foot}"}},
      {"speed", {"{link: \"*\", below: 100 m/s}", "{link: base, below: -1}"}},
      {"contact", {"[foot, ground]", "[ground, block]"}},
      {"no_contact", {"[foot, block.side]", "[foot, block.cap]", "[foot]"}},
      {"self_collision", {"true", "false", "{x: 1}"}},
      {"joint_limits", {"{joints: hip}", "{joints: wheel}", "{joints: hip, margin: 2}"}},
      {"torque_limits", {"{}", "{joints: wheel}"}},
      {"torque_speed", {"{joints: slide}", "{joints: knee}"}},
      {"joint_speed", {"{joints: hip}", "{joints: hip, below: 0}"}},
  };
  static const std::vector<std::string> none = {"{}"};
  const auto found = known.find(component);
  return found == known.end() ? none : found->second;
}

/// What a scenario is put together from.
struct Parts {
  std::string policy = "hold: {}", tracker = "joint_pd: {kp: 10}", physics = "lanes", contact = "{}", uncertain = "{}",
              sampling = "{}", task = "{}",
              environment = "{ground: {plane: z}, block: {box: [1, 1, 1], position: [3, 0, 0]}}";

  std::string text() const {
    return "graze: 1\nrobot: {urdf: " + std::string(GRAZE_SOURCE_DIR) +
           "/tests/scenarios/robots/hopper.urdf}\nenvironment: " + environment +
           "\ntime: {end: 2 ms, step: 1 ms}\nphysics: " + physics + "\ncontact: " + contact +
           "\nuncertain: " + uncertain + "\nsampling: " + sampling + "\npolicies: {p: {" + policy + ", control: {" +
           tracker + "}}}\ntask: " + task + "\n";
  }
};

class Generator {
 public:
  explicit Generator(unsigned seed) : random_(seed) {}

  Parts scenario() {
    Parts out;
    out.physics = rarely(20) ? "bulet" : one_of(physics_names());
    out.policy = component(policy_names());
    out.tracker = component(tracker_names());
    if (rarely(3)) out.contact = "{model: " + one_of(contact_models_of(one_of(physics_names()))) + "}";
    if (!rarely(3)) out.uncertain = "{" + uncertain() + (rarely(3) ? ", " + uncertain() : "") + "}";
    out.sampling = "{design: " + one_of({"random", "sobol", "latin_hypercube"}) + "}";
    std::string window = rarely(4) ? ", window: " + one_of({"[0, 1]", "[1, 2]", "[2, 1]", "[0.4 ms, 0.6 ms]"}) : "";
    out.task = "{requirements: {r: {" + component(witness_names()) + window + "}}";
    if (rarely(2)) out.task += ", objective: {o: {not: {" + component(witness_names()) + "}}}";
    out.task += "}";
    return out;
  }

 private:
  bool rarely(int n) { return std::uniform_int_distribution<int>(1, n)(random_) == 1; }
  std::string one_of(const std::vector<std::string>& list) {
    return list[std::uniform_int_distribution<std::size_t>(0, list.size() - 1)(random_)];
  }
  /// Mostly with the settings that are right: of many mistakes only the first would be seen.
  std::string component(const std::vector<std::string>& names) {
    const std::string name = one_of(names);
    return name + ": " + (rarely(6) ? one_of(settings_of(name)) : settings_of(name).front());
  }
  std::string uncertain() {
    const std::string parameter =
        one_of({"robot.link.base.mass", "robot.link.base.density", "robot.link.*.mass", "contact.friction",
                "contact.model", "control.lag", "environment.block.friction", "sensor.encoder.hip.position",
                "sensor.contact.foot.missed", "initial.base.z", "robot.link.bse.mass"});
    const std::string spread = component(distribution_names());
    return "\"" + parameter + "\": {" + (rarely(4) ? "jitter: {" + spread + "}" : spread) + "}";
  }

  std::mt19937 random_;
};

struct Told {
  int code;
  std::string message;
  bool operator==(const Told& other) const { return code == other.code && message == other.message; }
};
std::ostream& operator<<(std::ostream& out, const Told& told) { return out << told.code << ": " << told.message; }

class Verbs : public ::testing::Test {
 protected:
  testing::TemporaryFolder folder;

  void SetUp() override {
    level_ = spdlog::get_level();
    spdlog::set_level(spdlog::level::off);
  }
  void TearDown() override { spdlog::set_level(level_); }

  /// What a verb says of case.yaml, in this process.
  Told verb(std::vector<std::string> words) const {
    CLI::App app("", "graze");
    Action action;
    add_check(app, action);
    add_sample(app, action);
    add_run(app, action, "graze run");
    add_submit(app, action);
    words.insert(words.begin() + 1, (folder / "case.yaml").string());
    std::ostringstream out;
    std::streambuf* const before = std::cout.rdbuf(out.rdbuf());
    Told told{0, ""};
    try {
      app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
      told.code = action();
    } catch (const InputError& error) {
      told = {kInvalidInput, error.what()};
    } catch (const std::exception& error) {
      told = {kMachineFailed, error.what()};
    }
    std::cout.rdbuf(before);
    return told;
  }

  /// True if the scenario was taken.
  bool agree(const Parts& parts) const {
    testing::write_file(folder / "case.yaml", parts.text());
    const Told checked = verb({"check"});
    SCOPED_TRACE(parts.text());
    EXPECT_EQ(verb({"sample", "-n", "2", "-o", "/dev/null"}), checked);
    EXPECT_EQ(verb({"submit", "--dry-run", "--time", "9", "-n", "2", "-o", (folder / "job.graze").string()}), checked);
    EXPECT_EQ(verb({"run", "-n", "2", "--threads", "1", "--quiet", "--force", "-o", (folder / "run.graze").string()}),
              checked);
    EXPECT_TRUE(checked.code == kDone || checked.code == kInvalidInput) << checked;
    if (checked.code == kInvalidInput) {
      EXPECT_THAT(checked.message, ::testing::ContainsRegex("^[^ ]*/case\\.yaml:[0-9]+:[0-9]+: ")) << "names the place";
    }
    return checked.code == kDone;
  }

 private:
  spdlog::level::level_enum level_ = spdlog::level::info;
};

TEST_F(Verbs, AgreeOnEveryPolicyAndTracker) {
  int taken = 0;
  for (const std::string& policy : policy_names()) {
    for (const std::string& tracker : tracker_names()) {
      for (const std::string& physics : physics_names()) {
        Parts parts;
        parts.policy = policy + ": " + settings_of(policy).front();
        parts.tracker = tracker + ": " + settings_of(tracker).front();
        parts.physics = physics;
        taken += agree(parts);
      }
    }
  }
  EXPECT_GE(taken, 12);
}

TEST_F(Verbs, AgreeOnWhatIsPutTogetherAtRandom) {
  Generator generator(1);
  const int trials = std::getenv("GRAZE_LONG") ? 2000 : 60;
  int taken = 0;
  for (int i = 0; i < trials; ++i) taken += agree(generator.scenario());
  EXPECT_GT(taken, trials / 20) << "some are right";
  EXPECT_LT(taken, trials - trials / 20) << "and some are wrong";
}

// What only run refused.
TEST_F(Verbs, AgreeOnWhatTheyDidNot) {
  Parts prescribed;
  prescribed.tracker = "prescribed: {}";
  prescribed.physics = "bullet";
  EXPECT_FALSE(agree(prescribed));
  Parts heavy;
  heavy.uncertain = "{robot.link.base.mass: {uniform: [1, 2]}, robot.link.base.density: {uniform: [900, 1000]}}";
  EXPECT_FALSE(agree(heavy));
  Parts twice;
  twice.environment = "{b: {sphere: 1, movable: true, mass: {uniform: [1, 2]}}}";
  twice.uncertain = "{environment.b.density: 3}";
  EXPECT_FALSE(agree(twice));
}

}  // namespace
}  // namespace graze
