#pragma once
// The section of the report's page about how long traces last (docs/report.md tells what sections are made of).

#include "analysis/explanation.h"
#include "analysis/report_numbers.h"

namespace graze {

/// Of explain() or explain_survival(). Kaplan and Meier's curves of each policy with bands, until any requirement and
/// until each that was violated; what is left in numbers; whether policies differ. Null if there is no valid trace.
Json survival_section(const Explanation& explanation, NumberForm form);

/// "p = 0.003", "p < 1e-300".
std::string p_words(double p);
/// A cell of a table: two digits, sorted by the number; null for NaN.
Json p_cell(double p);

}  // namespace graze
