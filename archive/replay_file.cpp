// write_replay(), and the HDF5 form.
#include "archive/replay_file.h"

#include <fmt/format.h>

#include "archive/files/files.h"
#include "archive/hdf5/file_driver.h"
#include "archive/schema/culprit.h"
#include "archive/schema/kept.h"
#include "archive/schema/schema.h"
#include "simulation/results_epoch.h"

namespace graze {
namespace {

using hdf5::Spec;
using hdf5::Type;

constexpr int kReplayDeflate = 4;
constexpr std::uint64_t kReplayFormatVersion = 1;

class Hdf5Writer {
 public:
  Hdf5Writer(const ReplayFile& replay, hid_t file) : replay_(replay), file_(file) {}

  void write() {
    write_facts();
    write_frames();
    write_contacts();
    write_events();
    write_phases();
    write_requirements();
    write_parameters();
    write_derived();
    hdf5::write_strings(file_, "names/colliders", replay_.info.colliders);
    hdf5::write_strings(file_, "names/bodies", replay_.info.bodies);
  }

 private:
  void write_facts() {
    const CampaignInfo& info = replay_.info;
    const TraceRecord& trace = replay_.trace;
    hdf5::write_attribute(file_, "format", std::string(kReplayFormat));
    hdf5::write_attribute(file_, "format_version", kReplayFormatVersion);
    hdf5::write_attribute(file_, "archive", replay_.archive);
    hdf5::write_attribute(file_, "scenario_name", info.scenario_name);
    hdf5::write_attribute(file_, "scenario", info.scenario_text);
    hdf5::write_attribute(file_, "scenario_sha256", info.scenario_sha256);
    hdf5::write_attribute(file_, "results_version", results_version());
    const BuildFacts build = build_facts();
    each_fact(build, [&](const char* name, const std::string& text) { hdf5::write_attribute(file_, name, text); });
    hdf5::write_attribute(file_, "physics", info.physics);
    hdf5::write_attribute(file_, "seed", info.seed);
    hdf5::write_attribute(file_, "particle", std::uint64_t{trace.particle});
    hdf5::write_attribute(file_, "policy", replay_.policy);
    hdf5::write_attribute(file_, "step", info.step);
    hdf5::write_attribute(file_, "control", info.control);
    hdf5::write_attribute(file_, "outcome", std::string(outcome_name(trace.outcome)));
    hdf5::write_attribute(file_, "violated", trace.violated < 0 ? "" : info.requirements.at(trace.violated).name);
    hdf5::write_attribute(file_, "invalid_reason", trace.invalid_reason);
    hdf5::write_attribute(file_, "end_time", trace.end_time);
    each_solver_fact(trace.solver, info.unconverged,
                     [&](const char* name, double value, const char*) { hdf5::write_attribute(file_, name, value); });
    hdf5::write_attribute(file_, "objective", info.objective);
    hdf5::write_attribute(file_, "objective_margin", trace.objective_margin);
    hdf5::write_attribute(file_, "objective_culprit", culprit_text(-1, trace.objective_culprit, info));
    hdf5::write_attribute(file_, "contact_sequence", trace.sequence);
    hdf5::write_attribute(file_, "verification", replay_.verification);
    hdf5::write_attribute(file_, "digest", trace.digest);
    if (replay_.archived_digest) hdf5::write_attribute(file_, "archived_digest", *replay_.archived_digest);
  }

  void write_frames() {
    column("telemetry", schema::time(), replay_.log.time);
    for (const FrameTable& table : replay_.log.tables) {
      const std::size_t slash = table.name.rfind('/');
      const bool nested = slash != std::string::npos;
      const std::string group = nested ? "telemetry/" + table.name.substr(0, slash) : "telemetry";
      const std::string name = nested ? table.name.substr(slash + 1) : table.name;
      column(group, {name, Type::f64, true, table.columns.size()}, table.values);
      std::vector<std::string> names, units;
      for (const NamedColumn& one : table.columns) {
        names.push_back(one.name);
        units.push_back(one.unit);
      }
      hdf5::write_strings(file_, "names/" + table.name, names);
      hdf5::write_strings(file_, "units/" + table.name, units);
    }
  }

