#include "jobs/workers/worker_channel.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace graze {
namespace {

using PlainJson = nlohmann::json;

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

bool send_word(int descriptor, char kind, const std::string& bytes) {
  const std::uint64_t size = bytes.size();
  std::string head(1 + sizeof size, kind);
  std::memcpy(head.data() + 1, &size, sizeof size);
  return send_bytes(descriptor, head.data(), head.size()) && send_bytes(descriptor, bytes.data(), bytes.size());
}

std::optional<WorkerMessage> receive_word(int descriptor) {
  WorkerMessage out{};
  std::uint64_t size = 0;
  if (!receive_bytes(descriptor, &out.kind, 1)) return std::nullopt;
  if (!receive_bytes(descriptor, reinterpret_cast<char*>(&size), sizeof size)) return std::nullopt;
  constexpr std::uint64_t kMost = std::uint64_t{1} << 36;  // bytes; more is no message, but something that went wrong
  if (size > kMost) return std::nullopt;
  out.bytes.resize(size);
  if (!receive_bytes(descriptor, out.bytes.data(), size)) return std::nullopt;
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
