#include "jobs/workers/record_bytes.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace graze {
namespace {

/// Writes, or reads back, by one and the same walk.
class Bytes {
 public:
  Bytes() = default;
  explicit Bytes(std::string_view written) : source_(written), reads_(true) {}

  template <class T>
  void plain(T& x) {
    static_assert(std::is_trivially_copyable_v<T>);
    raw(&x, sizeof x);
  }
  /// `least`: bytes that each of them takes at least, so that a number that cannot be costs no memory.
  std::uint64_t count(std::uint64_t now, std::size_t least) {
    plain(now);
    if (reads_ && now > (source_.size() - at_) / least) refuse();
    return now;
  }
  template <class T>
  void numbers(std::vector<T>& items) {
    items.resize(count(items.size(), sizeof(T)));
    raw(items.data(), items.size() * sizeof(T));
  }
  void text(std::string& text) {
    text.resize(count(text.size(), 1));
    raw(text.data(), text.size());
  }
  bool reads() const { return reads_; }
  void end() const {
    if (at_ != source_.size()) refuse();
  }
  std::string take() { return std::move(written_); }

 private:
  [[noreturn]] static void refuse() {
    throw std::runtime_error("the controller's process sent traces that cannot be read");
  }
  void raw(void* x, std::size_t size) {
    if (size == 0) return;
    if (!reads_) {
      written_.append(static_cast<const char*>(x), size);
      return;
    }
    if (size > source_.size() - at_) refuse();
    std::memcpy(x, source_.data() + at_, size);
    at_ += size;
  }

  std::string_view source_;
  bool reads_ = false;
  std::size_t at_ = 0;
  std::string written_;
};

void carry(Bytes& bytes, Event& event) {
  bytes.plain(event.time), bytes.plain(event.kind), bytes.plain(event.a), bytes.plain(event.b);
  bytes.plain(event.feature_a), bytes.plain(event.feature_b), bytes.plain(event.impulse);
  for (int k = 0; k < 3; ++k) bytes.plain(event.p_W[k]);
}

void carry(Bytes& bytes, FrameLog& log) {
  std::vector<double> time = log.time(), q = log.q(), v = log.v(), tau = log.tau();
  for (std::vector<double>* column : {&time, &q, &v, &tau}) bytes.numbers(*column);
  if (!bytes.reads()) return;
  const std::size_t frames = time.size();
  log.clear();
  for (std::size_t i = 0; i < frames; ++i) {
    const auto row = [&](const std::vector<double>& column) {
      const std::size_t width = column.size() / frames;
      return std::span<const double>(column).subspan(i * width, width);
    };
    log.add(time[i], row(q), row(v), row(tau));
  }
}

void carry(Bytes& bytes, TraceRecord& record) {
  bytes.plain(record.particle), bytes.plain(record.outcome), bytes.plain(record.violated);
  bytes.plain(record.end_time), bytes.plain(record.objective_margin);
  bytes.numbers(record.margins), bytes.numbers(record.first_violations);
  bytes.numbers(record.margin_parts), bytes.numbers(record.violation_parts);
  bytes.plain(record.objective_culprit);
  bytes.numbers(record.q), bytes.numbers(record.v);
  bytes.plain(record.digest);
  bytes.text(record.sequence), bytes.text(record.invalid_reason);
  bytes.plain(record.stopped), bytes.plain(record.solver);
  record.events.resize(bytes.count(record.events.size(), sizeof(Event::time) + sizeof(Event::p_W)));
  for (Event& event : record.events) carry(bytes, event);
  bytes.numbers(record.phases);
  carry(bytes, record.telemetry);
}

constexpr std::size_t kLeastRecord = sizeof(SolverLog);  // bytes; each has one, and more

}  // namespace

std::string bytes_of(const std::vector<TraceRecord>& records) {
  Bytes bytes;
  bytes.count(records.size(), kLeastRecord);
  for (TraceRecord record : records) carry(bytes, record);
  return bytes.take();
}

std::vector<TraceRecord> records_of(std::string_view written, const std::vector<std::uint32_t>& particles) {
  Bytes bytes(written);
  std::vector<TraceRecord> out(bytes.count(0, kLeastRecord));
  for (TraceRecord& record : out) carry(bytes, record);
  bytes.end();
  const bool those = std::equal(out.begin(), out.end(), particles.begin(), particles.end(),
                                [](const TraceRecord& record, std::uint32_t id) { return record.particle == id; });
  if (!those) throw std::runtime_error("the controller's process sent other traces than it was asked for");
  return out;
}

}  // namespace graze
