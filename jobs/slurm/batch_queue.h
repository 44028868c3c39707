#pragma once
// Batch scripts on disk, and in Slurm's queue.

#include <filesystem>
#include <string>
#include <vector>

namespace graze {

struct BatchFile {
  std::filesystem::path path;
  std::string text;
};

/// Those of the files that are there already with another text.
std::vector<std::filesystem::path> differing(const std::vector<BatchFile>& files);

/// Writes the files, in a folder that is made if it is not there, and submits the first one; then the second one, if
/// there is one, to begin when the first has ended. Returns the numbers of their jobs. Throws MachineError: a file
/// cannot be written; there is no sbatch here (the files stay, for elsewhere); Slurm refuses (files and folders that
/// were not there before are removed if nothing was queued).
std::vector<std::string> queue_jobs(const std::vector<BatchFile>& files);

}  // namespace graze
