#include "archive/schema/info.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "archive/schema/schema.h"

namespace graze {
namespace {

using hdf5::Handle;

void write_format(const Handle& file, const char* format) {
  hdf5::write_attribute(file.id(), "format", std::string(format));
  hdf5::write_attribute(file.id(), "format_version", std::uint64_t{kArchiveFormatVersion});
}

/// Root attribute; empty: the file is none of this program's.
std::string format_of(const Handle& file) {
  const bool ours = hdf5::has_attribute(file.id(), "format") && hdf5::has_attribute(file.id(), "format_version");
  return ours ? hdf5::read_text(file.id(), "format") : "";
}

constexpr const char* kUnconverged = "unconverged_limit";  // absent from older archives
constexpr const char* kOnlyShard = "is one shard of a campaign; give the campaign's directory";
constexpr const char* kOnlyReplay = "is what graze replay has exported, one trace and no archive";

void check_format(const Handle& file, const std::string& wanted) {
  const std::string found = format_of(file);
  if (found == kReplayFormat) throw hdf5::Error(kOnlyReplay);
  if (found != kCampaignFormat && found != kShardFormat) throw hdf5::Error("is not a Graze archive");
  if (const std::string newer = newer_format(file); !newer.empty()) throw hdf5::Error(newer);
  if (hdf5::read_count(file.id(), "format_version") == 0) throw hdf5::Error("has format_version 0; they begin with 1");
  if (found != wanted) {
    throw hdf5::Error(found == kShardFormat ? kOnlyShard : "is a whole campaign where one of its shards is expected");
  }
}

/// A member of each row of a table as a list of strings.
template <class Row>
std::vector<std::string> member(const std::vector<Row>& rows, std::string Row::*field) {
  std::vector<std::string> out;
  for (const Row& row : rows) out.push_back(row.*field);
  return out;
}

template <class Row>
void read_member(const Handle& file, const std::string& path, std::vector<Row>& rows, std::string Row::*field) {
  std::vector<std::string> texts = hdf5::read_strings(file.id(), path);
  if (texts.size() != rows.size()) throw hdf5::Error("dataset '" + path + "' is not as long as its neighbours");
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].*field = std::move(texts[i]);
}

const hdf5::Spec kMeasure{"measure", hdf5::Type::u8};
const hdf5::Spec kFrom{"from", hdf5::Type::f64, false, 1, "s"};
const hdf5::Spec kTo{"to", hdf5::Type::f64, false, 1, "s"};
const hdf5::Spec kNominal{"nominal", hdf5::Type::f64};
const hdf5::Spec kLabelOffset{"label_offset", hdf5::Type::u64};

using Parameter = CampaignInfo::ParameterRow;
using RequirementRow = CampaignInfo::RequirementRow;

void write_parameters(const Handle& file, const std::vector<Parameter>& rows) {
  hdf5::write_strings(file.id(), "parameters/name", member(rows, &Parameter::name));
  hdf5::write_strings(file.id(), "parameters/unit", member(rows, &Parameter::unit));
  hdf5::write_strings(file.id(), "parameters/distribution", member(rows, &Parameter::distribution));
  hdf5::write_strings(file.id(), "parameters/jitter", member(rows, &Parameter::jitter));
  std::vector<double> nominal;
  std::vector<std::uint64_t> offset = {0};
  std::vector<std::string> labels;
  for (const Parameter& row : rows) {
    nominal.push_back(row.nominal);
    labels.insert(labels.end(), row.labels.begin(), row.labels.end());
    offset.push_back(labels.size());
  }
  hdf5::write_column(file.id(), "parameters", kNominal, nominal, 0);
  hdf5::write_column(file.id(), "parameters", kLabelOffset, offset, 0);
  hdf5::write_strings(file.id(), "parameters/labels", labels);
}

std::vector<Parameter> read_parameters(const Handle& file, std::uint64_t file_bytes) {
  const auto nominal = hdf5::read_column<double>(file.id(), "parameters", kNominal, file_bytes);
  const auto offset = hdf5::read_column<std::uint64_t>(file.id(), "parameters", kLabelOffset, file_bytes);
  const auto labels = hdf5::read_strings(file.id(), "parameters/labels");
  if (offset.size() != nominal.size() + 1 || offset.front() != 0 || offset.back() != labels.size() ||
      !std::is_sorted(offset.begin(), offset.end())) {
    throw hdf5::Error("dataset 'parameters/label_offset' does not divide the labels");
  }
  std::vector<Parameter> rows(nominal.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].nominal = nominal[i];
    rows[i].labels.assign(labels.begin() + static_cast<std::ptrdiff_t>(offset[i]),
                          labels.begin() + static_cast<std::ptrdiff_t>(offset[i + 1]));
  }
  read_member(file, "parameters/name", rows, &Parameter::name);
  read_member(file, "parameters/unit", rows, &Parameter::unit);
  read_member(file, "parameters/distribution", rows, &Parameter::distribution);
  read_member(file, "parameters/jitter", rows, &Parameter::jitter);
  return rows;
}

