// The CSV form of a replay: numbers with as many digits as give the same bits when they are read again.
#include <fmt/format.h>

#include <cmath>

#include "archive/files/csv.h"
#include "archive/files/files.h"
#include "archive/replay_file.h"
#include "archive/schema/culprit.h"
#include "simulation/results_epoch.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// A CSV file (RFC 4180) that appears whole or not at all.
class CsvFile {
 public:
  CsvFile(const fs::path& path, bool force) : path_(path), file_(path, force) {}

  void cell(const std::string& text) {
    begin();
    buffer_ += csv_cell(text);
  }
  /// NaN is an empty cell.
  void cell(double x) {
    begin();
    if (!std::isnan(x)) fmt::format_to(std::back_inserter(buffer_), "{}", x);
  }
  void cell(std::uint32_t x) {
    begin();
    fmt::format_to(std::back_inserter(buffer_), "{}", x);
  }
  void cells(const Vec3& vector) {
    for (int i = 0; i < 3; ++i) cell(vector[i]);
  }
  void end_row() {
    buffer_ += '\n';
    fresh_ = true;
    if (buffer_.size() > kBuffer) flush();
  }
  void row(std::initializer_list<const char*> names) {
    for (const char* name : names) cell(std::string(name));
    end_row();
  }
  void publish() {
    flush();
    file_.publish();
  }

 private:
  static constexpr std::size_t kBuffer = std::size_t{1} << 20;

  void begin() {
    if (!fresh_) buffer_ += ',';
    fresh_ = false;
  }
  void flush() {
    const int error = write_all(file_.descriptor(), std::as_bytes(std::span(buffer_)));
    if (error != 0) fail_writing(path_, error);
    buffer_.clear();
  }

  fs::path path_;
  NewFile file_;
  std::string buffer_;
  bool fresh_ = true;  // at the beginning of a row
};

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() || unit == "1" ? name : name + " [" + unit + "]";
}

/// "command/kp" and "LF_X_1" give "command.kp.LF_X_1 [N m/rad]".
std::string heading(const FrameTable& table, const NamedColumn& column) {
  std::string prefix = table.name;
  std::replace(prefix.begin(), prefix.end(), '/', '.');
  return with_unit(prefix + "." + column.name, column.unit);
}

void write_frames(const ReplayFile& replay, CsvFile out) {
  const StepLog& log = replay.log;
  out.cell(std::string("time [s]"));
  for (const FrameTable& table : log.tables) {
    for (const NamedColumn& column : table.columns) out.cell(heading(table, column));
  }
  out.end_row();
  for (std::size_t frame = 0; frame < log.time.size(); ++frame) {
    out.cell(log.time[frame]);
    for (const FrameTable& table : log.tables) {
      const std::size_t width = table.columns.size();
      for (std::size_t i = 0; i < width; ++i) out.cell(table.values[frame * width + i]);
    }
    out.end_row();
  }
  out.publish();
}

std::string feature_text(Feature feature) { return std::string(feature_name(feature)); }

void write_contacts(const ReplayFile& replay, CsvFile out) {
  constexpr std::array<const char*, 3> kModes = {"stick", "slip", "roll"};
  out.row({"frame", "time [s]", "a", "b", "feature_a", "feature_b", "mode", "gap [m]", "normal_impulse [N s]", "x [m]",
           "y [m]", "z [m]", "normal_x", "normal_y", "normal_z", "impulse_x [N s]", "impulse_y [N s]",
           "impulse_z [N s]"});
  const StepLog& log = replay.log;
  for (std::size_t i = 0; i < log.contacts.size(); ++i) {
    const Contact& contact = log.contacts[i];
    out.cell(log.contact_frame[i]);
    out.cell(log.time[log.contact_frame[i]]);
    out.cell(replay.info.colliders.at(contact.a));
    out.cell(replay.info.colliders.at(contact.b));
    out.cell(feature_text(contact.feature_a));
    out.cell(feature_text(contact.feature_b));
    out.cell(std::string(kModes.at(static_cast<std::size_t>(contact.mode))));
    out.cell(contact.phi);
    out.cell(contact.normal_impulse());
    out.cells(contact.p_W);
    out.cells(contact.n_W);
    out.cells(contact.impulse_W);
    out.end_row();
  }
  out.publish();
}

void write_events(const ReplayFile& replay, CsvFile out) {
  out.row({"time [s]", "kind", "a", "b", "feature_a", "feature_b", "impulse [N s]", "x [m]", "y [m]", "z [m]"});
  for (const Event& event : replay.trace.events) {
    const bool limit = event.kind == EventKind::limit_begin || event.kind == EventKind::limit_end;
    out.cell(event.time);
    out.cell(std::string(event_kind_name(event.kind)));
    out.cell(limit ? replay.info.bodies.at(event.a) : replay.info.colliders.at(event.a));
    out.cell(limit ? std::string(event.b < 0 ? "lower" : "upper") : replay.info.colliders.at(event.b));
    out.cell(feature_text(event.feature_a));
    out.cell(feature_text(event.feature_b));
    out.cell(event.impulse);
    out.cells(event.p_W);
    out.end_row();
  }
  out.publish();
}

