#include "scenarios/hull_reader.h"

#include <fmt/format.h>

namespace graze {

std::vector<Key> hull_keys() {
  return {{"vertices",
           {Form::whole(Bound::positive)},
           Default::value("128"),
           "of its hull, at most, for contact; at least 8. They may leave a larger error than the next line"},
          {"error",
           {Form::number(Quantity::length, Bound::positive)},
           Default::words("the smaller of 1 mm and 1 % of the size"),
           "how far the hull may reach out of the simpler one"},
          {"exact", {Form::flag()}, Default::value("false"), "the whole hull, however many vertices it has"}};
}

HullSettings read_hull(const Settings& map) {
  HullSettings out;
  out.exact = map.flag_or("exact", false);
  if (const auto vertices = map.find("vertices")) {
    const long long count = vertices->integer();
    constexpr long long kFewest = HullSettings::kFewest;
    if (count < kFewest) vertices->fail(fmt::format("{}: a hull has at least {} vertices, as a box", count, kFewest));
    out.vertices = static_cast<std::size_t>(count);
  }
  if (const auto error = map.find("error")) out.error = error->positive(Quantity::length);
  for (const char* bound : {"vertices", "error"}) {
    if (out.exact && map.has(bound)) map.at(bound).fail_key("does not go with 'exact: true', which keeps all vertices");
  }
  return out;
}

}  // namespace graze