/// Root attributes by name, so that writing and reading cannot differ.
template <class Info, class Do>
void each_text(Info& info, const Do& act) {
  act("scenario_name", info.scenario_name);
  act("scenario", info.scenario_text);
  act("scenario_sha256", info.scenario_sha256);
  act("command_line", info.command_line);
  act("start_time", info.start_time);
  act("program_version", info.program_version);
  act("program_revision", info.program_revision);
  act("physics", info.physics);
  act("design", info.design);
  act("objective", info.objective);
}

const hdf5::Spec kInputOffset{"offset", hdf5::Type::u64};
const hdf5::Spec kInputBytes{"bytes", hdf5::Type::u8};
/// Of meshes, which are most of it, level 6 leaves 3 % less and takes 1.7 times as long.
constexpr int kInputDeflate = 1;

/// The files one behind the other, and where each begins.
void write_source(const Handle& file, const ScenarioSource& source) {
  const hid_t root = file.id();
  hdf5::write_attribute(root, "source_file", source.file);
  hdf5::write_attribute(root, "source_folder", source.folder);
  hdf5::write_attribute(root, "source_ignores_missing_meshes", std::uint64_t{source.options.ignore_missing_meshes});
  std::vector<std::string> keys, values, paths;
  for (const Override& one : source.options.overrides) keys.push_back(one.path), values.push_back(one.value);
  std::vector<std::uint64_t> offset = {0};
  std::vector<std::uint8_t> bytes;
  for (const auto& [path, content] : source.inputs) {
    paths.push_back(path);
    bytes.insert(bytes.end(), content.begin(), content.end());
    offset.push_back(bytes.size());
  }
  hdf5::write_strings(root, "inputs/set_path", keys);
  hdf5::write_strings(root, "inputs/set_value", values);
  hdf5::write_strings(root, "inputs/path", paths);
  hdf5::write_column(root, "inputs", kInputOffset, offset, 0);
  hdf5::write_column(root, "inputs", kInputBytes, bytes, kInputDeflate);
}

ScenarioSource read_source(const Handle& file, std::uint64_t file_bytes) {
  const hid_t root = file.id();
  ScenarioSource source;
  if (!hdf5::has_attribute(root, "source_file")) return source;
  source.file = hdf5::read_text(root, "source_file");
  source.folder = hdf5::read_text(root, "source_folder");
  source.options.ignore_missing_meshes = hdf5::read_count(root, "source_ignores_missing_meshes") != 0;
  const auto keys = hdf5::read_strings(root, "inputs/set_path"), values = hdf5::read_strings(root, "inputs/set_value");
  if (keys.size() != values.size()) throw hdf5::Error("dataset 'inputs/set_value' is not as long as its neighbours");
  for (std::size_t i = 0; i < keys.size(); ++i) source.options.overrides.push_back({keys[i], values[i]});
  const auto paths = hdf5::read_strings(root, "inputs/path");
  const auto offset = hdf5::read_column<std::uint64_t>(root, "inputs", kInputOffset, file_bytes);
  const auto bytes = hdf5::read_column<std::uint8_t>(root, "inputs", kInputBytes, file_bytes);
  if (offset.size() != paths.size() + 1 || offset.front() != 0 || offset.back() != bytes.size() ||
      !std::is_sorted(offset.begin(), offset.end())) {
    throw hdf5::Error("dataset 'inputs/offset' does not divide the bytes");
  }
  for (std::size_t i = 0; i < paths.size(); ++i) {
    source.inputs[paths[i]].assign(bytes.begin() + static_cast<std::ptrdiff_t>(offset[i]),
                                   bytes.begin() + static_cast<std::ptrdiff_t>(offset[i + 1]));
  }
  return source;
}

template <class Info, class Do>
void each_number(Info& info, const Do& act) {
  act("step", info.step);
  act("control", info.control);
  act("end", info.end);
}

