#include "jobs/campaign/improvement_history.h"

#include <utility>

#include "archive/hdf5/file_driver.h"

namespace graze {
namespace {

/// Columns of one group, a row per element of a list.
template <class Row>
class HistoryRows {
 public:
  HistoryRows(hid_t file, const char* group, const std::vector<Row>& rows) : file_(file), group_(group), rows_(rows) {}

  template <class Value>
  void numbers(const std::string& name, const std::string& unit, const Value& value) const {
    std::vector<double> out;
    for (const Row& row : rows_) out.push_back(value(row));
    write(hdf5::Spec{.name = name, .unit = unit}, out);
  }
  template <class Value>
  void counts(const std::string& name, const Value& value) const {
    std::vector<std::uint32_t> out;
    for (const Row& row : rows_) out.push_back(static_cast<std::uint32_t>(value(row)));
    write(hdf5::Spec{.name = name, .type = hdf5::Type::u32}, out);
  }
  template <class Value>
  void lists(const std::string& name, std::size_t width, const Value& value) const {
    std::vector<double> out;
    for (const Row& row : rows_) {
      const std::vector<double>& list = value(row);
      for (std::size_t i = 0; i < width; ++i) out.push_back(list.at(i));
    }
    write(hdf5::Spec{.name = name, .matrix = true, .width = width}, out);
  }
  template <class Value>
  void texts(const std::string& name, const Value& value) const {
    std::vector<std::string> out;
    for (const Row& row : rows_) out.push_back(value(row));
    hdf5::write_strings(file_, std::string(group_) + "/" + name, out);
  }

