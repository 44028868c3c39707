#include "scenarios/task.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "engine/settings/merged.h"
#include "engine/settings/warnings.h"
#include "sampling/constants.h"
#include "scenarios/doubts.h"
#include "scenarios/keys.h"
#include "scenarios/limits.h"
#include "scenarios/predicate_form.h"
#include "scenarios/task_range.h"
#include "scenarios/witnesses.h"

namespace graze {
namespace {

Key window_key(const char* help) {
  return {"window", {Form::numbers(2, Quantity::time)}, Default::words("all along"), help};
}

/// What may stand beside a witness that is a predicate.
std::vector<std::string> timing_keys() {
  std::vector<std::string> out;
  for (const Key& key : predicate_description().keys) {
    if (std::find(inner_keys().begin(), inner_keys().end(), key.name) == inner_keys().end()) out.push_back(key.name);
  }
  return out;
}

Window read_window(const Settings& settings) {
  const std::vector<double> ends = settings.numbers(2, Quantity::time);
  if (ends[0] < 0 || ends[1] < ends[0]) {
    settings.fail(fmt::format("[{:g}, {:g}] s: must be [from, to] with 0 <= from <= to", ends[0], ends[1]));
  }
  return {ends[0], ends[1]};
}

/// ", from 1 to 2 s" behind what is judged within it.
std::string from_to(const Window& window) { return fmt::format(", from {:g} to {:g} s", window.from, window.to); }

class TaskReader {
 public:
  TaskReader(const Model& nominal, const TraceTimes& times) : nominal_(nominal), times_(times) {}

  /// As a measure it decides nothing: a bound that never holds is warned of, not refused.
  Requirement requirement(const std::string& name, const Settings& settings, bool measure = false) const {
    if (name.empty()) settings.fail_key(measure ? "a measure needs a name" : "a requirement needs a name");
    if (is_witness(name) && !names_a_predicate(settings)) {
      settings.fail_key(fmt::format("is a witness; what it is for has a name of its own: NAME: {{{}: …}}", name));
    }
    const std::vector<std::string> beside = requirement_description().names();
    refuse_predicate(settings);
    settings.allow(with_names(beside));
    Requirement out;
    out.measure = measure;
    out.name = name;
    const ReadWitness witness = the_witness(settings, beside);
    out.kind = witness.kind;
    out.witness = witness.witness;
    out.description = witness.description;
    out.unit = witness.unit;
    const auto window = settings.find("window");
    if (window) {
      out.window = read_window(*window);
      out.witness = witness.within(out.window);
      out.description += from_to(out.window);
    }
    const char* const then = measure ? "so nothing is measured" : "so the requirement is never violated";
    if (window && warn_of_window(*window, out.window, times_, then)) return out;
    if (measure) {
      doubt(settings, witness.range, "a measure that every trace keeps", "a measure that no trace keeps");
      return out;
    }
    doubt(settings, witness.range, "a requirement that can never be violated", "every trace violates it");
    if (witness.range.never_holds() && !witness.range.of_nominal) {
      settings.fail("every trace would violate it: " + witness.range.why);
    }
    return out;
  }

  /// The predicate itself, or a map that gives it a name.
  Objective objective(const Settings& settings) const {
    const auto entries = settings.entries();
    const bool named =
        entries.size() == 1 && !is_predicate_key(entries[0].first) && names_a_predicate(entries[0].second);
    if (entries.size() == 1 && !named) refuse_empty_name(entries[0].first, entries[0].second);
    refuse_several(entries);
    const Settings& meant = named ? entries[0].second : settings;
    if (named) check_objective_name(entries[0].first, meant);
    Objective out = predicate(meant);
    out.name = named ? entries[0].first : "objective";
    if (out.range.never_holds() && !out.range.of_nominal) {
      meant.fail("no trace could ever meet it: " + out.range.why);
    }
    if (!out.parts.empty()) doubt(meant, out.range, "every trace meets it", "no trace meets it");
    return out;
  }

