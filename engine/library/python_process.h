#pragma once
// A Python interpreter that runs one controller: started, spoken to through a socket and shared memory, watched, ended.

#include <sys/types.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "engine/lanes/block.h"
#include "engine/library/library_use.h"
#include "engine/settings/regular_file.h"

namespace graze {

/// The most lanes that arrays in Python have: those of a block, and one that never acts where there are as many joints.
constexpr int kPythonLanes = kLanes + 1;

/// The beginning of the memory that is shared with the interpreter; arrays follow. Its places are told to the runner.
struct PythonPage {
  std::int64_t begun;          // lanes that begin a trace with this call
  std::int64_t stage;          // LibraryCall, by the runner
  std::int64_t message_size;   // bytes, by the runner
  std::int64_t reads;          // SensedGroup, by the runner once
  std::int64_t lanes[kLanes];  // [begun]
  std::uint64_t seeds[kLanes];
  double time[kPythonLanes];  // s since the trace began
  bool active[kPythonLanes];  // which lanes act
  char message[2048];         // what was raised, in one line
};
constexpr std::size_t kPythonArrays = 4096;  // bytes from the memory's beginning to its arrays
static_assert(sizeof(PythonPage) <= kPythonArrays);

/// The controller cannot be made, because of what the scenario says under `key`.
class PythonRefused : public std::runtime_error {
 public:
  PythonRefused(const char* of_key, const std::string& what) : std::runtime_error(what), key(of_key) {}
  const char* const key;
};

class PythonProcess {
 public:
  /// Starts the interpreter and waits until the controller has been made. `setup`: a line of JSON; `bytes`: of the
  /// shared memory, zero at first. It dies with this thread. Throws PythonRefused that says what the controller
  /// did, CallTimedOut, MachineError where the system has nothing left.
  PythonProcess(const LibraryUse& use, const std::string& setup, std::size_t bytes);
  ~PythonProcess();
  PythonProcess(const PythonProcess&) = delete;
  PythonProcess& operator=(const PythonProcess&) = delete;

  PythonPage& page() const { return *reinterpret_cast<PythonPage*>(memory_); }
  /// An array in the shared memory, `offset` bytes from its beginning.
  double* array(std::size_t offset) const { return reinterpret_cast<double*>(memory_ + offset); }

  /// One control step, at a time (s) that messages tell. Throws std::runtime_error: what was raised, how it ended, that
  /// it did not come back in time. Then the object is of no more use.
  void step(double time);
  /// Throws what a controller has done wrong: "walk.py: act() at 0.01 s asks …".
  [[noreturn]] void fail(double time, const std::string& what) const;

 private:
  void start(const std::string& setup);
  void say(const std::string& bytes);
  void wait_for(short what, double time, double limit, double& waited);
  char listen(double time, double limit);
  [[noreturn]] void not_started();
  [[noreturn]] void died(double time);
  [[noreturn]] void hangs(double time, double limit);
  std::string message() const;
  std::string failure(double time, const std::string& what) const;
  std::string where(double time) const;
  bool has_ended() const;
  bool is_owner() const;
  void end() noexcept;

  const std::string name_, interpreter_;
  const double timeout_;
  const std::size_t bytes_;
  std::byte* memory_ = nullptr;
  Descriptor socket_;
  const pid_t owner_ = getpid();  // a copy of it by fork() leaves the interpreter alone
  pid_t id_ = 0;                  // 0: none that runs
  bool own_group_ = false;
  unsigned requests_ = 0;      // control steps that were asked for
  std::optional<int> status_;  // how it has ended, if anybody knows
};

}  // namespace graze
