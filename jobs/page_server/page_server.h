#pragma once
// What serves a page to a browser of this machine: a module that the program loads when it is asked for a page, because
// the library that it needs brings five others with it, with TLS among them: a fifth of the page faults of a start.

#include <cstdint>
#include <string>
#include <vector>

namespace graze {

/// File of the module.
inline constexpr const char* kPageServerModule = "libgraze_page_server.so";

class PageServer {
 public:
  /// Waits for a moment until those who look have seen the last frame.
  virtual ~PageServer() = default;
  /// Serves the page at a port of 127.0.0.1, 0: any that is free. Returns its address. Throws MachineError.
  virtual std::string begin(std::uint16_t port) = 0;
  virtual void show(std::string frame) = 0;
  virtual std::vector<std::string> pressed() = 0;
};

}  // namespace graze

/// The module's one function: a server of this page, which the caller owns.
extern "C" graze::PageServer* graze_make_page_server(const std::string* page);
