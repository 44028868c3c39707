#pragma once
// What to say about a path that leads nowhere.

#include <string>
#include <vector>

namespace graze {

/// "; did you mean 'curb.yaml'?" for a path that is not there, by the entries of the deepest folder on the way that is;
/// "; there is no folder 'scenes'" if nothing there is near and folders are missing; else empty. `kinds`: endings of
/// the files that are meant, for names without one or with another of them.
std::string path_suggestion(const std::string& path, const std::vector<std::string>& kinds = {});

/// Why what is there under a path is no file that can be read: "not a file, but a folder", "is a symbolic link to
/// 'a.so', where nothing is", "cannot be opened: Permission denied". Empty: it can be read, or nothing is there.
std::string why_no_file(const std::string& path);

/// The path that the former would name, if it leads to something; else empty.
std::string near_path(const std::string& path);

}  // namespace graze
