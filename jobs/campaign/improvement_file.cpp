#include "jobs/campaign/improvement_file.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/settings/inputs.h"
#include "jobs/campaign/sealed_json.h"

namespace graze {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr SealedKind kKindOfHistory = {"graze improve", 1, "history of graze improve", std::size_t{1} << 28};

/// JSON has neither NaN nor infinities; both stand as null, which `otherwise` says what it was.
Json number_json(double x) { return std::isfinite(x) ? Json(x) : Json(); }
double number_of(const Json& json, double otherwise = std::numeric_limits<double>::quiet_NaN()) {
  return json.is_null() ? otherwise : json.get<double>();
}

Json list_json(const std::vector<double>& values) {
  Json out = Json::array();
  for (const double x : values) out.push_back(number_json(x));
  return out;
}

std::vector<double> list_of(const Json& json) {
  std::vector<double> out;
  for (const Json& one : json) out.push_back(number_of(one));
  return out;
}

Json refused_json(const std::vector<RefusedStep>& refused) {
  Json out = Json::array();
  for (const RefusedStep& one : refused) {
    out.push_back({{"size", one.size}, {"progress", number_json(one.progress)}, {"lack", number_json(one.lack)}});
  }
  return out;
}

/// Histories of older programs do not have them.
std::vector<RefusedStep> refused_of(const Json& json) {
  std::vector<RefusedStep> out;
  for (const Json& one : json.value("refused", Json::array())) {
    out.push_back({one.at("size"), number_of(one.at("progress")), number_of(one.at("lack"))});
  }
  return out;
}

/// Histories of older programs do not have them either.
Json lost_json(const LostTraces& lost) { return {{"count", lost.count}, {"of", lost.of}, {"why", lost.why}}; }
LostTraces lost_of(const Json& json, const char* key) {
  if (!json.contains(key)) return {};
  const Json& one = json.at(key);
  return {one.at("count"), one.at("of"), one.at("why")};
}

Json step_json(const ImproveStep& step) {
  Json out = {{"level", step.level},
              {"from", step.from},
              {"to", number_json(step.to)},
              {"before", list_json(step.before)},
              {"after", list_json(step.after)},
              {"margins_before", list_json(step.margins_before)},
              {"predicted", list_json(step.predicted)},
              {"margins_after", list_json(step.margins_after)},
              {"lack_before", step.lack_before},
              {"lack_after", step.lack_after},
              {"progress_before", step.progress_before},
              {"progress_after", step.progress_after},
              {"success_before", step.success_before},
              {"success_after", step.success_after},
              {"lost_before", lost_json(step.lost_before)},
              {"lost_after", lost_json(step.lost_after)},
              {"size", step.size},
              {"rolled_back", step.rolled_back},
              {"refused", refused_json(step.refused)},
              {"kinks", Json::array()},
              {"reverts", Json::array()}};
  for (const StepKink& one : step.kinks) {
    out["kinks"].push_back({{"limit", one.limit}, {"variable", one.variable}, {"contacts", one.contacts}});
  }
  for (const Revert& one : step.reverts) {
    out["reverts"].push_back({{"variable", one.variable}, {"step", one.step}, {"share", one.share}});
  }
  return out;
}

ImproveStep step_of(const Json& json) {
  ImproveStep out;
  json.at("level").get_to(out.level);
  json.at("from").get_to(out.from);
  out.to = number_of(json.at("to"), std::numeric_limits<double>::infinity());
  out.before = list_of(json.at("before")), out.after = list_of(json.at("after"));
  out.margins_before = list_of(json.at("margins_before")), out.margins_after = list_of(json.at("margins_after"));
  out.predicted = list_of(json.at("predicted"));
  json.at("lack_before").get_to(out.lack_before), json.at("lack_after").get_to(out.lack_after);
  json.at("progress_before").get_to(out.progress_before), json.at("progress_after").get_to(out.progress_after);
  json.at("success_before").get_to(out.success_before), json.at("success_after").get_to(out.success_after);
  json.at("size").get_to(out.size), json.at("rolled_back").get_to(out.rolled_back);
  out.lost_before = lost_of(json, "lost_before"), out.lost_after = lost_of(json, "lost_after");
  out.refused = refused_of(json);
  for (const Json& one : json.at("kinks")) {
    out.kinks.push_back({one.at("limit"), one.at("variable"), one.at("contacts")});
  }
  for (const Json& one : json.at("reverts")) {
    out.reverts.push_back({one.at("variable"), one.at("step"), one.at("share")});
  }
  return out;
}

Json question_json(const ImproveQuestion& question) {
  const ImproveOptions& options = question.options;
  return {{"scenario_sha256", question.scenario},
          {"files_sha256", question.files},
          {"policy", options.policy},
          {"step", options.damped ? "damped" : "plain"},
          {"alpha", options.alpha},
          {"particles", options.particles},
          {"seed", question.seed},
          {"drawn", question.drawn}};
}

ImproveQuestion question_of_json(const Json& json) {
  ImproveQuestion out;
  json.at("scenario_sha256").get_to(out.scenario);
  out.files = json.value("files_sha256", "");
  json.at("policy").get_to(out.options.policy);
  out.options.damped = json.at("step") == "damped";
  json.at("alpha").get_to(out.options.alpha);
  json.at("particles").get_to(out.options.particles);
  json.at("seed").get_to(out.seed);
  json.at("drawn").get_to(out.drawn);
  return out;
}

Json variables_json(const DesignBlock& block) {
  Json out = Json::array();
  for (const DesignVariable& one : block.variables) {
    out.push_back({{"name", one.name},
                   {"unit", one.unit},
                   {"initial", one.nominal},
                   {"lower", one.lower},
                   {"upper", one.upper},
                   {"paths", one.paths}});
    if (!one.choices.empty()) out.back()["choices"] = one.choices;
  }
  return out;
}

Json limits_json(const Scenario& scenario) {
  const std::vector<std::string> names = limit_names(scenario), units = limit_units(scenario);
  Json out = Json::array();
  for (std::size_t k = 0; k < names.size(); ++k) out.push_back({{"name", names[k]}, {"unit", units[k]}});
  return out;
}

Json state_json(const ImproveState& state) {
  Json out = {{"design", list_json(state.design)},
              {"level", state.level},
              {"scales", list_json(state.scales)},
              {"radius", state.radius},
              {"end", state.end == ImproveEnd::none    ? ""
                      : state.end == ImproveEnd::stuck ? "stuck"
                                                       : "reached all"},
              {"why", state.why},
              {"lost", lost_json(state.lost)},
              {"idle", state.idle},
              {"refused", refused_json(state.refused)},
              {"answers", Json::array()},
              {"reached", Json::array()},
              {"steps", Json::array()}};
  for (const SessionAnswer& one : state.answers) out["answers"].push_back({{"text", one.text}, {"steps", one.steps}});
  for (const ReachedLevel& one : state.reached) {
    out["reached"].push_back({{"level", one.level},
                              {"steps", one.steps},
                              {"design", list_json(one.design)},
                              {"margins", list_json(one.margins)},
                              {"success", one.success}});
  }
  for (const ImproveStep& one : state.steps) out["steps"].push_back(step_json(one));
  return out;
}

ImproveState state_of(const Json& json) {
  ImproveState out;
  out.design = list_of(json.at("design"));
  json.at("level").get_to(out.level);
  out.scales = list_of(json.at("scales"));
  json.at("radius").get_to(out.radius);
  const std::string end = json.at("end");
  out.end = end.empty() ? ImproveEnd::none : end == "stuck" ? ImproveEnd::stuck : ImproveEnd::reached_all;
  json.at("why").get_to(out.why);
  out.lost = lost_of(json, "lost");
  json.at("idle").get_to(out.idle);
  out.refused = refused_of(json);
  for (const Json& one : json.value("answers", Json::array())) out.answers.push_back({one.at("text"), one.at("steps")});
  for (const Json& one : json.at("reached")) {
    out.reached.push_back(
        {one.at("level"), one.at("steps"), list_of(one.at("design")), list_of(one.at("margins")), one.at("success")});
  }
  for (const Json& one : json.at("steps")) out.steps.push_back(step_of(one));
  return out;
}

/// What fits the scenario alone may be gone on with.
void check_state(const ImproveState& state, const Scenario& scenario) {
  const std::size_t limits = limit_names(scenario).size();
  const std::size_t levels = std::max<std::size_t>(1, scenario.redesign->task_values.size());
  bool fits = state.design.size() == scenario.redesign->variables.size() && state.level < levels &&
              (state.scales.empty() || state.scales.size() == limits);
  for (const ReachedLevel& one : state.reached) fits = fits && one.level < levels;
  const auto& answers = state.answers;
  fits = fits && (answers.empty() || answers.back().text != kAuto || answers.back().steps <= state.steps.size());
  for (const ImproveStep& one : state.steps) {
    fits = fits && one.before.size() == state.design.size() && one.after.size() == state.design.size() &&
           one.level < levels && one.margins_before.size() == limits && one.margins_after.size() == limits &&
           one.predicted.size() == limits;
  }
  for (const ReachedLevel& one : state.reached) {
    fits = fits && one.design.size() == state.design.size() && one.margins.size() == limits;
  }
  if (!fits) throw InputError("its numbers are not those of the scenario");
}

Json content_json(const Scenario& scenario, const ImproveQuestion& question, const ImproveState& state) {
  return {{"scenario", scenario.name},
          {"question", question_json(question)},
          {"variables", variables_json(*scenario.redesign)},
          {"limits", limits_json(scenario)},
          {"task", {{"path", scenario.redesign->task_path}, {"values", scenario.redesign->task_values}}},
          {"state", state_json(state)}};
}

void check_question(const Json& asked, const Json& had) {
  for (const auto& [key, value] : asked.items()) {
    if (key == "files_sha256") {
      if (!had.contains(key) || had.at(key) == value) continue;  // older programs did not keep it
      throw InputError(
          "is of another robot: a file that the scenario names (robot, mesh, controller, table) is not what it was "
          "when "
          "the session began; put the old one in its place, or choose another --output, or --force to begin anew");
    }
    if (had.at(key) == value) continue;
    throw InputError(
        fmt::format("is of another question: its {} is {}, and {} is asked for; choose another "
                    "--output, or --force to begin anew",
                    key, clipped(had.at(key).dump(), 60), clipped(value.dump(), 60)));
  }
}

}  // namespace