 private:
  template <class T>
  void write(const hdf5::Spec& spec, const std::vector<T>& data) const {
    hdf5::write_column(file_, group_, spec, data, 0);
  }
  hid_t file_;
  const char* group_;
  const std::vector<Row>& rows_;
};

void write_steps(hid_t file, const ImproveState& state, std::size_t variables, std::size_t limits) {
  const HistoryRows<ImproveStep> steps(file, "steps", state.steps);
  using Step = ImproveStep;
  steps.counts("task", [](const Step& s) { return s.level; });
  steps.counts("rolled_back", [](const Step& s) { return s.rolled_back; });
  steps.counts("kinks", [](const Step& s) { return s.kinks.size(); });
  steps.counts("reverts", [](const Step& s) { return s.reverts.size(); });
  steps.numbers("from", "s", [](const Step& s) { return s.from; });
  steps.numbers("to", "s", [](const Step& s) { return s.to; });
  steps.numbers("size", "", [](const Step& s) { return s.size; });
  steps.numbers("lack_before", "", [](const Step& s) { return s.lack_before; });
  steps.numbers("lack_after", "", [](const Step& s) { return s.lack_after; });
  steps.numbers("progress_before", "", [](const Step& s) { return s.progress_before; });
  steps.numbers("progress_after", "", [](const Step& s) { return s.progress_after; });
  steps.numbers("success_before", "", [](const Step& s) { return s.success_before; });
  steps.numbers("success_after", "", [](const Step& s) { return s.success_after; });
  steps.counts("lost_before", [](const Step& s) { return s.lost_before.count; });
  steps.counts("lost_after", [](const Step& s) { return s.lost_after.count; });
  steps.lists(
      "design_before", variables, [](const Step& s) -> const auto& { return s.before; });
  steps.lists(
      "design_after", variables, [](const Step& s) -> const auto& { return s.after; });
  steps.lists(
      "margins_before", limits, [](const Step& s) -> const auto& { return s.margins_before; });
  steps.lists(
      "margins_predicted", limits, [](const Step& s) -> const auto& { return s.predicted; });
  steps.lists(
      "margins_after", limits, [](const Step& s) -> const auto& { return s.margins_after; });
}

/// A row per proposal that was rolled back; `step`: which one was made in its place, from 0; of those that ended the
/// session the number of steps.
void write_refused(hid_t file, const ImproveState& state) {
  std::vector<std::pair<std::size_t, RefusedStep>> all;
  for (std::size_t k = 0; k < state.steps.size(); ++k) {
    for (const RefusedStep& one : state.steps[k].refused) all.emplace_back(k, one);
  }
  for (const RefusedStep& one : state.refused) all.emplace_back(state.steps.size(), one);
  using Row = std::pair<std::size_t, RefusedStep>;
  const HistoryRows<Row> rows(file, "refused", all);
  rows.counts("step", [](const Row& row) { return row.first; });
  rows.numbers("size", "", [](const Row& row) { return row.second.size; });
  rows.numbers("progress", "", [](const Row& row) { return row.second.progress; });
  rows.numbers("lack", "", [](const Row& row) { return row.second.lack; });
}

/// What the drives of a robot did, a column per joint.
void write_drives(hid_t file, const std::string& group, const DesignTrace& trace) {
  hdf5::make_group(file, group);
  const std::size_t drives = trace.drives.size();
  std::vector<std::string> names;
  std::vector<double> effort, velocity, speed, torque, asked;
  for (const DriveTrace& one : trace.drives) {
    names.push_back(one.joint);
    effort.push_back(one.effort), velocity.push_back(one.velocity);
  }
  for (std::size_t i = 0; i < trace.time.size(); ++i) {
    for (const DriveTrace& one : trace.drives) {
      speed.push_back(one.speed[i]), torque.push_back(one.torque[i]), asked.push_back(one.asked[i]);
    }
  }
  hdf5::write_strings(file, group + "/joint", names);
  const auto column = [&](const hdf5::Spec& spec, const std::vector<double>& data) {
    hdf5::write_column(file, group, spec, data, 0);
  };
  column({.name = "effort"}, effort);
  column({.name = "velocity"}, velocity);
  column({.name = "time", .unit = "s"}, trace.time);
  if (drives == 0) return;
  column({.name = "speed", .matrix = true, .width = drives}, speed);
  column({.name = "torque", .matrix = true, .width = drives}, torque);
  column({.name = "asked", .matrix = true, .width = drives}, asked);
}

}  // namespace

void write_history(const std::filesystem::path& folder, const Scenario& scenario, const ImproveState& state,
                   const DesignPair& traces) {
  const std::vector<DesignVariable>& all = scenario.redesign->variables;
  const std::vector<std::string> names = limit_names(scenario), units = limit_units(scenario);
  publish_hdf5(folder / kHistoryFile, true, [&](const hdf5::Handle& file) {
    hdf5::write_attribute(file.id(), "format", "graze improve history");
    hdf5::write_attribute(file.id(), "format_version", std::uint64_t{1});
    hdf5::write_attribute(file.id(), "scenario", scenario.name);
    for (const char* group : {"variables", "limits", "steps", "refused", "traces"}) hdf5::make_group(file.id(), group);
    const HistoryRows<DesignVariable> variables(file.id(), "variables", all);
    variables.texts("name", [](const DesignVariable& one) { return one.name; });
    variables.texts("unit", [](const DesignVariable& one) { return one.unit; });  // in which it is told
    variables.numbers("scale", "", [](const DesignVariable& one) { return one.scale; });
    variables.numbers("initial", "", [](const DesignVariable& one) { return one.nominal; });
    variables.numbers("lower", "", [](const DesignVariable& one) { return one.lower; });
    variables.numbers("upper", "", [](const DesignVariable& one) { return one.upper; });
    hdf5::write_strings(file.id(), "limits/name", names);
    hdf5::write_strings(file.id(), "limits/unit", units);
    hdf5::write_column(file.id(), "limits", hdf5::Spec{.name = "scale"}, state.scales, 0);
    write_steps(file.id(), state, all.size(), names.size());
    write_refused(file.id(), state);
    write_drives(file.id(), "traces/before", traces.before);
    write_drives(file.id(), "traces/improved", traces.improved);
  });
}

}  // namespace graze