void write_until(const Handle& file, const UntilInfo& until) {
  if (until.questions.empty()) return;
  const hid_t root = file.id();
  hdf5::write_attribute(root, "until", fmt::format("{}", fmt::join(until.questions, "\n")));
  hdf5::write_attribute(root, "until_confidence", until.confidence);
  hdf5::write_attribute(root, "until_most", until.most);
  hdf5::write_attribute(root, "until_least", until.least);
  hdf5::write_attribute(root, "until_answered_at", until.answered_at);
}

UntilInfo read_until(const Handle& file) {
  const hid_t root = file.id();
  UntilInfo until;
  if (!hdf5::has_attribute(root, "until")) return until;
  std::istringstream lines(hdf5::read_text(root, "until"));
  for (std::string line; std::getline(lines, line);) until.questions.push_back(line);
  until.confidence = hdf5::read_number(root, "until_confidence");
  if (!(until.confidence > 0 && until.confidence < 1)) throw hdf5::Error("until_confidence is not within (0, 1)");
  until.most = hdf5::read_count(root, "until_most");
  until.least = hdf5::read_count(root, "until_least");
  until.answered_at = hdf5::read_count(root, "until_answered_at");
  return until;
}

void write_part(const Handle& file, const ParticleRange& part) {
  if (part.end == 0) return;
  hdf5::write_attribute(file.id(), "part_begin", part.begin);
  hdf5::write_attribute(file.id(), "part_end", part.end);
}

ParticleRange read_part(const Handle& file, std::uint64_t particles) {
  if (!hdf5::has_attribute(file.id(), "part_end")) return {};
  const ParticleRange part = {hdf5::read_count(file.id(), "part_begin"), hdf5::read_count(file.id(), "part_end")};
  if (part.begin >= part.end || part.end > particles) throw hdf5::Error("part_end does not fit its campaign");
  return part;
}

/// Archives without measures do without the last three datasets.
void write_requirements(const Handle& file, const CampaignInfo& info) {
  const hid_t root = file.id();
  hdf5::write_strings(root, "requirements/name", member(info.requirements, &RequirementRow::name));
  hdf5::write_strings(root, "requirements/description", member(info.requirements, &RequirementRow::description));
  hdf5::write_strings(root, "requirements/unit", member(info.requirements, &RequirementRow::unit));
  if (info.deciding() == info.requirements.size()) return;
  std::vector<std::uint8_t> measure;
  std::vector<double> from, to;
  for (const RequirementRow& row : info.requirements) {
    measure.push_back(row.measure ? 1 : 0);
    from.push_back(row.window.from);
    to.push_back(row.window.to);
  }
  hdf5::write_column(root, "requirements", kMeasure, measure, 0);
  hdf5::write_column(root, "requirements", kFrom, from, 0);
  hdf5::write_column(root, "requirements", kTo, to, 0);
}

/// Older archives have none.
void read_windows(const Handle& file, std::uint64_t file_bytes, std::vector<RequirementRow>& rows) {
  if (!hdf5::exists(file.id(), "requirements/from")) return;
  const auto from = hdf5::read_column<double>(file.id(), "requirements", kFrom, file_bytes);
  const auto to = hdf5::read_column<double>(file.id(), "requirements", kTo, file_bytes);
  if (from.size() != rows.size() || to.size() != rows.size()) {
    throw hdf5::Error("datasets 'requirements/from' and 'to' do not fit their neighbours");
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].window = {from[i], to[i]};
}

std::vector<RequirementRow> read_requirements(const Handle& file, std::uint64_t file_bytes) {
  const hid_t root = file.id();
  std::vector<RequirementRow> rows(hdf5::read_strings(root, "requirements/name").size());
  read_member(file, "requirements/name", rows, &RequirementRow::name);
  read_member(file, "requirements/description", rows, &RequirementRow::description);
  read_member(file, "requirements/unit", rows, &RequirementRow::unit);
  if (!hdf5::exists(root, "requirements/measure")) return rows;
  const auto measure = hdf5::read_column<std::uint8_t>(root, "requirements", kMeasure, file_bytes);
  if (measure.size() != rows.size() || !std::is_sorted(measure.begin(), measure.end())) {
    throw hdf5::Error("dataset 'requirements/measure' does not fit its neighbours");
  }
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].measure = measure[i] != 0;
  read_windows(file, file_bytes, rows);
  return rows;
}

