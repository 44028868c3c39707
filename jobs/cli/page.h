#pragma once
// The page of `graze report` and `graze view`: one HTML file that needs nothing else, made from analysis/web.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "archive/files/files.h"

namespace graze {

/// What the build made of analysis/web, in pieces: the page before its data, and behind it. Empty: built without it.
struct PageTemplate {
  std::vector<std::string_view> head, tail;
};
const PageTemplate& page_template();

/// Throws InputError if this program was built without the page.
void check_page_built(const std::string& verb);
/// Beside the archive: "out/curb.graze" and ".p3" give "out/curb.p3.html".
std::filesystem::path default_page(const std::filesystem::path& archive, const std::string& behind);
/// Throws InputError unless a page of the archive may be written: it ends in .html, is not there (unless `force`), and
/// is or lies in no archive.
void check_page_output(const std::filesystem::path& output, bool force, const std::filesystem::path& archive,
                       NamedBy named = NamedBy::output);
/// Writes the page with these data (script_json()). It appears whole or not at all. Throws InputError, MachineError.
void write_page(const std::filesystem::path& output, bool force, const std::string& data);

}  // namespace graze
