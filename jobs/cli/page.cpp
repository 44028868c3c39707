#include "jobs/cli/page.h"

#include <fmt/format.h>

#include <span>

#include "archive/files/files.h"
#include "engine/settings/settings.h"

namespace graze {

void check_page_built(const std::string& verb) {
  if (!page_template().head.empty()) return;
  throw InputError(fmt::format(
      "graze {}: this program was built without pages (GRAZE_REPORT=OFF: there was no npm); install nodejs and npm, "
      "configure with -DGRAZE_REPORT=ON and build again; --json needs no page",
      verb));
}

std::filesystem::path default_page(const std::filesystem::path& archive, const std::string& behind) {
  std::filesystem::path out = archive.has_filename() ? archive : archive.parent_path();  // "curb.graze/"
  if (!out.has_filename()) {
    throw InputError(
        fmt::format("{}: has no name that a file could be called after; name the file by --output", archive.string()));
  }
  out.replace_extension();
  return out += behind + ".html";
}

void check_page_output(const std::filesystem::path& output, bool force, const std::filesystem::path& archive,
                       NamedBy named) {
  check_ending(output, "a page is one HTML file", {".html", ".htm"}, Endings::only, named);
  check_new_file(output, force, {archive}, named);
}

void write_page(const std::filesystem::path& output, bool force, const std::string& data) {
  NewFile file(output, force);
  const auto write = [&](std::string_view text) {
    const int error = write_all(file.descriptor(), std::as_bytes(std::span(text)));
    if (error != 0) fail_writing(output, error);
  };
  for (const std::string_view text : page_template().head) write(text);
  write(data);
  for (const std::string_view text : page_template().tail) write(text);
  file.publish();
}

}  // namespace graze
