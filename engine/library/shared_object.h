#pragma once
// A controller's shared object: loaded, checked, and called so that what it does wrong is an error with a name.

#include <unistd.h>

#include <functional>
#include <string>

#include "engine/library/kept_place.h"
#include "engine/library/library_use.h"
#include "graze/policy.h"

namespace graze {

/// The functions of a shared object. It stays loaded as long as the process lives: its threads and its exit handlers
/// may.
class SharedObject {
 public:
  /// Throws InputError: not the file that was meant, no shared object, no graze_policy(), another version of the
  /// interface, functions that are missing.
  explicit SharedObject(const LibraryUse& use);

  const GrazePolicy& table() const { return *table_; }

  /// Calls a function of the library, which returns 0 if all went well. `time`: s in the trace, for messages; NaN:
  /// there is none. Throws std::runtime_error if it fails, throws, or leaves rounding or floating-point exceptions
  /// otherwise than they were; these are put right again.
  template <class Call>
  void call(LibraryCall which, double time, void* policy, const Call& function) const {
    const FloatingPoint before;
    const Shown shown(which, time, file_.c_str(), limit_of(which));
    int code = 0;
    try {
      code = function();
    } catch (const std::exception& thrown) {
      before.restore();
      fail(which, time, std::string("threw an exception: ") + thrown.what());
    } catch (...) {
      before.restore();
      fail(which, time, "threw an exception");
    }
    if (!before.holds()) {
      before.restore();
      fail(which, time,
           "changed the floating-point environment (rounding, exceptions that trap, or flushing of small numbers); it "
           "must put it back before it returns");
    }
    if (code != 0) fail(which, time, "returned error " + std::to_string(code) + reason(policy));
  }
  [[noreturn]] void fail(LibraryCall which, double time, const std::string& what) const;
  /// ": " and what last_error() says, or nothing. To be asked within a call(), whose limits hold for it.
  std::string reason(void* policy) const;

 private:
  /// How this thread computes: rounding, trapping exceptions, denormal numbers.
  class FloatingPoint {
   public:
    FloatingPoint();
    bool holds() const;
    void restore() const;

   private:
    unsigned vector_ = 0;
    unsigned short stack_ = 0;
  };
  /// Shows a call to whoever watches. A copy of this process that the library has made by fork(), and that comes back
  /// from the call, ends: it shall not go on with a campaign that the process itself goes on with.
  class Shown {
   public:
    Shown(LibraryCall which, double time, const char* file, double limit)
        : which_(which), page_(shown_library_calls()) {
      show_call_here({which, time, file, limit});
      if (!page_) return;
      page_->time.store(time, std::memory_order_relaxed);
      page_->inside.store(which, std::memory_order_release);
    }
    ~Shown() {
      if (is_forked_copy()) _exit(0);
      // Once for each step it would cost too much, and after each trace there is destroy() or the next start().
      if (which_ != LibraryCall::act) put_place_back();
      show_call_here({});
      if (!page_) return;
      page_->inside.store(LibraryCall::none, std::memory_order_relaxed);
      page_->count.fetch_add(1, std::memory_order_release);
    }
    Shown(const Shown&) = delete;
    Shown& operator=(const Shown&) = delete;

   private:
    LibraryCall which_;
    LibraryCalls* page_;
  };

  double limit_of(LibraryCall which) const;

  std::string file_;
  double timeout_ = 0;  // s
  const GrazePolicy* table_ = nullptr;
};

}  // namespace graze
