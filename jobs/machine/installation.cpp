#include "jobs/machine/installation.h"

#include <H5public.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <sstream>
#include <string_view>

#include "engine/lanes/isa.h"
#include "engine/library/python_use.h"
#include "engine/physics.h"
#include "engine/settings/settings.h"
#include "graze_build.h"
#include "graze_version.h"
#include "jobs/campaign/communicator.h"
#include "simulation/results_epoch.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

Finding isa_finding() {
  std::string all;
  for (const Isa isa : available_isas()) all += (all.empty() ? "" : ", ") + isa_name(isa);
  const char* const told = std::getenv("GRAZE_ISA");
  try {
    const Isa isa = chosen_isa();
    Finding out{
        "program", "instructions", Health::good,
        fmt::format("{} (there are: {}); GRAZE_ISA {}", isa_name(isa), all, told && *told ? "says so" : "is not set")};
    if (isa != available_isas().back()) {
      out.health = Health::note;
      out.advice = fmt::format("unset GRAZE_ISA: {} gives the same bits faster", isa_name(available_isas().back()));
    }
    return out;
  } catch (const InputError& error) {
    return {"program", "instructions", Health::broken, error.what(), "unset GRAZE_ISA"};
  }
}

Finding data_finding(const Shipped& shipped) {
  constexpr const char* kName = "data";
  if (shipped.scenarios > 0) {
    return {"program",    kName,
            Health::good, fmt::format("{}: {} scenarios", shipped.data.string(), shipped.scenarios),
            "",           {{"scenarios", static_cast<double>(shipped.scenarios)}}};
  }
  return {"program", kName, Health::note,
          shipped.data.empty() ? "no shipped scenarios were found" : "no scenarios in " + shipped.data.string(),
          "export GRAZE_DATA=FOLDER, which holds scenarios/ and robots/; scenarios of your own run without it"};
}

/// One line of what the MPI library says of itself; empty if the module cannot be loaded, then `problem` says why.
std::string mpi_version(std::string& problem) {
  void* const module = dlopen(mpi_module().c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (module == nullptr) {
    problem = dlerror();
    return "";
  }
  // May be called before MPI begins. 8192: more than MPI_MAX_LIBRARY_VERSION_STRING of any MPI.
  using Version = int (*)(char*, int*);
  const auto version = reinterpret_cast<Version>(dlsym(module, "MPI_Get_library_version"));
  std::array<char, 8192> text{};
  int length = 0;
  if (version != nullptr) version(text.data(), &length);
  const std::string whole(text.data());
  return whole.empty() ? "MPI" : whole.substr(0, whole.find_first_of(",\n"));
}

Finding mpi_finding() {
  constexpr const char* kAdvice =
      "threads and graze run --part need none; for ranks: apt-get install libopenmpi3 openmpi-bin";
  if (!built_with_mpi()) {
    return {"libraries", "MPI", Health::note, "none: " + mpi_module().string() + " is not there",
            "threads and graze run --part need none; for ranks build with libopenmpi-dev, or install its package"};
  }
  std::string problem;
  const std::string version = mpi_version(problem);
  if (version.empty()) return {"libraries", "MPI", Health::note, problem, kAdvice};
  const fs::path mpirun = found_on_path("mpirun");
  if (mpirun.empty()) return {"libraries", "MPI", Health::note, version + ", but no mpirun on PATH", kAdvice};
  return {"libraries", "MPI", Health::good, fmt::format("{}, {}", version, mpirun.string())};
}

Finding hdf5_finding() {
  unsigned major = 0, minor = 0, release = 0;
  H5get_libversion(&major, &minor, &release);
  Finding out{"libraries", "HDF5", Health::good, fmt::format("{}.{}.{}", major, minor, release)};
  if (major != H5_VERS_MAJOR || minor != H5_VERS_MINOR || release != H5_VERS_RELEASE) {
    out.text += fmt::format(", built against {}.{}.{}", H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE);
    out.health = Health::note;
    out.advice = "HDF5 refuses to work with another version than it was built against unless they are compatible";
  }
  return out;
}

/// What the interpreter is for is not done without NumPy.
Finding python_finding(const fs::path& program, const char* what_for) {
  const std::string environment = working_python(kDefaultInterpreter);
  if (!environment.empty()) {
    return {"tools", kDefaultInterpreter, Health::good,
            fmt::format("{}: {}; for {}", program.string(), environment, what_for)};
  }
  const std::string none = fmt::format("{}: has no NumPy, which {} need", program.string(), what_for);
  const std::string other = program == kSystemInterpreter ? "" : working_python(kSystemInterpreter);
  if (!other.empty()) {
    return {"tools", kDefaultInterpreter, Health::note, none,
            fmt::format("{0} has it ({1}); name that in the scenario: python: {{interpreter: {0}}}", kSystemInterpreter,
                        other)};
  }
  return {"tools", kDefaultInterpreter, Health::note, none,
          fmt::format("apt-get install python3-numpy; or {} -m pip install numpy; or name another one in the scenario: "
                      "python: {{interpreter: .venv/bin/python}}",
                      program.string())};
}

struct Tool {
  std::vector<const char*> names;  // any of them will do
  const char* what_for;
  const char* how_to_get;
};

const std::vector<Tool>& tools() {
  static const std::vector<Tool> all = {
      {{"gnuplot"}, "graze plot, graze sweep --plot", "apt-get install gnuplot-nox"},
      {{"xacro"},
       "robots in .xacro files",
       "ROS has it (ros-DISTRO-xacro); or expand them where it is: xacro r.urdf.xacro > r.urdf"},
      {{"sbatch"}, "graze submit", "it is a part of Slurm, on the nodes of a cluster; --dry-run needs none"},
      {{kDefaultInterpreter}, "controllers of your own in Python", "apt-get install python3-numpy"},
      {{"cc", "gcc", "clang"}, "controllers of your own in C", "apt-get install gcc make libc6-dev"},
  };
  return all;
}

}  // namespace

