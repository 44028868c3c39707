#include "jobs/cli/size_estimate.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "archive/archive.h"
#include "jobs/cli/progress.h"
#include "simulation/block_run.h"
#include "simulation/particles.h"

namespace graze {
namespace {

constexpr double kEventBytes = 51;        // columns of /events, plain
constexpr double kEventsPerSecond = 450;  // the curb's, as a guess for others; --probe measures
constexpr double kPhaseBytes = 58;        // columns of /phases, plain
constexpr double kPhasesPerSecond = 25;   // the curb's
constexpr double kSequenceBytes = 20;     // of a contact sequence, per phase: two names
constexpr double kTraceBytes = 4 + 1 + 4 + 8 + 8 + 64 + 8 + 4 + 4 + 8 + 16;  // columns that all have, offsets

double row_bytes(const Scenario& s) {
  return kTraceBytes + 8.0 * (3 * static_cast<double>(s.task.requirements.size()) + s.model.nq + s.model.nv);
}

double frame_bytes(const Scenario& s) { return 8.0 * (1 + s.model.nq + s.model.nv + s.model.na()); }

/// Frames of a trace of full length, on average over traces of which half fail.
double frames_per_trace(const Scenario& s) {
  const double all = s.timing.end / (s.timing.step * s.recording.every) + 1;
  const double last = std::min(all, s.recording.last / (s.timing.step * s.recording.every) + 1);
  switch (s.recording.telemetry) {
    case Telemetry::none:
      return 0;
    case Telemetry::failures:
      return all / 2;
    case Telemetry::last:
      return last / 2;
    case Telemetry::all:
      return all;
  }
  return 0;
}

SizeEstimate base(const Scenario& s, const ParticleRange& part) {
  SizeEstimate out;
  out.particles = part.count(s.particles);
  out.policies = s.policies.size();
  out.logs_events = s.recording.events;
  if (s.space.size() > 0)
    out.values = static_cast<double>(out.particles) * (4 + 8 * static_cast<double>(s.space.size()));
  out.traces = static_cast<double>(out.particles * out.policies) * row_bytes(s);
  constexpr double kDescriptions = 2;  // campaign.h5 and its copy, which compress what they hold
  for (const auto& [name, content] : s.source.inputs) out.inputs += kDescriptions * static_cast<double>(content.size());
  return out;
}

}  // namespace

SizeEstimate estimate_size(const Scenario& s, const ParticleRange& part) {
  SizeEstimate out = base(s, part);
  const double traces = static_cast<double>(out.particles * out.policies);
  if (!s.model.pairs.empty()) {
    out.events = traces * s.timing.end *
                 (kPhasesPerSecond * (kSequenceBytes + (s.recording.phases ? kPhaseBytes : 0)) +
                  (s.recording.events ? kEventsPerSecond * kEventBytes : 0));
  }
  out.telemetry = traces * frames_per_trace(s) * frame_bytes(s);
  return out;
}

SizeEstimate probe_size(const Scenario& s) {
  SizeEstimate out = base(s, {});
  const ParticleSource source(s, s.seed, s.particles);
  const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(kLanes, s.particles));
  std::vector<Particle> particles;
  for (std::uint32_t id = 0; id < count; ++id) {
    try {
      particles.push_back(source.fabricate(id, source.draw(id)));
    } catch (const InputError&) {
      // Becomes an invalid trace in the campaign, with next to no bytes.
    }
  }
  RunCost cost;
  const auto begin = std::chrono::steady_clock::now();
  for (const PolicySpec& policy : s.policies) {
    BlockRun run(s, policy, s.seed);
    for (const TraceRecord& trace : run.run(particles, &cost)) {
      out.events += kEventBytes * static_cast<double>(trace.events.size()) +
                    kPhaseBytes * static_cast<double>(trace.phases.size()) + static_cast<double>(trace.sequence.size());
      out.telemetry += frame_bytes(s) * static_cast<double>(trace.telemetry.size());
      ++out.probed;
    }
  }
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double share = static_cast<double>(out.particles) / std::max(1u, count);
  out.events *= share;
  out.telemetry *= share;
  out.seconds = elapsed * share;
  out.step_seconds = elapsed / static_cast<double>(std::max<std::uint64_t>(1, cost.steps));
  return out;
}

std::optional<double> free_bytes(const std::filesystem::path& archive) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path place = fs::absolute(archive, error);
  while (!place.empty() && !fs::is_directory(place, error) && place.has_relative_path()) place = place.parent_path();
  const fs::space_info space = fs::space(place, error);
  if (error || space.available == static_cast<std::uintmax_t>(-1)) return std::nullopt;
  return static_cast<double>(space.available);
}

std::string bytes_text(double bytes) {
  constexpr std::array units = {"B", "kB", "MB", "GB", "TB", "PB"};
  std::size_t unit = 0;
  for (; bytes >= 999.5 && unit + 1 < units.size(); ++unit) bytes /= 1000;
  return fmt::format("{:.{}f} {}", bytes, bytes < 9.95 && unit > 0 ? 1 : 0, units[unit]);
}

std::string size_text(const SizeEstimate& e, std::optional<double> free) {
  std::string out = fmt::format(
      "{}{} for {} particles x {} {}: values {}, traces {}, {} {}, telemetry {}, "
      "scenario and robot {} at most",
      e.probed > 0 ? "" : "about ", bytes_text(e.total()), e.particles, e.policies,
      e.policies == 1 ? "policy" : "policies", bytes_text(e.values), bytes_text(e.traces),
      e.logs_events ? "contacts and events" : "contacts", bytes_text(e.events), bytes_text(e.telemetry),
      bytes_text(e.inputs));
  out += e.probed > 0 ? fmt::format(" (as in {} probed traces)", e.probed)
                      : " (contacts and lengths of traces are guessed)";
  if (free) out += fmt::format("; {} are free", bytes_text(*free));
  if (e.seconds > 0) {
    out +=
        fmt::format("; {} of one processor, {:.3g} us a particle-step", duration_text(e.seconds), 1e6 * e.step_seconds);
  }
  return out;
}

void check_space(const SizeEstimate& e, const std::filesystem::path& archive, bool packed) {
  const std::optional<double> free = free_bytes(archive);
  if (!free) return;
  const double copies = packed ? 2 : 1;
  // What is known for certain; traces may end early, so telemetry and events are not.
  const double least = copies * (e.values + e.traces);
  if (least > *free) {
    throw MachineError(fmt::format(
        "{}: will not fit: particles and outcomes alone take {}, {} are free; write elsewhere (--output), simulate "
        "fewer particles, or go on all the same with --ignore-space",
        archive.string(), bytes_text(least), bytes_text(*free)));
  }
  if (copies * e.total() > *free) {
    spdlog::warn("{}: may not fit: {}. A campaign that fills the disk keeps what it has; 'graze resume' goes on",
                 archive.string(), size_text(e, free));
  }
}

}  // namespace graze
