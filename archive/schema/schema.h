#pragma once
// The columns of an archive, in one place: the writer, the reader, `pack` and docs/archive.md follow it. A *part* is a
// file with traces: a shard, or the packed file. All parts look the same.

#include <string>
#include <vector>

#include "archive/hdf5/hdf5.h"
#include "archive/schema/campaign_info.h"

namespace graze {

/// Root attribute "format".
inline constexpr const char* kCampaignFormat = "graze-campaign";
inline constexpr const char* kShardFormat = "graze-shard";
inline constexpr const char* kReplayFormat = "graze-replay";

/// Widths of the columns that depend on the campaign.
struct Widths {
  std::size_t parameters, requirements, q, v, actuators;
};
Widths widths_of(const CampaignInfo& info);

namespace schema {

// /particles: one row per particle
hdf5::Spec particle();  // id; also in /traces
hdf5::Spec values(const Widths& widths);

// /traces/<policy>: one row per trace
hdf5::Spec outcome();
hdf5::Spec violated();
hdf5::Spec end_time();
hdf5::Spec objective_margin();
hdf5::Spec solver();       // [4]: the first members of SolverLog; absent from older archives
hdf5::Spec convergence();  // [4]: the others; absent from older archives
hdf5::Spec margins(const Widths& widths);
hdf5::Spec first_violations(const Widths& widths);
hdf5::Spec margin_parts(const Widths& widths);  // this and the next two: absent from older archives
hdf5::Spec violation_parts(const Widths& widths);
hdf5::Spec objective_culprit();  // [2]: leaf, part
hdf5::Spec final_q(const Widths& widths);
hdf5::Spec final_v(const Widths& widths);
hdf5::Spec digest();
hdf5::Spec sequence();        // index into /sequences/text
hdf5::Spec invalid_reason();  // index into /reasons/text

/// /events/<policy>, /phases/<policy> and /telemetry/<policy>: rows of trace t are offset[t] … offset[t + 1]; one more
/// row than traces.
hdf5::Spec offset();
hdf5::Spec time();

hdf5::Spec kind();
hdf5::Spec collider(const char* name);  // "a", "b"
hdf5::Spec feature(const char* name);   // "feature_a", "feature_b"
hdf5::Spec impulse();
hdf5::Spec position();

hdf5::Spec begin();
hdf5::Spec end();
hdf5::Spec peak();
hdf5::Spec share(const char* name);  // "slip", "roll"

hdf5::Spec telemetry_q(const Widths& widths);
hdf5::Spec telemetry_v(const Widths& widths);
hdf5::Spec telemetry_tau(const Widths& widths);

/// The flat columns, without the offsets.
std::vector<hdf5::Spec> events();
std::vector<hdf5::Spec> phases();
std::vector<hdf5::Spec> telemetry(const Widths& widths);

std::string traces_group(const std::string& policy);
std::string events_group(const std::string& policy);
std::string phases_group(const std::string& policy);
std::string telemetry_group(const std::string& policy);
inline constexpr const char* kParticles = "particles";
inline constexpr const char* kSequences = "sequences/text";
inline constexpr const char* kReasons = "reasons/text";

}  // namespace schema
}  // namespace graze
