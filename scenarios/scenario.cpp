#include "scenarios/scenario.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <string_view>
#include <unordered_map>

#include "engine/model/measures.h"
#include "engine/physics.h"
#include "engine/settings/sha256.h"
#include "engine/settings/units.h"
#include "engine/settings/warnings.h"
#include "sampling/design_name.h"
#include "scenarios/at_start.h"
#include "scenarios/design_block.h"
#include "scenarios/disturbances.h"
#include "scenarios/doubts.h"
#include "scenarios/keys.h"
#include "scenarios/limits.h"
#include "scenarios/names.h"
#include "scenarios/overlaps.h"
#include "scenarios/policies.h"
#include "scenarios/uncertain.h"
#include "scenarios/world_reader.h"

namespace graze {
namespace {

constexpr long long kFormat = 1;

void check_format(const Settings& root) {
  const auto version = root.find("graze");
  if (!version) root.fail(fmt::format("the key 'graze' is missing; a scenario begins with 'graze: {}'", kFormat));
  const long long number = version->integer();
  if (number != kFormat) {
    version->fail(fmt::format("{}: this program reads format {}, the file is of format {}", number, kFormat, number));
  }
}

/// "a step of 1 ms or 2 ms would do": the steps nearest to `step` that divide `whole` into a round number of parts.
std::string steps_that_divide(double whole, double step) {
  std::string below, above;
  for (double decade = 1; decade <= 1e6; decade *= 10) {
    for (const double parts : {1.0, 2.0, 4.0, 5.0, 8.0}) {
      const double one = whole / (parts * decade);
      const std::string text = one < 0.1 ? fmt::format("{:.10g} ms", one * 1000) : fmt::format("{:.10g} s", one);
      if (one > step) above = text;
      if (one < step && below.empty()) below = text;
    }
    if (!below.empty()) break;
  }
  return fmt::format("a step of {}{}{} would do", below, below.empty() || above.empty() ? "" : " or ", above);
}

/// Number of `step`s in `whole`, which must be a whole multiple of it.
double multiple(const Settings& place, double whole, double step, const char* name) {
  const double n = std::round(whole / step);
  // Both numbers are rounded to double, and so is their quotient: a few ulps of n.
  if (n < 1 || std::abs(n * step - whole) > 1e-9 * whole) {
    place.fail(fmt::format("{:g} s: must be a whole multiple of {} ({:g} s); {}", whole, name, step,
                           steps_that_divide(whole, step)));
  }
  return n;
}

/// Of a bare step of a second or so, of which the other times are no multiples, the step is what is wrong.
void check_step(const Settings& time) {
  const Settings step = time.at("step");
  const double seconds = step.positive(Quantity::time);
  if (seconds < 0.5 || !is_bare(step)) return;
  const auto is_multiple = [](double whole, double part) {
    const double n = std::round(whole / part);
    return n >= 1 && std::abs(n * part - whole) <= 1e-9 * whole;
  };
  for (const char* key : {"control", "end"}) {
    const auto other = time.find(key);
    const double whole = other ? other->positive(Quantity::time) : seconds;
    if (is_multiple(whole, seconds) || !is_multiple(whole, seconds / 1000)) continue;
    step.fail(fmt::format("{0}: time.{1} ({2:g} s) is no whole multiple of a step of {0} s; did you mean {0} ms?",
                          step.text(), key, whole));
  }
}

double read_step(const Settings& settings) {
  const double step = settings.positive(Quantity::time);
  constexpr double kLong = 0.02;  // s; twenty times the usual
  if (step >= kLong) {
    warn(settings, fmt::format("{:g} s: is long for a step of physics; 0.5 to 1 ms is usual{}", step,
                               step >= 0.5 ? fmt::format("; did you mean {:g} ms?", step) : ""));
  }
  return step;
}

Timing read_time(const Settings& root) {
  Timing out;
  const auto time = root.find("time");
  if (!time) return out;
  time->allow(keys_of("time"));
  if (time->has("step")) {
    check_step(*time);
    out.step = read_step(time->at("step"));
  }
  out.control = out.step;
  if (const auto control = time->find("control")) {
    out.control = control->positive(Quantity::time);
    constexpr double kMostSubsteps = 1e6;
    if (multiple(*control, out.control, out.step, "time.step") > kMostSubsteps) {
      control->fail(fmt::format("more than {:g} physics steps in a control step", kMostSubsteps));
    }
  }
  out.end = Described(*time, section_of("time")).number("end");
  if (time->has("control") && out.control > out.end) {
    warn(time->at("control"),
         fmt::format("{:g} s: the trace is over after {:g} s, so policies act once", out.control, out.end));
  }
  const Settings end = time->has("end") ? time->at("end") : *time;
  constexpr double kMostSteps = 1e9;  // fits an int; 11 days at 1 ms
  if (out.end > (kMostSteps + 0.5) * out.step) {
    end.fail(fmt::format("{:g} s: more than {:g} physics steps of {:g} s; at most {:g} s", out.end, kMostSteps,
                         out.step, kMostSteps * out.step));
  }
  multiple(end, out.end, out.step, "time.step");
  return out;
}

/// The decimal digits of `0x10` (16) and `1_000` (1000), which other languages read; else empty.
std::string decimal_meant(const std::string& text) {
  std::string digits;
  const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
  std::remove_copy(text.begin() + (hexadecimal ? 2 : 0), text.end(), std::back_inserter(digits), '_');
  if (digits.size() == text.size()) return "";
  std::uint64_t value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [after, error] = std::from_chars(digits.data(), end, value, hexadecimal ? 16 : 10);
  return error == std::errc{} && after == end ? std::to_string(value) : "";
}

/// Refuses short names that other programs give the designs, with ours.
void refuse_short_name(const Settings& design) {
  const std::string name = design.is_scalar() ? design.text() : "";
  for (const char* other : {"latin", "lhs", "LHS", "hypercube"}) {
    if (name != other) continue;
    const std::vector<std::string>& designs = section_of("sampling").find("design")->forms.front().words;
    design.fail(fmt::format("{}: must be one of: {}; did you mean '{}'?", name, fmt::join(designs, ", "),
                            design_name(Design::latin_hypercube)));
  }
}

/// Any number of 64 bits, in digits as --seed; doubles hold those up to 2^53 alone.
std::uint64_t read_seed(const Settings& seed) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  const std::string text = seed.is_scalar() ? seed.text() : "";
  std::uint64_t digits = 0;
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, digits);
  if (!text.empty() && error == std::errc{} && after == end) return digits;
  if (const std::string right = decimal_meant(text); !right.empty()) {
    seed.fail(fmt::format("{}: must be a whole number from 0 to {}, in decimal digits alone; did you mean {}?", text,
                          kMost, right));
  }
  const double value = seed.number();
  const double whole = std::round(value);
  seed.fail(fmt::format("{}: must be a whole number from 0 to {}, in digits; nearest right answer: {}", text, kMost,
                        whole <= 0                            ? 0
                        : whole >= static_cast<double>(kMost) ? kMost
                                                              : static_cast<std::uint64_t>(whole)));
}