  void write_contacts() {
    const StepLog& log = replay_.log;
    column("contacts", {"frame", Type::u32}, log.contact_frame);
    std::vector<double> time;
    for (const std::uint32_t frame : log.contact_frame) time.push_back(log.time[frame]);
    column("contacts", schema::time(), time);
    write_sides<Contact>("contacts", log.contacts);
    const auto bytes = [](ContactMode mode) { return static_cast<std::uint8_t>(mode); };
    const Spec mode = {"mode", Type::enumeration, false, 1, {}, {"stick", "slip", "roll"}};
    column("contacts", mode, gather<std::uint8_t>(log.contacts, [&](const Contact& c) { return bytes(c.mode); }));
    column("contacts", {"gap", Type::f64, false, 1, "m"},
           gather<double>(log.contacts, [](const Contact& c) { return c.phi; }));
    column("contacts", {"normal_impulse", Type::f64, false, 1, "N s"},
           gather<double>(log.contacts, [](const Contact& c) { return c.normal_impulse(); }));
    column("contacts", schema::position(), vectors(log.contacts, [](const Contact& c) { return c.p_W; }));
    column("contacts", {"normal", Type::f64, true, 3}, vectors(log.contacts, [](const Contact& c) { return c.n_W; }));
    column("contacts", {"impulse", Type::f64, true, 3, "N s"},
           vectors(log.contacts, [](const Contact& c) { return c.impulse_W; }));
  }

  void write_events() {
    const std::vector<Event>& events = replay_.trace.events;
    column("events", schema::time(), gather<double>(events, [](const Event& e) { return e.time; }));
    column("events", schema::kind(),
           gather<std::uint8_t>(events, [](const Event& e) { return static_cast<std::uint8_t>(e.kind); }));
    write_sides<Event>("events", events);
    column("events", schema::impulse(), gather<double>(events, [](const Event& e) { return e.impulse; }));
    column("events", schema::position(), vectors(events, [](const Event& e) { return e.p_W; }));
  }

  void write_phases() {
    const std::vector<ContactPhase>& phases = replay_.trace.phases;
    const auto numbers = [&](const Spec& spec, double ContactPhase::*member) {
      column("phases", spec, gather<double>(phases, [&](const ContactPhase& p) { return p.*member; }));
    };
    numbers(schema::begin(), &ContactPhase::begin);
    numbers(schema::end(), &ContactPhase::end);
    write_sides<ContactPhase>("phases", phases);
    numbers(schema::peak(), &ContactPhase::peak);
    numbers(schema::impulse(), &ContactPhase::impulse);
    numbers(schema::share("slip"), &ContactPhase::slip);
    numbers(schema::share("roll"), &ContactPhase::roll);
  }

  /// a, b and their features.
  template <class Item>
  void write_sides(const char* group, const std::vector<Item>& items) {
    column(group, schema::collider("a"), gather<std::int32_t>(items, [](const Item& i) { return i.a; }));
    column(group, schema::collider("b"), gather<std::int32_t>(items, [](const Item& i) { return i.b; }));
    const auto byte = [](Feature feature) { return static_cast<std::uint8_t>(feature); };
    column(group, schema::feature("feature_a"),
           gather<std::uint8_t>(items, [&](const Item& i) { return byte(i.feature_a); }));
    column(group, schema::feature("feature_b"),
           gather<std::uint8_t>(items, [&](const Item& i) { return byte(i.feature_b); }));
  }

  void write_requirements() {
    strings("requirements/name", replay_.requirements, &ReplayedRequirement::name);
    strings("requirements/description", replay_.requirements, &ReplayedRequirement::description);
    strings("requirements/unit", replay_.requirements, &ReplayedRequirement::unit);
    const auto byte = [](const ReplayedRequirement& r) { return std::uint8_t{r.measure}; };
    column("requirements", {"measure", Type::u8}, gather<std::uint8_t>(replay_.requirements, byte));
    std::vector<std::string> kept;
    for (std::size_t i = 0; i < replay_.requirements.size(); ++i) kept.push_back(replay_.kept(i));
    hdf5::write_strings(file_, "requirements/kept", kept);
    column("requirements", {"margin"}, replay_.trace.margins);
    column("requirements", {"first_violation", Type::f64, false, 1, "s"}, replay_.trace.first_violations);
    hdf5::write_strings(file_, "requirements/margin_culprit", culprits(replay_.trace.margin_parts));
    hdf5::write_strings(file_, "requirements/violation_culprit", culprits(replay_.trace.violation_parts));
    column("requirements", {"from", Type::f64, false, 1, "s"},
           gather<double>(replay_.requirements, [](const ReplayedRequirement& r) { return r.from; }));
    column("requirements", {"to", Type::f64, false, 1, "s"},
           gather<double>(replay_.requirements, [](const ReplayedRequirement& r) { return r.to; }));
  }

