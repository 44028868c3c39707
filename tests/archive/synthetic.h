#pragma once
// Campaigns without a simulation: records whose every field follows from (policy, particle), so that a test knows what
// an archive must give back.

#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "archive/archive.h"
#include "sampling/stream.h"

namespace graze::synthetic {

/// A directory that is removed at the end of the test.
class Folder {
 public:
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "graze-test-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// A reproducible uniform in (0,1) for a place in a record.
inline double draw(int policy, std::uint32_t particle, std::uint32_t place) {
  return uniform(7, particle, static_cast<std::uint64_t>(policy) + 1, place);
}

inline CampaignInfo info(std::uint64_t particles = 40) {
  CampaignInfo info;
  info.scenario_name = "Quadruped and curb: α = 3 cm";
  info.scenario_text = "graze: 1\nname: synthetic\n" + std::string(100'000, '#');  // larger than 64 kB
  info.scenario_sha256 = std::string(64, 'a');
  info.command_line = "graze run synthetic.yaml -n 40";
  info.start_time = "2026-01-02T03:04:05Z";
  info.program_version = "0.1.0";
  info.program_revision = "0123456789ab";
  info.build = {"GCC 1.2.3", "glibc 4.5", "6.7.8", "9.10", "-O3", "x86_64, avx2"};
  info.physics = "bullet";
  info.design = "random";
  info.seed = 0xFFFFFFFFFFFFFFF0;
  info.particles = particles;
  info.step = 0.001;
  info.control = 0.002;
  info.end = 1.5;
  info.parameters = {{"robot.link.LF_SHIN.length", "m", "normal(mean=0.1, std=0.0025)", "", 0.1, {}},
                     {"contact.model", "1", "choice(2)", "", 0, {"complementarity", "complementarity_free"}},
                     {"control.lag", "s", "uniform(min=0, max=0.01)", "normal(mean=0, std=0.0003)", 0.005, {}}};
  info.requirements = {{"upright", "tilt of BODY0 below 90 deg", "rad"},
                       {"clears-curb", "no contact", "m", false, "pairs"}};
  info.leaves = {{"", "height of BODY0", "m"}, {"", "place of the feet", "m", false, "links"}};
  info.objective = "crossed";
  info.policies = {"step/1cm", "step/4cm", "hold"};
  info.colliders = {"LF_FOOT", "curb", "ground"};
  info.bodies = {"BODY0", "LF_SHIN"};
  info.links = {"BODY0", "LF_SHIN", "LF_FOOT"};
  info.q_names = {"base.qw", "base.x", "LF_X_1"};
  info.v_names = {"base.wx", "LF_X_1"};
  info.actuator_names = {"LF_X_1"};
  return info;
}

inline std::vector<double> row(int policy, std::uint32_t particle, std::uint32_t place, std::size_t width) {
  std::vector<double> values;
  for (std::size_t i = 0; i < width; ++i) {
    values.push_back(draw(policy, particle, place + static_cast<std::uint32_t>(i)));
  }
  return values;
}

inline Event event(int policy, std::uint32_t particle, std::uint32_t number) {
  Event event;
  event.time = 0.01 * number;
  event.kind = static_cast<EventKind>(number % 10);
  const bool limit = event.kind == EventKind::limit_begin || event.kind == EventKind::limit_end;
  event.a = limit ? 1 : 0;
  event.b = limit ? -1 : 1 + static_cast<int>(number % 2);
  event.feature_a = Feature::surface;
  event.feature_b = static_cast<Feature>(number % 8);
  event.impulse = draw(policy, particle, 100 + number);
  event.p_W = Vec3(number, draw(policy, particle, 200 + number), -1);
  return event;
}

inline ContactPhase phase(int policy, std::uint32_t particle, std::uint32_t index) {
  ContactPhase out;
  out.begin = 0.1 * index + 0.01 * draw(policy, particle, 600 + index);
  out.end = out.begin + 0.05 * draw(policy, particle, 700 + index);
  out.a = static_cast<int>(index % 2);
  out.b = 2;
  out.feature_b = static_cast<Feature>((particle + index) % 8);
  out.peak = draw(policy, particle, 800 + index);
  out.impulse = 2 * out.peak;
  out.slip = 0.5 * draw(policy, particle, 900 + index);
  out.roll = 0.25;
  return out;
}

/// Success, known, unknown failure and invalid in proportions that differ between policies.
inline TraceRecord trace(const CampaignInfo& info, int policy, std::uint32_t particle) {
  TraceRecord record;
  record.particle = particle;
  const double fate = draw(policy, particle, 0);
  record.outcome = fate < 0.2 + 0.2 * policy ? Outcome::success
                   : fate < 0.8              ? Outcome::known_failure
                   : fate < 0.95             ? Outcome::unknown_failure
                                             : Outcome::invalid;
  if (record.outcome == Outcome::known_failure) record.violated = fate < 0.7 ? 1 : 0;
  record.end_time = 1.5 * draw(policy, particle, 1);
  record.solver = {draw(policy, particle, 300), 7,
                   1e-7 * (particle + 1),       particle % 3 + 0.0,
                   100 + 2.0 * particle,        particle % 3 > 0 ? 1e-8 * (particle + 1) : 0.0,
                   particle % 2 + 0.0,          1 / (2.0 + particle % 100)};
  record.objective_margin = record.outcome == Outcome::success ? 0.5 : -0.5;
  record.margins = row(policy, particle, 10, info.requirements.size());
  record.first_violations.assign(info.requirements.size(), std::numeric_limits<double>::quiet_NaN());
  if (record.violated >= 0) record.first_violations[record.violated] = record.end_time;
  record.margin_parts = {kNoPart, 1 + static_cast<int>(particle % 2)};  // LF_FOOT and curb, LF_FOOT and ground
  record.margin_parts.resize(info.requirements.size(), kNoPart);
  record.violation_parts = {kNoPart, record.violated == 1 ? 2 : kNoPart};
  record.violation_parts.resize(info.requirements.size(), kNoPart);
  if (record.outcome != Outcome::invalid) record.objective_culprit = {1, static_cast<int>(particle % 3)};
  record.q = row(policy, particle, 20, info.q_names.size());
  record.v = row(policy, particle, 30, info.v_names.size());
  std::memcpy(&record.digest, &record.end_time, 8);
  if (particle % 4 != 3) record.sequence = "LF_FOOT-ground LF_FOOT-curb.side µ" + std::to_string(particle % 5);
  if (record.outcome == Outcome::invalid) record.invalid_reason = "state is not finite after step 12";
  for (std::uint32_t i = 0; i < (particle * 7 + static_cast<std::uint32_t>(policy)) % 9; ++i) {
    record.events.push_back(event(policy, particle, i));
  }
  for (std::uint32_t i = 0; i < (particle * 5 + static_cast<std::uint32_t>(policy)) % 7; ++i) {
    record.phases.push_back(phase(policy, particle, i));
  }
  for (std::uint32_t i = 0; i < (record.outcome == Outcome::unknown_failure ? 5 + particle % 3 : 0); ++i) {
    record.telemetry.add({0.01 * i, row(policy, particle, 1000 + 10 * i, info.q_names.size()),
                          row(policy, particle, 2000 + 10 * i, info.v_names.size()),
                          row(policy, particle, 3000 + 10 * i, info.actuator_names.size())});
  }
  return record;
}

inline std::vector<double> values(const CampaignInfo& info, std::uint32_t particle) {
  return row(99, particle, 0, info.parameters.size());
}

/// The traces of some particles under a policy, and their values.
struct Block {
  std::vector<TraceRecord> traces;
  std::vector<double> values;
};

inline Block block(const CampaignInfo& info, int policy, const std::vector<std::uint32_t>& particles) {
  Block out;
  for (const std::uint32_t particle : particles) {
    out.traces.push_back(trace(info, policy, particle));
    const auto drawn = values(info, particle);
    out.values.insert(out.values.end(), drawn.begin(), drawn.end());
  }
  return out;
}

/// Particles first … last - 1.
inline std::vector<std::uint32_t> range(std::uint32_t first, std::uint32_t last) {
  std::vector<std::uint32_t> ids;
  for (std::uint32_t id = first; id < last; ++id) ids.push_back(id);
  return ids;
}

/// A campaign of info.particles particles, all policies, in blocks of 8.
inline void write(const std::filesystem::path& directory, const CampaignInfo& info, bool complete = true) {
  CampaignWriter writer(directory, info, false);
  for (std::uint32_t first = 0; first < info.particles; first += 8) {
    for (int policy = 0; policy < static_cast<int>(info.policies.size()); ++policy) {
      const auto last = static_cast<std::uint32_t>(std::min<std::uint64_t>(info.particles, first + 8));
      Block one = block(info, policy, range(first, last));
      writer.append(policy, std::move(one.traces), std::move(one.values));
    }
  }
  writer.finish(complete);
}

}  // namespace graze::synthetic
