#include "jobs/cli/live_page.h"

#include <fmt/format.h>
#include <httplib.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <random>
#include <string_view>
#include <utility>

#include "engine/settings/settings.h"
#include "jobs/cli/page.h"

namespace graze {
namespace {

constexpr const char* kHost = "127.0.0.1";
constexpr std::chrono::seconds kSilence(1);          // after which a listener is told that all is well
constexpr std::chrono::milliseconds kFarewell(300);  // for the last frame to arrive
constexpr std::size_t kMostPressed = 1000, kMostWord = 64;
constexpr std::size_t kMostListeners = 32;

/// Pages that are opened as files may ask nobody; this one asks us.
std::string document(const std::string& data) {
  constexpr std::string_view kClosed = "default-src 'none'; ", kOpen = "default-src 'none'; connect-src 'self'; ";
  std::string out;
  for (const std::string_view text : page_template().head) out += text;
  const std::size_t policy = out.find(kClosed);
  if (policy != std::string::npos) out.replace(policy, kClosed.size(), kOpen);
  out += data;
  for (const std::string_view text : page_template().tail) out += text;
  return out;
}

std::string secret() {
  std::random_device device;
  return fmt::format("{:08x}{:08x}", device(), device());
}

}  // namespace

class LivePage::Server {
 public:
  explicit Server(std::string page) : page_(std::move(page)), name_(secret()) {
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

  /// Returns the port.
  int begin(std::uint16_t port) {
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
    return bound;
  }

  ~Server() {
    {
      std::unique_lock lock(mutex_);
      closing_ = true;
      news_.notify_all();
      left_.wait_for(lock, kFarewell, [&] { return listeners_ == 0; });
    }
    server_.stop();
  }

  const std::string& name() const { return name_; }

  void show(std::string frame) {
    const std::lock_guard lock(mutex_);
    frame_ = std::move(frame);
    ++number_;
    news_.notify_all();
  }

  std::vector<std::string> pressed() {
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

LivePage::LivePage(const std::string& data, std::uint16_t port) {
  check_page_built("drive --page");
  server_ = std::make_unique<Server>(document(data));
  address_ = fmt::format("http://{}:{}/{}/", kHost, server_->begin(port), server_->name());
}

LivePage::~LivePage() = default;

void LivePage::show(std::string frame) { server_->show(std::move(frame)); }

std::vector<std::string> LivePage::pressed() { return server_->pressed(); }

}  // namespace graze
