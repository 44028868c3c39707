#pragma once
// A page in a browser of this machine that shows what goes on while it goes on, and passes on what is pressed there.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "jobs/page_server/page_server.h"

namespace graze {

class LivePage {
 public:
  /// Serves a page made of `data` (script_json()) at a port of 127.0.0.1, 0: any that is free, under a name that no
  /// other program or page can guess. Throws InputError if this program was built without pages, MachineError if the
  /// port is not to be had or the module that serves is not there.
  LivePage(const std::string& data, std::uint16_t port);
  /// Waits for a moment until those who look have seen the last frame.
  ~LivePage();
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  /// "http://127.0.0.1:40123/f00dfeedf00dfeed/"
  const std::string& address() const { return address_; }
  /// JSON without line breaks, to all who look; whoever is slow misses those in between.
  void show(std::string frame);
  /// What was sent since the last call, oldest first: names of keys, or "stick F S T" with shares from -1 to 1.
  std::vector<std::string> pressed();

 private:
  std::unique_ptr<PageServer> server_;
  std::string address_;
};

}  // namespace graze
