#include "jobs/machine/machine_limits.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "jobs/campaign/communicator.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

/// A count in decimal digits; nothing for "max" and for files that are not there.
std::optional<std::uint64_t> count_in(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end == text.data()) return std::nullopt;
  return value;
}

/// A group's folder and those above it, from the group itself up to the mount. Within a container the path may be
/// that of the host: then the mount alone is there.
std::vector<fs::path> upwards(const fs::path& mount, const std::string& group) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::path at = fs::path(group).relative_path(); !at.empty(); at = at.parent_path()) {
    if (fs::is_directory(mount / at, error)) out.push_back(mount / at);
  }
  out.push_back(mount);
  return out;
}

void limit_processors(GroupLimits& limits, const std::optional<std::uint64_t>& quota,
                      const std::optional<std::uint64_t>& period) {
  if (!quota || !period || *period == 0) return;
  const double processors = static_cast<double>(*quota) / static_cast<double>(*period);
  limits.processors = std::min(limits.processors.value_or(processors), processors);
}

void limit_memory_to(GroupLimits& limits, const fs::path& limit, const fs::path& in_use) {
  constexpr std::uint64_t kNone = std::uint64_t{1} << 60;  // version 1 writes a huge number for "no limit"
  const auto bytes = count_in(first_line(limit));
  if (!bytes || *bytes >= kNone || (limits.memory && *limits.memory <= *bytes)) return;
  limits.memory = bytes;
  limits.memory_in_use = count_in(first_line(in_use));
}

void read_version_2(GroupLimits& limits, const fs::path& mount, const std::string& group) {
  for (const fs::path& folder : upwards(mount, group)) {
    std::istringstream processors(first_line(folder / "cpu.max"));  // "150000 100000", "max 100000"
    std::string quota, period;
    processors >> quota >> period;
    limit_processors(limits, count_in(quota), count_in(period));
    limit_memory_to(limits, folder / "memory.max", folder / "memory.current");
  }
}

void read_version_1(GroupLimits& limits, const fs::path& mount, const std::string& controllers,
                    const std::string& group) {
  const auto has = [&](const char* name) { return ("," + controllers + ",").find(name) != std::string::npos; };
  if (has(",cpu,")) {
    for (const fs::path& folder : upwards(mount / "cpu", group)) {  // "-1": no quota
      limit_processors(limits, count_in(first_line(folder / "cpu.cfs_quota_us")),
                       count_in(first_line(folder / "cpu.cfs_period_us")));
    }
  }
  if (has(",memory,")) {
    for (const fs::path& folder : upwards(mount / "memory", group)) {
      limit_memory_to(limits, folder / "memory.limit_in_bytes", folder / "memory.usage_in_bytes");
    }
  }
}

/// Of /proc/meminfo, in bytes by name.
std::map<std::string, double> memory_info() {
  std::map<std::string, double> out;
  std::ifstream in("/proc/meminfo");  // "MemTotal:       24593084 kB"
  for (std::string name, unit; in >> name;) {
    double value = 0;
    in >> value;
    std::getline(in, unit);
    if (!name.empty()) name.pop_back();
    constexpr double kKibi = 1024;
    out[name] = value * kKibi;
  }
  return out;
}

std::string gigabytes(double bytes) { return fmt::format("{:.1f} GB", bytes / 1e9); }

Finding processors_finding(const GroupLimits& groups) {
  const int allowed = default_threads();
  const long online = sysconf(_SC_NPROCESSORS_ONLN);
  Finding out{"machine", "processors", Health::good, fmt::format("{} of {} may be used", allowed, online)};
  out.text += fmt::format("; --threads is {} if it is not given", allowed);
  out.numbers = {{"online", static_cast<double>(online)}, {"threads", allowed}};
  if (!groups.processors) return out;
  out.numbers.emplace_back("group_quota", *groups.processors);
  out.text += fmt::format("; the control group grants the time of {:g}", *groups.processors);
  const int enough = std::max(1, static_cast<int>(std::ceil(*groups.processors)));
  if (enough < allowed) {
    out.health = Health::note;
    out.advice = fmt::format("--threads {} is as fast, and waits less", enough);
  }
  return out;
}

Finding memory_finding(const GroupLimits& groups) {
  const std::map<std::string, double> info = memory_info();
  const auto of = [&](const char* name) { return info.contains(name) ? info.at(name) : 0.0; };
  const double total = of("MemTotal");
  double available = of("MemAvailable");
  Finding out{"machine", "memory", Health::good, fmt::format("{} in all", gigabytes(total))};
  out.numbers = {{"total_bytes", total}};
  if (groups.memory) {
    const auto limit = static_cast<double>(*groups.memory);
    out.text += fmt::format(", {} for the control group", gigabytes(limit));
    available = std::min(available, limit - static_cast<double>(groups.memory_in_use.value_or(0)));
    out.numbers.emplace_back("group_bytes", limit);
  }
  rlimit space{};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY) {
    out.text += fmt::format(", {} of address space (ulimit -v)", gigabytes(static_cast<double>(space.rlim_cur)));
    available = std::min(available, static_cast<double>(space.rlim_cur));
    out.numbers.emplace_back("address_space_bytes", static_cast<double>(space.rlim_cur));
  }
  out.text += fmt::format("; {} free", gigabytes(std::max(0.0, available)));
  out.numbers.emplace_back("free_bytes", available);
  constexpr double kLittle = 5e8;  // a campaign of the shipped quadruped takes some 100 MB, its verbs that read more
  if (available < kLittle) {
    out.health = Health::note;
    out.advice = "that is little: end other programs, or ask for a larger limit (Slurm: --mem)";
  }
  return out;
}

Finding files_finding() {
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  const auto most = static_cast<double>(files.rlim_cur);
  Finding out{"machine", "open files", Health::good, fmt::format("{:.0f} at a time", most), "", {{"limit", most}}};
  constexpr double kFew = 256;  // reading a campaign directory holds some, a rank with controllers a few per thread
  if (most < kFew) {
    out.health = Health::note;
    out.advice = "that is few: ulimit -n 1024";
  }
  return out;
}

}  // namespace

GroupLimits group_limits(const fs::path& root) {
  GroupLimits out;
  const fs::path mount = root / "sys/fs/cgroup";
  std::ifstream groups(root / "proc/self/cgroup");  // "0::/user.slice", "4:cpu,cpuacct:/jobs/17"
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1), group = line.substr(second + 1);
    if (controllers.empty()) {
      std::error_code error;
      const fs::path unified = mount / "unified";  // version 2 beside version 1
      read_version_2(out, fs::is_directory(unified, error) ? unified : mount, group);
    } else {
      read_version_1(out, mount, controllers, group);
    }
  }
  return out;
}

std::vector<Finding> limit_findings(const GroupLimits& groups) {
  return {processors_finding(groups), memory_finding(groups), files_finding()};
}

}  // namespace graze
