// Makes the seed corpus of the archive target: packed campaigns of a few traces, one empty, one with everything in it.
// usage: archive_seeds FOLDER

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>

#include "archive/archive.h"
#include "jobs/campaign/describe_campaign.h"

namespace {

namespace fs = std::filesystem;

/// The same wherever the seeds are made.
void forget_place(graze::ScenarioSource& source) {
  const std::string root = GRAZE_SOURCE_DIR;
  const auto moved = [&](const std::string& path) {
    return path.compare(0, root.size(), root) == 0 ? "/graze" + path.substr(root.size()) : path;
  };
  graze::InputFiles inputs;
  for (auto& [path, content] : source.inputs) inputs[moved(path)] = std::move(content);
  source.inputs = std::move(inputs);
  source.file = moved(source.file);
  source.folder = "/graze";
}

graze::CampaignInfo campaign(const std::string& seed) {
  const std::string file = GRAZE_SOURCE_DIR "/tests/fuzz/corpus/scenario/" + seed;
  graze::CampaignInfo info = graze::describe_campaign(graze::load_scenario(file), 3, "graze run " + seed);
  info.start_time = "2000-01-01T00:00:00Z";  // so that the seeds do not change with the day or the revision
  info.program_revision = "seed";
  forget_place(info.source);
  info.policies.resize(1);  // each costs 40 kB
  return info;
}

graze::TraceRecord trace(const graze::CampaignInfo& info, std::uint32_t particle) {
  graze::TraceRecord out;
  out.particle = particle;
  out.outcome = static_cast<graze::Outcome>(particle % 4);
  out.violated = out.outcome == graze::Outcome::known_failure ? 0 : -1;
  out.end_time = 0.5;
  out.objective_margin = out.outcome == graze::Outcome::success ? 0.5 : -0.5;
  out.margins.assign(info.requirements.size(), 0.25);
  out.first_violations.assign(info.requirements.size(), std::numeric_limits<double>::quiet_NaN());
  if (out.violated == 0) out.margins[0] = -0.25, out.first_violations[0] = out.end_time;
  out.q.assign(info.q_names.size(), 0.5);
  out.v.assign(info.v_names.size(), 0.0);
  out.digest = 1000 + particle;
  out.sequence = "L_foot-ground";
  out.events.assign(particle, graze::Event{.time = 0.1, .b = 1});
  const graze::TelemetryFrame frame{0.0, out.q, out.v, std::vector<double>(info.actuator_names.size(), 0.0)};
  for (std::uint32_t i = 0; i < particle; ++i) out.telemetry.add(frame);
  return out;
}

void make(const fs::path& file, const std::string& seed, std::uint32_t traces) {
  const graze::CampaignInfo info = campaign(seed);
  const fs::path folder = fs::temp_directory_path() / ("graze_seed_" + std::to_string(getpid()));
  {
    graze::CampaignWriter writer(folder, info, true);
    for (std::size_t policy = 0; policy < info.policies.size() && traces > 0; ++policy) {
      std::vector<graze::TraceRecord> records;
      for (std::uint32_t i = 0; i < traces; ++i) records.push_back(trace(info, i));
      writer.append(static_cast<int>(policy), records, std::vector<double>(traces * info.parameters.size(), 1.5));
    }
    writer.finish();
  }
  graze::pack(folder, file, true);
  fs::remove_all(folder);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: archive_seeds FOLDER\n";
    return 2;
  }
  const fs::path folder = argv[1];
  make(folder / "empty.h5", "least.yaml", 0);
  make(folder / "full.h5", "full.yaml", 3);
  return 0;
}