void read_sampling(const Settings& root, Scenario& out) {
  const auto sampling = root.find("sampling");
  if (!sampling) return;
  sampling->allow(keys_of("sampling"));
  if (const auto design = sampling->find("design")) {
    refuse_short_name(*design);
    const std::string name = Described(*sampling, section_of("sampling")).word("design");
    for (const Design one : kDesigns) {
      if (name == design_name(one)) out.design = one;
    }
    constexpr int kSobolDimensions = 3667;
    if (out.design == Design::sobol && out.space.size() > kSobolDimensions) {
      design->fail(fmt::format("sobol: {} parameters are uncertain; Sobol points have at most {} dimensions",
                               out.space.size(), kSobolDimensions));
    }
  }
  if (const auto seed = sampling->find("seed")) out.seed = read_seed(*seed);
  if (const auto particles = sampling->find("particles")) {
    const std::string text = particles->is_scalar() ? particles->text() : "";
    if (const std::string right = decimal_meant(text); !right.empty()) {
      particles->fail(fmt::format("{}: must be a whole number in decimal digits alone; did you mean {}?", text, right));
    }
    const long long value = particles->integer();
    if (value < 1 || value > static_cast<long long>(kParticleLimit)) {
      particles->fail(fmt::format("{}: must lie within [1, {}]", value, kParticleLimit));
    }
    out.particles = static_cast<std::uint64_t>(value);
  }
}

