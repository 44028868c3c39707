#include "archive/directory/damaged.h"

#include <fmt/format.h>

#include "archive/directory/campaign_directory.h"

namespace graze {

void put_aside(const Directory& directory, const Directory& folder, const std::string& name) {
  const Directory damaged = directory.make(kDamagedFolder);
  const std::filesystem::path path(name);
  std::string place = name;
  for (int number = 1; damaged.has(place); ++number) {
    place = fmt::format("{}.{}{}", path.stem().string(), number, path.extension().string());
  }
  folder.move(name, damaged, place);
  damaged.sync();
  folder.sync();
}

std::string why_not_put_aside(const Directory& directory) {
  try {
    directory.find(kDamagedFolder);
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

}  // namespace graze
