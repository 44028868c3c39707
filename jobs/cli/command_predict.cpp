// graze predict: what becomes of the robot under several policies from a moment on, before a deadline.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iostream>
#include <limits>
#include <memory>
#include <thread>

#include "jobs/campaign/hanging_controllers.h"
#include "jobs/campaign/nominal_estimate.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/predict_text.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

constexpr double kShortestDeadline = 1e-3, kLongestTime = 1e6;  // s
constexpr double kMostWidening = 1e6;

struct PredictArguments {
  ScenarioArguments scenario;
  std::vector<std::string> candidates;  // globs, several in one word with commas
  std::string under;
  double at = 0, horizon = 0, deadline = 0;  // s; 0: the scenario's end, none
  double widen = 1;
  std::uint64_t particles = 0;
  std::optional<std::uint64_t> seed;
  std::uint32_t repeat = 1;
  int threads = 0;
  bool afresh = false, follow = false, json = false;
};

/// The words between commas that are not within braces.
std::vector<std::string> split_globs(const std::vector<std::string>& words) {
  std::vector<std::string> out;
  for (const std::string& word : words) {
    int depth = 0;
    std::string one;
    for (const char c : word + ",") {
      depth += c == '{' ? 1 : c == '}' ? -1 : 0;
      if (c != ',' || depth > 0) {
        one += c;
        continue;
      }
      if (one.empty()) {
        throw InputError(
            fmt::format("--candidates {}: nothing stands before, behind or between two commas; a policy must", word));
      }
      out.push_back(std::exchange(one, {}));
    }
    if (!one.empty()) throw InputError(fmt::format("--candidates {}: a brace is not closed", word));
  }
  return out;
}

double read_factor(const std::string& text, const std::string& option) {
  std::size_t used = 0;
  double value = -1;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
  }
  if (used == text.size() && value >= 0 && value <= kMostWidening) return value;
  throw InputError(fmt::format("{} {}: is no factor from 0 to {:g}; 1 leaves standard deviations as they are", option,
                               text, kMostWidening));
}

/// Adds an option whose value is a time.
void add_time(CLI::App& verb, const std::string& name, double& value, double least, const std::string& description) {
  add_read_option(verb, name, description, [&value, least](const std::string& text, const std::string& option) {
    value = parse_seconds(text, option, least, kLongestTime);
  })->type_name("TIME");
}

PredictionStory tell_of(const PredictArguments& arguments, const Simulation& simulation, const std::string& under,
                        const NominalEstimate& nominal, bool remembers) {
  const Scenario& scenario = simulation.scenario();
  PredictionStory out;
  out.scenario = scenario.name;
  out.under = under;
  for (const Requirement& one : scenario.task.requirements) {
    if (!one.measure) out.requirements.push_back(one.name);
  }
  out.objective_unit = scenario.task.objective.unit;
  out.at = nominal.estimate.time;
  out.remembers = remembers;
  out.deadline = arguments.deadline > 0 ? arguments.deadline : std::numeric_limits<double>::infinity();
  out.threads =
      arguments.threads > 0 ? arguments.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  return out;
}

std::string kind_of(const Simulation& simulation, const std::string& name) {
  return policy_kind(simulation.scenario().policies[static_cast<std::size_t>(simulation.policy(name))]);
}

/// Whether what a policy remembers is of use to all candidates.
bool of_one_kind(const Simulation& simulation, const std::string& under, const std::vector<std::string>& candidates) {
  return std::all_of(candidates.begin(), candidates.end(),
                     [&](const std::string& name) { return kind_of(simulation, name) == kind_of(simulation, under); });
}

NominalEstimate estimate_at(const Simulation& simulation, const std::string& under, const NominalTimes& times) try {
  return nominal_estimate(simulation, under, times);
} catch (const SavedTraceError& error) {
  throw InputError(
      fmt::format("--follow: the robot cannot go on from the middle of a trace under {}: {}", under, error.what()));
} catch (const InputError& error) {
  throw InputError(std::string("--at: ") + error.what());
}

/// A trace goes on under another policy of its kind only.
void check_can_follow(const Simulation& simulation, const std::string& under,
                      const std::vector<std::string>& candidates) {
  const std::string own = kind_of(simulation, under);
  for (const std::string& name : candidates) {
    const std::string other = kind_of(simulation, name);
    if (other == own) continue;
    throw InputError(
        fmt::format("--follow: a trace under {} ({}) cannot go on under {} ({}), which may be the best; "
                    "choose --candidates of one kind, and --under one of them, or leave --follow out",
                    under, own, name, other));
  }
}

/// The robot does what it did until the verdict is there, and then what was told to be best.
std::optional<PredictionStory::Followed> follow(const Simulation& simulation, const PredictionStory& story,
                                                const NominalEstimate& nominal, double verdict) {
  const Prediction& told = story.calls.front();
  if (told.best < 0) return std::nullopt;
  PredictionStory::Followed out{verdict, "", 0};
  if (!nominal.saved) return out;
  const TraceRecord trace =
      gone_on(simulation, told.candidates[static_cast<std::size_t>(told.best)].policy, nominal.saved);
  out.ends = how_it_ends(simulation.scenario(), trace);
  out.end_time = trace.end_time;
  return out;
}