/// Frames are kept by steps; for a time the message says how many steps that is.
int read_every(const Settings& every, const Timing& timing) {
  const std::string text = every.is_scalar() ? every.text() : "";
  const auto written = split_number(text);  // looks into the text
  const auto seconds =
      written && !written->unit.empty() ? to_si(Quantity::time, written->value, written->unit) : std::nullopt;
  if (seconds) {
    const auto steps = std::max(1LL, std::llround(std::clamp(*seconds / timing.step, 1.0, 1e9)));
    every.fail(fmt::format("{}: is a number of steps of {:g} s, not a time; {} step{} last{} {:g} s", text, timing.step,
                           steps, steps == 1 ? "" : "s", steps == 1 ? "s" : "",
                           static_cast<double>(steps) * timing.step));
  }
  const long long value = every.integer();
  if (value < 1 || value > 1'000'000'000) every.fail(fmt::format("{}: must lie within [1, 1e9]", value));
  return static_cast<int>(value);
}

/// `weight`: of the robot, N.
PhaseRules read_phases(const Described& own, double weight) {
  return {own.number("gap"), own.number("dwell"), own.find_number("impulse").value_or(weight * kPhaseWeightTime)};
}

Recording read_record(const Settings& root, const Timing& timing, double weight) {
  Recording out;
  const auto record = root.find("record");
  const auto phases = record && record->is_map() ? record->find("phases") : std::nullopt;
  const bool ruled = phases && phases->is_map();
  const Settings nothing = Settings::parse("{}", "");
  out.rules = read_phases(Described(ruled ? *phases : nothing, section_of("phases")), weight);
  if (!record) return out;
  const Described own(*record, section_of("record"));
  const std::string word = own.word("telemetry");
  out.telemetry = word == "none"   ? Telemetry::none
                  : word == "all"  ? Telemetry::all
                  : word == "last" ? Telemetry::last
                                   : Telemetry::failures;
  if (const auto every = record->find("every")) out.every = read_every(*every, timing);
  out.last = own.number("last");
  out.events = own.flag("events");
  if (!ruled && phases && !phases->is_scalar()) {
    phases->fail(
        fmt::format("{}: must be true, false, or a map of gap, dwell, impulse", phases->is_null() ? "~" : "a list"));
  }
  if (!ruled) out.phases = own.flag("phases");
  return out;
}

/// A trace's telemetry is held in memory until the trace has ended.
void check_frames(const Settings& root, const Scenario& s) {
  if (s.recording.telemetry == Telemetry::none) return;
  const double bytes = 8.0 * (1 + s.model.nq + s.model.nv + s.model.na());
  double seconds = s.timing.end;
  if (s.recording.telemetry == Telemetry::last) seconds = std::min(seconds, s.recording.last);
  const double kept = seconds / s.timing.step * bytes;
  if (kept / s.recording.every <= kMaxTraceBytes) return;
  const Settings record = root.at("record");
  const Settings place = record.find("every").value_or(record.at("telemetry"));
  place.fail(fmt::format("{:.3g} frames of {} bytes for each trace; at most {:g} MB are held: 'every: {}' or more",
                         kept / bytes / s.recording.every, bytes, kMaxTraceBytes / 1e6,
                         static_cast<long long>(std::ceil(kept / kMaxTraceBytes))));
}

/// Builds every controller once, so that its mistakes come out before anything is simulated. Notes what each reads.
void check_policies(Scenario& scenario) {
  const State initial = initial_state(*scenario.world, scenario.model);
  const ControlContext context{scenario.model, initial, scenario.timing.control,
                               make_physics(scenario.physics, scenario.model)->solves_drives(), scenario.timing.end};
  for (PolicySpec& policy : scenario.policies) policy.reads = Controller(context, policy.settings).reads();
}

/// What no particle could be made of, said here rather than by the first particle.
void check_fabrication(const Settings& root, const Scenario& scenario) {
  std::vector<std::string> paths;
  for (const UncertainParameter& parameter : scenario.space.parameters) paths.push_back(parameter.name);
  try {
    const Fabricator fabricator(scenario.world, paths);
  } catch (const InputError& e) {
    root.find("uncertain").value_or(root).fail(e.what());
  }
}

/// Joints with <mimic>, and what each follows.
std::map<std::string, std::string> followed_joints(const Robot& robot) {
  std::map<std::string, std::string> out;
  for (const Joint& joint : robot.joints) {
    if (!joint.mimic.joint.empty()) out[joint.name] = joint.mimic.joint;
  }
  return out;
}

/// Looks at the control lag where it stands last.
void check_lag(const Settings& root, const Scenario& scenario) {
  constexpr const char* kLag = "control.lag";
  double typical = scenario.world->control_lag;
  for (const UncertainParameter& parameter : scenario.space.parameters) {
    if (parameter.name == kLag) typical = parameter.persistent.median();
  }
  const auto control = root.find("control"), uncertain = root.find("uncertain");
  auto written = control ? control->find("lag") : std::nullopt;
  if (uncertain && uncertain->has(kLag)) written = uncertain->find(kLag);
  doubt_lag(root, written, typical, scenario.timing.end);
}

/// A back end's own errors name no place; the robot's file is where the mistake is.
Model compiled(const Settings& root, const World& world) {
  try {
    return compile(world);
  } catch (const InputError& e) {
    root.at("robot").fail(e.what());
  }
}

/// What has its place elsewhere, where a list of the keys that are allowed would not lead to it.
void refuse_misplaced_sections(const Settings& root) {
  const auto sampling = root.find("sampling");
  for (const auto& map : {std::optional<Settings>(root), sampling}) {
    const auto found = map && map->is_map() ? map->find("correlated") : std::nullopt;
    if (found) found->fail_key("stands under 'uncertain': uncertain: {correlated: [{parameters: …, correlation: …}]}");
  }
}

Scenario read_scenario(const Settings& root, const std::string& file, const ScenarioOptions& options) {
  check_format(root);
  refuse_misplaced_sections(root);
  root.allow(keys_of("scenario"));
  const Warnings warnings;
  Scenario out;
  out.file = file;
  out.text = root.resolved_text();
  out.sha256 = sha256_of(out.text);
  out.name = root.text_or("name", "");
  out.description = root.text_or("description", "");
  if (const auto physics = root.find("physics")) out.physics = physics->choice(physics_names());
  ReadWorld read = read_world(root, {out.physics, options.ignore_missing_meshes});
  out.world = read.world;
  out.model = compiled(root, *out.world);
  if (keep_apart(root, out.model, *read.world)) out.model = compiled(root, *out.world);
  check_contact_names(root, out.model);
  doubt_gravity(root);
  doubt_solver(root, out.model, out.physics);
  out.timing = read_time(root);
  check_disturbances(root, out.model, *out.world);
  const Vec3 extent = robot_extent(out.model, initial_state(*out.world, out.model));
  doubt_clearance(root, extent);
  doubt_support(root, *out.world);
  doubt_places(root, *out.world, out.model, initial_state(*out.world, out.model));
  out.space = read_uncertain(root, ParameterTable(*out.world), read.uncertain, out.timing.control, extent,
                             followed_joints(out.world->robot));
  doubt_welded(root, ParameterTable(*out.world), out.model);
  doubt_disturbances(root, out.space, *out.world, out.model, extent, out.timing.end, out.timing.step);
  check_lag(root, out);
  read_sampling(root, out);
  if (const auto actuators = root.find("actuators")) {
    out.torque_speed = Described(*actuators, section_of("actuators")).flag("torque_speed");
  }
  if (const auto contact = root.find("contact")) {
    out.unconverged = Described(*contact, section_of("contact")).number("unconverged");
  }
  out.recording = read_record(root, out.timing, robot_weight(out.model));
  doubt_last(root, out.timing);
  check_frames(root, out);
  const auto task = root.find("task");
  out.task = read_task(task ? *task : Settings::parse("", file), out.model, {out.timing.step, out.timing.end});
  doubt_task(root, out.task);
  out.policies = read_policies(root.at("policies"));
  refuse_hidden(root.at("policies"), options.overrides);
  for (const PolicySpec& policy : out.policies) doubt_waits(policy.settings, out.timing.end);
  check_policies(out);
  check_fabrication(root, out);
  try {
    out.redesign = read_design(root, ParameterTable(*out.world), out.task, out.timing.end);
  } catch (const InputError& error) {  // campaigns do not heed it
    out.redesign_problem = error.what();
  }
  doubt_start(root, out);
  out.warnings.insert(out.warnings.begin(), read.warnings.begin(), read.warnings.end());
  out.warnings.insert(out.warnings.end(), warnings.texts().begin(), warnings.texts().end());
  return out;
}

}  // namespace