 private:
  /// The one witness among the keys of a map that may hold `others` too.
  ReadWitness the_witness(const Settings& settings, const std::vector<std::string>& others) const {
    const WitnessKind* kind = nullptr;
    std::optional<SettingsEntry> first;
    for (const SettingsEntry& entry : settings.entries()) {
      if (std::find(others.begin(), others.end(), entry.first) != others.end()) continue;
      if (kind) {
        entry.second.fail_key(fmt::format("a second witness beside '{}'; give each its own name{}", kind->name,
                                          replace_hint(*first, entry)));
      }
      for (const WitnessKind& one : witness_kinds()) {
        if (one.name == entry.first) kind = &one;
      }
      first.emplace(entry);
    }
    if (!kind) {
      settings.fail(fmt::format("names no witness; one of {}", fmt::join(witness_names(), ", ")));
    }
    const Settings written = settings.at(kind->name);
    for (const std::string& other : others) {
      if (!written.is_map() || !written.has(other)) continue;
      written.at(other).fail_key(
          fmt::format("stands beside the witness, not in it: {{{}: {{…}}, {}: …}}", kind->name, other));
    }
    ReadWitness out = kind->read(Described(written, kind->text), nominal_);
    out.kind = kind->name;
    if (kind->name == "contact_impulse") doubt_impulse(written, nominal_, times_.end);
    return out;
  }

  Objective predicate(const Settings& settings) const {
    settings.allow(with_names(predicate_description().names()));
    for (const std::string& inner : inner_keys()) {
      if (!settings.has(inner)) continue;
      if (settings.entries().size() > 1) {
        settings.fail(fmt::format("'{}' stands alone; times belong to the witnesses in it", inner));
      }
      return inner_node(inner, settings.at(inner));
    }
    Objective out;
    const ReadWitness witness = the_witness(settings, timing_keys());
    out.witness = witness.witness;
    out.description = witness.description;
    out.unit = witness.unit;
    out.range = witness.range;
    read_timing(settings, out, witness.at_start);
    out.witness = witness.within(out.window);
    return out;
  }

  Objective inner_node(const std::string& key, const Settings& settings) const {
    Objective out;
    out.kind = key == "all" ? Objective::Kind::all : key == "any" ? Objective::Kind::any : Objective::Kind::negation;
    for (const Settings& part : settings.items()) out.parts.push_back(predicate(part));
    if (out.parts.empty()) settings.fail("needs at least one predicate");
    if (key == "not" && out.parts.size() != 1) settings.fail("takes one predicate");
    out.range = range_of_parts(out);
    return out;
  }

  void read_timing(const Settings& settings, Objective& out, const std::optional<double>& at_start) const {
    const auto window = settings.find("window");
    const bool always = settings.flag_or("always", false), once = settings.flag_or("once", false);
    if (settings.has("at")) settings.at("at").choice({"end"});
    if ((settings.has("at") ? 1 : 0) + (always ? 1 : 0) + (once ? 1 : 0) > 1) {
      settings.fail("is judged at one kind of time: 'at: end', 'always: true' or 'once: true'");
    }
    if (window && settings.has("at")) window->fail_key("a window goes with 'always' or 'once', not with 'at: end'");
    if (window) {
      out.window = read_window(*window);
      out.description += from_to(out.window);
    }
    // A window alone means throughout it.
    out.kind = once ? Objective::Kind::once : always || window ? Objective::Kind::always : Objective::Kind::at_end;
    const char* const then = once ? "so it never holds" : "so it always holds";
    if (window && warn_of_window(*window, out.window, times_, then)) {
      out.range = unopened(out.window, once);
    } else {
      if (once && out.window.contains(0) && at_start && *at_start >= 0) {
        out.range = {*at_start, out.range.high, "once is enough, and nothing has struck when the trace begins", false};
      }
      doubt(settings, out.range, "it always holds", "it never holds");
    }
  }