int predict(const PredictArguments& arguments) {
  if (arguments.deadline == 0 && arguments.particles == 0) {
    throw InputError(
        "predict: say when it shall be done, --deadline 100ms, or how many particles are simulated, -n 100");
  }
  Scenario scenario = arguments.scenario.load();
  if (arguments.seed) scenario.seed = *arguments.seed;
  std::vector<std::string> names;
  for (const PolicySpec& policy : scenario.policies) names.push_back(policy.name);
  const std::vector<std::string> candidates =
      chosen_names(names, split_globs(arguments.candidates), scenario.file, "--candidates");
  const EndHangingControllers watch;
  const Simulation simulation(std::move(scenario), arguments.particles);
  const std::string under = arguments.under.empty() ? candidates.front() : arguments.under;
  simulation.policy(under);  // there is one
  if (arguments.follow) check_can_follow(simulation, under, candidates);
  NominalEstimate nominal =
      estimate_at(simulation, under, {arguments.at, arguments.follow ? arguments.at + arguments.deadline : -1});
  const bool remembers = !arguments.afresh && nominal.remembers && of_one_kind(simulation, under, candidates);
  if (!remembers) nominal.estimate.memory = nullptr;
  nominal.estimate.covariance *= arguments.widen * arguments.widen;
  PredictionStory story = tell_of(arguments, simulation, under, nominal, remembers);
  Predictor predictor(simulation, candidates, story.threads);
  predictor.prepare(arguments.particles > 0 ? arguments.particles : Predictor::kKeptParticles);
  for (std::uint32_t i = 0; i < arguments.repeat; ++i) {
    story.calls.push_back(
        predictor.predict(nominal.estimate, {arguments.horizon, story.deadline, arguments.particles}));
  }
  if (arguments.follow) story.followed = follow(simulation, story, nominal, arguments.at + arguments.deadline);
  std::cout << (arguments.json ? prediction_json(story) : prediction_text(story));
  return story.calls.front().best >= 0 ? kDone : kInconclusive;
}

void add_options(CLI::App& verb, PredictArguments& arguments) {
  arguments.scenario.add_to(verb);
  add_time(verb, "--at", arguments.at, 0, "When the prediction begins: the nominal robot's state then is its start");
  verb.get_option("--at")->required();
  verb.add_option("--candidates", arguments.candidates,
                  "Policies (globs, by commas) that are compared (default: all of the scenario)")
      ->type_name("POLICY,…")
      ->allow_extra_args(false);
  verb.add_option("--under", arguments.under,
                  "The policy that the robot is under until then (default: the first candidate)")
      ->type_name("POLICY");
  add_time(verb, "--horizon", arguments.horizon, 1e-6, "How far ahead (default, and 0: until the scenario's end)");
  add_time(verb, "--deadline", arguments.deadline, kShortestDeadline,
           "How long it may take on the clock, once engines and controllers are made");
  add_whole(verb, "-n,--particles", arguments.particles, 1, kParticleLimit,
            "How many particles of each candidate, at most (default: as many as the deadline allows)");
  add_read_option(
      verb, "--widen", "Factor of the estimate's standard deviations, which are those of the sensors' jitter",
      [&arguments](const std::string& text, const std::string& option) { arguments.widen = read_factor(text, option); })
      ->type_name("FACTOR")
      ->default_str("1");
  verb.add_flag("--afresh", arguments.afresh, "Candidates start without what the robot's controller remembers");
  verb.add_flag("--follow", arguments.follow,
                "Let the robot go on under the best one, from when the verdict is there: --deadline after --at");
  add_whole(verb, "--seed", arguments.seed, 0, std::numeric_limits<std::uint64_t>::max(),
            "Root seed (default: the scenario's)");
  add_whole(verb, "--repeat", arguments.repeat, 1, 1'000'000,
            "Predict as often as this, and tell how many were in time")
      ->default_str("1");
  add_threads(verb, arguments.threads);
  verb.add_flag("--json", arguments.json, "Print as JSON, in SI units");
}

}  // namespace

void add_predict(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<PredictArguments>();
  CLI::App* verb = add_verb(
      app, "predict", "Which of several policies is best from a moment on, told before a deadline",
      "  graze predict quadruped_gait_transition --at 0.85s --horizon 2s --deadline 100ms\n"
      "  graze predict quadruped_gait_transition --at 0.4s --deadline 450ms -n 16 --follow\n"
      "  graze predict my.yaml --at 1s --candidates 'turn/*' --under walk -n 200 --json\n\n"
      "Simulates the nominal robot up to there, takes what its sensors read, and simulates particles from there on, "
      "under each\ncandidate the same. docs/predict.md. Nothing is written. Exit code 4: no verdict.\n");
  add_options(*verb, *arguments);
  verb->callback([arguments, &action] { action = [arguments] { return predict(*arguments); }; });
}

}  // namespace graze
