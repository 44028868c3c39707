#include "jobs/workers/worker_channel.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

namespace graze {
namespace {

using PlainJson = nlohmann::json;

/// Of a message: its kind, its mark, how many bytes follow.
constexpr std::size_t kMarkAt = 1, kSizeAt = kMarkAt + sizeof(std::uint64_t), kHead = kSizeAt + sizeof(std::uint64_t);
/// What a worker, which may take no more memory (limit_memory()), can have to say.
constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;

std::uint64_t number_at(const char* bytes) {
  std::uint64_t out = 0;
  std::memcpy(&out, bytes, sizeof out);
  return out;
}

std::string as_message_pack(const PlainJson& json) {
  const std::vector<std::uint8_t> bytes = PlainJson::to_msgpack(json);
  return {bytes.begin(), bytes.end()};
}

PlainJson binary(const std::string& bytes) {
  return PlainJson::binary(std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
}

std::string text_of_binary(const PlainJson& json) {
  const std::vector<std::uint8_t>& bytes = json.get_binary();
  return {bytes.begin(), bytes.end()};
}

bool send_bytes(int descriptor, const char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t sent = send(descriptor, bytes, count, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return false;
    bytes += sent;
    count -= static_cast<std::size_t>(sent);
  }
  return true;
}

bool receive_bytes(int descriptor, char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t got = recv(descriptor, bytes, count, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes += got;
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

PlainJson as_json(const Recording& r) {
  return {
      static_cast<int>(r.telemetry), r.every, r.last, r.phases, r.rules.gap, r.rules.dwell, r.rules.impulse, r.events};
}

Recording recording_of(const PlainJson& json) {
  return {static_cast<Telemetry>(json.at(0).get<int>()),  json.at(1), json.at(2), json.at(3),
          PhaseRules{json.at(4), json.at(5), json.at(6)}, json.at(7)};
}

}  // namespace

std::string scenario_kind(const Scenario& scenario) {
  const Timing& timing = scenario.timing;
  std::string out =
      fmt::format("{} {} {} {} {}", scenario.sha256, scenario.physics, timing.end, timing.step, timing.control);
  for (const UncertainParameter& parameter : scenario.space.parameters) {
    out += fmt::format("; {} {} {}", parameter.name, parameter.persistent.describe(), parameter.jitter.has_value());
  }
  return out;
}

bool send_word(int descriptor, const WorkerMessage& word) {
  const std::uint64_t size = word.bytes.size();
  std::string head(kHead, word.kind);
  std::memcpy(head.data() + kMarkAt, &word.mark, sizeof word.mark);
  std::memcpy(head.data() + kSizeAt, &size, sizeof size);
  return send_bytes(descriptor, head.data(), head.size()) && send_bytes(descriptor, word.bytes.data(), size);
}

std::optional<WorkerMessage> receive_word(int descriptor) {
  std::array<char, kHead> head{};
  if (!receive_bytes(descriptor, head.data(), head.size())) return std::nullopt;
  WorkerMessage out{head[0], {}, number_at(head.data() + kMarkAt)};
  const std::uint64_t size = number_at(head.data() + kSizeAt);
  if (size > kMostBytes) return std::nullopt;
  out.bytes.resize(size);
  if (!receive_bytes(descriptor, out.bytes.data(), size)) return std::nullopt;
  return out;
}

WorkerInbox::State WorkerInbox::look(int descriptor, std::uint64_t mark) {
  constexpr std::size_t kPortion = std::size_t{1} << 20;  // bytes: memory grows by what has arrived, not by a claim
  while (true) {
    if (const State now = state(mark); now != State::part) return now;
    const std::size_t before = bytes_.size(), portion = std::min(wanted() - before, kPortion);
    bytes_.resize(before + portion);
    const ssize_t got = recv(descriptor, bytes_.data() + before, portion, MSG_DONTWAIT);
    const int error = errno;
    bytes_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got > 0 || (got < 0 && error == EINTR)) continue;
    return got < 0 && (error == EAGAIN || error == EWOULDBLOCK) ? State::part : State::closed;
  }
}

WorkerInbox::State WorkerInbox::state(std::uint64_t mark) const {
  if (bytes_.size() >= kSizeAt && number_at(bytes_.data() + kMarkAt) != mark) return State::garbled;
  if (bytes_.size() < kHead) return State::part;
  if (number_at(bytes_.data() + kSizeAt) > kMostBytes) return State::garbled;
  return bytes_.size() == wanted() ? State::whole : State::part;
}

std::size_t WorkerInbox::wanted() const {
  return bytes_.size() < kHead ? kHead : kHead + number_at(bytes_.data() + kSizeAt);
}

WorkerMessage WorkerInbox::take() {
  WorkerMessage out{bytes_[0], {}, number_at(bytes_.data() + kMarkAt)};
  bytes_.erase(0, kHead);
  out.bytes = std::exchange(bytes_, {});
  return out;
}

std::string WorkerBriefing::to_text() const {
  PlainJson json = {{"file", source.file},
                    {"folder", source.folder},
                    {"lax", source.options.ignore_missing_meshes},
                    {"recording", as_json(recording)},
                    {"seed", seed},
                    {"particles", particles},
                    {"watchdog", watchdog},
                    {"kind", kind}};
  json["overrides"] = PlainJson::array();
  for (const Override& one : source.options.overrides) json["overrides"].push_back({one.path, one.value});
  json["inputs"] = PlainJson::array();
  for (const auto& [name, bytes] : source.inputs) json["inputs"].push_back({binary(name), binary(bytes)});
  return as_message_pack(json);
}

WorkerBriefing WorkerBriefing::from_text(const std::string& text) {
  const PlainJson json = PlainJson::from_msgpack(text.begin(), text.end());
  WorkerBriefing out;
  out.source.file = json.at("file");
  out.source.folder = json.at("folder");
  out.source.options.ignore_missing_meshes = json.at("lax");
  for (const PlainJson& one : json.at("overrides")) out.source.options.overrides.push_back({one.at(0), one.at(1)});
  for (const PlainJson& one : json.at("inputs"))
    out.source.inputs[text_of_binary(one.at(0))] = text_of_binary(one.at(1));
  out.kind = json.at("kind");
  out.recording = recording_of(json.at("recording"));
  out.seed = json.at("seed");
  out.particles = json.at("particles");
  out.watchdog = json.at("watchdog");
  return out;
}

std::string WorkerRequest::to_text() const { return as_message_pack({{"policy", policy}, {"particles", particles}}); }

WorkerRequest WorkerRequest::from_text(const std::string& text) {
  const PlainJson json = PlainJson::from_msgpack(text.begin(), text.end());
  return {json.at("policy"), json.at("particles").get<std::vector<std::uint32_t>>()};
}

}  // namespace graze
