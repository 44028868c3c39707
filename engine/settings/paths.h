#pragma once
// What to say about a path that leads nowhere.

#include <string>
#include <vector>

namespace graze {

/// "; did you mean 'curb.yaml'?" for a path that is not there, by the entries of the deepest folder on the way that is;
/// "; there is no folder 'scenes'" if nothing there is near and folders are missing; else empty. `kinds`: endings of
/// the files that are meant, for names without one or with another of them.
std::string path_suggestion(const std::string& path, const std::vector<std::string>& kinds = {});

/// The path that the former would name, if it leads to something; else empty.
std::string near_path(const std::string& path);

}  // namespace graze
