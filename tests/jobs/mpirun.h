#pragma once
// The program as ranks under mpirun.

#include <string>

namespace graze::testing {

#ifdef GRAZE_HAVE_MPI
constexpr bool kHaveMpi = true;
#else
constexpr bool kHaveMpi = false;
#endif

/// The words before the program: so many ranks on this machine, however few processors it has, and whoever we are. What
/// Open MPI itself never frees is not ours to report; it insists on a remote shell, which a bare machine has not.
inline std::string mpirun(int ranks) {
  return "ASAN_OPTIONS=detect_leaks=0 OMPI_MCA_plm_rsh_agent=sh OMPI_ALLOW_RUN_AS_ROOT=1 "
         "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe "
         "--bind-to none -np " +
         std::to_string(ranks) + " '" GRAZE_PROGRAM "' ";
}

}  // namespace graze::testing