  const Model& nominal_;
  const TraceTimes& times_;
};

void collect_leaves(const Objective& node, std::vector<const Objective*>& leaves) {
  if (node.witness) leaves.push_back(&node);
  for (const Objective& part : node.parts) collect_leaves(part, leaves);
}

/// The margin of a node, and the leaf that gave it (-1: none).
struct Judged {
  double margin;
  int leaf;
};

/// Walks the tree in the order of collect_leaves; `next` counts the leaves, whose values stand in `value`.
Judged judge(const Objective& node, const std::vector<double>& value, int& next) {
  if (node.witness) {
    const int leaf = next++;
    return {value[leaf], leaf};
  }
  const bool any = node.kind == Objective::Kind::any;
  Judged out{any ? -kInfinity : kInfinity, -1};
  for (const Objective& part : node.parts) {
    const Judged one = judge(part, value, next);
    if (any ? out.margin < one.margin : one.margin < out.margin) out = one;
  }
  if (node.kind == Objective::Kind::negation) out.margin = -out.margin;
  return out;
}

Judged judge(const Objective& objective, const std::vector<double>& value) {
  int next = 0;
  return judge(objective, value, next);
}

double start_value(const Objective& leaf) { return leaf.kind == Objective::Kind::always ? kInfinity : -kInfinity; }

/// Lanes of the input whose time is in the window.
unsigned lanes_within(const Window& window, const WitnessInput& input) {
  unsigned out = 0;
  for (int lane = 0; lane < kLanes; ++lane) out |= static_cast<unsigned>(window.contains(input.time[lane])) << lane;
  return out & input.lanes.bits();
}

/// Values of a witness and the parts that gave them, a row of lanes each.
struct Evaluated {
  double value[kLanes], part[kLanes];
};

/// row = min(row, value) in some lanes, and the part with it; with `sign` -1 the greatest.
void lower(double* row, double* part, const Evaluated& now, unsigned lanes, double sign = 1) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const bool take = (lanes >> lane & 1u) && sign * now.value[lane] < sign * row[lane];
    row[lane] = take ? now.value[lane] : row[lane];
    part[lane] = take ? now.part[lane] : part[lane];
  }
}

}  // namespace

std::vector<const Objective*> leaves(const Objective& objective) {
  std::vector<const Objective*> out;
  collect_leaves(objective, out);
  return out;
}

Task read_task(const Settings& settings, const Model& nominal, const TraceTimes& times) {
  settings.allow(keys_of("task"));
  const TaskReader reader(nominal, times);
  Task task;
  task.objective.kind = Objective::Kind::all;  // of nothing: met by every trace that reaches its end
  task.objective.name = "reaches the end";
  if (const auto requirements = settings.find("requirements")) {
    check_count(*requirements, requirements->entries().size(), kMaxRequirements, "requirements");
    for (const auto& [name, value] : requirements->entries())
      task.requirements.push_back(reader.requirement(name, value));
  }
  if (const auto measures = settings.find("measures")) {
    check_count(*measures, measures->entries().size(), kMostMeasures, "measures");
    for (const auto& [name, value] : measures->entries()) {
      for (const Requirement& other : task.requirements) {
        if (other.name == name) value.fail_key("is a requirement too; give the measure a name of its own");
      }
      task.requirements.push_back(reader.requirement(name, value, true));
    }
  }
  if (const auto objective = settings.find("objective")) {
    task.objective = reader.objective(*objective);
    check_count(*objective, leaves(task.objective).size(), kMaxRequirements, "predicates");
  }
  task.stop_at_violation = settings.flag_or("stop_at_violation", true);
  return task;
}

const Description& requirement_description() {
  static const Description text = {"a witness that must stay >= 0",
                                   {window_key("`[from, to]`, within which alone it is judged")}};
  return text;
}