int Timing::steps() const { return static_cast<int>(std::lround(end / step)); }
int Timing::steps_per_control() const { return static_cast<int>(std::lround(control / step)); }

Scenario load_scenario(const std::string& file, const ScenarioOptions& options) {
  const InputRecord record;
  const Warnings warnings;
  Scenario out = read_scenario(Settings::load(file, options.overrides), file, options);
  out.warnings.insert(out.warnings.begin(), warnings.texts().begin(), warnings.texts().end());
  out.source = {file, input_folder(), options, record.files()};
  return out;
}

Scenario reload_scenario(const ScenarioSource& source) {
  const Warnings warnings;
  Scenario out = read_scenario(Settings::load(source.file, source.options.overrides), source.file, source.options);
  out.warnings.insert(out.warnings.begin(), warnings.texts().begin(), warnings.texts().end());
  out.source = source;
  return out;
}

Scenario parse_scenario(const std::string& text, const std::string& name, const ScenarioOptions& options) {
  return read_scenario(Settings::parse(text, name).overridden(options.overrides), name, options);
}

SensorNoise sensor_noise(const Scenario& scenario, std::uint64_t seed) {
  SensorNoise out;
  out.seed = seed;
  std::unordered_map<std::string_view, const UncertainParameter*> by_name;
  for (const UncertainParameter& parameter : scenario.space.parameters) by_name.emplace(parameter.name, &parameter);
  for (const std::string& channel : channel_names(scenario.world->robot)) {
    const auto found = by_name.find(channel);
    out.jitter.push_back(found == by_name.end() ? std::nullopt : found->second->jitter);
  }
  return out;
}

}  // namespace graze
