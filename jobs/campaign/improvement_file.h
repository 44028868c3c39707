#pragma once
// The history of `graze improve` on disk: DIR/improve.json, written whole after every step. A session that is begun
// again goes on from there.

#include <filesystem>
#include <optional>
#include <string>

#include "jobs/campaign/improvement.h"

namespace graze {

inline constexpr const char* kImproveFile = "improve.json";

/// What a session was asked: a folder is gone on with for the same question alone.
struct ImproveQuestion {
  std::string scenario;  // SHA-256 of its text
  std::string files;     // the same of the robot, meshes, controllers and tables; empty: of an older program
  ImproveOptions options;
  std::uint64_t seed = 1;   // of the particles
  std::uint64_t drawn = 0;  // particles of the design that they are of
};

/// The history as JSON, with names and units of variables and limits, for people and scripts.
std::string improvement_json(const Scenario& scenario, const ImproveQuestion& question, const ImproveState& state);
/// Throws MachineError.
void write_improvement(const std::filesystem::path& folder, const Scenario& scenario, const ImproveQuestion& question,
                       const ImproveState& state);
/// The session in a folder; none: there is none. Throws InputError: of another question (says what differs), of a newer
/// format, damaged.
std::optional<ImproveState> read_improvement(const std::filesystem::path& folder, const Scenario& scenario,
                                             const ImproveQuestion& question);

struct ImproveSession {
  ImproveQuestion question;
  ImproveState state;
};
/// The session in a folder, whatever it was asked. `scenario`: with the design block that it is about. Throws
/// InputError: there is none, of another design, of a newer format, damaged.
ImproveSession read_session(const std::filesystem::path& folder, const Scenario& scenario);

}  // namespace graze