  std::vector<std::string> culprits(const std::vector<int>& parts) const {
    std::vector<std::string> out(replay_.requirements.size());
    for (std::size_t i = 0; i < std::min(out.size(), parts.size()); ++i) {
      out[i] = culprit_text(static_cast<int>(i), {-1, parts[i]}, replay_.info);
    }
    return out;
  }

  void write_parameters() {
    const auto& parameters = replay_.parameters;
    using Parameter = ReplayedParameter;
    strings("parameters/name", parameters, &Parameter::name);
    strings("parameters/unit", parameters, &Parameter::unit);
    strings("parameters/distribution", parameters, &Parameter::distribution);
    strings("parameters/nominal_label", parameters, &Parameter::nominal_label);
    strings("parameters/value_label", parameters, &Parameter::value_label);
    column("parameters", {"nominal"}, gather<double>(parameters, [](const Parameter& p) { return p.nominal; }));
    column("parameters", {"value"}, gather<double>(parameters, [](const Parameter& p) { return p.value; }));
    column("parameters", {"deviations"}, gather<double>(parameters, [](const Parameter& p) { return p.deviations; }));
  }

  void write_derived() {
    const auto& derived = replay_.derived;
    strings("derived/name", derived, &ReplayedNumber::name);
    strings("derived/unit", derived, &ReplayedNumber::unit);
    column("derived", {"nominal"}, gather<double>(derived, [](const ReplayedNumber& n) { return n.nominal; }));
    column("derived", {"value"}, gather<double>(derived, [](const ReplayedNumber& n) { return n.value; }));
  }

  template <class T>
  void column(const std::string& group, const Spec& spec, const std::vector<T>& data) {
    if (spec.matrix && spec.width == 0) {  // no columns: still a row per frame
      hdf5::Column::create(file_, group, spec, replay_.log.time.size(), 0);
    } else {
      hdf5::write_column(file_, group, spec, data, kReplayDeflate);
    }
  }

  template <class Item>
  void strings(const std::string& path, const std::vector<Item>& items, std::string Item::*member) {
    std::vector<std::string> texts;
    for (const Item& item : items) texts.push_back(item.*member);
    hdf5::write_strings(file_, path, texts);
  }

  template <class T, class Item, class Get>
  static std::vector<T> gather(const std::vector<Item>& items, const Get& get) {
    std::vector<T> out;
    out.reserve(items.size());
    for (const Item& item : items) out.push_back(get(item));
    return out;
  }

  template <class Item, class Get>
  static std::vector<double> vectors(const std::vector<Item>& items, const Get& get) {
    std::vector<double> out;
    for (const Item& item : items) {
      const Vec3 vector = get(item);
      out.insert(out.end(), vector.data(), vector.data() + 3);
    }
    return out;
  }

  const ReplayFile& replay_;
  const hid_t file_;
};

}  // namespace

std::string ReplayFile::kept(std::size_t i) const {
  if (!requirements[i].measure || trace.outcome == Outcome::invalid) return "";
  return kept_name(kept_by(info.requirements.at(i), trace.margins.at(i), trace.outcome, trace.end_time, info));
}

std::vector<std::filesystem::path> replay_files(const std::filesystem::path& output) {
  check_ending(output, "a replay is exported as one HDF5 file or as several CSV files", {".h5", ".hdf5", ".csv"},
               Endings::only);
  if (ending_of(output) != ".csv") return {output};
  std::vector<std::filesystem::path> files = {output};
  for (const char* what :
       {".contacts.csv", ".events.csv", ".phases.csv", ".parameters.csv", ".derived.csv", ".trace.csv"}) {
    files.push_back(std::filesystem::path(output).replace_extension(what));
  }
  return files;
}

void check_replay_output(const std::filesystem::path& output, bool force, const std::filesystem::path& archive,
                         const std::vector<std::filesystem::path>& inputs) {
  std::vector<std::filesystem::path> made_of = {archive};
  made_of.insert(made_of.end(), inputs.begin(), inputs.end());
  for (const auto& file : replay_files(output)) check_new_file(file, force, made_of);
}

void write_replay(const ReplayFile& replay, const std::filesystem::path& output, bool force) {
  const std::vector<std::filesystem::path> files = replay_files(output);
  files.size() == 1 ? write_replay_hdf5(replay, files[0], force) : write_replay_csv(replay, files, force);
}

void write_replay_hdf5(const ReplayFile& replay, const std::filesystem::path& file, bool force) {
  publish_hdf5(file, force, [&](const hdf5::Handle& out) { Hdf5Writer(replay, out.id()).write(); });
}

}  // namespace graze