const Description& predicate_description() {
  static const Description text = {
      "a witness, judged at the end, always or once; or all, any or not of other predicates",
      {{"all", {Form::sections(-1, "predicate", "[PREDICATE, …]")}, {}, "every one of them holds"},
       {"any", {Form::sections(-1, "predicate", "[PREDICATE, …]")}, {}, "at least one of them holds"},
       {"not", {Form::section("predicate", "PREDICATE")}, {}, "it does not hold"},
       {"at", {Form::word({"end"})}, Default::words("end"), "beside a witness: it holds at the end"},
       {"always", {Form::flag()}, Default::value("false"), "beside a witness: it holds all along"},
       {"once", {Form::flag()}, Default::value("false"), "beside a witness: it holds at some time"},
       window_key("beside a witness: `[from, to]`, within which it holds `always` (if neither is said) or `once`")}};
  return text;
}

TaskMonitor::Watched::Watched(const Witness& one) : witness(&one), own(one.numbers()), memory(one.remember()) {}

void TaskMonitor::Watched::start(int lane, const Model& model) {
  witness->read(model, lane, own);
  if (memory) memory->start(lane, model);
}

void TaskMonitor::Watched::follow(WitnessInput input) const {
  input.memory = memory.get();
  witness->follow(input);
}

void TaskMonitor::Watched::evaluate(WitnessInput input, const double* enough, double* out, double* part) const {
  input.memory = memory.get();
  input.enough = enough;
  input.moves = moves;
  witness->evaluate(input, own, out, part);
  if (witness->parts() == PartKind::none) std::fill_n(part, kLanes, double{kNoPart});  // nobody reads its number
}

TaskMonitor::TaskMonitor(const Task& task) : task_(&task), leaves_(leaves(task.objective)) {
  for (const Requirement& one : task.requirements) watched_.emplace_back(*one.witness);
  for (const Objective* leaf : leaves_) judging_.emplace_back(*leaf->witness);
  std::vector<int> bodies;
  for (const std::vector<Watched>* some : {&watched_, &judging_}) {
    for (const Watched& one : *some) {
      for (const int body : one.memory ? one.memory->bodies() : std::vector<int>()) bodies.push_back(body);
    }
  }
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  moves_ = std::make_unique<BodyMoves>(std::move(bodies));
  for (std::vector<Watched>* some : {&watched_, &judging_}) {
    for (Watched& one : *some) one.moves = moves_.get();
  }
  margin_ = violation_ = margin_part_ = violation_part_ = BlockArray(static_cast<int>(watched_.size()));
  leaf_ = leaf_part_ = BlockArray(static_cast<int>(leaves_.size()));
}

void TaskMonitor::start(int lane, const Model& model) {
  moves_->start(lane);
  for (Watched& one : watched_) one.start(lane, model);
  for (Watched& one : judging_) one.start(lane, model);
  for (int i = 0; i < margin_.rows(); ++i) {
    margin_(i, lane) = kInfinity;
    violation_(i, lane) = std::numeric_limits<double>::quiet_NaN();
    margin_part_(i, lane) = violation_part_(i, lane) = kNoPart;
  }
  for (int i = 0; i < leaf_.rows(); ++i) {
    leaf_(i, lane) = start_value(*leaves_[i]);
    leaf_part_(i, lane) = kNoPart;
  }
  violated_[lane] = -1;
}

void TaskMonitor::carry(int lane, LaneTape& tape) {
  for (std::vector<Watched>* some : {&watched_, &judging_}) {
    for (Watched& one : *some) {
      if (one.memory) one.memory->carry(lane, tape);
    }
  }
  for (BlockArray* rows : {&margin_, &violation_, &margin_part_, &violation_part_, &leaf_, &leaf_part_}) {
    tape.carry(*rows, lane);
  }
  tape.carry(violated_[lane]);
}

