#include "jobs/page_server/page_server.h"

#include <fmt/format.h>
#include <httplib.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <random>
#include <utility>

#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr const char* kHost = "127.0.0.1";
constexpr std::chrono::seconds kSilence(1);          // after which a listener is told that all is well
constexpr std::chrono::milliseconds kFarewell(300);  // for the last frame to arrive
constexpr std::size_t kMostPressed = 1000, kMostWord = 64;
constexpr std::size_t kMostListeners = 32;

std::string secret() {
  std::random_device device;
  return fmt::format("{:08x}{:08x}", device(), device());
}

class HttpPageServer final : public PageServer {
 public:
  explicit HttpPageServer(std::string page) : page_(std::move(page)), name_(secret()) {
    // Each listener holds a thread.
    server_.new_task_queue = [] { return new httplib::ThreadPool(kMostListeners); };
    server_.set_keep_alive_max_count(1);  // nobody is waited for at the end
    server_.set_read_timeout(kSilence);   // nor by others, who ask for something
    server_.set_payload_max_length(kMostWord);
    // The library's own options would share a port that another program has; this takes one that has just been left.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    const std::string root = "/" + name_ + "/";
    server_.Get(root, [this](const httplib::Request&, httplib::Response& answer) {
      answer.set_header("Cache-Control", "no-store");
      answer.set_content(page_, "text/html; charset=utf-8");
    });
    server_.Get(root + "frames", [this](const httplib::Request&, httplib::Response& answer) { listen(answer); });
    server_.Post(root + "keys", [this](const httplib::Request& request, httplib::Response&) { take(request.body); });
  }

  std::string begin(std::uint16_t port) override {
    const int bound = port == 0 ? server_.bind_to_any_port(kHost) : server_.bind_to_port(kHost, port) ? port : -1;
    if (bound <= 0) {
      throw MachineError(
          fmt::format("--page: port {} of {} is not to be had; another program may have it; --page 0 "
                      "takes one that is free",
                      port, kHost));
    }
    serving_ = std::async(std::launch::async, [this] { server_.listen_after_bind(); });
    while (!server_.is_running()) {
      if (serving_.wait_for(std::chrono::milliseconds(1)) == std::future_status::ready) {
        throw MachineError(fmt::format("--page: port {} of {} cannot be listened to", bound, kHost));
      }
    }
    return fmt::format("http://{}:{}/{}/", kHost, bound, name_);
  }

  ~HttpPageServer() override {
    {
      std::unique_lock lock(mutex_);
      closing_ = true;
      news_.notify_all();
      left_.wait_for(lock, kFarewell, [&] { return listeners_ == 0; });
    }
    server_.stop();
  }

  void show(std::string frame) override {
    const std::lock_guard lock(mutex_);
    frame_ = std::move(frame);
    ++number_;
    news_.notify_all();
  }

  std::vector<std::string> pressed() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(pressed_, {});
  }

 private:
  void take(const std::string& word) {
    const std::lock_guard lock(mutex_);
    if (word.size() <= kMostWord && pressed_.size() < kMostPressed) pressed_.push_back(word);
  }

  void listen(httplib::Response& answer) {
    {
      const std::lock_guard lock(mutex_);
      ++listeners_;
    }
    answer.set_header("Cache-Control", "no-store");
    answer.set_chunked_content_provider(
        "text/event-stream",
        [this, seen = std::uint64_t{0}](std::size_t, httplib::DataSink& sink) mutable { return send(sink, seen); },
        [this](bool) {
          const std::lock_guard lock(mutex_);
          --listeners_;
          left_.notify_all();
        });
  }

  /// One frame that has not been seen, or a sign of life. False: the listener has left.
  bool send(httplib::DataSink& sink, std::uint64_t& seen) {
    std::string text = ": waiting\n\n";
    bool last = false;
    {
      std::unique_lock lock(mutex_);
      news_.wait_for(lock, kSilence, [&] { return closing_ || number_ > seen; });
      if (number_ > seen) text = "data: " + frame_ + "\n\n";
      seen = number_;
      last = closing_;
    }
    if (!sink.write(text.data(), text.size())) return false;
    if (last) sink.done();
    return true;
  }

  const std::string page_, name_;
  httplib::Server server_;
  std::mutex mutex_;
  std::condition_variable news_, left_;
  std::string frame_;
  std::uint64_t number_ = 0;  // of frame_
  std::vector<std::string> pressed_;
  std::size_t listeners_ = 0;
  bool closing_ = false;
  std::future<void> serving_;  // last: it is waited for before anything goes
};

}  // namespace
}  // namespace graze

extern "C" graze::PageServer* graze_make_page_server(const std::string* page) {
  return new graze::HttpPageServer(*page);
}
