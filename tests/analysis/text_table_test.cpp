// Texts for people: numbers that are short.
#include "analysis/text_table.h"

#include <gtest/gtest.h>

namespace graze {
namespace {

// Claim: decimals come down to six digits, and everything else of the text stays.
TEST(RoundedNumbers, AreShort) {
  EXPECT_EQ(rounded_numbers("normal(mean=2700.0000035993075, std=270.00000035993077)"), "normal(mean=2700, std=270)");
  EXPECT_EQ(rounded_numbers("normal(mean=0, std=0.17453292519943295)"), "normal(mean=0, std=0.174533)");
  EXPECT_EQ(rounded_numbers("uniform(min=-0.05, max=1.23456789e-12)"), "uniform(min=-0.05, max=1.23457e-12)");
  EXPECT_EQ(rounded_numbers("empirical(n=1234567, min=-inf, max=inf)"), "empirical(n=1234567, min=-inf, max=inf)");
  EXPECT_EQ(rounded_numbers(""), "");
}

}  // namespace
}  // namespace graze
