// Claims: heights drawn from a spectrum have its root mean square, its slope, and nothing beyond its wavelengths;
// another number gives unrelated ground; a finer grid sees the same ground.
#include "engine/model/spectrum.h"

#include <cmath>
#include <complex>
#include <numbers>

#include "engine/model/fabrication.h"
#include "tests/engine/model/support.h"

namespace graze {
namespace {

/// A field of 4 m by 3 m, with its heights without the last row and column, which are the first again.
struct DrawnGround {
  static constexpr int kX = 40, kY = 30;  // cells
  std::vector<double> height;             // [kY + 1][kX + 1]

  explicit DrawnGround(const Spectrum& spectrum) : height(spectral_heights(spectrum, kX + 1, kY + 1, 4, 3)) {}
  double at(int x, int y) const { return height[static_cast<std::size_t>(y) * (kX + 1) + x]; }

  /// Mean of h exp(-2 pi i (i x / kX + j y / kY)).
  std::complex<double> wave(int i, int j) const {
    std::complex<double> sum = 0;
    for (int y = 0; y < kY; ++y) {
      for (int x = 0; x < kX; ++x) {
        sum += at(x, y) * std::polar(1.0, -2 * std::numbers::pi * (double(i) * x / kX + double(j) * y / kY));
      }
    }
    return sum / double(kX * kY);
  }
};

constexpr Spectrum kSpectrum{0.02, 1.5, 0.4, 2, 0.25};

TEST(Spectrum, HasItsRootMeanSquareAndClosesUp) {
  for (const double seed : {0.0, 0.25, 7.0, -3.5, 1e300}) {
    Spectrum spectrum = kSpectrum;
    spectrum.seed = seed;
    const DrawnGround ground(spectrum);
    double sum = 0, squares = 0;
    for (int y = 0; y < DrawnGround::kY; ++y) {
      for (int x = 0; x < DrawnGround::kX; ++x) sum += ground.at(x, y), squares += ground.at(x, y) * ground.at(x, y);
      EXPECT_EQ(ground.at(DrawnGround::kX, y), ground.at(0, y));
    }
    for (int x = 0; x <= DrawnGround::kX; ++x) EXPECT_EQ(ground.at(x, DrawnGround::kY), ground.at(x, 0));
    constexpr int kPoints = DrawnGround::kX * DrawnGround::kY;
    EXPECT_NEAR(sum / kPoints, 0, 1e-15) << seed;
    EXPECT_NEAR(std::sqrt(squares / kPoints), spectrum.rms, 1e-14) << seed;
  }
}

// By the discrete Fourier transform: the power of a wave times its wavenumber to the exponent + 1 is the same for all
// in the band, and nothing is outside. No chance is in this: amplitudes are certain.
TEST(Spectrum, FallsWithItsExponentAndHasNothingBeyondItsBand) {
  for (const double exponent : {0.0, 2.0, 3.5}) {
    Spectrum spectrum = kSpectrum;
    spectrum.exponent = exponent;
    const DrawnGround ground(spectrum);
    double level = 0;
    int in = 0, out = 0;
    for (int j = 0; j < DrawnGround::kY / 2; ++j) {
      for (int i = 1 - DrawnGround::kX / 2; i < DrawnGround::kX / 2; ++i) {
        const double power = std::norm(ground.wave(i, j)), number = std::hypot(i / 4.0, j / 3.0);
        if (number < 1 / spectrum.longest || number > 1 / spectrum.shortest) {
          EXPECT_LT(power, 1e-30) << i << " " << j;
          ++out;
          continue;
        }
        const double levelled = power * std::pow(number, exponent + 1);
        if (in++ == 0) level = levelled;
        EXPECT_NEAR(levelled, level, 1e-9 * level) << i << " " << j;
      }
    }
    EXPECT_GT(in, 50);
    EXPECT_GT(out, 50);
  }
}

// Along a line the power falls with the exponent itself, where the bounds of the band are far: the regression of its
// logarithm over wavelengths of 1 m to 30 cm, in a band from 4 m to 5 cm. All rows together have certain power; what
// the bounds do to the slope is 0.05 here.
TEST(Spectrum, FallsAlongALineAsItIsTold) {
  constexpr int kCells = 160;
  const std::vector<double> height = spectral_heights({0.01, 4, 0.05, 2, 1}, kCells + 1, kCells + 1, 4, 4);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int i = 4; i <= 13; ++i) {
    double power = 0;
    for (int y = 0; y < kCells; ++y) {
      std::complex<double> sum = 0;
      for (int x = 0; x < kCells; ++x) {
        sum += height[static_cast<std::size_t>(y) * (kCells + 1) + x] *
               std::polar(1.0, -2 * std::numbers::pi * double(i) * x / kCells);
      }
      power += std::norm(sum);
    }
    const double x = std::log(i), y = std::log(power);
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  EXPECT_NEAR((n * sxy - sx * sy) / (n * sxx - sx * sx), -2, 0.1);
}

// Over seeds that are neighbours a height at one place has mean 0 and mean square rms^2, and its products with that of
// the next seed mean 0. Standard errors of n = 4000: rms / sqrt(n), at most rms^2 sqrt(2 / n) (a sum of cosines has no
// longer tails than a normal number) and rms^2 / sqrt(n). Three of them at 4.5: 1 seed in 50,000 would fail.
TEST(Spectrum, OfAnotherSeedIsUnrelated) {
  constexpr int kSeeds = 4000;
  Spectrum spectrum = kSpectrum;
  double sum = 0, squares = 0, products = 0, before = 0;
  for (int k = 0; k < kSeeds; ++k) {
    spectrum.seed = std::nextafter(k == 0 ? 0.5 : spectrum.seed, 1.0);
    const double h = spectral_heights(spectrum, 21, 16, 4, 3)[5 * 21 + 7];
    sum += h, squares += h * h, products += h * before;
    before = h;
  }
  const double rms = spectrum.rms, root = std::sqrt(kSeeds);
  EXPECT_NEAR(sum / kSeeds, 0, 4.5 * rms / root);
  EXPECT_NEAR(squares / kSeeds, rms * rms, 4.5 * rms * rms * std::sqrt(2) / root);
  EXPECT_NEAR(products / kSeeds, 0, 4.5 * rms * rms / root);
}

TEST(Spectrum, IsTheSameGroundOnAFinerGrid) {
  const std::vector<double> coarse = spectral_heights(kSpectrum, 41, 31, 4, 3);
  const std::vector<double> fine = spectral_heights(kSpectrum, 121, 61, 4, 3);
  for (int y = 0; y <= 30; ++y) {
    for (int x = 0; x <= 40; ++x) EXPECT_NEAR(fine[2 * y * 121 + 3 * x], coarse[y * 41 + x], 1e-14);
  }
  EXPECT_EQ(spectral_heights(kSpectrum, 41, 31, 4, 3), coarse);
}

// A wider band keeps the phases of the waves that both have.
TEST(Spectrum, KeepsItsPhasesWhenTheBandBecomesWider) {
  Spectrum wider = kSpectrum;
  wider.shortest = 0.25;
  const DrawnGround one(kSpectrum), other(wider);
  for (const auto& [i, j] : {std::pair(3, 0), {4, 2}, {-5, 3}, {0, 4}}) {
    EXPECT_NEAR(std::arg(one.wave(i, j) / other.wave(i, j)), 0, 1e-12) << i << " " << j;
  }
}

TEST(Spectrum, RefusesBandsWithoutAWave) {
  Spectrum spectrum = kSpectrum;
  spectrum.longest = spectrum.shortest;
  EXPECT_EQ(input_error([&] { spectral_heights(spectrum, 41, 31, 4, 3); }),
            "waves of 0.4 to 0.4 m: the longest must be longer than the shortest");
  spectrum.shortest = 2.9, spectrum.longest = 2.95;
  EXPECT_EQ(
      input_error([&] { spectral_heights(spectrum, 41, 31, 4, 3); }),
      "no wave of 2.9 to 2.95 m has a whole number of periods in 4 x 3 m; make the field larger or the band wider");
}

/// A ball over drawn ground.
World ball_over_drawn_ground(const Spectrum& spectrum) {
  World world;
  world.robot = parse_urdf(R"(<robot name="ball"><link name="ball"><inertial><mass value="1"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision></link></robot>)",
                           "ball.urdf");
  auto grid = std::make_shared<HeightGrid>();
  grid->nx = 41, grid->ny = 31;
  grid->height = spectral_heights(spectrum, 41, 31, 4, 3);
  Object hills;
  hills.name = "hills";
  hills.shape = {ShapeKind::heightfield, {4, 3, 1}, nullptr, grid};
  hills.shape.spectrum = std::make_shared<Spectrum>(spectrum);
  world.objects.push_back(hills);
  world.initial.on_ground = true;
  return world;
}

// Every number of the spectrum is a parameter, set in any order; what is not set is nominal; sizes are none.
TEST(Spectrum, IsFabricated) {
  const auto world = std::make_shared<const World>(ball_over_drawn_ground(kSpectrum));
  const std::string path = "environment.hills.spectrum.";
  const Fabricator fabricator(world,
                              {path + "seed", path + "rms", path + "longest", path + "shortest", path + "exponent"});
  const Spectrum other{0.03, 2, 0.3, 1, 0.75};
  const std::vector<double> values = {other.seed, other.rms, other.longest, other.shortest, other.exponent};
  const Shape shape = fabricator.perturbed(values).objects[0].shape;
  EXPECT_EQ(shape.grid->height, spectral_heights(other, 41, 31, 4, 3));
  EXPECT_EQ(shape.spectrum->rms, 0.03);
  EXPECT_EQ(world->objects[0].shape.grid->height, spectral_heights(kSpectrum, 41, 31, 4, 3)) << "of the nominal world";
  const std::vector<double> seed = {0.75};
  Spectrum reseeded = kSpectrum;
  reseeded.seed = 0.75;
  EXPECT_EQ(Fabricator(world, {path + "seed"}).perturbed(seed).objects[0].shape.grid->height,
            spectral_heights(reseeded, 41, 31, 4, 3));
  EXPECT_FALSE(ParameterTable(*world).find("environment.hills.size.z"));
  const std::vector<double> crossed = {0.5, 0.02, 0.35, 0.4, 2};
  EXPECT_EQ(input_error([&] { fabricator.fabricate(3, crossed); }),
            "waves of 0.4 to 0.35 m: the longest must be longer than the shortest");
  const std::vector<double> negative = {0.5, -0.02, 1.5, 0.4, 2};
  EXPECT_EQ(input_error([&] { fabricator.fabricate(3, negative); }),
            "environment.hills.spectrum.rms: -0.02 m: must be >= 0");
}

}  // namespace
}  // namespace graze
