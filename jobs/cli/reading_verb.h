#pragma once
// Verbs that read archives, which may be anybody's (archive/hdf5/reading_child.h).

#include <functional>
#include <string>
#include <vector>

namespace graze {

/// Goes on in a child process with limits by the size of the archives, and returns its exit code. Throws InputError in
/// the parent if an archive crashes, hangs or floods the library that reads it. A signal that ends the child (Ctrl-C, a
/// closed pipe) ends the parent, too. To be called before there are threads.
int in_reading_child(const std::vector<std::string>& archives, const std::function<int()>& act,
                     double seconds_per_megabyte = 0.1);

/// The same for what simulates traces anew with controllers that the user trusts. Where one of them ends the child that
/// is told, and `act` is done once more without them; the exit code is then that of a machine that failed.
int in_page_child(const std::vector<std::string>& archives, const std::function<int()>& act,
                  double seconds_per_megabyte = 0.1);

}  // namespace graze
