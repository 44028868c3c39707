#pragma once
// What this program is, what it was built with, and which programs of others single verbs find.

#include <filesystem>
#include <vector>

#include "jobs/machine/finding.h"

namespace graze {

/// Version, results epoch, build, instruction sets. `data`: the folder of shipped robots and scenarios; `scenarios`:
/// how many were found there; `page`: whether the report's page is built in.
struct Shipped {
  std::filesystem::path data;
  std::size_t scenarios = 0;
  bool page = false;
};
std::vector<Finding> program_findings(const Shipped& shipped);

/// MPI and HDF5.
std::vector<Finding> library_findings();

/// gnuplot, xacro, sbatch, mpirun, a compiler: whether they are on PATH, and what for.
std::vector<Finding> tool_findings();

/// The first file of that name on $PATH that may be executed; empty: none.
std::filesystem::path found_on_path(const std::string& name);

}  // namespace graze
