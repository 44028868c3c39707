#pragma once
// Rows of a part as what they stand for: events, telemetry frames, one whole trace. Throws InputError that names the
// file; needs the library's lock.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "archive/schema/part.h"
#include "simulation/trace.h"

namespace graze {

/// Whether a trace can say so: known failures name the requirement that was violated.
bool possible_outcome(Outcome outcome, int violated, std::size_t requirements);

/// What makes up the verdict on a trace.
struct Verdict {
  Outcome outcome;
  int violated;                              // requirement; -1: none
  double end_time;                           // s
  double objective_margin;                   // unit of the objective
  std::span<const double> margins;           // [requirement]
  std::span<const double> first_violations;  // [requirement], s; NaN: never
};
/// Where an outcome contradicts the margins and times that it follows from (design.md, Outcome), in words; empty: it
/// does not. Of invalid traces nothing is known. `deciding`: so many requirements, the first, are no measures.
std::string contradiction(const Verdict& trace, std::size_t deciding);

/// Throws InputError unless a time, s, of the column lies in a trace.
void check_time(const OpenPart& file, const std::string& group, const std::string& name, double time,
                const CampaignInfo& info);
/// Throws InputError unless a trace can have ended then, s. Of one whose simulation threw nobody knows: NaN.
void check_end(const OpenPart& file, const std::string& group, Outcome outcome, double end_time,
               const CampaignInfo& info);
/// Throws InputError unless the requirements of a trace can have been violated first then, s; NaN: never.
void check_violations(const OpenPart& file, const std::string& group, std::span<const double> times,
                      const CampaignInfo& info);
/// Throws InputError unless the numbers (final_q, final_v) can be the last of a trace: those of an invalid one need not
/// be finite.
void check_state(const OpenPart& file, const std::string& group, const hdf5::Spec& spec, Outcome outcome,
                 std::span<const double> numbers);

/// Throws InputError if the traces lack what the campaign says that they tell of their contact solver.
void check_solver_columns(const OpenPart& file, const std::string& group, const CampaignInfo& info);
/// Throws InputError, which names row and column, unless a contact solver can have told this of a trace with that
/// outcome: of a valid one all is finite. `whole`: with schema::convergence(); else only what is in schema::solver().
void check_solver(const OpenPart& file, const std::string& group, std::uint64_t row, Outcome outcome,
                  const SolverLog& log, bool whole);

/// Whether a witness that says `parts` of itself can name this part.
bool possible_part(const std::string& parts, int part, const CampaignInfo& info);

/// `count` rows from `first` on, of a table that has `rows`.
struct RowRange {
  std::uint64_t rows, first, count;
};

/// Culprits of traces, in file order: at the first violation if `violated`, of the same rows, names a requirement, else
/// of the objective. All {} in older archives.
std::vector<Culprit> read_culprits(const OpenPart& file, const std::string& policy, RowRange range,
                                   const std::vector<std::int32_t>& violated, const CampaignInfo& info);

/// Events in file order. Indices into the campaign's names are in range.
std::vector<Event> read_events(const OpenPart& file, const std::string& group, RowRange range,
                               const CampaignInfo& info);
/// Contact phases, as read_events(). Without `shares` peak, slip and roll are 0.
std::vector<ContactPhase> read_phases(const OpenPart& file, const std::string& group, RowRange range,
                                      const CampaignInfo& info, bool shares = true);
/// Throws unless the phases of one trace stand in the order of their beginnings.
void check_in_order(const OpenPart& file, const std::string& group, std::span<const ContactPhase> trace);
std::vector<TelemetryFrame> read_frames(const OpenPart& file, const std::string& group, RowRange range,
                                        const Widths& widths);
/// Row `row` of /traces/<policy> with its events and phases, without telemetry and contact sequence.
TraceRecord read_trace(const OpenPart& file, const std::string& policy, std::uint64_t row, const CampaignInfo& info);

}  // namespace graze