std::string improvement_json(const Scenario& scenario, const ImproveQuestion& question, const ImproveState& state) {
  return sealed_text(content_json(scenario, question, state), kKindOfHistory);
}

void write_improvement(const fs::path& folder, const Scenario& scenario, const ImproveQuestion& question,
                       const ImproveState& state) {
  write_sealed(folder, kImproveFile, content_json(scenario, question, state), kKindOfHistory);
}

std::optional<ImproveState> read_improvement(const fs::path& folder, const Scenario& scenario,
                                             const ImproveQuestion& question) {
  const std::string file = (folder / kImproveFile).string();
  if (!input_exists(file)) return std::nullopt;
  return read_sealed(file, kKindOfHistory, [&](const Json& json) {
    check_question(question_json(question), json.at("question"));
    ImproveState out = state_of(json.at("state"));
    check_state(out, scenario);
    return std::optional(std::move(out));
  });
}

ImproveSession read_session(const fs::path& folder, const Scenario& scenario) {
  return read_sealed((folder / kImproveFile).string(), kKindOfHistory, [&](const Json& json) {
    if (json.at("variables") != variables_json(*scenario.redesign) || json.at("limits") != limits_json(scenario)) {
      throw InputError("its design variables or limits are no longer those of the scenario; begin anew with --force");
    }
    ImproveSession out{question_of_json(json.at("question")), state_of(json.at("state"))};
    check_state(out.state, scenario);
    return out;
  });
}

}  // namespace graze
