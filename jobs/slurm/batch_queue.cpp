#include "jobs/slurm/batch_queue.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "archive/archive.h"
#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

/// Runs sbatch; returns the number of the job. Its complaints go to stderr.
std::string sbatch(const std::string& arguments) {
  const std::string line = "sbatch --parsable " + arguments;
  std::FILE* pipe = popen(line.c_str(), "r");
  if (!pipe) throw MachineError(fmt::format("{}: cannot be started", line));
  std::string out;
  std::array<char, 256> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe)) out += buffer.data();
  if (pclose(pipe) != 0) throw MachineError(fmt::format("{}: failed, see above", line));
  return out.substr(0, out.find_first_of(";\n"));
}

bool have_sbatch() {
  return std::system("command -v sbatch >/dev/null 2>&1") == 0;  // NOLINT: a shell is what runs it, too
}

void write_file(const BatchFile& file) {
  NewFile out(file.path, true);  // differing() has been asked
  const int error = write_all(out.descriptor(), std::as_bytes(std::span(file.text)));
  if (error != 0) fail_writing(file.path, error);
  out.publish();
}

/// Whether a file says that, and no more. What cannot be read says something else.
bool says(const fs::path& path, const std::string& text) {
  const OpenedFile file = open_regular(AT_FDCWD, path.c_str(), O_RDONLY, Links::followed);
  std::string there(text.size() + 1, '\0');
  return file.file && pread(file.file.number(), there.data(), there.size(), 0) == static_cast<ssize_t>(text.size()) &&
         there.compare(0, text.size(), text) == 0;
}

}  // namespace

std::vector<fs::path> differing(const std::vector<BatchFile>& files) {
  std::vector<fs::path> out;
  for (const BatchFile& file : files) {
    if (!fs::exists(fs::symlink_status(file.path))) continue;
    if (!says(file.path, file.text)) out.push_back(file.path);
  }
  return out;
}

std::vector<std::string> queue_jobs(const std::vector<BatchFile>& files) {
  const ParentFolders folders(files.front().path);
  std::vector<fs::path> fresh;
  for (const BatchFile& file : files) {
    if (!fs::exists(fs::symlink_status(file.path))) fresh.push_back(file.path);
    write_file(file);
  }
  const std::string first = shell_path(files.front().path.string());
  if (!have_sbatch()) {
    throw MachineError(fmt::format(
        "sbatch: not found on this machine; {} is written: submit it where Slurm is (sbatch {}), or look at it with "
        "--dry-run",
        files.front().path.string(), first));
  }
  std::vector<std::string> jobs;
  try {
    jobs.push_back(sbatch(first));
  } catch (const MachineError& failed) {
    std::error_code error;
    for (const fs::path& path : fresh) fs::remove(path, error);
    throw MachineError(fmt::format("{}; nothing is queued", failed.what()));
  }
  if (files.size() == 1) return jobs;
  try {
    jobs.push_back(sbatch(fmt::format("--dependency=afterany:{} {}", jobs[0], shell_path(files[1].path.string()))));
  } catch (const MachineError& failed) {
    throw MachineError(fmt::format("{}; job {} is queued all the same: {}", failed.what(), jobs[0], first));
  }
  return jobs;
}

}  // namespace graze