template <class Info, class Do>
void each_list(Info& info, const Do& act) {
  act("policies/name", info.policies);
  act("names/colliders", info.colliders);
  act("names/bodies", info.bodies);
  act("names/q", info.q_names);
  act("names/v", info.v_names);
  act("names/actuators", info.actuator_names);
}

bool is_path(const std::string& name) {
  for (std::size_t begin = 0;;) {
    const std::size_t end = name.find('/', begin);
    const std::string part = name.substr(begin, end == std::string::npos ? end : end - begin);
    if (part.empty() || part == "." || part == ".." || part.find('\0') != std::string::npos) return false;
    if (end == std::string::npos) return true;
    begin = end + 1;
  }
}

/// Throws unless the facts are such as a campaign has: everything else is reckoned with them.
void check_facts(const CampaignInfo& info) {
  for (const auto& [name, value] : {std::pair{"step", info.step}, {"control", info.control}, {"end", info.end}}) {
    if (value > 0 && std::isfinite(value)) continue;
    throw hdf5::Error(fmt::format("'{}' is {} s; it must be a time above 0", name, value));
  }
  if (!(info.unconverged >= 0 && info.unconverged <= 1)) {
    throw hdf5::Error(fmt::format("'{}' is {}; it must be a share of steps, 0 to 1", kUnconverged, info.unconverged));
  }
  constexpr std::uint64_t kMost = std::uint64_t{1} << 32;  // ids have 32 bits
  if (info.particles < 1 || info.particles > kMost) {
    throw hdf5::Error(fmt::format("'particles' is {}; a campaign has 1 to {}", info.particles, kMost));
  }
  static const std::vector<std::string> designs = {"random", "latin_hypercube", "sobol"};
  if (std::find(designs.begin(), designs.end(), info.design) == designs.end()) {
    throw hdf5::Error(fmt::format("'design' is '{}'; {}", info.design, nearest_or_all(info.design, designs)));
  }
  // Its name alone: an archive can be read by a program that has not the back end.
  if (info.physics.empty()) throw hdf5::Error("'physics' is ''; it must name the back end");
  try {
    check_policy_names(info.policies);
  } catch (const InputError& error) {
    throw hdf5::Error(error.what());
  }
}

}  // namespace

std::size_t CampaignInfo::deciding() const {
  return static_cast<std::size_t>(
      std::count_if(requirements.begin(), requirements.end(), [](const RequirementRow& row) { return !row.measure; }));
}

void check_policy_names(const std::vector<std::string>& policies) {
  for (const std::string& name : policies) {
    if (!is_path(name)) {
      throw InputError(
          fmt::format("policies: '{}' cannot name a group of the archive; parts between '/' must not be "
                      "empty, '.' or '..'",
                      name));
    }
    for (const std::string& other : policies) {
      if (&other != &name && (other == name || other.starts_with(name + "/"))) {
        throw InputError(fmt::format("policies: '{}' lies inside policy '{}'; rename one of them", other, name));
      }
    }
  }
}

void write_info_attributes(const Handle& file, const CampaignInfo& info, Layout layout, bool complete) {
  const hid_t root = file.id();
  write_format(file, kCampaignFormat);
  hdf5::write_attribute(root, "layout", std::string(layout == Layout::packed ? "packed" : "directory"));
  hdf5::write_attribute(root, "complete", std::uint64_t{complete});
  each_text(info, [&](const char* name, const std::string& text) { hdf5::write_attribute(root, name, text); });
  each_number(info, [&](const char* name, double value) { hdf5::write_attribute(root, name, value); });
  if (info.tells_convergence) hdf5::write_attribute(root, kUnconverged, info.unconverged);
  hdf5::write_attribute(root, "seed", info.seed);
  hdf5::write_attribute(root, "particles", info.particles);
  hdf5::write_attribute(root, "store_values", std::uint64_t{info.store_values});
  hdf5::write_attribute(root, "results_version", info.results_version);
  each_fact(info.build, [&](const char* name, const std::string& text) {
    if (!text.empty()) hdf5::write_attribute(root, name, text);
  });
  write_until(file, info.until);
  write_part(file, info.part);
}

