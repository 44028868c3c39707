#include "jobs/cli/picture_file.h"

#include <fmt/format.h>

#include <iostream>
#include <span>

#include "archive/files/files.h"
#include "archive/files/utf8.h"
#include "jobs/cli/gnuplot.h"

namespace graze {

PlotStyle picture_style(const std::string& file, bool force) {
  PlotStyle style;
  check_ending(file, "a picture is one SVG or PNG file", {".svg", ".png"}, Endings::only, NamedBy::word);
  check_new_file(file, force, {}, NamedBy::word);
  const bool png = ending_of(file) == ".png";
  style.format = png ? PlotStyle::Format::png : PlotStyle::Format::svg;
  check_gnuplot(png);
  return style;
}

std::string drawn_figure(const Figure& figure, const PlotStyle& style, const std::filesystem::path& path) {
  std::string out = drawn_by_gnuplot(gnuplot_script(figure, style), path.string());
  return style.format == PlotStyle::Format::svg ? finished_svg(std::move(out)) : out;
}

void write_picture(const std::filesystem::path& path, bool force, const std::string& bytes, bool tell) {
  NewFile file(path, force);
  const int error = write_all(file.descriptor(), std::as_bytes(std::span(bytes)));
  if (error != 0) fail_writing(path, error);
  file.publish();
  if (tell)
    std::cout << fmt::format("{}: {:.1f} kB\n", printable(path.string()), static_cast<double>(bytes.size()) / 1e3);
}

}  // namespace graze
