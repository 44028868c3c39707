#pragma once
// What a process that runs controllers and the one that has started it say to each other, over a socket: a kind, a
// length, bytes.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scenarios/scenario.h"

namespace graze {

/// Of a message from the worker.
enum class WorkerWord : char {
  ready = 'k',     // it has been briefed
  traces = 't',    // steps done (8 bytes), bytes_of() the records
  fault = 'f',     // of the controller, in words
  refusal = 'r',   // an InputError
  machine = 'm',   // a MachineError
  overtime = 'o',  // a trace takes too long
};

/// The numbers of a worker's descriptors: its end of the socket, and the page LibraryCalls.
inline constexpr int kWorkerSocket = 3, kWorkerPage = 4;
/// How it ends when the simulator itself hangs.
inline constexpr int kWorkerStuck = 77;
/// The only argument of a program that is started as a worker.
inline constexpr const char* kWorkerVerb = "worker";

/// Writes a whole message; false if nobody listens any more.
bool send_word(int descriptor, char kind, const std::string& bytes);
/// Waits for a whole message; nothing if the other end is closed.
struct WorkerMessage {
  char kind;
  std::string bytes;
};
std::optional<WorkerMessage> receive_word(int descriptor);

/// What a program that reads the scenario's files must find there: text, parameters, timing. Commands that change these
/// after reading have another scenario than a worker would.
std::string scenario_kind(const Scenario& scenario);

/// All that a worker must know: the scenario's files, the seed, how many particles there are, what is recorded.
struct WorkerBriefing {
  ScenarioSource source;
  std::string kind;  // scenario_kind(), which must be the same there
  Recording recording;
  std::uint64_t seed = 1, particles = 1;
  double watchdog = 0;          // s
  std::string to_text() const;  // MessagePack
  static WorkerBriefing from_text(const std::string& text);
};

/// Some particles under one policy.
struct WorkerRequest {
  std::string policy;
  std::vector<std::uint32_t> particles;
  std::string to_text() const;
  static WorkerRequest from_text(const std::string& text);
};

}  // namespace graze