fs::path found_on_path(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path file = fs::path(folder.empty() ? "." : folder) / name;
    std::error_code error;
    if (fs::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0) return file;
  }
  return {};
}

std::vector<Finding> program_findings(const Shipped& shipped) {
  std::vector<Finding> out = {
      {"program", "version", Health::good, fmt::format("graze {} ({})", GRAZE_VERSION, GRAZE_REVISION)},
      {"program", "results", Health::good,
       results_version() + ": campaigns of the same epoch can be resumed and replayed"},
      {"program", "build", Health::good, fmt::format("{} for {}", GRAZE_BUILD_FLAGS, GRAZE_BUILD_PROCESSOR)},
      {"program", "physics", Health::good, fmt::format("{}", fmt::join(physics_names(), ", "))},
      isa_finding(),
      data_finding(shipped)};
  out.push_back(shipped.page ? Finding{"program", "report page", Health::good,
                                       "built in; any browser shows it, none is needed to write it"}
                             : Finding{"program", "report page", Health::note,
                                       "was left out of this build: graze report and view refuse",
                                       "build with Node.js and npm there (-DGRAZE_REPORT=ON)"});
  return out;
}

std::vector<Finding> library_findings() { return {hdf5_finding(), mpi_finding()}; }

std::vector<Finding> tool_findings() {
  std::vector<Finding> out;
  for (const Tool& tool : tools()) {
    fs::path found;
    for (const char* name : tool.names) {
      if (found.empty()) found = found_on_path(name);
    }
    // Not there is no fault: only those verbs want it, and they say so.
    if (found.empty()) {
      out.push_back(
          {"tools", tool.names[0], Health::note, fmt::format("not there; for {}", tool.what_for), tool.how_to_get});
    } else if (tool.names[0] == std::string_view(kDefaultInterpreter)) {
      out.push_back(python_finding(found, tool.what_for));
    } else {
      out.push_back({"tools", tool.names[0], Health::good, fmt::format("{}; for {}", found.string(), tool.what_for)});
    }
  }
  return out;
}

}  // namespace graze
