#pragma once
// What a process that runs controllers and the one that has started it say to each other, over a socket: a kind, a
// mark, a length, bytes. An answer bears the mark of what it answers, which nobody can guess, so that what a controller
// writes into the socket by mistake is no answer.

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
  refusal = 'r',   // an InputError, before any particle is simulated
  machine = 'm',   // a MachineError
  overtime = 'o',  // a trace takes too long, or a call, in words
};

/// The numbers of a worker's descriptors: its end of the socket, and the page LibraryCalls.
inline constexpr int kWorkerSocket = 3, kWorkerPage = 4;
/// How it ends when the simulator itself hangs; when nobody takes its answer.
inline constexpr int kWorkerStuck = 77, kWorkerUnheard = 78;
/// The only argument of a program that is started as a worker.
inline constexpr const char* kWorkerVerb = "worker";

struct WorkerMessage {
  char kind;
  std::string bytes;
  std::uint64_t mark = 0;
};
/// Writes a whole message; false if nobody listens any more, or (EAGAIN) for longer than the socket waits.
bool send_word(int descriptor, const WorkerMessage& word);
/// Waits for a whole message; nothing if the other end is closed.
std::optional<WorkerMessage> receive_word(int descriptor);

/// Puts a message together from what has arrived, without waiting for the rest.
class WorkerInbox {
 public:
  enum class State {
    part,     // nothing, or part of a message, has arrived
    whole,    // take() gives it
    closed,   // nothing comes any more
    garbled,  // what has arrived is no answer to the message with the mark
  };
  /// Takes what there is of one message.
  State look(int descriptor, std::uint64_t mark);
  WorkerMessage take();
  /// Bytes of the message under way.
  std::size_t arrived() const { return bytes_.size(); }

 private:
  State state(std::uint64_t mark) const;
  std::size_t wanted() const;  // bytes of the message as far as it is known
  std::string bytes_;
};

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