LaneMask TaskMonitor::update(const WitnessInput& input) {
  moves_->next();
  Evaluated now;
  for (int i = 0; i < margin_.rows(); ++i) {
    watched_[i].follow(input);
    const unsigned lanes = lanes_within(task_->requirements[i].window, input);
    if (lanes == 0) continue;
    watched_[i].evaluate(input, margin_.row(i), now.value, now.part);
    lower(margin_.row(i), margin_part_.row(i), now, lanes);
    unsigned below = 0;
    for (int lane = 0; lane < kLanes; ++lane) below |= static_cast<unsigned>(!(now.value[lane] >= 0)) << lane;
    if ((below & lanes) != 0) note_violations(i, below & lanes, input, now.part);
  }
  for (int i = 0; i < leaf_.rows(); ++i) {
    const Objective& leaf = *leaves_[i];
    judging_[i].follow(input);
    const unsigned lanes = leaf.kind == Objective::Kind::at_end ? 0 : lanes_within(leaf.window, input);
    if (lanes == 0) continue;
    judging_[i].evaluate(input, leaf.kind == Objective::Kind::once ? nullptr : leaf_.row(i), now.value, now.part);
    lower(leaf_.row(i), leaf_part_.row(i), now, lanes, leaf.kind == Objective::Kind::once ? -1 : 1);
  }
  LaneMask out;
  for (int lane = 0; lane < kLanes; ++lane) out.set(lane, input.lanes[lane] && violated_[lane] >= 0);
  return out;
}

void TaskMonitor::values(const WitnessInput& input, BlockArray& requirements, BlockArray& objective) const {
  // Once, not at every step.
  if (requirements.rows() != margin_.rows()) requirements = BlockArray(margin_.rows());
  if (objective.rows() != leaf_.rows()) objective = BlockArray(leaf_.rows());
  double part[kLanes];
  for (int i = 0; i < requirements.rows(); ++i) watched_[i].evaluate(input, nullptr, requirements.row(i), part);
  for (int i = 0; i < objective.rows(); ++i) judging_[i].evaluate(input, nullptr, objective.row(i), part);
}

void TaskMonitor::note_violations(int requirement, unsigned lanes, const WitnessInput& input, const double* part) {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!(lanes >> lane & 1u) || !std::isnan(violation_(requirement, lane))) continue;
    violation_(requirement, lane) = input.time[lane];
    violation_part_(requirement, lane) = part[lane];
    if (violated_[lane] < 0 && !task_->requirements[requirement].measure) violated_[lane] = requirement;
  }
}

void TaskMonitor::finish(const WitnessInput& input) {
  Evaluated now;
  for (int i = 0; i < leaf_.rows(); ++i) {
    if (leaves_[i]->kind != Objective::Kind::at_end) continue;
    judging_[i].evaluate(input, nullptr, now.value, now.part);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!input.lanes[lane]) continue;
      leaf_(i, lane) = now.value[lane];
      leaf_part_(i, lane) = now.part[lane];
    }
  }
}

std::vector<double> TaskMonitor::column(const BlockArray& array, int lane) {
  std::vector<double> out(array.rows());
  for (int i = 0; i < array.rows(); ++i) out[i] = array(i, lane);
  return out;
}

std::vector<int> TaskMonitor::parts(const BlockArray& array, int lane) {
  std::vector<int> out(array.rows());
  for (int i = 0; i < array.rows(); ++i) out[i] = static_cast<int>(array(i, lane));
  return out;
}

double TaskMonitor::objective_margin(int lane) const { return judge(task_->objective, column(leaf_, lane)).margin; }

Culprit TaskMonitor::objective_culprit(int lane) const {
  const int leaf = judge(task_->objective, column(leaf_, lane)).leaf;
  return leaf < 0 ? Culprit{} : Culprit{leaf, static_cast<int>(leaf_part_(leaf, lane))};
}

}  // namespace graze