void write_info(const Handle& file, const CampaignInfo& info, Layout layout, bool complete) {
  const hid_t root = file.id();
  write_info_attributes(file, info, layout, complete);
  each_list(info, [&](const char* path, const auto& list) { hdf5::write_strings(root, path, list); });
  write_parameters(file, info.parameters);
  write_source(file, info.source);
  write_requirements(file, info);
  hdf5::write_strings(root, "requirements/parts", member(info.requirements, &RequirementRow::parts));
  hdf5::write_strings(root, "objective/description", member(info.leaves, &RequirementRow::description));
  hdf5::write_strings(root, "objective/unit", member(info.leaves, &RequirementRow::unit));
  hdf5::write_strings(root, "objective/parts", member(info.leaves, &RequirementRow::parts));
  hdf5::write_strings(root, "names/links", info.links);
}

/// What culprits are numbers of; older archives have none of it.
void read_culprits(const Handle& file, CampaignInfo& info) {
  if (!hdf5::exists(file.id(), "names/links")) return;
  info.links = hdf5::read_strings(file.id(), "names/links");
  read_member(file, "requirements/parts", info.requirements, &RequirementRow::parts);
  info.leaves.resize(hdf5::read_strings(file.id(), "objective/parts").size());
  read_member(file, "objective/description", info.leaves, &RequirementRow::description);
  read_member(file, "objective/unit", info.leaves, &RequirementRow::unit);
  read_member(file, "objective/parts", info.leaves, &RequirementRow::parts);
}

StoredInfo read_info(const Handle& file) {
  check_format(file, kCampaignFormat);
  const hid_t root = file.id();
  hsize_t bytes = 0;
  hdf5::check(H5Fget_filesize(root, &bytes), "file size");
  StoredInfo stored;
  CampaignInfo& info = stored.info;
  stored.layout = hdf5::read_text(root, "layout") == "packed" ? Layout::packed : Layout::directory;
  stored.complete = hdf5::read_count(root, "complete") != 0;
  each_text(info, [&](const char* name, std::string& text) { text = hdf5::read_text(root, name); });
  each_number(info, [&](const char* name, double& value) { value = hdf5::read_number(root, name); });
  info.tells_convergence = hdf5::has_attribute(root, kUnconverged);
  if (info.tells_convergence) info.unconverged = hdf5::read_number(root, kUnconverged);
  info.seed = hdf5::read_count(root, "seed");
  info.particles = hdf5::read_count(root, "particles");
  info.store_values = hdf5::read_count(root, "store_values") != 0;
  each_list(info, [&](const char* path, auto& list) { list = hdf5::read_strings(root, path); });
  if (hdf5::has_attribute(root, "results_version")) info.results_version = hdf5::read_text(root, "results_version");
  each_fact(info.build, [&](const char* name, std::string& text) {
    if (hdf5::has_attribute(root, name)) text = hdf5::read_text(root, name);
  });
  check_facts(info);
  info.until = read_until(file);
  info.part = read_part(file, info.particles);
  info.source = read_source(file, bytes);
  info.parameters = read_parameters(file, bytes);
  info.requirements = read_requirements(file, bytes);
  read_culprits(file, info);
  return stored;
}

std::string why_no_campaign(const Handle& file) {
  const std::string found = format_of(file);
  if (found == kShardFormat) return kOnlyShard;
  if (found == kReplayFormat) return kOnlyReplay;
  if (found != kCampaignFormat) return "is not a Graze archive";
  return hdf5::read_text(file.id(), "layout") == "packed"
             ? ""
             : "only describes a campaign; give the directory that it lies in";
}

std::string newer_format(const Handle& file) {
  const std::string found = format_of(file);
  if (found != kCampaignFormat && found != kShardFormat) return "";
  const std::uint64_t version = hdf5::read_count(file.id(), "format_version");
  if (version <= kArchiveFormatVersion) return "";
  return fmt::format(
      "has format version {}, newer than version {}, the newest that this program reads; use a newer Graze", version,
      kArchiveFormatVersion);
}

void write_shard_identity(const Handle& file, const CampaignInfo& info) {
  write_format(file, kShardFormat);
  hdf5::write_attribute(file.id(), "scenario_sha256", info.scenario_sha256);
  hdf5::write_attribute(file.id(), "seed", info.seed);
}

void check_shard_identity(const Handle& file, const CampaignInfo& info) {
  check_format(file, kShardFormat);
  if (hdf5::read_text(file.id(), "scenario_sha256") != info.scenario_sha256 ||
      hdf5::read_count(file.id(), "seed") != info.seed) {
    throw hdf5::Error("belongs to another campaign: its scenario or seed differs");
  }
}

}  // namespace graze