void write_phases(const ReplayFile& replay, CsvFile out) {
  out.row({"begin [s]", "end [s]", "a", "b", "feature_a", "feature_b", "peak [N s]", "impulse [N s]", "slip", "roll"});
  for (const ContactPhase& phase : replay.trace.phases) {
    out.cell(phase.begin);
    out.cell(phase.end);
    out.cell(replay.info.colliders.at(phase.a));
    out.cell(replay.info.colliders.at(phase.b));
    out.cell(feature_text(phase.feature_a));
    out.cell(feature_text(phase.feature_b));
    for (const double number : {phase.peak, phase.impulse, phase.slip, phase.roll}) out.cell(number);
    out.end_row();
  }
  out.publish();
}

void write_parameters(const ReplayFile& replay, CsvFile out) {
  out.row({"name", "unit", "nominal", "value", "deviations", "nominal_label", "value_label", "distribution"});
  for (const ReplayedParameter& parameter : replay.parameters) {
    out.cell(parameter.name);
    out.cell(parameter.unit);
    out.cell(parameter.nominal);
    out.cell(parameter.value);
    out.cell(parameter.deviations);
    out.cell(parameter.nominal_label);
    out.cell(parameter.value_label);
    out.cell(parameter.distribution);
    out.end_row();
  }
  out.publish();
}

void write_derived(const ReplayFile& replay, CsvFile out) {
  out.row({"name", "unit", "nominal", "value"});
  for (const ReplayedNumber& number : replay.derived) {
    out.cell(number.name);
    out.cell(number.unit);
    out.cell(number.nominal);
    out.cell(number.value);
    out.end_row();
  }
  out.publish();
}

/// The facts of the trace, a row each.
void write_trace(const ReplayFile& replay, CsvFile out) {
  const auto fact = [&](const std::string& name, const auto& value, const char* unit = "") {
    out.cell(name);
    out.cell(value);
    out.cell(std::string(unit));
    out.end_row();
  };
  const CampaignInfo& info = replay.info;
  const TraceRecord& trace = replay.trace;
  out.row({"name", "value", "unit"});
  fact("scenario", info.scenario_name);
  fact("scenario_sha256", info.scenario_sha256);
  fact("archive", replay.archive);
  fact("results_version", results_version());
  const BuildFacts build = build_facts();
  each_fact(build, [&](const char* name, const std::string& text) { fact(name, text); });
  fact("seed", std::to_string(info.seed));
  fact("particle", trace.particle);
  fact("policy", replay.policy);
  fact("step", info.step, "s");
  fact("outcome", std::string(outcome_name(trace.outcome)));
  fact("violated", trace.violated < 0 ? std::string() : info.requirements.at(trace.violated).name);
  fact("invalid_reason", trace.invalid_reason);
  fact("end_time", trace.end_time, "s");
  each_solver_fact(trace.solver, info.unconverged,
                   [&](const char* name, double value, const char* unit) { fact(name, value, unit); });
  for (std::size_t i = 0; i < replay.requirements.size(); ++i) {
    const ReplayedRequirement& requirement = replay.requirements[i];
    fact("is_measure." + requirement.name, std::string(requirement.measure ? "yes" : "no"));
    fact("margin." + requirement.name, trace.margins[i], requirement.unit.c_str());
    fact("first_violation." + requirement.name, trace.first_violations[i], "s");
    const auto culprit = [&](const std::vector<int>& parts) {
      return i < parts.size() ? culprit_text(static_cast<int>(i), {-1, parts[i]}, info) : std::string();
    };
    fact("margin_culprit." + requirement.name, culprit(trace.margin_parts));
    fact("violation_culprit." + requirement.name, culprit(trace.violation_parts));
    fact("from." + requirement.name, requirement.from, "s");
    fact("to." + requirement.name, requirement.to, "s");
    if (requirement.measure) fact("kept." + requirement.name, replay.kept(i));
  }
  fact("objective", info.objective);
  fact("objective_margin", trace.objective_margin);
  fact("objective_culprit", culprit_text(-1, trace.objective_culprit, info));
  fact("verification", replay.verification);
  fact("digest", fmt::format("{:#018x}", trace.digest));
  if (replay.archived_digest) fact("archived_digest", fmt::format("{:#018x}", *replay.archived_digest));
  out.publish();
}

}  // namespace

void write_replay_csv(const ReplayFile& replay, const std::vector<fs::path>& files, bool force) {
  write_frames(replay, CsvFile(files.at(0), force));
  write_contacts(replay, CsvFile(files.at(1), force));
  write_events(replay, CsvFile(files.at(2), force));
  write_phases(replay, CsvFile(files.at(3), force));
  write_parameters(replay, CsvFile(files.at(4), force));
  write_derived(replay, CsvFile(files.at(5), force));
  write_trace(replay, CsvFile(files.at(6), force));
}

}  // namespace graze
