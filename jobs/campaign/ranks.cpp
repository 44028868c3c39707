#include "jobs/campaign/ranks.h"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "archive/directory/campaign_files.h"
#include "archive/directory/unfinished.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/campaign/crash.h"
#include "jobs/campaign/exit_code.h"
#include "jobs/campaign/signals.h"
#include "jobs/campaign/stopping_rule.h"
#include "jobs/workers/controllers.h"
#include "simulation/contained.h"

namespace graze {
namespace {

nlohmann::json packed(const std::vector<bool>& flags) {
  std::vector<std::uint8_t> bytes((flags.size() + 7) / 8);
  for (std::size_t i = 0; i < flags.size(); ++i) bytes[i / 8] |= static_cast<std::uint8_t>(flags[i] << (i % 8));
  return {{"size", flags.size()}, {"bits", nlohmann::json::binary(std::move(bytes))}};
}

std::vector<bool> unpacked(const nlohmann::json& json) {
  const std::vector<std::uint8_t>& bytes = json.at("bits").get_binary();
  std::vector<bool> flags(json.at("size").get<std::size_t>());
  for (std::size_t i = 0; i < flags.size(); ++i) flags[i] = bytes.at(i / 8) >> (i % 8) & 1;
  return flags;
}

/// The policies of a campaign, in its order, out of its scenario's.
Scenario with_policies_of(const CampaignInfo& info, Scenario scenario) {
  std::erase_if(scenario.policies, [&](const PolicySpec& policy) {
    return std::find(info.policies.begin(), info.policies.end(), policy.name) == info.policies.end();
  });
  return scenario;
}

/// All that a rank other than 0 works with.
class Part {
 public:
  Part(Communicator& comm, const Briefing& briefing, int threads)
      : comm_(comm),
        info_(read_description(std::filesystem::path(briefing.directory))),
        archived_(briefing.directory, info_, "other ranks cannot read it"),
        scenario_(with_policies_of(info_, archived_.scenario())),
        writer_(briefing.directory, info_, CampaignMember{comm.rank(), briefing.shards, comm.size()}) {
    finished_.done = briefing.finished;
    set_out(options_, writer_, finished_);
    options_.particles = briefing.particles;
    options_.part = info_.part;
    options_.seed = info_.seed;
    options_.threads = threads;
    options_.workers = briefing.workers;
    options_.watchdog = briefing.watchdog;
    if (!info_.until.questions.empty()) options_.stopping_rule = &stopping_rule_.emplace(comm, info_);
  }
  CampaignEnd run() { return run_share(scenario_, options_, comm_, writer_); }

 private:
  Communicator& comm_;
  const CampaignInfo info_;
  const ArchivedScenario archived_;
  const Scenario scenario_;
  FinishedTraces finished_;
  CampaignOptions options_;
  std::optional<StoppingRule> stopping_rule_;
  CampaignWriter writer_;
};

/// Says what this rank failed at.
ExitCode tell(const Communicator& comm, const CampaignEnd& end) {
  if (!end.error) return kDone;  // what is unfinished is told by rank 0
  try {
    std::rethrow_exception(end.error);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("graze: {}: {}\n", rank_name(comm), error.what()) << std::flush;
  }
  return kMachineFailed;
}

}  // namespace

std::string Briefing::to_text() const {
  nlohmann::json json = {{"directory", directory},
                         {"particles", particles},
                         {"workers", workers},
                         {"watchdog", watchdog},
                         {"shards", shards}};
  json["finished"] = nlohmann::json::object();
  for (const auto& [policy, flags] : finished) json["finished"][policy] = packed(flags);
  const std::vector<std::uint8_t> bytes = nlohmann::json::to_msgpack(json);
  return {bytes.begin(), bytes.end()};
}

Briefing Briefing::from_text(const std::string& text) {
  const nlohmann::json json = nlohmann::json::from_msgpack(text.begin(), text.end());
  Briefing out{json.at("directory"), json.at("particles"), json.at("workers"),
               json.at("watchdog"),  json.at("shards"),    {}};
  for (const auto& [policy, flags] : json.at("finished").items()) out.finished[policy] = unpacked(flags);
  return out;
}

Start::~Start() {
  if (!given_ && comm_.size() > 1) comm_.broadcast("");
}

void Start::give(const Briefing& briefing) {
  given_ = true;
  if (comm_.size() > 1) comm_.broadcast(briefing.to_text());
}

void set_out(CampaignOptions& options, CampaignWriter& writer, const FinishedTraces& finished) {
  const bool trust = controllers_trusted();  // whoever goes on has to say it again
  options.stop = &heed_signals(writer.directory().string(), trust);
  contain_crashes(writer.directory().string(), trust);
  options.finished = finished.count;
  options.is_finished = [&finished](const std::string& policy, std::uint64_t particle) {
    return finished.has(policy, particle);
  };
  options.unfinished = [&writer](const std::string& policy, const UnfinishedParticle& particle) {
    writer.add_unfinished({policy, particle.particle, particle.reason, particle.by_controller});
  };
}

CampaignEnd run_share(const Scenario& scenario, const CampaignOptions& options, Communicator& comm,
                      CampaignWriter& writer) {
  CampaignEnd end = run_campaign(scenario, options, comm,
                                 [&](int policy, std::vector<TraceRecord> traces, std::vector<double> values) {
                                   writer.append(policy, std::move(traces), std::move(values));
                                 });
  try {
    if (!end.error) writer.flush();
  } catch (...) {
    end.error = std::current_exception();
  }
  end.runs.clear();
  return end;
}

CampaignEnd together(Communicator& comm, const std::function<CampaignEnd()>& share) {
  CampaignEnd end;
  try {
    end = share();
  } catch (...) {
    end.error = std::current_exception();
    stop_all(comm);
  }
  if (end.error) comm.fetch_add(kFailedRanks, 1);
  comm.barrier();
  return end;
}

int assist(Communicator& comm, int threads) {
  const std::string text = comm.broadcast("");
  if (text.empty()) return kDone;  // rank 0 says why
  std::unique_ptr<Part> part;
  const CampaignEnd end = together(comm, [&] {
    part = std::make_unique<Part>(comm, Briefing::from_text(text), threads);
    return part->run();
  });
  const ExitCode code = tell(comm, end);
  if (!end.hanging.empty()) leave_hanging(comm, code);
  return code;
}

void leave_hanging(Communicator& comm, int exit_code) {
  std::fflush(nullptr);
  comm.leave();
  std::_Exit(exit_code);
}

}  // namespace graze
