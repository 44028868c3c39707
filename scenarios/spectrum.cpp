#include "scenarios/spectrum.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenarios/limits.h"
#include "scenarios/spread.h"

namespace graze {
namespace {

/// The numbers that may be drawn, and which of a Spectrum they are.
struct Member {
  const char* name;
  double Spectrum::*member;
  Quantity quantity;
};
constexpr Member kMembers[] = {{"rms", &Spectrum::rms, Quantity::length},
                               {"longest", &Spectrum::longest, Quantity::length},
                               {"shortest", &Spectrum::shortest, Quantity::length},
                               {"exponent", &Spectrum::exponent, Quantity::dimensionless},
                               {"seed", &Spectrum::seed, Quantity::dimensionless}};

/// What no spectrum may be, whatever the field.
Parameter parameter_of(const Member& member, const std::string& head, double nominal) {
  Parameter out;
  out.path = head + member.name;
  out.quantity = member.quantity;
  out.nominal = nominal;
  if (member.member == &Spectrum::seed) return out;
  out.lower = 0;
  out.strict = member.member == &Spectrum::longest || member.member == &Spectrum::shortest;
  out.upper = member.member == &Spectrum::exponent ? kMostExponent : kMaxLength;
  return out;
}

/// With the means of what is drawn.
Spectrum nominal_spectrum(const Described& own) {
  Spectrum out;
  for (const Member& member : kMembers) {
    if (member.quantity == Quantity::dimensionless && !own.has(member.name)) continue;  // lengths are required
    const Parameter parameter = parameter_of(member, "", out.*member.member);
    out.*member.member = read_spread(own.at(member.name), parameter, Standing::as_nominal).persistent.mean();
  }
  return out;
}

int points(double length, double cell) {
  constexpr double kRounding = 1e-9;  // 2 m in cells of 0.1 m are 20
  return std::max(2, static_cast<int>(std::ceil(std::min(length / cell, 1e6) - kRounding)) + 1);
}

void check_work(const Settings& where, int nx, int ny, double cell) {
  const double work = spectrum_work(nx, ny);
  if (work <= kMostSpectrumWork) return;
  where.fail(fmt::format(
      "cells of {:g} m make a grid of {} x {} heights, which is too much to draw for each particle; at least {:.2g} m, "
      "or a smaller field",
      cell, nx, ny, 1.02 * cell * std::cbrt(work / kMostSpectrumWork)));
}

void check_band(const Described& own, const Spectrum& spectrum, const SpectrumLimits& limits) {
  if (!(spectrum.shortest < spectrum.longest)) {
    own.at("longest").fail(
        fmt::format("{:g} m: must be longer than 'shortest', {:g} m", spectrum.longest, spectrum.shortest));
  }
  if (spectrum.longest > limits.longest) {
    own.at("longest").fail(fmt::format("{:g} m: does not fit the field; at most its longer side, {:g} m",
                                       spectrum.longest, limits.longest));
  }
  if (spectrum.shortest < limits.shortest) {
    const Settings where = own.has("cell") ? own.at("cell") : own.at("shortest");
    where.fail(fmt::format("waves of {:g} m take cells of at most {:g} m; these are {:g} m long", spectrum.shortest,
                           0.5 * spectrum.shortest, 0.5 * limits.shortest));
  }
}

}  // namespace

const Description& spectrum_description() {
  const auto number = [](const char* name, Quantity quantity, Bound bound, const Default& otherwise, const char* help) {
    return Key{name, {Form::number(quantity, bound), Form::spread()}, otherwise, help};
  };
  static const Description out(
      "ground that is drawn: waves between two lengths, whose power falls with their wavenumber",
      {number("rms", Quantity::length, Bound::not_negative, Default::required(),
              "root mean square of the heights over the field"),
       number("longest", Quantity::length, Bound::positive, Default::required(), "wavelength, at most the longer side"),
       number("shortest", Quantity::length, Bound::positive, Default::required(), "wavelength, at least two cells"),
       number("exponent", Quantity::dimensionless, Bound::not_negative, Default::value("2"),
              "of the power spectral density along a line, 0 to 10: roads have 2 (ISO 8608)"),
       number(
           "seed", Quantity::dimensionless, Bound::none, Default::value("0"),
           "which ground: any number, and another one for another ground. `{uniform: [0, 1]}`: each particle has its "
           "own"),
       {"cell",
        {Form::number(Quantity::length, Bound::positive)},
        Default::words("a quarter of `shortest`"),
        "of the grid, at most"}});
  return out;
}

Shape read_spectrum(const Settings& settings, double length_x, double length_y) {
  const Described own(settings, spectrum_description());
  const Spectrum spectrum = nominal_spectrum(own);
  const double cell = own.find_number("cell").value_or(0.25 * spectrum.shortest);
  const Settings fine = own.has("cell") ? own.at("cell") : own.at("shortest");
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = points(length_x, cell), grid->ny = points(length_y, cell);
  check_work(fine, grid->nx, grid->ny, cell);
  const SpectrumLimits limits = spectrum_limits(grid->nx, grid->ny, length_x, length_y);
  check_band(own, spectrum, limits);
  if (spectrum.rms > limits.rms) {
    own.at("rms").fail(fmt::format("{:g} m: at most {:g} m, so that no height is beyond {:g} m", spectrum.rms,
                                   limits.rms, kMaxLength));
  }
  try {
    grid->height = spectral_heights(spectrum, grid->nx, grid->ny, length_x, length_y);
  } catch (const InputError& e) {
    settings.fail(e.what());
  }
  Shape out{ShapeKind::heightfield, {length_x, length_y, 1}, nullptr, std::move(grid)};
  out.spectrum = std::make_shared<const Spectrum>(spectrum);
  return out;
}

void read_spectrum_spreads(const Settings& spectrum, const std::string& path, const Shape& shape,
                           const ReadNumber& number) {
  for (const Member& member : kMembers) {
    double value = (*shape.spectrum).*member.member;
    if (spectrum.has(member.name))
      number(spectrum, member.name, parameter_of(member, path + ".spectrum.", value), value);
  }
}

}  // namespace graze
